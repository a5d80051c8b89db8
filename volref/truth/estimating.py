"""Marching to a tolerance where no integrator has a proof: radars, lit volumes, tables of value and gradient.

The difference to three times the step estimates the error of a march, and by chance may be nothing: the
greatest of a pixel and its eight neighbours hardly ever is.  How that relates to the error of the scene is
measured on a few tiles, marched at a fraction of the step too; and where it exceeds the tolerance the rays
are marched again, at a quarter of the step.
"""

import dataclasses
from dataclasses import dataclass

import numpy as np

from volref import planning
from volref.arrays import Booleans, Floats, Indices, Numbers
from volref.errors import SceneError
from volref.planning import RAYS_PER_CHUNK, Plan, Stage
from volref.scene.footprint import Rectangle
from volref.scene.scene import Scene
from volref.truth.canvas import Canvas
from volref.truth.choosing import SIDE, TILES, around_each
from volref.truth.crew import Crew
from volref.truth.integration import Integration
from volref.truth.parts import Parts, cut

# The error of a step is measured against this many times finer segments.
FINER = 8

# Bounds are made to hold for this share of the pixels tried, with this margin.
HELD, MARGIN = 0.999, 3.0

# What estimates may be scaled by: never down by more than the leading term of the error says, where they are
# 8 times the error; and what would have to be scaled up by more than the last is better covered by a floor.
FACTORS = tuple(2.0**k for k in range(-3, 5))

# Rays that miss the tolerance are marched again at a quarter of the step, at most so often.
ROUNDS, QUARTER = 3, 4


@dataclass(frozen=True)
class Scale:
    """An error is at most `factor` times the greatest estimate around a pixel, and `floor`."""

    factor: float
    floor: float


def march_to_tolerance(scene: Scene, plan: Plan, canvas: Canvas, crew: Crew, where: Rectangle) -> Plan:
    """Fill in the pixels of `where`; return the plan that was followed."""
    marching = finer = _marching(scene, plan, None)
    integration, shape = Integration(scene, marching), (scene.height, scene.width)
    reached = drawn(canvas, crew, integration, crew.runs(where, scene.width, RAYS_PER_CHUNK))
    own = np.where(reached, canvas.bound, 0.0)
    scale = _scale(scene, marching, canvas, own)
    # What lies behind an early end is certain, and not to be scaled down with the rest.
    certain = marching.termination * max(integration.field.color_limit, *scene.background, 1.0)
    # Pixels that nothing was found in are as certain as their neighbours.
    seen = _around(own, shape) > 0
    canvas.bound[reached] = (_bound(scale, own, shape) + certain)[reached] * seen[reached]
    again = 0
    for _ in range(ROUNDS):
        left = reached & (canvas.bound > plan.tolerance)
        if not left.any():
            break
        try:
            finer = _marching(scene, plan, finer.step / QUARTER)
        except SceneError:  # more segments than any march may take
            break
        again, bound = again or int(np.count_nonzero(left)), canvas.bound.copy()
        # With their neighbours, whose estimates count too.
        missing = np.flatnonzero(reached & (_around(left.astype(np.float64), shape) > 0))
        before, moved = canvas.rgba[missing], np.zeros(len(bound))
        redrawn = drawn(canvas, crew, Integration(scene, finer), cut(missing, RAYS_PER_CHUNK))
        own[redrawn], better = canvas.bound[redrawn], left & redrawn
        scale = dataclasses.replace(scale, floor=scale.floor / QUARTER)
        # A march of first order moves by three times as much as it is off then.
        moved[missing] = np.abs(canvas.rgba[missing] - before).max(axis=1) * (MARGIN / (QUARTER - 1))
        new = np.maximum(_bound(scale, own, shape), _around(moved, shape)) + certain
        bound[better] = new[better]
        canvas.bound[:] = bound
    reason = f"marched, for no proof covers {planning.sampled_because(scene)}; estimates scaled by "
    reason += f"{scale.factor:.3g}, as tiles at 1/{FINER} of the step say; {again} pixels at finer steps"
    stage = Stage("method", included=True, reason=reason)
    return dataclasses.replace(marching, stages=(*marching.stages, stage))


def drawn(canvas: Canvas, crew: Crew, integration: Integration, parts: Parts) -> Booleans:
    """Draw `parts`; return the pixels (H W,) that were reached before the deadline, with an estimate now."""
    known = canvas.bound.copy()
    canvas.bound[:] = np.nan
    crew.draw(canvas, integration, parts)
    reached: Booleans = ~np.isnan(canvas.bound)
    canvas.bound[~reached] = known[~reached]
    return reached


def _bound(scale: Scale, own: Floats, shape: tuple[int, int]) -> Floats:
    """Return the bound (H W,) that follows from the estimates of the pixels themselves."""
    return scale.factor * _around(own, shape) + scale.floor


def _around(own: Floats, shape: tuple[int, int]) -> Floats:
    """Return the greatest (H W,) of each pixel and its neighbours."""
    return around_each(own.reshape(shape)).reshape(-1)


def _marching(scene: Scene, plan: Plan, step: float | None) -> Plan:
    return planning.plan(scene, method="march", step=step, tolerance=plan.tolerance)


def _scale(scene: Scene, marching: Plan, canvas: Canvas, own: Floats) -> Scale:
    """Return how the estimates relate to the error, on a few tiles or, of a small image, on all of it."""
    tiles = _tiles_seen(own.reshape(scene.height, scene.width))
    pixels = tiles.ravel()
    if len(pixels) == 0:
        return Scale(MARGIN, 0.0)
    try:
        finer = Integration(scene, _marching(scene, marching, marching.step / FINER))
    except SceneError:
        return Scale(MARGIN, 0.0)
    truth = canvas.integrated(finer, pixels, marching.tolerance).rgba
    error = np.abs(canvas.rgba[pixels] - truth).max(axis=1)
    estimate = around_each(own[tiles]).ravel()
    return min((_with_floor(factor, error, estimate) for factor in FACTORS), key=lambda scale: scale[0])[1]


def _with_floor(factor: float, error: Floats, estimate: Floats) -> tuple[float, Scale]:
    """Return what the bounds would be on average with this factor, and the scale with the floor it needs."""
    floor = float(np.quantile(np.maximum(MARGIN * error - factor * estimate, 0.0), HELD))
    return float(np.mean(factor * estimate)) + floor, Scale(factor, floor)


def _tiles_seen(own: Floats) -> Indices:
    """Return the pixels (k, h, w) of tiles in which something was drawn, or all of a small image."""
    height, width = own.shape
    pixels = np.arange(own.size).reshape(own.shape)
    if own.size <= TILES * SIDE * SIDE:
        return pixels[None]
    down, across = max(height // SIDE, 1), max(width // SIDE, 1)
    h, w = min(SIDE, height), min(SIDE, width)

    def tiled(image: Numbers) -> Numbers:
        whole = image[: down * h, : across * w].reshape(down, h, across, w)
        return whole.swapaxes(1, 2).reshape(-1, h, w)

    tiles = tiled(pixels)
    seen = np.flatnonzero(tiled(own).max(axis=(1, 2)) > 0)
    chosen = np.random.default_rng(0).choice(seen, min(TILES, len(seen)), replace=False)
    return np.asarray(tiles[chosen])
