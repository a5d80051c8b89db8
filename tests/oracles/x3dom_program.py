"""x3dom's VolumeData for one pixel, in plain Python, one sample at a time.

Positions, on which the count of samples hangs, are numpy.float32 in the order of the shader; colours are
Python floats.  It shares no code with volref: its own box, atlas, fetches and blending.
"""

import math

import numpy as np

from tests.oracles.scalar import box_span, look_at_ray

f32 = np.float32


def place_and_eye(volume, look, x, y, width, height):
    """Where a pixel's ray meets the face that is drawn, and the eye, in texture space; None if it meets none.

    `look` is (eye, target, up, vertical field of view in degrees).  From outside the front face is drawn,
    from inside the back face.
    """
    eye, direction = look_at_ray(*look, width, height, x, y)
    sides = [n * s for n, s in zip(volume.size, volume.spacing, strict=True)]
    low = [o - s / 2 for o, s in zip(volume.origin, volume.spacing, strict=True)]
    span = box_span(eye, direction, low, [a + s for a, s in zip(low, sides, strict=True)])
    if span is None:
        return None
    t = span[1] if span[0] == 0 else span[0]
    place = [(e + t * d - a) / s for e, d, a, s in zip(eye, direction, low, sides, strict=True)]
    # A face's varying has its constant coordinate exactly.
    place = [round(p) if abs(p - round(p)) < 1e-9 else p for p in place]
    return [f32(p) for p in place], [f32((e - a) / s) for e, a, s in zip(eye, low, sides, strict=True)]


def positions(place, eye, *, steps=85, length=1.4142 / 85):
    """Positions of the samples that a ray takes if it never gets opaque."""
    away = [p - e for p, e in zip(place, eye, strict=True)]
    size = np.sqrt(away[0] * away[0] + away[1] * away[1] + away[2] * away[2])
    step = [a / size * f32(length) for a in away]
    at = eye if all(0 < e < 1 for e in eye) else place
    taken = []
    for _ in range(steps):
        taken.append(at)
        at = [a + s for a, s in zip(at, step, strict=True)]
        if any(a < 0 or a > 1 for a in at):
            break
    return taken


def texel(image, u, v):
    """Value 0..1 of an image of bytes (H, W) at (u, v), row 0 at v = 0: linear, clamped to the edge."""
    height, width = image.shape
    x, y = u * width - 0.5, v * height - 0.5
    left, low = math.floor(x), math.floor(y)
    total = 0.0
    for column, across in ((left, 1 - (x - left)), (left + 1, x - left)):
        for row, up in ((low, 1 - (y - low)), (low + 1, y - low)):
            kept = min(max(row, 0), height - 1), min(max(column, 0), width - 1)
            total += across * up * float(image[kept]) / 255
    return total


def value(atlas, at, tiles, slices, *, older=False):
    """Value at a position: two slices of the atlas, mixed; `older` versions divide by the rows."""
    across, down = tiles
    x, y, z = (float(p) for p in at)
    first = math.floor(float(at[2] * f32(slices)))
    found = []
    for s in (first, first + 1):
        column = s / across - math.floor(s / across)
        row = math.floor(s / (down if older else across)) / down
        found.append(texel(atlas, column + x / across, row + y / down))
    return found[0] + (found[1] - found[0]) * (z * slices - first)


def walked(atlas, table, taken, tiles, slices, *, factor, light=1.2, steps=85, older=False):
    """What the shader writes, and how many samples it took."""
    color, alpha, count = [0.0, 0.0, 0.0], 0.0, 0
    for at in taken:
        v = value(atlas, at, tiles, slices, older=older)
        *rgb, a = (texel(table[..., c], v, 0.5) for c in range(4))
        opacity = a * factor / steps
        color = [c + (1 - alpha) * x * opacity * light for c, x in zip(color, rgb, strict=True)]
        alpha, count = alpha + (1 - alpha) * opacity, count + 1
        if alpha >= 1:
            break
    return color, alpha, count


def blended(color, alpha, behind):
    """SRC_ALPHA, ONE_MINUS_SRC_ALPHA for the colour; ONE, ONE for alpha."""
    mixed = [alpha * c + (1 - alpha) * b for c, b in zip(color, behind[:3], strict=True)]
    return [*mixed, alpha + behind[3]]
