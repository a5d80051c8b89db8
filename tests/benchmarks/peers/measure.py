"""Times one renderer on one problem over its ladder, against the truth: the work of one process.

    python -m tests.benchmarks.peers.measure JOB.json     prints the run as one line of JSON

P judged pixels.
"""

import json
import os
import statistics
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tests.benchmarks.peers.problems import Problem, problem_of
from tests.benchmarks.peers.renderers import RENDERERS, Renderer
from volref.arrays import Floats

# A frame that takes longer is timed once, without one before it that warms up.
SLOW, FRAMES = 1.0, 3

# A rung is expected to cost at most so many times what the one before it did.
MOST_GROWTH = 3.0

# A rung that is less than this times more exact than the best before it is on a floor: the ladder ends there,
# if it is slow.
FALLING = 1.5


def measure(renderer: Renderer, problem: Problem, truth: Floats, max_seconds: float) -> dict[str, Any]:
    """Return the run as plain data: a point for each rung of the ladder; `truth` is (P, 4)."""
    started = time.process_time()
    draw, remark = renderer.prepare(problem)
    preparation = time.process_time() - started
    points: list[dict[str, Any]] = []
    for setting in renderer.ladder:
        if too_dear(points, max_seconds * renderer.patience):
            break
        seconds, frames, image = cpu_seconds(lambda setting=setting: draw(setting))
        points.append(
            {"setting": setting, "seconds": seconds, "frames": frames} | errors_of(problem, image, truth)
        )
    return {
        "problem": problem.name,
        "renderer": renderer.name,
        "remark": remark,
        "preparation": preparation,
        "points": points,
        "stopped": len(points) < len(renderer.ladder),
    }


def too_dear(points: Sequence[dict[str, Any]], max_seconds: float) -> bool:
    """Tell whether the next rung after `points` would take too long, or take long for nothing."""
    if expected_seconds([point["seconds"] for point in points]) > max_seconds:
        return True
    return len(points) > 1 and points[-1]["seconds"] > SLOW and not is_falling(points)


def is_falling(points: Sequence[dict[str, Any]]) -> bool:
    """Tell whether the last rung is clearly more exact than all before it.

    Examples
    --------
    >>> [is_falling([{"rms": 1e-3}, {"rms": rms}]) for rms in (1e-4, 9e-4)], is_falling([{"rms": 1.0}])
    ([True, False], True)
    """
    before = [float(point["rms"]) for point in points[:-1]]
    return not before or points[-1]["rms"] * FALLING < min(before)


def expected_seconds(seconds: Sequence[float]) -> float:
    """Return what the next rung is expected to take after those that took `seconds`.

    Examples
    --------
    >>> expected_seconds([]), expected_seconds([1.0]), expected_seconds([1.0, 2.0])
    (0.0, 1.0, 4.0)
    """
    if len(seconds) < 2:
        return sum(seconds, 0.0)
    return seconds[-1] * min(max(seconds[-1] / seconds[-2], 1.0), MOST_GROWTH)


def cpu_seconds(frame: Callable[[], Floats]) -> tuple[float, int, Floats]:
    """Return the median CPU seconds of a few frames, how many they are, and the image."""
    times: list[float] = []
    while True:
        started = time.process_time()
        image = frame()
        times.append(time.process_time() - started)
        if times[0] > SLOW:
            return times[0], 1, image
        if len(times) > FRAMES:
            return statistics.median(times[1:]), FRAMES, image


def errors_of(problem: Problem, image: Floats, truth: Floats) -> dict[str, float]:
    """Return the error of the judged pixels: of premultiplied colours, and of opacities.

    Raises
    ------
    ValueError
        If the image has not the shape of the problem, or holds what is no number.
    """
    wanted = (problem.height, problem.width, 4)
    if image.shape != wanted or not np.isfinite(image).all():
        message = f"image must be finite and {wanted}, got {image.shape}; mend the renderer"
        raise ValueError(message)
    difference = np.asarray(image, np.float64).reshape(-1, 4)[problem.judged] - truth
    color, opacity = difference[:, :3], difference[:, 3]
    return {
        "rms": float(np.sqrt((color**2).mean())),
        "largest": float(np.abs(color).max()),
        "rms_opacity": float(np.sqrt((opacity**2).mean())),
        "largest_opacity": float(np.abs(opacity).max()),
    }


def main() -> None:
    """Do the job that a file states, on one core."""
    job = json.loads(Path(sys.argv[1]).read_text(encoding="utf-8"))
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {job["core"]})
    problem = problem_of(job["problem"], job["side"])
    run = measure(RENDERERS[job["renderer"]], problem, np.load(job["truth"]), job["max_seconds"])
    print(json.dumps(run))


if __name__ == "__main__":
    main()
