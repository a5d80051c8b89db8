"""Triangles at pixel centres, one at a time and in exact fractions: the judge of `volref.stages.raster`.

It knows half planes and determinants only: no spans, no clipping, no planes of attributes.
"""

from fractions import Fraction

import numpy as np


def snapped(corner, width, height, bits):
    """Window position on the grid, in whole steps: float32 as SwiftShader computes it, half to even."""
    x, y, _, w = (np.float32(part) for part in corner)
    steps, inverse = np.float32(2.0**bits), np.float32(1) / w
    place = []
    for along, size in ((x, width), (y, height)):
        half = np.float32(size / 2) * steps
        place.append(round(float(along * inverse * half + (half - steps / 2))) + 2**bits // 2)
    return place


def covers(triangle, point):
    """Whether a counter-clockwise triangle has a point, with the rule for points on its edges."""
    for (ax, ay), (bx, by) in zip(triangle, [*triangle[1:], triangle[0]], strict=True):
        side = (bx - ax) * (point[1] - ay) - (by - ay) * (point[0] - ax)
        left_or_below = by < ay or (by == ay and bx > ax)
        if side < 0 or (side == 0 and not left_or_below):
            return False
    return True


def fragments(corners, varyings, width, height, bits):
    """List (pixel, window_z, 1 / w, varyings, front) of a triangle within the viewport, in fractions."""
    places = [snapped(corner, width, height, bits) for corner in corners]
    (ax, ay), (bx, by), (cx, cy) = places
    area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    found = []
    for row in range(height):
        for column in range(width):
            point = (Fraction(2 * column + 1, 2) * 2**bits, (height - Fraction(2 * row + 1, 2)) * 2**bits)
            if area and covers(places if area > 0 else places[::-1], point):
                found.append(
                    (row * width + column, *attributes(places, area, point, corners, varyings), area > 0)
                )
    return found


def attributes(places, area, point, corners, varyings):
    """Depth, 1 / w and varyings: areas are weights on the screen, weights over w are weights in space."""
    weights = []
    for i in range(3):
        (bx, by), (cx, cy) = places[(i + 1) % 3], places[(i + 2) % 3]
        weights.append(((bx - point[0]) * (cy - point[1]) - (by - point[1]) * (cx - point[0])) / area)
    w = [Fraction(float(corner[3])) for corner in corners]
    z = [Fraction(float(corner[2])) for corner in corners]
    window_z = sum(b * (z_i / w_i + 1) / 2 for b, z_i, w_i in zip(weights, z, w, strict=True))
    inverse = sum(b / w_i for b, w_i in zip(weights, w, strict=True))
    values = [
        sum(b / w_i * Fraction(float(v[k])) for b, w_i, v in zip(weights, w, varyings, strict=True)) / inverse
        for k in range(len(varyings[0]))
    ]
    return window_z, inverse, values


def visible(corners, width, height, pixel):
    """Weights over w at a pixel centre of a triangle that may reach behind the eye, and its margin.

    A point of the triangle is sum c_i V_i with c_i >= 0; where its x / w and y / w are the pixel's, c_i / w
    solve three equations.  The margin is the least of what must be positive: these weights and the distances
    from the near and the far plane.
    """
    x = 2 * (pixel % width + 0.5) / width - 1
    y = 1 - 2 * (pixel // width + 0.5) / height
    weights = np.linalg.solve(corners[:, [0, 1, 3]].T, [x, y, 1.0])
    z = weights @ corners[:, 2]
    return weights, min(*weights, 1 + z, 1 - z)
