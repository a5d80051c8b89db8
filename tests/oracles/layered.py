"""All hits of a ray with all triangles, one at a time, and what they make of a homogeneous box.

Moller and Trumbore 1997 and the slab test, as scalar loops over float64; share no code with volref.
"""

import math

import numpy as np


def all_hits(origin, direction, triangles):
    """Return (distance, triangle) of every triangle (T, 3, 3) that a ray meets at a distance >= 0, sorted."""
    hits = []
    a, e, f = triangles[:, 0], triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    across = np.cross(direction, f)
    det = (e * across).sum(axis=1)
    from_a = origin - a
    u = (from_a * across).sum(axis=1)
    up = np.cross(from_a, e)
    v, t = up @ direction, (f * up).sum(axis=1)
    with np.errstate(all="ignore"):
        u, v, t = u / det, v / det, t / det
    hits = [
        (float(t[k]), k)
        for k in np.flatnonzero((det != 0) & (u >= 0) & (v >= 0) & (u + v <= 1) & (t >= 0)).tolist()
    ]
    return sorted(hits)


def faceted_truth(ray, triangles, look, box, medium, background):
    """Return the pixel (4,) of a ray through transparent triangles in a homogeneous box.

    `look[k]` is (colour, opacity) of triangle k, `box` the two corners, `medium` (colour, extinction).
    Front to back: segments of the box between hits are c (1 - exp(-sigma L)), layers opacity x colour.
    """
    origin, direction = ray
    near, far = slab(origin, direction, *box)
    shine, passed, last = np.zeros(3), 1.0, 0.0
    for distance, k in [*all_hits(origin, direction, triangles), (math.inf, None)]:
        length = max(min(distance, far) - max(last, near), 0.0)
        opacity = -math.expm1(-medium[1] * length)
        shine, passed = shine + passed * opacity * np.array(medium[0]), passed * (1 - opacity)
        if k is not None:
            color, opacity = look[k]
            shine, passed = shine + passed * opacity * np.array(color), passed * (1 - opacity)
        last = distance
    background = np.array(background)
    return np.append(shine + passed * background[:3], 1 - passed + passed * background[3])


def slab(origin, direction, low, high):
    """Return where a ray is in the box, t >= 0; empty if the first number is not below the second."""
    near, far = 0.0, math.inf
    for o, d, a, b in zip(origin, direction, low, high, strict=True):
        if d == 0:
            if not a <= o <= b:
                return math.inf, 0.0
            continue
        t = sorted(((a - o) / d, (b - o) / d))
        near, far = max(near, t[0]), min(far, t[1])
    return near, far
