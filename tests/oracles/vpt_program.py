"""VPT's emission-absorption renderer for one pixel, in plain Python, one sample at a time.

Numbers on which the count of samples and the rounding of bytes hang are numpy.float32, in the order of the
shader; colours are Python floats.  It shares no code with volref.
"""

import math

import numpy as np

from tests.oracles.scalar import cross, normalized, trilinear

f32 = np.float32


def near_and_far(volume, look, x, y, width, height):
    """Ends of a pixel's ray on the near and the far plane, in texture space, for an axis-aligned volume.

    `look` is (eye, target, up, vertical field of view in degrees, near, far).
    """
    eye, target, up, fov_y, near, far = look
    forward = normalized([t - e for t, e in zip(target, eye, strict=True)])
    right = normalized(cross(forward, up))
    above = cross(right, forward)
    half = math.tan(math.radians(fov_y) / 2)
    across = (2 * (x + 0.5) / width - 1) * half * width / height
    upward = (1 - 2 * (y + 0.5) / height) * half
    ray = [f + across * r + upward * u for f, r, u in zip(forward, right, above, strict=True)]
    ends = []
    for depth in (near, far):
        world = [e + depth * d for e, d in zip(eye, ray, strict=True)]
        texture = [
            (w - o) / (n * s) + 0.5 / n
            for w, o, n, s in zip(world, volume.origin, volume.size, volume.spacing, strict=True)
        ]
        ends.append([float(f32(place)) for place in texture])
    return ends


def cut(near, far):
    """Entry and exit of the unit cube, not before `near`; None if there is nothing between."""
    begin, end = -math.inf, math.inf
    for a, b in zip(near, far, strict=True):
        first, second = sorted([(0 - a) / (b - a), (1 - a) / (b - a)])
        begin, end = max(begin, first), min(end, second)
    begin, end = max(begin, 0.0), max(end, 0.0)
    if begin >= end:
        return None
    return [[a + (b - a) * t for a, b in zip(near, far, strict=True)] for t in (begin, end)]


def parameters(steps, offset=0.0):
    """Each t of a ray that never gets opaque, as float32 sums them."""
    step = f32(1 / steps)
    t, taken = step * f32(offset), []
    while t < 1:
        taken.append(float(t))
        t = t + step
    return taken


def fetched(codes, at):
    """Value 0..1 of bytes codes[z][y][x] at a place in texture space: linear, clamped to the edge."""
    nz, ny, nx = np.shape(codes)
    return trilinear(codes, [p * n - 0.5 for p, n in zip(at, (nx, ny, nz), strict=True)]) / 255


def decoded(code):
    """Light of an sRGB code 0..1."""
    return code / 12.92 if code <= 0.04045 else ((code + 0.055) / 1.055) ** 2.4


def entry(table, value):
    """Light and alpha of a value in a table of bytes that is decoded, then filtered."""
    n = len(table)
    place = min(max(value * n - 0.5, 0.0), n - 1.0)
    low = min(int(place), n - 2)
    rows = [[*(decoded(c / 255) for c in row[:3]), row[3] / 255] for row in table[low : low + 2].tolist()]
    return [a + (b - a) * (place - low) for a, b in zip(*rows, strict=True)]


def frame(codes, table, near, far, *, steps, extinction, offset=0.0):
    """Colour of a pixel of a frame, and how many samples it took; None where the ray misses."""
    found = cut(near, far)
    if found is None:
        return None
    begin, end = found
    length = math.dist(begin, end) / steps
    color, alpha, count = [0.0, 0.0, 0.0], 0.0, 0
    for t in parameters(steps, offset):
        if alpha >= 0.99:
            break
        at = [a + (b - a) * t for a, b in zip(begin, end, strict=True)]
        *light, opacity = entry(table, fetched(codes, at))
        opacity *= length * extinction
        color = [c + (1 - alpha) * opacity * x for c, x in zip(color, light, strict=True)]
        alpha, count = alpha + (1 - alpha) * opacity, count + 1
    if alpha > 1:
        color = [c / alpha for c in color]
    return color, count


def running_mean(frames):
    """Byte of a channel after frames of these bytes, stored after each of them."""
    mean = 0
    for number, byte in enumerate(frames, start=1):
        before, now = (f32(code) * f32(1 / 255) for code in (mean, byte))
        mixed = before + (now - before) * f32(1 / number)
        mean = int(np.rint(mixed * f32(255)))
    return mean


def artistic(color, low=0.0, mid=0.5, high=1.0, saturation=1.0, gamma=2.2):
    """Tone map of a colour: the grey part is its projection on (1, 1, 1)."""
    unit = [(c - low) / (high - low) for c in color]
    gray = sum(c / math.sqrt(3) for c in unit) / math.sqrt(3)
    mixed = [gray + (c - gray) * saturation for c in unit]
    exponent = -math.log((mid - low) / (high - low)) / math.log(2)
    return [max(c, 0.0) ** (exponent / gamma) for c in mixed]
