"""`render`: a scene in, an image with its error and its cost out."""

import dataclasses
import time
from concurrent.futures import Executor

import numpy as np

from volref import planning
from volref.arrays import number, whole_number
from volref.errors import SceneError
from volref.planning import HALF_LEVEL, RAYS_PER_CHUNK, Plan, Stage
from volref.scene.footprint import Rectangle, footprint
from volref.scene.scene import Scene
from volref.truth.canvas import Canvas
from volref.truth.choosing import Choice, around_each, choose
from volref.truth.crew import Crew, Progress, available_cores
from volref.truth.estimating import drawn, march_to_tolerance
from volref.truth.integration import Integration
from volref.truth.meshes.surfaces import visible_surface
from volref.truth.parts import TILE_HEIGHT, TILE_WIDTH, cut, tiles
from volref.truth.result import Render


def render(
    scene: Scene,
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
) -> Render:
    """Return the image of `scene` with a bound on its error per pixel.

    Parameters
    ----------
    scene
        What to draw.
    method
        "march": the midpoint rule in float64 with exponential opacities at a uniform step, and an estimate of
        its error.  "exact": the integral with a proven bound, at the cost that `tolerance` takes.  "auto":
        the cheapest whose bound meets the tolerance.
    tolerance
        The error per pixel in the working space, over all four channels; `met_tolerance` compares.
    certified
        Whether "auto" needs a proven bound, or an estimate may do.
    step
        Length of a segment in world units; default half the least spacing of the volume.
    threads
        Threads to work with; default every core this process may use.  The image does not depend on it.
    executor
        Any `concurrent.futures.Executor` to do the work in their place, such as a `ProcessPoolExecutor` or
        that of a Dask client, on this machine or others.  Workers read the volume from its file; a volume
        that has none is written to a temporary folder, inside the folder that the environment variable
        VOLREF_SHARED names.  The image does not depend on it either.
    progress
        Called with (tasks done, tasks in all).
    max_seconds
        Time after which nothing more is begun.  Pixels not reached by then hold the middle of all that they
        could be, and half of that as their bound; `met_tolerance` tells.
    plan
        A plan from `volref.plan` to follow instead of making one from `method`, `step` and `tolerance`.

    Raises
    ------
    SceneError
        If an argument breaks a rule of `volref.plan`, or the plan is another scene's.
    FormatError
        If a worker of the executor cannot read the volume's file, or finds something else in it.
    """
    started = time.perf_counter()
    deadline = np.inf if max_seconds is None else started + number("max_seconds", max_seconds, above=0)
    decided = decide(scene, plan, method, step, tolerance, certified=certified)
    workers = available_cores() if threads is None else whole_number("threads", threads, low=1, high=1024)
    with Crew(executor, workers, progress, deadline) as crew:
        canvas = Canvas(scene, visible_surface(scene) if decided.includes("meshes") else None)
        kind, decided = _draw(scene, decided, canvas, crew)
    shape = scene.height, scene.width
    return Render(
        canvas.rgba.reshape(*shape, 4),
        canvas.distances().reshape(shape),
        canvas.bound.reshape(shape),
        kind,
        time.perf_counter() - started,
        canvas.samples,
        crew.size,
        decided,
    )


def _draw(scene: Scene, plan: Plan, canvas: Canvas, crew: Crew) -> tuple[str, Plan]:
    """Draw as the plan says; return the kind of the bound, and the plan with the method that answered."""
    if not plan.includes("volume"):
        canvas.show_what_lies_behind()
        return _nothing_drawn(plan)
    where = _where(scene, plan)
    if where.pixels < len(canvas.bound):
        canvas.show_what_lies_behind()
    if where.pixels == 0:
        return _nothing_drawn(plan)
    if crew.deadline < np.inf:
        canvas.show_anything(tiles(scene, where))
    if plan.method == "march":
        crew.draw(canvas, Integration(scene, plan), crew.runs(where, scene.width, RAYS_PER_CHUNK))
        return "estimate", plan
    if planning.sampled_because(scene):
        return "estimate", march_to_tolerance(scene, plan, canvas, crew, where)
    integration = Integration(scene, plan)
    if scene.mode != "composite":
        _draw_exactly(integration, canvas, crew)
        return "estimate" if scene.lights_volume else "certified", plan
    if plan.method == "auto" and canvas.layers is None and not scene.clip:
        around = canvas.distance, canvas.all_behind()
        choice = choose(scene, plan, integration.prepared, *around)
        if choice is not None:
            return "estimate", _march_then_mend(integration, choice, canvas, crew)
    _draw_exactly(integration, canvas, crew)
    return "certified", dataclasses.replace(plan, method="exact")


def _nothing_drawn(plan: Plan) -> tuple[str, Plan]:
    """Return the kind of the bound where there is nothing to integrate, and the plan."""
    return (
        ("estimate", plan)
        if plan.method == "march"
        else ("certified", dataclasses.replace(plan, method="exact"))
    )


def _where(scene: Scene, plan: Plan) -> Rectangle:
    """Return the pixels whose rays are cast."""
    if plan.includes("rays that miss"):
        return Rectangle(0, scene.width, 0, scene.height)
    return footprint(scene)


def _march_then_mend(integration: Integration, choice: Choice, canvas: Canvas, crew: Crew) -> Plan:
    """March, scale the estimates, and integrate exactly the pixels whose estimate exceeds the tolerance."""
    scene, plan = integration.scene, choice.plan
    where = _where(scene, plan)
    reached = drawn(canvas, crew, Integration(scene, plan), crew.runs(where, scene.width, RAYS_PER_CHUNK))
    own = np.where(reached, canvas.bound, 0.0).reshape(scene.height, scene.width)
    canvas.bound[reached] = (choice.factor * around_each(own).reshape(-1) + plan.termination)[reached]
    left = np.flatnonzero(reached & (canvas.bound > plan.tolerance))
    crew.draw(canvas, integration, cut(left, TILE_WIDTH * TILE_HEIGHT), plan.tolerance)
    reason = f"marched, its estimates scaled by {choice.factor:.3g} after tiles integrated exactly; "
    reason += f"{len(left)} pixels above the tolerance integrated exactly"
    return dataclasses.replace(plan, stages=(*plan.stages, Stage("method", included=True, reason=reason)))


def _draw_exactly(integration: Integration, canvas: Canvas, crew: Crew) -> None:
    """Integrate every pixel to the tolerance; against a deadline, all of them roughly first."""
    scene, plan = integration.scene, integration.plan
    parts, tolerance = tiles(scene, _where(scene, plan)), plan.tolerance
    timed = crew.deadline < np.inf
    if timed:
        crew.draw(canvas, integration, parts, np.inf, only_better=True)
        left = [i for i in range(parts.count) if canvas.bound[parts.pixels(i)].max() > tolerance]
        parts = parts.only(left)
    crew.draw(canvas, integration, parts, tolerance, only_better=timed)


def decide(
    scene: Scene,
    plan: Plan | None,
    method: str = "march",
    step: float | None = None,
    tolerance: float = HALF_LEVEL,
    *,
    certified: bool = True,
) -> Plan:
    """Return the plan to follow: the given one, checked, or one made from the other arguments.

    Raises
    ------
    SceneError
        If both are given, or the plan is another scene's.
    """
    if plan is None:
        return planning.plan(scene, method=method, step=step, tolerance=tolerance, certified=certified)
    if not isinstance(plan, Plan):
        message = f"plan must be a volref.Plan, got {type(plan).__name__}; make one with volref.plan(scene)"
        raise SceneError(message)
    if (
        method not in ("auto", plan.method)
        or step is not None
        or tolerance not in (HALF_LEVEL, plan.tolerance)
    ):
        message = (
            f"plan must stand alone, got method {method!r}, step {step} and tolerance {tolerance:g} too; "
        )
        raise SceneError(message + "state them to volref.plan, or dataclasses.replace them in the plan")
    plan.check(scene)
    return plan
