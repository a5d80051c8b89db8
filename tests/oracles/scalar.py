"""The marcher again, one ray and one sample at a time, in plain Python floats: the judge of the array form.

It shares no code with volref: its own basis, slab test, clamping and table walk, written from the
definitions in the scene records' docstrings.
"""

import math


def normalized(v):
    length = math.sqrt(sum(x * x for x in v))
    return [x / length for x in v]


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def look_at_ray(eye, target, up, fov_y, width, height, x, y):
    """Origin and unit direction through the centre of pixel (x, y)."""
    forward = normalized([t - e for t, e in zip(target, eye, strict=True)])
    right = normalized(cross(forward, up))
    above = cross(right, forward)
    half = math.tan(math.radians(fov_y) / 2)
    across = (2 * (x + 0.5) / width - 1) * half * width / height
    upward = (1 - 2 * (y + 0.5) / height) * half
    direction = [f + across * r + upward * u for f, r, u in zip(forward, right, above, strict=True)]
    return list(eye), normalized(direction)


def box_span(origin, direction, low, high):
    """Enter and leave the box, at t >= 0; None when there is nothing between."""
    t_near, t_far = 0.0, math.inf
    for o, d, a, b in zip(origin, direction, low, high, strict=True):
        if d == 0:
            if not a <= o <= b:
                return None
            continue
        enter, leave = sorted([(a - o) / d, (b - o) / d])
        t_near, t_far = max(t_near, enter), min(t_far, leave)
    return (t_near, t_far) if t_near < t_far else None


def trilinear(values, index):
    """Value at the index point (x, y, z) of a nested list or array values[z][y][x], clamped to its border."""
    sizes = [len(values[0][0]), len(values[0]), len(values)]
    total = 0.0
    lower = [math.floor(i) for i in index]
    for corner in range(8):
        weight, place = 1.0, []
        for axis in range(3):
            bit = corner >> axis & 1
            fraction = index[axis] - lower[axis]
            weight *= fraction if bit else 1 - fraction
            place.append(min(max(lower[axis] + bit, 0), sizes[axis] - 1))
        total += weight * float(values[place[2]][place[1]][place[0]])
    return total


def table_value(positions, column, value):
    """Piecewise linear in value, constant beyond the ends; at a jump the later knot."""
    if value < positions[0]:
        return column[0]
    if value >= positions[-1]:
        return column[-1]
    k = max(i for i in range(len(positions)) if positions[i] <= value)
    part = (value - positions[k]) / (positions[k + 1] - positions[k])
    return column[k] + part * (column[k + 1] - column[k])


def march_ray(volume, transfer, origin, direction, step, surface=None, background=(0, 0, 0, 0), place=0.5):
    """Premultiplied RGBA of one world ray by the midpoint rule, for an axis-aligned volume.

    `surface` is (distance, (r, g, b)) of an opaque surface; `place` is where in its segment a sample lies.
    """
    low, high = ([float(x) for x in bound] for bound in volume.index_bounds)
    scale = [1 / s for s in volume.spacing]
    start = [(o - c) * s for o, c, s in zip(origin, volume.origin, scale, strict=True)]
    slope = [d * s for d, s in zip(direction, scale, strict=True)]
    span = box_span(start, slope, low, high)
    behind = [*surface[1], 1.0] if surface else list(background)
    transmittance, color = 1.0, [0.0, 0.0, 0.0]
    if span and surface:
        span = (span[0], min(span[1], surface[0]))
    length = max(span[1] - span[0], 0.0) if span else 0.0
    count = 3 * math.ceil(length / (3 * step) * (1 - 1e-12))
    for k in range(count):
        t = span[0] + (k + place) * length / count
        value = trilinear(volume.values, [a + t * b for a, b in zip(start, slope, strict=True)])
        opacity = segment_opacity(transfer, value, length / count)
        for channel in range(3):
            shade = table_value(list(transfer.values), list(transfer.colors[:, channel]), value)
            color[channel] += transmittance * opacity * shade
        transmittance *= 1 - opacity
    rgb = [c + transmittance * b for c, b in zip(color, behind, strict=False)]
    return [*rgb, 1 - transmittance + transmittance * behind[3]]


def segment_opacity(transfer, value, length):
    positions = list(transfer.values)
    if transfer.extinction is not None:
        return -math.expm1(-table_value(positions, list(transfer.extinction), value) * length)
    opacity = table_value(positions, list(transfer.opacity), value)
    if opacity == 1:
        return 1.0
    return -math.expm1(math.log1p(-opacity) * length / transfer.unit_distance)
