"""Which method is cheapest where an estimate may do: measured on a few tiles of the image.

The marcher's error is known only where the truth is.  So some tiles are integrated exactly and marched, which
tells how its estimate relates to its error in this scene, which step meets the tolerance, how many pixels
will have to be integrated exactly all the same, and what either costs.
"""

import time
from dataclasses import dataclass

import numpy as np

from volref import planning
from volref.arrays import Floats, Indices
from volref.planning import MOST_DEFAULT_SEGMENTS, Plan
from volref.scene.footprint import footprint
from volref.scene.scene import Scene
from volref.truth.exact import Prepared, integrate_pixels
from volref.truth.fields import field_of
from volref.truth.march import march_chunk
from volref.workspace import Workspace

# Tiles to try, pixels on a side, at most this share of where the volume may show, and at least so many.
TILES, SIDE, MOST_SHARE, FEWEST_TILES = 24, 8, 1 / 2, 6

# The estimate is scaled so that it holds for this share of the pixels tried, with this margin.
HELD, MARGIN = 0.999, 2.0

# The first step tried, in units of the least spacing, and the range of those that may follow from it.
FIRST_STEP, LEAST_STEP, MOST_STEP = 1.0, 0.05, 4.0

# How many steps are tried, and how much they differ at least.
TRIES, SAME_STEP = 4, 0.15

# The truth on the tiles is known to this part of the tolerance.
TRUER = 1e-2

# The marcher is timed on this many times the pixels: a call of NumPy costs as much for few as for many.
REPEATED = 8

# A pixel that is left takes this many times as long as an average one, to integrate exactly.
DEAR = 3.0

# The step is aimed at so that this share of the pixels is left to be integrated exactly.
MOST_LEFT = 0.01

# Where its leading term rules, the estimate is 8 times the error.  One that would have to be scaled up by
# more than this has missed what matters, and may have missed more beside the tiles.
LEAST_FACTOR, MOST_FACTOR = 1 / 8, 1.5

# Marching has to be predicted to take less than this part of the time: prediction is rough.
WORTH = 0.7


@dataclass(frozen=True, eq=False)
class Choice:
    """March with `plan`, and take `factor` times the greatest estimate around a pixel as its bound."""

    plan: Plan
    factor: float


@dataclass(frozen=True, eq=False)
class _Tried:
    """A step on the pixels tried: the factor of its estimates, seconds per pixel, a typical bound."""

    plan: Plan
    factor: float
    seconds: float
    typical: float


def choose(scene: Scene, plan: Plan, prepared: Prepared, distance: Floats, behind: Floats) -> Choice | None:
    """Return how to march `scene` to `plan.tolerance`, or None where integrating exactly is cheaper.

    distance (H W,) and behind (H W, 4) are those of all pixels.
    """
    tiles = tiles_to_try(scene)
    if len(tiles) == 0:
        return None
    pixels = tiles.ravel()
    on_tiles = distance[pixels], behind[pixels]
    many = np.tile(pixels, REPEATED)
    truth = integrate_pixels(scene, prepared, pixels, 0.0, *on_tiles, max(plan.tolerance * TRUER, 1e-12))
    if not (truth.bound > 0).any():  # nothing was met that could tell how estimates relate to errors
        return None
    started = time.perf_counter()
    integrate_pixels(scene, prepared, pixels, 0.0, *on_tiles, plan.tolerance)
    exactly = (time.perf_counter() - started) / len(pixels)
    busy = max(float((truth.bound > 0).mean()), 1e-3)  # pixels that cost nothing are never left

    def tried(step: float) -> _Tried | None:
        marching = planning.plan(scene, method="march", step=step, tolerance=plan.tolerance)
        if marching.most_segments > MOST_DEFAULT_SEGMENTS:
            return None
        field = field_of(scene, marching)
        started = time.perf_counter()
        chunk = march_chunk(scene, marching, field, many, 0.0, distance[many], behind[many], Workspace())
        seconds = (time.perf_counter() - started) / len(many)
        error = np.abs(chunk.rgba[: len(pixels)] - truth.rgba).max(axis=1)
        around = around_each(chunk.bound[: len(pixels)].reshape(tiles.shape)).ravel()
        ratio = np.quantile(error / np.maximum(around, 1e-300), HELD)
        factor = max(float(MARGIN * ratio), LEAST_FACTOR)
        if factor > MOST_FACTOR:
            return None
        left = float((factor * around > plan.tolerance).mean())
        typical = float(np.quantile(factor * around, 1 - MOST_LEFT))
        return _Tried(marching, factor, seconds + min(DEAR * left / busy, 1.0) * exactly, typical)

    voxel = min(scene.gridded[0].spacing)
    step, best = FIRST_STEP, None
    for _ in range(TRIES):
        latest = tried(step * voxel)
        if latest is None:
            break
        if best is None or latest.seconds < best.seconds:
            best = latest
        # The error goes with the square of the step.
        wanted = step * np.sqrt(plan.tolerance / max(latest.typical, 1e-300))
        wanted = float(np.clip(wanted, LEAST_STEP, MOST_STEP))
        if abs(wanted / step - 1) < SAME_STEP:
            break
        step = wanted
    if best is None:
        return None
    return Choice(best.plan, best.factor) if best.seconds < WORTH * exactly else None


def around_each(estimate: Floats) -> Floats:
    """Return the greatest estimate of each pixel and its eight neighbours, of images (..., H, W)."""
    from scipy.ndimage import maximum_filter

    size = (1,) * (estimate.ndim - 2) + (3, 3)
    return np.asarray(maximum_filter(estimate, size, mode="nearest"))


def tiles_to_try(scene: Scene) -> Indices:
    """Return the pixels (k, SIDE, SIDE) of tiles spread over where the volume may show.

    None if that is small.
    """
    where = footprint(scene)
    across, down = (where.right - where.left) // SIDE, (where.bottom - where.top) // SIDE
    count = min(TILES, int(across * down * MOST_SHARE))
    if count < FEWEST_TILES:
        return np.empty((0, SIDE, SIDE), np.intp)
    chosen = np.random.default_rng(0).choice(across * down, count, replace=False)
    y, x = np.divmod(chosen, across)
    corner = (where.top + y * SIDE) * scene.width + where.left + x * SIDE
    return np.asarray(corner[:, None, None] + np.arange(SIDE)[:, None] * scene.width + np.arange(SIDE))
