"""Seed 003 and its base for one pixel, in plain Python: the paper's equations, one sample at a time.

Numbers on which the count of samples hangs are numpy.float32, in the order of the shader; colours are Python
floats.  It shares no code with volref: its own basis, slab test, fetches and sums.
"""

import math

import numpy as np

from tests.oracles.scalar import cross, normalized, trilinear

f32 = np.float32


def ray(volume, look, x, y, width, height, *, aspect=True):
    """Eye and direction in texture space, float32: eq. 1 and 2 of the paper, for an axis-aligned volume.

    `look` is (eye, target, up, vertical field of view in degrees).
    """
    eye, target, up, fov_y = look
    forward = normalized([t - e for t, e in zip(target, eye, strict=True)])
    right = normalized(cross(forward, up))
    above = cross(right, forward)
    sides = [n * s for n, s in zip(volume.size, volume.spacing, strict=True)]
    low = [o - s / 2 for o, s in zip(volume.origin, volume.spacing, strict=True)]
    focal = f32(1 / math.tan(math.radians(fov_y) / 2))
    across = f32(2) * f32(x + 0.5) / f32(width) - f32(1)
    upward = f32(2) * f32(height - y - 0.5) / f32(height) - f32(1)
    if aspect:
        across = across * f32(width / height)
    origin = [f32((e - a) / s) for e, a, s in zip(eye, low, sides, strict=True)]
    direction = []
    for k, side in enumerate(sides):
        columns = f32(right[k] / side), f32(above[k] / side), f32(-forward[k] / side)
        direction.append(columns[0] * across + columns[1] * upward + columns[2] * -focal)
    return origin, direction


def span(origin, direction):
    """Where the ray enters and leaves 0..1, at t >= 0; None if it does not."""
    begin, end = f32(0), f32(np.inf)
    for o, d in zip(origin, direction, strict=True):
        inverse = f32(1) / d
        first, second = inverse * (f32(0) - o), inverse * (f32(1) - o)
        begin, end = max(begin, min(first, second)), min(end, max(first, second))
    return (begin, end) if begin < end else None


def places(origin, direction, step, jitter=0.0):
    """Positions of the samples that a ray takes if it never gets opaque."""
    found = span(origin, direction)
    if found is None:
        return []
    start, stop = ([o + d * t for o, d in zip(origin, direction, strict=True)] for t in found)
    way = [b - a for a, b in zip(start, stop, strict=True)]
    left = np.sqrt(way[0] * way[0] + way[1] * way[1] + way[2] * way[2])
    step = f32(step)
    delta = [step * w / left for w in way]
    at = [a + d * f32(jitter) for a, d in zip(start, delta, strict=True)]
    taken = []
    while left > 0:
        taken.append([float(a) for a in at])
        left = left - step
        at = [a + d for a, d in zip(at, delta, strict=True)]
    return taken


def fetched(codes, at):
    """Value 0..1 of bytes codes[z][y][x] at a place in texture space: linear, clamped to the edge."""
    nz, ny, nx = np.shape(codes)
    return trilinear(codes, [p * n - 0.5 for p, n in zip(at, (nx, ny, nz), strict=True)]) / 255


def entry(table, value, *, centered=False):
    """Straight RGBA of a value in a linear texture of n rows: looked up at v, or from first to last row."""
    n = len(table)
    at = (value * (n - 1) + 0.5) / n if centered else value
    place = min(max(at * n - 0.5, 0.0), n - 1.0)
    low = min(int(place), n - 2)
    return [a + (b - a) * (place - low) for a, b in zip(table[low], table[low + 1], strict=True)]


def over(samples, opaque_at=0.95):
    """Seed 003: premultiplied colour, alpha, and the count of samples, until alpha is above `opaque_at`."""
    color, alpha, count = [0.0, 0.0, 0.0], 0.0, 0
    for *rgb, a in samples:
        color = [c + (1 - alpha) * a * x for c, x in zip(color, rgb, strict=True)]
        alpha, count = alpha + (1 - alpha) * a, count + 1
        if alpha > opaque_at:
            break
    return color, alpha, count


def deepest_in_front(samples):
    """The base: each sample over those before it, whose colour is taken for straight."""
    color, alpha, count = [0.0, 0.0, 0.0], 0.0, 0
    for *rgb, a in samples:
        color = [a * x + (1 - a) * alpha * c for c, x in zip(color, rgb, strict=True)]
        alpha, count = a + (1 - a) * alpha, count + 1
        if alpha >= 1:
            break
    return color, alpha, count


def working(color, alpha, background):
    """Tone map, the background's light behind it, gamma."""
    light = [c / (1 + c) + (1 - alpha) * b**2.2 for c, b in zip(color, background, strict=True)]
    return [*(x ** (1 / 2.2) for x in light), 1.0]


def printed(color, alpha):
    """Tone map and gamma, to the letter."""
    return [*((c / (1 + c)) ** (1 / 2.2) for c in color), alpha]


def base(color, alpha, background):
    """Colour times alpha, the background's light behind it, gamma."""
    light = [alpha * c + (1 - alpha) * b**2.2 for c, b in zip(color, background, strict=True)]
    return [*(x ** (1 / 2.2) for x in light), 1.0]
