"""Cubic splines through control points, baked to the entries of a lookup table.

Burkalo (2022, section 3.1; seed of volref's `burkalo2022`) lets a user set control points, draws a cubic
spline through them and uploads it as a 1-D texture; a shader never sees the spline itself.
"""

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from volref.arrays import Floats, one_of, whole_number
from volref.errors import SceneError
from volref.scene.transfer_checks import checked_positions, share

# How SciPy names what holds at the ends.
ENDS: dict[str, Literal["natural", "clamped", "not-a-knot"]] = {
    "natural": "natural",
    "clamped": "clamped",
    "not-a-knot": "not-a-knot",
}
KINDS = (*ENDS, "catmull-rom", "monotone")
MOST_SAMPLES = 65536


def spline_table(
    values: ArrayLike, colors: ArrayLike, opacity: ArrayLike, samples: int, kind: str, *, texel_centers: bool
) -> tuple[Floats, tuple[float, float]]:
    """Return the straight RGBA entries (samples, 4) of a spline, held to 0..1, and their domain.

    natural         second derivative 0 at the ends
    clamped         slope 0 at the ends
    not-a-knot      one cubic over the first two intervals, and one over the last two
    catmull-rom     at each point the slope of the chord between its neighbours; at an end, of its interval
    monotone        PCHIP (Fritsch and Carlson 1980): between two points never beyond them

    All but the last may swing beyond the control points.
    """
    count = whole_number("samples", samples, low=2, high=MOST_SAMPLES)
    one_of("kind", kind, KINDS)
    at = checked_positions("transfer.values", values)
    if len(at) < 2 or (np.diff(at) == 0).any():
        message = f"transfer.values must rise, at least 2 of them, for a spline, got {_short(at)}; "
        raise SceneError(message + "give distinct control points")
    points = np.concatenate(
        [
            share("transfer.colors", colors, (len(at), 3)),
            share("transfer.opacity", opacity, (len(at),))[:, None],
        ],
        axis=1,
    )
    index = np.arange(count)
    place = (index + 0.5) / count if texel_centers else index / (count - 1)
    first, last = float(at[0]), float(at[-1])
    # Over 0..1, so that the sizes of the values do not matter.
    curve = _curve((at - first) / (last - first), points, kind, place)
    return np.clip(curve, 0.0, 1.0), (first, last)


def _curve(at: Floats, points: Floats, kind: str, place: Floats) -> Floats:
    from scipy import interpolate

    if kind == "monotone":
        return np.asarray(interpolate.PchipInterpolator(at, points)(place))
    if kind == "catmull-rom":
        slopes = np.empty(points.shape)
        slopes[1:-1] = (points[2:] - points[:-2]) / (at[2:] - at[:-2])[:, None]
        slopes[0] = (points[1] - points[0]) / (at[1] - at[0])
        slopes[-1] = (points[-1] - points[-2]) / (at[-1] - at[-2])
        return np.asarray(interpolate.CubicHermiteSpline(at, points, slopes)(place))
    return np.asarray(interpolate.CubicSpline(at, points, bc_type=ENDS[kind])(place))


def _short(values: Floats) -> str:
    return str(values.tolist()) if len(values) <= 4 else f"{len(values)} with two equal"
