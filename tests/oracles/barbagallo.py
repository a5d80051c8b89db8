"""Seed 002's fragment shader for one pixel, in plain Python: the judge of the array form.

Written from the article, the page and the table of what differs between them, with no code of volref.
Positions and lengths are numpy.float32, one operation at a time; colours are Python floats.
"""

import math

from numpy import float32


def texel_place(u, count):
    """Lower texel of a linear fetch, the next one, and the weight of that; both held at the edges."""
    place = min(max(u, float32(0)), float32(1)) * float32(count) - float32(0.5)
    whole = math.floor(place)
    hold = [min(max(k, 0), count - 1) for k in (whole, whole + 1)]
    return *hold, float(place - float32(whole))


def atlas_value(png, u, v):
    """Linear fetch of an image (rows from the top, bytes) that was uploaded upside down."""
    left, right, across = texel_place(u, len(png[0]))
    low, high, up = texel_place(v, len(png))

    def row(k):
        texels = png[len(png) - 1 - k]
        a, b = int(texels[left]) / 255, int(texels[right]) / 255
        return a + (b - a) * across

    below, above = row(low), row(high)
    return below + (above - below) * up


def color_of(value, table):
    """Colour of a value of 0..1 in a row of bytes, one entry at (k + 1/2) / n."""
    place = min(max(value, 0.0), 1.0) * len(table) - 0.5
    whole = math.floor(place)
    low, high = (table[min(max(k, 0), len(table) - 1)] for k in (whole, whole + 1))
    return [int(a) / 255 + (int(b) - int(a)) / 255 * (place - whole) for a, b in zip(low, high, strict=True)]


def in_slice(at, number, program):
    """Colour and value in one slice; the tiles are counted in rows from the top left, v upwards."""
    across, down = program["tiles"]
    column, row = number % across, (across * down - 1 - number) // across
    u = float32(column) / float32(across) + at[0] / float32(across)
    v = float32(row) / float32(down) + at[1] / float32(down)
    value = atlas_value(program["png"], u, v)
    return [*color_of(value, program["table"])[:3], value]


def in_volume(at, program):
    """Two slices, each with its colour, then mixed."""
    last = program["slices"] - 1
    depth = at[2] * float32(last)
    first = math.floor(depth)
    one, two = (in_slice(at, number, program) for number in (first, min(first + 1, last)))
    share = float(depth - float32(first))
    return [a + (b - a) * share for a, b in zip(one, two, strict=True)]


def length(x):
    return (x[0] * x[0] + x[1] * x[1] + x[2] * x[2]) ** float32(0.5)


def walk(entry, exit_, program):
    """Colour that the shader writes, its own alpha, and the iterations that it took."""
    ray = [b - a for a, b in zip(entry, exit_, strict=True)]
    ray_length = length(ray)
    delta = [component / ray_length * (float32(1) / float32(program["steps"])) for component in ray]
    step = length(delta)
    at, walked, alpha, written = list(entry), float32(0), 0.0, [0.0] * 4
    count = 0
    while count < program["cap"]:
        sample = in_volume(at, program)
        opacity = sample[3] * program["scale"]
        written = [c + (1 - alpha) * opacity * s for c, s in zip(written, sample, strict=True)]
        alpha += opacity if program["adds_alpha"] else (1 - alpha) * opacity
        at = [a + d for a, d in zip(at, delta, strict=True)]
        walked = walked + step
        count += 1
        if walked >= ray_length or alpha >= 1:
            break
    return written, alpha, count
