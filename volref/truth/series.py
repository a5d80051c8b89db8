"""`render_series`: one scene at several times."""

import dataclasses
from collections.abc import Iterator, Sequence

from volref.arrays import one_of
from volref.errors import SceneError
from volref.io.guard import Foreign
from volref.scene.scene import Scene
from volref.scene.series import INTERPOLATIONS, Frame, Series
from volref.truth.rendering import render
from volref.truth.result import Render
from volref.truth.supersampling import supersample


def render_series(
    scene: Scene,
    series: Series,
    times: Sequence[float] | None = None,
    *,
    interpolation: str = "nearest",
    factor: int = 1,
    **options: Foreign,
) -> Iterator[tuple[float, Render]]:
    """Yield (time, image) of `scene` with its volume replaced by that of `series`, one after the other.

    Camera, transfer function and all else stay.  Each image has its own bound: it certifies the image of that
    volume, and says nothing of what was in the air between two measurements.  Times with the same volume are
    rendered once.

    Parameters
    ----------
    times
        Seconds, within the series, in any order; default its own.
    interpolation
        "nearest" or "linear", as `Series.at` has it.
    factor
        Rays per pixel along x and along y, as `volref.supersample` has it.
    options
        As `volref.render` has them, for each image.

    Raises
    ------
    SceneError
        If a time lies outside, before anything is rendered, or as `Series.at` and `volref.render` do.
    """
    if not isinstance(series, Series):
        message = f"series must be a volref.Series, got {type(series).__name__}; build or load one first"
        raise SceneError(message)
    one_of("interpolation", interpolation, INTERPOLATIONS)
    moments = series.times.tolist() if times is None else [series.checked_time(time) for time in times]
    return _rendered(scene, series, moments, interpolation, factor, options)


def _rendered(
    scene: Scene,
    series: Series,
    moments: list[float],
    interpolation: str,
    factor: int,
    options: dict[str, Foreign],
) -> Iterator[tuple[float, Render]]:
    last: tuple[Frame, Render] | None = None
    for moment in moments:
        volume = series.at(moment, interpolation)
        if last is None or volume is not last[0]:
            now = dataclasses.replace(scene, volume=volume)
            many = factor != 1
            last = volume, supersample(now, factor, **options) if many else render(now, **options)
        yield moment, last[1]
