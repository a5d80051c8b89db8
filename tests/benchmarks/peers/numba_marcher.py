"""A marcher compiled by Numba: one loop over rays, float64 arithmetic, a table with linear interpolation."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from tests.benchmarks.peers.problems import Problem
from tests.benchmarks.peers.renderers import Draw
from volref.arrays import Floats

OPAQUE = 1e-4


def prepare(problem: Problem) -> tuple[Draw, str]:
    """Return what draws a frame at a step in voxels, compiled."""
    import numba

    return drawing(problem, numba.njit(fastmath=True)(march))


def drawing(problem: Problem, kernel: Callable[..., Any]) -> tuple[Draw, str]:
    """Return what draws a frame by `kernel`, which is `march` or what a compiler made of it."""
    near, far = problem.spans
    table = problem.table(problem.entries)
    table = np.vstack([table, table[-1:]])
    low, scale = float(problem.knots[0]), (problem.entries - 1) / float(np.ptp(problem.knots))
    eye, directions = problem.index_eye, problem.index_directions

    def pixels(rays: slice, step: float) -> Floats:
        image = np.zeros((len(near[rays]), 4))
        length = step * problem.voxel
        kernel(problem.values, table, low, scale, eye, directions[rays], near[rays], far[rays], length, image)
        return image

    pixels(slice(0, 1), 4.0)
    return lambda step: pixels(slice(None), step).reshape(problem.height, problem.width, 4), ""


def march(
    values: Any,
    table: Any,
    low: float,
    scale: float,
    eye: Any,
    directions: Any,
    near: Any,
    far: Any,
    length: float,
    image: Any,
) -> None:
    """Fill `image` (R, 4); values are (nz, ny, nx), eye and directions in index space, x first."""
    top = (values.shape[2] - 1.0000001, values.shape[1] - 1.0000001, values.shape[0] - 1.0000001)
    last = table.shape[0] - 2
    for ray in range(directions.shape[0]):
        t, end = near[ray], far[ray]
        clear = 1.0
        red = green = blue = 0.0
        while t < end and clear > OPAQUE:
            h = min(length, end - t)
            middle = t + 0.5 * h
            x = min(max(eye[0] + directions[ray, 0] * middle, 0.0), top[0])
            y = min(max(eye[1] + directions[ray, 1] * middle, 0.0), top[1])
            z = min(max(eye[2] + directions[ray, 2] * middle, 0.0), top[2])
            i, j, k = int(x), int(y), int(z)
            u, v, w = x - i, y - j, z - k
            a = values[k, j, i] * (1 - u) + values[k, j, i + 1] * u
            b = values[k, j + 1, i] * (1 - u) + values[k, j + 1, i + 1] * u
            c = values[k + 1, j, i] * (1 - u) + values[k + 1, j, i + 1] * u
            d = values[k + 1, j + 1, i] * (1 - u) + values[k + 1, j + 1, i + 1] * u
            value = (a * (1 - v) + b * v) * (1 - w) + (c * (1 - v) + d * v) * w
            place = min(max((value - low) * scale, 0.0), last)
            e = int(place)
            f = place - e
            opacity = 1 - math.exp(-(table[e, 3] + f * (table[e + 1, 3] - table[e, 3])) * h)
            weight = clear * opacity
            red += weight * (table[e, 0] + f * (table[e + 1, 0] - table[e, 0]))
            green += weight * (table[e, 1] + f * (table[e + 1, 1] - table[e, 1]))
            blue += weight * (table[e, 2] + f * (table[e + 1, 2] - table[e, 2]))
            clear *= 1 - opacity
            t += length
        image[ray, 0], image[ray, 1], image[ray, 2], image[ray, 3] = red, green, blue, 1 - clear
