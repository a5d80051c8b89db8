"""`render`: a scene in, an image with its error and its cost out."""

import os
import queue
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed

import numpy as np

from volref import planning
from volref.arrays import Floats, Indices, whole_number
from volref.errors import SceneError
from volref.planning import HALF_LEVEL, RAYS_PER_CHUNK, Plan
from volref.records import Surface
from volref.scene.scene import Scene
from volref.truth.march import field_of, march_chunk
from volref.truth.result import Render
from volref.truth.surfaces import visible_surface
from volref.workspace import Workspace

# Called now and then with (chunks done, chunks in all).
Progress = Callable[[int, int], None]


def render(
    scene: Scene,
    *,
    method: str = "march",
    tolerance: float = HALF_LEVEL,
    step: float | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
    plan: Plan | None = None,
) -> Render:
    """Return the image of `scene` with an estimate of its error per pixel.

    Parameters
    ----------
    scene
        What to draw.
    method
        "march": the midpoint rule in float64 with exponential opacities at a uniform step.
    tolerance
        The error in the working space that `met_tolerance` compares the bound with.
    step
        Length of a segment in world units; default half the least spacing of the volume.
    threads
        Threads to march with; default every core this process may use.  The image does not depend on it.
    progress
        Called with (chunks done, chunks in all).
    plan
        A plan from `volref.plan` to follow instead of making one from `method`, `step` and `tolerance`.

    Raises
    ------
    SceneError
        If an argument breaks a rule of `volref.plan`, or the plan is another scene's.
    """
    started = time.perf_counter()
    decided = decide(scene, plan, method, step, tolerance)
    workers = available_cores() if threads is None else whole_number("threads", threads, low=1, high=1024)
    surface = visible_surface(scene) if decided.includes("meshes") else None
    field = field_of(scene) if decided.includes("volume") else None
    pixels = scene.width * scene.height
    rgba, bound = np.empty((pixels, 4)), np.empty(pixels)
    distance = np.full(pixels, np.inf) if surface is None else surface.distance.reshape(-1)
    spare: queue.SimpleQueue[Workspace] = queue.SimpleQueue()
    for _ in range(workers):
        spare.put(Workspace())

    def march(first: int) -> int:
        part = np.arange(first, min(first + RAYS_PER_CHUNK, pixels))
        behind = light_behind(scene, surface, part)
        work = spare.get()
        try:
            chunk = march_chunk(scene, decided, field, part, distance[part], behind, work)
        finally:
            spare.put(work)  # a thread that waited for it would wait for ever
        rgba[part], bound[part] = chunk.rgba, chunk.bound
        return chunk.samples

    samples = _sum_in_threads(march, range(0, pixels, RAYS_PER_CHUNK), workers, progress)
    shape = scene.height, scene.width
    return Render(
        rgba.reshape(*shape, 4),
        distance.reshape(shape),
        bound.reshape(shape),
        "estimate",
        time.perf_counter() - started,
        samples,
        workers,
        decided,
    )


def decide(
    scene: Scene,
    plan: Plan | None,
    method: str = "march",
    step: float | None = None,
    tolerance: float = HALF_LEVEL,
) -> Plan:
    """Return the plan to follow: the given one, checked, or one made from the other arguments.

    Raises
    ------
    SceneError
        If both are given, or the plan is another scene's.
    """
    if plan is None:
        return planning.plan(scene, method=method, step=step, tolerance=tolerance)
    if not isinstance(plan, Plan):
        message = f"plan must be a volref.Plan, got {type(plan).__name__}; make one with volref.plan(scene)"
        raise SceneError(message)
    if method != plan.method or step is not None or tolerance not in (HALF_LEVEL, plan.tolerance):
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
    work: Callable[[int], int], items: Sequence[int], workers: int, progress: Progress | None
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
