"""The program of Congote et al. 2012 for one pixel, in plain Python: the chapter's equations by number.

Positions, and all that leads to texture coordinates, are numpy.float32; colours are Python floats.  It shares
no code with volref: its own rays, box, mosaic and fetches.  `printed` is the chapter to the letter.
"""

import math
from dataclasses import dataclass

import numpy as np

from tests.oracles.scalar import box_span, look_at_ray

f32 = np.float32
PI = f32(math.pi)


@dataclass(frozen=True)
class Setting:
    """What is drawn: value(place, printed) of 0..1, the box low..high, a table of straight rgba, the camera.

    camera: eye, target, up, fov_y.  factor: O_f; steps: s of eq. 1.
    """

    value: object
    low: tuple
    high: tuple
    table: list
    camera: tuple
    width: int
    height: int
    steps: int
    factor: float


def ends(setting, x, y):
    """Colours of the cube where the ray enters and leaves it, 0..255 before rounding; None if it misses."""
    eye, way = look_at_ray(*setting.camera, setting.width, setting.height, x, y)
    span = box_span(eye, way, setting.low, setting.high)
    if span is None:
        return None
    places = [[e + t * d for e, d in zip(eye, way, strict=True)] for t in span]
    sides = list(zip(setting.low, setting.high, strict=True))
    return [[255 * (p - a) / (b - a) for p, (a, b) in zip(at, sides, strict=True)] for at in places]


def drawn(setting, x, y, printed):
    """Premultiplied rgba, and how many samples were taken."""
    found = ends(setting, x, y)
    if found is None:
        return [0.0] * 4, 0
    front, back = ([f32(round(c)) * f32(1 / 255) for c in place] for place in found)
    delta = [(b - a) / f32(setting.steps) for a, b in zip(front, back, strict=True)]
    color, alpha, place, taken = [0.0] * 3, 0.0, front, 0
    while taken < setting.steps:
        value = setting.value(place, printed)
        *rgb, opacity = entry(setting.table, value)
        s_a = (value if printed else opacity) * setting.factor / setting.steps
        color = [a + (1 - alpha) * s_a * c for a, c in zip(color, rgb, strict=True)]
        alpha = alpha + s_a if printed else alpha + (1 - alpha) * s_a
        place = [p + d for p, d in zip(place, delta, strict=True)]
        taken += 1
        if alpha >= 1:
            break
    return [*color, 1.0 if printed else alpha], taken


def entry(table, value):
    """Straight rgba of a value: a linear texture of one row, looked up at the value itself."""
    n = len(table)
    place = min(max(min(max(value, 0.0), 1.0) * n - 0.5, 0.0), n - 1.0)
    low = min(int(place), n - 2)
    return [a + (b - a) * (place - low) for a, b in zip(table[low], table[low + 1], strict=True)]


def fract(number):
    return number - np.floor(number)


def mosaic(slices, across):
    """Codes [row][column] of slices[z][y][x] side by side, row 0 at v = 0; tiles without a slice are 0."""
    depth, height, width = np.shape(slices)
    down = -(-depth // across)
    image = [[0] * (across * width) for _ in range(down * height)]
    for z in range(depth):
        for y in range(height):
            for x in range(width):
                image[z // across * height + y][z % across * width + x] = int(slices[z][y][x])
    return image


def tex2d(image, u, v):
    """Number 0..1 of codes image[row][column] at a texture coordinate: linear, clamped to the edge."""
    rows, columns = len(image), len(image[0])
    u, v = (min(max(c, f32(0)), f32(1)) for c in (u, v))
    across, upward = u * f32(columns) - f32(0.5), v * f32(rows) - f32(0.5)
    i, j = math.floor(across), math.floor(upward)
    a, b = float(across) - i, float(upward) - j

    def texel(column, row):
        return image[min(max(row, 0), rows - 1)][min(max(column, 0), columns - 1)] / 255

    below = texel(i, j) + (texel(i + 1, j) - texel(i, j)) * a
    above = texel(i, j + 1) + (texel(i + 1, j + 1) - texel(i, j + 1)) * a
    return below + (above - below) * b


def equations(image, s1, x, y, share, tiles, printed):
    """Equations 6 to 17 from s1 on; `share` is the third argument of mix."""
    m_x, m_y = (f32(m) for m in tiles)
    s2 = s1 + f32(1)
    dx1 = fract(s1 / m_x)
    dy1 = fract(s1 / m_y) / m_y if printed else np.floor(s1 / m_x) / m_y
    dx2 = np.floor(s2 / m_x) if printed else fract(s2 / m_x)
    dy2 = fract(s2 / m_y) / m_y if printed else np.floor(s2 / m_x) / m_y
    v1 = tex2d(image, dx1 + x / m_x, dy1 + y / m_y)
    v2 = tex2d(image, dx2 + x / m_x, dy2 + y / m_y)
    return v1 + (v2 - v1) * float(share)


def of_slices(slices, across):
    """Value function of an atlas: equations 5 to 17."""
    image, count = mosaic(slices, across), f32(len(slices))
    tiles = across, -(-len(slices) // across)

    def value(place, printed):
        x, y, z = place
        s1 = np.floor(z * count)
        share = (x if printed else z) * count - s1
        return equations(image, s1, x, y, share, tiles, printed)

    return value


def of_radar(sweeps, tilts, first_azimuth):
    """Value function of a radar in the middle of the cube: equations 18 to 20, a search, 6 to 17.

    sweeps: codes [sweep][radial][gate], the first gate at the antenna and the last at the faces.  tilts in
    degrees.  first_azimuth: where the first radial's degree begins.
    """
    radials, gates = len(sweeps[0]), len(sweeps[0][0])
    stacked = [[sweep[k][gate] for k in range(radials)] for sweep in sweeps for gate in range(gates)]
    between = [[row[-1], *row, row[0]] for row in stacked]
    elevations = [f32(math.radians(tilt)) for tilt in tilts]

    def value(place, printed):
        q = [p - f32(0.5) for p in place]
        r = np.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2])
        x, y, z = place if printed else q
        phi = np.arctan2(y, x) + PI
        with np.errstate(invalid="ignore"):
            theta = np.arccos(z / (phi if printed else r))
        elevation = PI / f32(2) - theta
        low = [k for k in range(len(tilts) - 1) if elevations[k] <= elevation <= elevations[k + 1]]
        if not low or r > f32(0.5):
            return 0.0
        s1, tiles = f32(low[-1]), (1, len(sweeps))
        turn = phi * f32(0.5 / math.pi)
        if printed:
            return equations(stacked, s1, turn, f32(2) * r, turn * f32(len(sweeps)) - s1, tiles, printed)
        below, above = elevations[low[-1]], elevations[low[-1] + 1]
        turn = fract(f32(0.75) - turn - f32(first_azimuth / 360))
        column = (turn * f32(radials) + f32(1)) / f32(radials + 2)
        half = f32(0.5 / gates)
        row = min(max(f32(2) * r, half), f32(1) - half)
        return equations(between, s1, column, row, (elevation - below) / (above - below), tiles, printed)

    return value
