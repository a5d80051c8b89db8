"""What most scientists write: all rays step by step, `map_coordinates`, `interp`, float64 throughout.

Midpoint rule, opacities 1 - exp(-sigma h), the last step cut at the far side of the box; rays end at a
transmittance of 1e-4.
"""

import numpy as np

from tests.benchmarks.peers.problems import Problem
from tests.benchmarks.peers.renderers import Draw
from volref.arrays import Floats

OPAQUE = 1e-4


def prepare(problem: Problem) -> tuple[Draw, str]:
    """Return what draws a frame at a step in voxels."""
    entering, leaving = problem.spans
    hit = np.flatnonzero(leaving > entering)
    near, far = entering[hit], leaving[hit]
    eye, directions = problem.index_eye[::-1, None], problem.index_directions[hit].T[::-1].copy()

    def draw(step: float) -> Floats:
        image = np.zeros((problem.height * problem.width, 4))
        image[hit] = march(problem, eye, directions, near, far, step * problem.voxel)
        return image.reshape(problem.height, problem.width, 4)

    return draw, ""


def march(
    problem: Problem, eye: Floats, directions: Floats, near: Floats, far: Floats, length: float
) -> Floats:
    """Return pixels (R, 4); eye (3, 1) and directions (3, R) are in index space, z first."""
    from scipy.ndimage import map_coordinates

    rgb, clear = np.zeros((3, len(near))), np.ones(len(near))
    for segment in range(int(np.ceil((far - near).max(initial=0.0) / length))):
        start = near + segment * length
        live = np.flatnonzero((start < far) & (clear > OPAQUE))
        if len(live) == 0:
            break
        h = np.minimum(length, far[live] - start[live])
        where = eye + directions[:, live] * (start[live] + h / 2)
        values = map_coordinates(problem.values, where, order=1, mode="nearest")
        opacity = -np.expm1(-problem.extinction(values) * h)
        rgb[:, live] += clear[live] * opacity * problem.color(values)
        clear[live] *= 1 - opacity
    return np.vstack([rgb, 1 - clear]).T
