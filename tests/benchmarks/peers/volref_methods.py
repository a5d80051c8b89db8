"""volref's own ways: a march at a step, an estimate or a certificate to a tolerance, on one thread.

Each returns what draws a frame at a setting, and a remark.  A frame of a few pixels comes first, so that what
volref keeps of a volume is there, as the other renderers' uploads are.
"""

from collections.abc import Callable
from typing import Any

import volref as vr
from tests.benchmarks.peers.problems import Problem
from tests.benchmarks.peers.renderers import Draw

FIRST_WIDTH = 16


def march(problem: Problem) -> tuple[Draw, str]:
    """March in float64; the setting is the step in voxels."""
    return _marching(problem, "float64")


def march_in_float32(problem: Problem) -> tuple[Draw, str]:
    """March in float32; the setting is the step in voxels."""
    return _marching(problem, "float32")


def _marching(problem: Problem, precision: str) -> tuple[Draw, str]:
    def planned(scene: vr.Scene, step: float) -> dict[str, Any]:
        plan = vr.plan(scene, method="march", step=step * problem.voxel, precision=precision)
        return {"plan": plan}

    return _ready(problem, planned, 4.0)


def estimated(problem: Problem) -> tuple[Draw, str]:
    """Draw by the cheapest method whose estimated error meets the tolerance, which is the setting."""
    return _ready(problem, lambda _, asked: {"method": "auto", "certified": False, "tolerance": asked}, 1e-2)


def certified(problem: Problem) -> tuple[Draw, str]:
    """Draw with a certified error; the setting is its tolerance."""
    return _ready(problem, lambda _, asked: {"method": "exact", "tolerance": asked}, 1e-2)


def _ready(
    problem: Problem, options: Callable[[vr.Scene, float], dict[str, Any]], coarse: float
) -> tuple[Draw, str]:
    """Return what draws a frame by `render`; its options come from a scene and a setting, in its time."""
    scene = problem.scene
    height = FIRST_WIDTH * problem.height // problem.width
    few = vr.Scene(scene.volume, scene.transfer, scene.camera, FIRST_WIDTH, height, meshes=scene.meshes)
    vr.render(few, threads=1, **options(few, coarse))
    return lambda setting: vr.render(scene, threads=1, **options(scene, setting)).rgba, ""
