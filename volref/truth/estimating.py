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
from volref.arrays import Floats
from volref.errors import SceneError
from volref.planning import RAYS_PER_CHUNK, Plan, Stage
from volref.scene.footprint import Rectangle
from volref.scene.scene import Scene
from volref.truth.canvas import Canvas
from volref.truth.choosing import around_each, tiles_to_try
from volref.truth.crew import Crew
from volref.truth.integration import Integration
from volref.truth.parts import cut

# The error of a step is measured against this many times finer segments.
FINER = 8

# Estimates are scaled so that they hold for this share of the pixels tried, with this margin, but never down
# by more than the leading term of the error says: there the estimate is 8 times the error.
HELD, MARGIN, LEAST_FACTOR = 0.999, 2.0, 1 / 8

# Rays that miss the tolerance are marched again at a quarter of the step, at most so often.
ROUNDS, QUARTER = 3, 4


@dataclass(frozen=True)
class Scale:
    """An error is at most `factor` times the greatest estimate around a pixel, and `floor`."""

    factor: float
    floor: float


def march_to_tolerance(scene: Scene, plan: Plan, canvas: Canvas, crew: Crew, where: Rectangle) -> Plan:
    """Fill in the pixels of `where`; return the plan that was followed."""
    marching = _marching(scene, plan, None)
    scale = _scale(scene, marching, canvas)
    crew.draw(canvas, Integration(scene, marching), crew.runs(where, scene.width, RAYS_PER_CHUNK))
    shape, own = (scene.height, scene.width), canvas.bound.copy()
    canvas.bound[:] = _bound(scale, own, shape) + marching.termination
    again, finer = 0, marching
    for _ in range(ROUNDS):
        left = np.flatnonzero(canvas.bound > plan.tolerance)
        try:
            finer = _marching(scene, plan, finer.step / QUARTER)
        except SceneError:  # more segments than any march may take
            break
        if len(left) == 0:
            break
        again = again or len(left)
        bound = canvas.bound.copy()
        # With their neighbours, whose estimates count too.
        missing = around_each((bound > plan.tolerance).astype(np.float64).reshape(shape)).reshape(-1) > 0
        crew.draw(canvas, Integration(scene, finer), cut(np.flatnonzero(missing), RAYS_PER_CHUNK))
        own[missing] = canvas.bound[missing]
        scale = dataclasses.replace(scale, floor=scale.floor / QUARTER)
        bound[left] = _bound(scale, own, shape)[left] + marching.termination
        canvas.bound[:] = bound
    reason = f"marched, for no proof covers {planning.sampled_because(scene)}; estimates scaled by "
    reason += f"{scale.factor:.3g}, as tiles at 1/{FINER} of the step say; {again} pixels at finer steps"
    stage = Stage("method", included=True, reason=reason)
    return dataclasses.replace(marching, stages=(*marching.stages, stage))


def _bound(scale: Scale, own: Floats, shape: tuple[int, int]) -> Floats:
    """Return the bound (H W,) that follows from the estimates of the pixels themselves."""
    return scale.factor * around_each(own.reshape(shape)).reshape(-1) + scale.floor


def _marching(scene: Scene, plan: Plan, step: float | None) -> Plan:
    return planning.plan(scene, method="march", step=step, tolerance=plan.tolerance)


def _scale(scene: Scene, marching: Plan, canvas: Canvas) -> Scale:
    """Return how the estimates relate to the error, on a few tiles or, of a tiny image, on all of it."""
    tiles = tiles_to_try(scene)
    if len(tiles) == 0:
        tiles = np.arange(scene.width * scene.height).reshape(1, scene.height, scene.width)
    pixels = tiles.ravel()

    def marched(plan: Plan) -> tuple[Floats, Floats]:
        done = canvas.integrated(Integration(scene, plan), pixels, plan.tolerance)
        return done.rgba, done.bound

    rgba, estimate = marched(marching)
    try:
        truth, _ = marched(_marching(scene, marching, marching.step / FINER))
    except SceneError:
        return Scale(MARGIN, 0.0)
    error = np.abs(rgba - truth).max(axis=1)
    estimate = around_each(estimate.reshape(tiles.shape)).ravel()
    seen = estimate > 0
    ratio = float(np.quantile(error[seen] / estimate[seen], HELD)) if seen.any() else 0.0
    factor = float(np.clip(MARGIN * ratio, LEAST_FACTOR, 8 * MARGIN))
    missed = np.maximum(error - factor * estimate, 0.0)
    return Scale(factor, float(MARGIN * np.quantile(missed, HELD)))
