"""The certified truth of the pixels that are judged."""

from typing import NamedTuple

import numpy as np

import volref as vr
from tests.benchmarks.peers.problems import MESH_COLOR, Problem
from volref.arrays import Floats
from volref.truth.exact import integrate_pixels, prepare
from volref.truth.meshes.surfaces import visible_surface

# What the truth may be off by at most, but for rounding.
TOLERANCE = 1e-11


class Truth(NamedTuple):
    """Premultiplied pixels (P, 4), and the proven bound (P,) on their error."""

    rgba: Floats
    bound: Floats


def truth_of(problem: Problem) -> Truth:
    """Return the truth of `problem.judged`."""
    scene, pixels = problem.scene, problem.judged
    surface = visible_surface(scene) if scene.meshes else None
    distance = np.full(len(pixels), np.inf) if surface is None else surface.distance.reshape(-1)[pixels]
    behind = np.where(np.isfinite(distance)[:, None], (*MESH_COLOR, 1.0), 0.0)
    prepared = prepare(scene, vr.plan(scene, method="exact", tolerance=TOLERANCE))
    found = integrate_pixels(scene, prepared, pixels, 0.0, distance, behind, TOLERANCE)
    return Truth(found.rgba, found.bound)
