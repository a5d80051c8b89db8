"""`supersample`: a pixel as the mean of a regular grid of rays, with a bound on that mean.

    factor 2: a pixel and its four rays        +-------+-------+
    at 1/4 and 3/4 of its width and height     |   x   |   x   |
                                               +-------+-------+
                                               |   x   |   x   |
                                               +-------+-------+

An image of `factor` times the width and height is rendered and averaged.  What is certified of it is the mean
of those rays, not of the whole pixel's area: |mean of images - mean of truths| is at most the mean of the
bounds, and a few roundings.  How far the mean of the rays is from that over the pixel, no bound here says.
"""

import dataclasses
import time
from concurrent.futures import Executor

import numpy as np

from volref.arrays import Floats, number, whole_number
from volref.planning import HALF_LEVEL, Plan, Stage
from volref.scene.camera import Camera
from volref.scene.scene import LARGEST_IMAGE_SIDE, Scene
from volref.truth.crew import Progress
from volref.truth.rendering import decide, render
from volref.truth.result import Render

# Rays of a band: the fine image is rendered in bands of rows, so that it is never in memory as a whole.
BAND_PIXELS = 1 << 22

# Beyond it, 4096 rays a pixel, another rule than a grid's would do better.
MOST_PER_SIDE = 64

# Steps in which the progress of a band is told.
TICKS = 1000


def supersample(
    scene: Scene,
    factor: int = 2,
    *,
    method: str = "auto",
    tolerance: float = HALF_LEVEL,
    certified: bool = True,
    step: float | None = None,
    threads: int | None = None,
    executor: Executor | None = None,
    progress: Progress | None = None,
    max_seconds: float | None = None,
    plan: Plan | None = None,
    band_pixels: int = BAND_PIXELS,
) -> Render:
    """Return the image of `scene` with every pixel the mean of `factor` x `factor` rays, premultiplied.

    The camera stays: it opens as wide, and an orthographic one is as high.  The bound is the mean of the
    rays' bounds and of the same kind, "certified" if all of theirs are; it says how far the mean of these
    rays may be off, not how far that is from the mean over the pixel's area.  The distance is the least of
    the rays': that of the nearest surface seen in the pixel.

    Parameters
    ----------
    factor
        Rays per pixel along x and along y, 1 to 64.
    method, tolerance, certified, step
        As `volref.render` has them, for each ray.
    threads, executor, progress, max_seconds, plan
        As `volref.render` has them, for the whole image.
    band_pixels
        The most rays whose results are held at a time; at least one row of pixels is.  Cameras of bands are
        given as matrices, so where an image takes several, rays may be another ulp off.

    Raises
    ------
    SceneError
        If `factor` is out of range, or `volref.render` refuses the rest.
    """
    started = time.perf_counter()
    budget = None if max_seconds is None else number("max_seconds", max_seconds, above=0)
    decided = decide(scene, plan, method, step, tolerance, certified=certified)
    most = min(MOST_PER_SIDE, LARGEST_IMAGE_SIDE // max(scene.width, scene.height))
    factor = whole_number("factor", factor, low=1, high=most)
    rows = max(1, band_pixels // (scene.width * factor**2))
    bands = [(top, min(top + rows, scene.height)) for top in range(0, scene.height, rows)]
    parts = []
    for i, band in enumerate(bands):
        # A band that comes too late still says what is known: next to nothing.
        left = None if budget is None else max(budget - (time.perf_counter() - started), 1e-9)
        fine = render(
            fine_band(scene, factor, *band),
            threads=threads,
            executor=executor,
            progress=None if progress is None else _part_of(progress, i, len(bands)),
            max_seconds=left,
            plan=decided,
        )
        parts.append(_averaged(fine, factor))
    return _joined(parts, factor, time.perf_counter() - started)


def fine_band(scene: Scene, factor: int, top: int, bottom: int) -> Scene:
    """Return the scene of rows `top` to `bottom` with `factor` times the pixels along x and y.

    The rows of the whole image span y_ndc from 1 to -1, those of the band from y_top to y_bottom; the row of
    the projection is stretched by 2 / (y_top - y_bottom) and shifted so that these become 1 and -1.
    """
    width, height = factor * scene.width, factor * (bottom - top)
    if (top, bottom) == (0, scene.height):
        return dataclasses.replace(scene, width=width, height=height)
    clip = np.array(scene.camera.clip_from_view(scene.width, scene.height))
    stretch = scene.height / (bottom - top)
    shift = (top + bottom) / (bottom - top) - stretch
    clip[1] = stretch * clip[1] + shift * clip[3]
    camera = Camera.from_matrices(scene.camera.view_from_world, clip, clip_z=scene.camera.clip_z)
    return dataclasses.replace(scene, camera=camera, width=width, height=height)


def _averaged(fine: Render, factor: int) -> Render:
    """Return a render with `factor` x `factor` pixels made one."""
    count = factor**2
    # Each of the count - 1 sums and the division rounds by half an ulp of what it gives; twice that is safe.
    rounding = count * 2.0**-52 * _mean(fine.rgba, factor).max(axis=-1)
    bound = fine.bound
    if factor > 1:
        bound = _mean(fine.bound, factor) * (1 + count * 2.0**-52) + rounding
    return dataclasses.replace(
        fine,
        rgba=_mean(fine.rgba, factor),
        distance=_cells(fine.distance, factor).min(axis=(1, 3)),
        bound=bound,
    )


def _joined(parts: list[Render], factor: int, seconds: float) -> Render:
    """Return the bands of an image as one; certified if all of them are."""
    last = parts[-1]
    reason = f"each pixel is the mean of {factor} x {factor} rays, and its bound that of their mean"
    stage = Stage("supersampling", included=factor > 1, reason=reason if factor > 1 else "one ray per pixel")
    kinds = {part.bound_kind for part in parts}
    return Render(
        np.concatenate([part.rgba for part in parts]),
        np.concatenate([part.distance for part in parts]),
        np.concatenate([part.bound for part in parts]),
        kinds.pop() if len(kinds) == 1 else "estimate",
        seconds,
        sum(part.samples for part in parts),
        max(part.threads for part in parts),
        dataclasses.replace(last.plan, stages=(*last.plan.stages, stage)),
    )


def _cells(image: Floats, factor: int) -> Floats:
    """Return an image (f H, f W, ...) as (H, f, W, f, ...)."""
    height, width = image.shape[0] // factor, image.shape[1] // factor
    return image.reshape(height, factor, width, factor, *image.shape[2:])


def _mean(image: Floats, factor: int) -> Floats:
    """Return the mean of each pixel's rays, added one after the other, so that no band changes the order."""
    cells = _cells(image, factor)
    total = np.zeros(cells[:, 0, :, 0].shape)
    for y in range(factor):
        for x in range(factor):
            total += cells[:, y, :, x]
    return total / factor**2


def _part_of(progress: Progress, number: int, count: int) -> Progress:
    """Return a progress for one of `count` bands that speaks to the one of the image."""

    def show(done: int, total: int) -> None:
        progress(number * TICKS + TICKS * done // max(total, 1), count * TICKS)

    return show
