"""`render`: a scene in, an image with its error and its cost out."""

import dataclasses
import os
import queue
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed

import numpy as np

from volref import planning
from volref.arrays import Floats, Indices, number, whole_number
from volref.errors import SceneError
from volref.planning import HALF_LEVEL, RAYS_PER_CHUNK, Plan, Stage
from volref.records import Surface
from volref.scene.scene import Scene
from volref.truth.choosing import Choice, around_each, choose
from volref.truth.exact import Prepared, integrate_pixels, prepare
from volref.truth.march import Field, field_of, march_chunk
from volref.truth.result import Render
from volref.truth.surfaces import visible_surface
from volref.workspace import Workspace

# Called now and then with (chunks done, chunks in all).
Progress = Callable[[int, int], None]

# The exact integrator takes the rays of a tile together: they go through the same cells.
TILE_WIDTH, TILE_HEIGHT = 32, 16

# What becomes of a chunk's pixels: rgba (R, 4), bound (R,), values interpolated or pieces integrated.
Integrator = Callable[[Indices, Workspace], tuple[Floats, Floats, int]]


def render(
    scene: Scene,
    *,
    method: str = "auto",
    tolerance: float = HALF_LEVEL,
    certified: bool = True,
    step: float | None = None,
    threads: int | None = None,
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
    progress
        Called with (chunks done, chunks in all).
    max_seconds
        Time after which nothing more is begun.  Pixels not reached by then hold the middle of all that they
        could be, and half of that as their bound; `met_tolerance` tells.
    plan
        A plan from `volref.plan` to follow instead of making one from `method`, `step` and `tolerance`.

    Raises
    ------
    SceneError
        If an argument breaks a rule of `volref.plan`, or the plan is another scene's.
    """
    started = time.perf_counter()
    deadline = np.inf if max_seconds is None else started + number("max_seconds", max_seconds, above=0)
    decided = decide(scene, plan, method, step, tolerance, certified=certified)
    workers = available_cores() if threads is None else whole_number("threads", threads, low=1, high=1024)
    surface = visible_surface(scene) if decided.includes("meshes") else None
    canvas = _Canvas(scene, surface, workers, progress, deadline)
    if decided.method == "march":
        kind = "estimate"
        canvas.draw(
            _marcher(scene, decided, field_of(scene) if decided.includes("volume") else None, canvas),
            _runs(scene),
        )
    else:
        kind, decided = _draw_to_tolerance(scene, decided, canvas)
    shape = scene.height, scene.width
    return Render(
        canvas.rgba.reshape(*shape, 4),
        canvas.distance.reshape(shape),
        canvas.bound.reshape(shape),
        kind,
        time.perf_counter() - started,
        canvas.samples,
        workers,
        decided,
    )


class _Canvas:
    """Pixels being filled in: rgba (H W, 4), bound (H W,), and the work spent so far."""

    def __init__(
        self,
        scene: Scene,
        surface: Surface | None,
        workers: int,
        progress: Progress | None,
        deadline: float,
    ) -> None:
        pixels = scene.width * scene.height
        self.scene, self.surface, self.workers = scene, surface, workers
        self.progress, self.deadline = progress, deadline
        self.distance = np.full(pixels, np.inf) if surface is None else surface.distance.reshape(-1)
        self.rgba, self.bound = _anything(scene, self.behind(np.arange(pixels)))
        self.samples = 0
        self._spare: queue.SimpleQueue[Workspace] = queue.SimpleQueue()
        for _ in range(workers):
            self._spare.put(Workspace())

    def behind(self, pixels: Indices) -> Floats:
        return light_behind(self.scene, self.surface, pixels)

    def draw(self, integrator: Integrator, parts: Sequence[Indices], *, only_better: bool = False) -> None:
        """Fill in `parts` until the deadline; what is not reached, or was known better, stays as it is."""

        def fill(part: Indices) -> int:
            if time.perf_counter() > self.deadline:
                return 0
            work = self._spare.get()
            try:
                rgba, bound, samples = integrator(part, work)
            finally:
                self._spare.put(work)  # a thread that waited for it would wait for ever
            better = np.ones(len(part), np.bool_)
            if only_better:
                better = bound <= self.bound[part]
            self.rgba[part[better]], self.bound[part[better]] = rgba[better], bound[better]
            return samples

        self.samples += _sum_in_threads(fill, parts, self.workers, self.progress)


def _anything(scene: Scene, behind: Floats) -> tuple[Floats, Floats]:
    """Return an image (R, 4) midway between all that the volume could show, and its bound (R,)."""
    if scene.volume is None or scene.transfer is None:
        return behind.copy(), np.zeros(len(behind))
    most = np.maximum(behind, np.append(scene.transfer.colors.max(axis=0), 1.0))
    least = np.append(np.zeros((len(behind), 3)), behind[:, 3:], axis=1)
    return (most + least) / 2, (most - least).max(axis=1) / 2


def _marcher(scene: Scene, plan: Plan, field: Field | None, canvas: _Canvas) -> Integrator:
    def march(part: Indices, work: Workspace) -> tuple[Floats, Floats, int]:
        chunk = march_chunk(scene, plan, field, part, canvas.distance[part], canvas.behind(part), work)
        return chunk.rgba, chunk.bound, chunk.samples

    return march


def _draw_to_tolerance(scene: Scene, plan: Plan, canvas: _Canvas) -> tuple[str, Plan]:
    """Draw by the exact method, or the cheaper one if the plan leaves the choice; return kind, plan."""
    prepared = prepare(scene, plan) if plan.includes("volume") else None
    if plan.method == "auto" and prepared is not None:
        behind = canvas.behind(np.arange(len(canvas.distance)))
        field = field_of(scene)
        choice = choose(scene, plan, field, prepared, canvas.distance, behind)
        if choice is not None:
            return "estimate", _march_then_mend(scene, choice, field, prepared, canvas)
    _draw_exactly(scene, plan.tolerance, prepared, canvas)
    return "certified", dataclasses.replace(plan, method="exact")


def _march_then_mend(scene: Scene, choice: Choice, field: Field, prepared: Prepared, canvas: _Canvas) -> Plan:
    """March, scale the estimates, and integrate exactly the pixels whose estimate exceeds the tolerance."""
    plan, shape = choice.plan, (scene.height, scene.width)
    canvas.draw(_marcher(scene, plan, field, canvas), _runs(scene))
    canvas.bound[:] = choice.factor * around_each(canvas.bound.reshape(shape)).reshape(-1) + plan.termination
    left = np.flatnonzero(canvas.bound > plan.tolerance)
    tile = TILE_WIDTH * TILE_HEIGHT
    parts = [left[first : first + tile] for first in range(0, len(left), tile)]
    canvas.draw(_integrator(scene, plan.tolerance, prepared, canvas), parts)
    reason = f"marched, its estimates scaled by {choice.factor:.3g} after tiles integrated exactly; "
    reason += f"{len(left)} pixels above the tolerance integrated exactly"
    return dataclasses.replace(plan, stages=(*plan.stages, Stage("method", included=True, reason=reason)))


def _integrator(scene: Scene, tolerance: float, prepared: Prepared | None, canvas: _Canvas) -> Integrator:
    def integrate(part: Indices, _: Workspace) -> tuple[Floats, Floats, int]:
        distance, behind = canvas.distance[part], canvas.behind(part)
        done = integrate_pixels(scene, prepared, part, distance, behind, tolerance)
        return done.rgba, done.bound, done.pieces

    return integrate


def _draw_exactly(scene: Scene, tolerance: float, prepared: Prepared | None, canvas: _Canvas) -> None:
    """Integrate every pixel to the tolerance; against a deadline, all of them roughly first."""
    parts = _tiles(scene)
    if canvas.deadline < np.inf:
        canvas.draw(_integrator(scene, np.inf, prepared, canvas), parts, only_better=True)
        parts = [part for part in parts if canvas.bound[part].max() > tolerance]
    timed = canvas.deadline < np.inf
    canvas.draw(_integrator(scene, tolerance, prepared, canvas), parts, only_better=timed)


def _runs(scene: Scene) -> list[Indices]:
    """Return the pixels in runs of RAYS_PER_CHUNK."""
    pixels = scene.width * scene.height
    starts = range(0, pixels, RAYS_PER_CHUNK)
    return [np.arange(first, min(first + RAYS_PER_CHUNK, pixels)) for first in starts]


def _tiles(scene: Scene) -> list[Indices]:
    """Return the pixels in tiles."""
    number_of = np.arange(scene.width * scene.height).reshape(scene.height, scene.width)
    return [
        number_of[y : y + TILE_HEIGHT, x : x + TILE_WIDTH].ravel()
        for y in range(0, scene.height, TILE_HEIGHT)
        for x in range(0, scene.width, TILE_WIDTH)
    ]


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


def light_behind(scene: Scene, surface: Surface | None, pixels: Indices) -> Floats:
    """Return the premultiplied RGBA (R, 4) behind the volume at `pixels`: the surface, or the background."""
    behind = np.tile(np.array(scene.background), (len(pixels), 1))
    if surface is not None:
        hit = surface.mesh.reshape(-1)[pixels] >= 0
        behind[hit, :3] = surface.color.reshape(-1, 3)[pixels[hit]]
        behind[hit, 3] = 1.0
    return behind


def available_cores() -> int:
    """Return how many cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _sum_in_threads(
    work: Callable[[Indices], int], items: Sequence[Indices], workers: int, progress: Progress | None
) -> int:
    """Return the sum of `work` over `items`; an exception, Ctrl-C included, drops what has not begun."""
    total = 0
    with ThreadPoolExecutor(workers) as pool:
        futures = [pool.submit(work, item) for item in items]
        try:
            for done, future in enumerate(as_completed(futures), start=1):
                total += future.result()
                if progress is not None:
                    progress(done, len(items))
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    return total
