"""The program of Arbelaz et al. 2016 again, a pixel at a time in Python floats: the judge of the emulation.

It shares no code with volref: rays by their own basis, the box by a slab test in place of rasterised faces,
meshes as parallelograms that a ray is solved with.  No rounding but that of targets.
"""

import math
from dataclasses import dataclass

from tests.oracles.scalar import box_span, look_at_ray


@dataclass(frozen=True)
class Setting:
    """What is drawn: slices[z][y][x] in 0..1 in the box low..high, table of straight rgba, parallelograms.

    plates: (corner, one edge, other edge, colour).  camera: eye, target, up, fov_y, near, far.
    """

    slices: list
    low: tuple
    high: tuple
    table: list
    plates: list
    camera: tuple
    width: int
    height: int
    across: int
    steps: int
    factor: float


def stored(value):
    return round(min(max(value, 0.0), 1.0) * 255) / 255


def fract(value):
    return value - math.floor(value)


def dot(a, b):
    return sum(x * y for x, y in zip(a, b, strict=True))


def solved(columns, right):
    """Cramer's rule for three unknowns; None for a flat system."""

    def determinant(a, b, c):
        return (
            a[0] * (b[1] * c[2] - b[2] * c[1])
            - a[1] * (b[0] * c[2] - b[2] * c[0])
            + a[2] * (b[0] * c[1] - b[1] * c[0])
        )

    whole = determinant(*columns)
    if whole == 0:
        return None
    replaced = [[right if i == k else columns[i] for i in range(3)] for k in range(3)]
    return [determinant(*three) / whole for three in replaced]


def pack_float(value, printed):
    digits = [fract(value * 256.0**power) for power in (3, 2, 1, 0)]
    less = [0.0, digits[0] / 256, digits[1] / 256, digits[2] / 256]
    stretch = 1.0 if printed else 256 / 255
    return [stored((digit - by) * stretch) for digit, by in zip(digits, less, strict=True)]


def unpack_float(color, printed):
    stretch = 1.0 if printed else 255 / 256
    return sum(part * stretch / 256.0**power for part, power in zip(color, (3, 2, 1, 0), strict=True))


class Pixel:
    """One pixel of a setting; `printed` is the paper to the letter."""

    def __init__(self, setting, x, y, printed):
        self.setting, self.printed = setting, printed
        eye, target, up, fov_y, self.near, self.far = setting.camera
        self.eye, self.way = look_at_ray(eye, target, up, fov_y, setting.width, setting.height, x, y)
        forward = [b - a for a, b in zip(eye, target, strict=True)]
        length = math.sqrt(dot(forward, forward))
        self.slant = dot(self.way, forward) / length

    def nearness(self, t):
        """What passes 1 and 3 pack: of a place t along the ray."""
        near, far, w = self.near, self.far, t * self.slant
        if not self.printed:
            return (far - w) / (far - near)
        clip_z = (far + near) / (far - near) * w - 2 * far * near / (far - near)
        return (clip_z / w + 1) / 2 * (1 / w)

    def plate(self):
        """Nearest parallelogram between the planes: (t, colour), or None."""
        found = None
        for corner, one, other, color in self.setting.plates:
            away = [e - c for e, c in zip(self.eye, corner, strict=True)]
            solution = solved([one, other, [-d for d in self.way]], away)
            if solution is None or not (0 <= solution[0] <= 1 and 0 <= solution[1] <= 1):
                continue
            t = solution[2]
            if self.near <= t * self.slant <= self.far and (found is None or t < found[0]):
                found = (t, color)
        return found

    def texture(self, t):
        low, high = self.setting.low, self.setting.high
        place = [e + t * d for e, d in zip(self.eye, self.way, strict=True)]
        return [(p - a) / (b - a) for p, a, b in zip(place, low, high, strict=True)]

    def volume(self, place):
        slices, across = self.setting.slices, self.setting.across
        count, rows, columns = len(slices), len(slices[0]), len(slices[0][0])
        down = -(-count // across)

        def texel(i, j):
            i, j = min(max(i, 0), across * columns - 1), min(max(j, 0), down * rows - 1)
            number = j // rows * across + i // columns
            return slices[number][j % rows][i % columns] if number < count else 0.0

        def atlas(number):
            u = (fract(number / across) + place[0] / across) * across * columns - 0.5
            v = (math.floor(number / across) + place[1]) / down * down * rows - 0.5
            i, j = math.floor(u), math.floor(v)
            a, b = u - i, v - j
            below = texel(i, j) * (1 - a) + texel(i + 1, j) * a
            return below * (1 - b) + (texel(i, j + 1) * (1 - a) + texel(i + 1, j + 1) * a) * b

        first = math.floor(place[2] * count)
        share = place[2] * count - first
        return atlas(first) * (1 - share) + atlas(first + 1) * share

    def color_of(self, value):
        table = self.setting.table
        at = min(max(value * len(table) - 0.5, 0.0), len(table) - 1.0)
        k = min(math.floor(at), len(table) - 2)
        return [a + (b - a) * (at - k) for a, b in zip(table[k], table[k + 1], strict=True)]

    def drawn(self):
        """Canvas (r, g, b, a) before it is stored, samples, and whether the loop met a mesh."""
        plate = self.plate()
        behind = [*plate[1], 1.0] if plate else [0.0] * 4
        span = box_span(self.eye, self.way, self.setting.low, self.setting.high)
        if span is None or (plate and plate[0] <= span[0]):
            return behind, 0, False
        surface = [stored(part) for part in behind]
        mesh_depth = pack_float(self.nearness(plate[0]), self.printed) if plate else [0.0] * 4
        back_depth = pack_float(self.nearness(span[1]), self.printed)
        exit_place = [stored(part) for part in self.texture(span[1])]
        color, samples, hit = self.walked(span[0], exit_place, back_depth, mesh_depth, surface)
        a = color[3]
        share = a if self.printed else 1.0
        return [share * c + (1 - a) * b for c, b in zip(color, behind, strict=True)], samples, hit

    def walked(self, t_near, exit_place, back_depth, mesh_depth, surface):
        steps, printed = self.setting.steps, self.printed
        place = self.texture(t_near)
        step = [(b - a) / steps for a, b in zip(place, exit_place, strict=True)]
        ray_depth = 1 - self.nearness(t_near)
        surf_depth = 1 - unpack_float(mesh_depth, printed)
        depth_step = (1 - unpack_float(back_depth, printed) - ray_depth) / steps
        color = [0.0, 0.0, 0.0, 0.0]
        for i in range(steps):
            met = ray_depth - surf_depth > -depth_step if printed else ray_depth >= surf_depth
            if met:
                a = color[3]
                share = a if printed else 1.0
                color[:3] = [share * c + (1 - a) * o for c, o in zip(color[:3], surface[:3], strict=True)]
                color[3] = a * a + (1 - a) if printed else 1.0
                return color, i, True
            found = self.color_of(self.volume(place))
            opacity = found[3] * self.setting.factor / steps
            weight = (1 - color[3]) * opacity
            color = [c + weight * f for c, f in zip(color, [*found[:3], 1.0], strict=True)]
            if color[3] >= 1.0 or (printed and any(p > 1 for p in place)):
                return color, i + 1, False
            place = [p + s for p, s in zip(place, step, strict=True)]
            ray_depth += depth_step
        return color, steps, False
