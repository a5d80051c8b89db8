"""Seed 004's program for one pixel, in plain Python: gradients, table, lights and the loop, one at a time.

It shares no code with volref; t is kept in float32, as it decides how many samples there are.
"""

import math

import numpy as np

from tests.oracles.scalar import box_span, look_at_ray, normalized, table_value

SMOOTH = (1, 2, 1)


def gradient_bytes(codes, x, y, z, *, printed, half):
    """Bytes (gx, gy, gz) of a voxel of nested lists or an array codes[z][y][x]."""
    nz, ny, nx = len(codes), len(codes[0]), len(codes[0][0])
    if 0 in (x, y, z) or (x, y, z) in {(nx - 1, y, z), (x, ny - 1, z), (x, y, nz - 1)}:
        return [128, 128, 128]
    sums = [0, 0, 0]
    for k in range(3):
        for j in range(3):
            for i in range(3):
                code = int(codes[z + k - 1][y + j - 1][x + i - 1])
                place = (i, j, k)
                for axis in range(3):
                    one, two = (SMOOTH[place[a]] for a in range(3) if a != axis)
                    weight = one * two
                    if printed and axis == 2 and place == (2, 2, 2):
                        weight = 2
                    sums[axis] -= (place[axis] - 1) * weight * code
    return [rounded(s / 27 / 255, half=half) for s in sums]


def rounded(g, *, half):
    exact = (g + 1) / 2 * 255 if half else 128 + 127 * g
    # A billionth: sums of 1/255 in floating point must not fall short of a half.
    return min(max(math.floor(exact + 0.5 + 1e-9), 0), 255)


class Pixels:
    """Pixels of a scene with a volume of bytes that is not turned, and a transfer function of the value."""

    def __init__(self, scene, *, printed, steps, factor, by_gradient=0.0):
        self.scene, self.printed, self.steps, self.factor = scene, printed, steps, factor
        self.by_gradient = by_gradient
        self.codes = scene.volume.values
        self.size = scene.volume.values.shape[::-1]
        self.spacing, self.origin = scene.volume.spacing, scene.volume.origin
        self.sides = [n * s for n, s in zip(self.size, self.spacing, strict=True)]
        self.low = [o - s / 2 for o, s in zip(self.origin, self.spacing, strict=True)]
        self.texels = {}

    def texel(self, x, y, z):
        x, y, z = (min(max(i, 0), n - 1) for i, n in zip((x, y, z), self.size, strict=True))
        if (x, y, z) not in self.texels:
            gradient = gradient_bytes(self.codes, x, y, z, printed=self.printed, half=self.printed)
            self.texels[x, y, z] = [code / 255 for code in (int(self.codes[z][y][x]), *gradient)]
        return self.texels[x, y, z]

    def fetched(self, place):
        """The four channels at a place in texture space, trilinear."""
        index = [p * n - 0.5 for p, n in zip(place, self.size, strict=True)]
        low = [math.floor(i) for i in index]
        sums = [0.0] * 4
        for corner in range(8):
            bits = [corner >> axis & 1 for axis in range(3)]
            weight = math.prod(
                i - a if bit else 1 - (i - a) for i, a, bit in zip(index, low, bits, strict=True)
            )
            texel = self.texel(*(a + bit for a, bit in zip(low, bits, strict=True)))
            sums = [s + weight * t for s, t in zip(sums, texel, strict=True)]
        return sums

    def entry(self, k):
        """Entry of the table, in bytes: all its rows are equal."""
        transfer = self.scene.transfer
        first, last = transfer.values[0], transfer.values[-1]
        value = first + (last - first) * (min(max(k, 0), 255) + 0.5) / 256
        columns = [*transfer.colors.T, transfer.opacity]
        return [round(255 * table_value(transfer.values, list(column), value)) / 255 for column in columns]

    def classified(self, value):
        place = value * 256 - 0.5
        k = math.floor(place)
        return [a + (place - k) * (b - a) for a, b in zip(self.entry(k), self.entry(k + 1), strict=True)]

    def unpacked(self, channels):
        if self.printed:
            return [2 * c - 1 for c in channels]
        return [(255 * c - 128) / 127 for c in channels]

    def illumination(self, place, gradient, towards_viewer):
        """Sum of the lights at a place in texture space; the published code lights in that space."""
        material = self.scene.material
        if self.printed:
            point, unit = place, sum(self.sides) / 3
            normal = normalized(gradient)
        else:
            point = [a + p * s for a, p, s in zip(self.low, place, self.sides, strict=True)]
            unit = 1.0
            length = math.sqrt(sum(g * g for g in gradient))
            world = [g / s for g, s in zip(gradient, self.spacing, strict=True)]
            normal = normalized(world) if length >= 1e-3 else None
        total = [0.0, 0.0, 0.0]
        for light in self.scene.lights:
            strength = 1.0
            if light.kind != "ambient":
                if light.kind == "point":
                    at = list(light.position)
                    if self.printed:
                        at = [(p - a) / s for p, a, s in zip(at, self.low, self.sides, strict=True)]
                    way = [a - p for a, p in zip(at, point, strict=True)]
                    c0, _, c2 = light.attenuation
                    strength /= c0 + c2 * unit**2 * sum(w * w for w in way)
                else:
                    way = [-d for d in light.direction]
                    if self.printed:
                        way = [w / s for w, s in zip(way, self.sides, strict=True)]
                strength *= answered(material, normal, normalized(way), towards_viewer)
            total = [t + strength * c for t, c in zip(total, light.color, strict=True)]
        return total

    def at(self, eye, target, up, fov_y, x, y, offset=0.0):
        """Colour (4,) of a pixel before it is stored, and how many samples it took."""
        scene = self.scene
        origin, direction = look_at_ray(eye, target, up, fov_y, scene.width, scene.height, x, y)
        start = [(o - a) / s for o, a, s in zip(origin, self.low, self.sides, strict=True)]
        along = [d / s for d, s in zip(direction, self.sides, strict=True)]
        viewer = [-d for d in (normalized(along) if self.printed else direction)]
        span = box_span(start, along, [0.0] * 3, [1.0] * 3)
        if span is None:
            return list(scene.background), 0
        enter, leave = ([s + t * a for s, a in zip(start, along, strict=True)] for t in span)
        length = math.dist(enter, leave) / self.steps
        step = np.float32(1 / self.steps)
        t, color, alpha, count = step * np.float32(offset), [0.0] * 3, 0.0, 0
        while t < 1 and alpha < 0.999:
            place = [a + (b - a) * float(t) for a, b in zip(enter, leave, strict=True)]
            value, *packed = self.fetched(place)
            gradient = self.unpacked(packed)
            *rgb, opacity = self.classified(value)
            opacity *= length * self.factor
            if self.by_gradient:
                opacity *= self.by_gradient * math.sqrt(sum(g * g for g in gradient))
            if scene.lights:
                light = self.illumination(place, gradient, viewer)
                rgb = [c * i for c, i in zip(rgb, light, strict=True)]
            color = [c + (1 - alpha) * opacity * s for c, s in zip(color, rgb, strict=True)]
            alpha += (1 - alpha) * opacity
            t, count = t + step, count + 1
        if alpha > 1:
            return [c / alpha for c in color] + [1.0], count
        behind = scene.background[:3]
        return [c + (1 - alpha) * b for c, b in zip(color, behind, strict=True)] + [1.0], count


def answered(material, normal, towards_light, towards_viewer):
    """What a material sends back of a light's colour."""
    if normal is None:
        return material.ambient
    held = abs if material.two_sided else lambda cosine: max(cosine, 0.0)
    facing = sum(n * t for n, t in zip(normal, towards_light, strict=True))
    answer = material.ambient + material.diffuse * held(facing)
    if material.model == "phong":
        mirrored = [2 * facing * n - t for n, t in zip(normal, towards_light, strict=True)]
        aligned = sum(m * v for m, v in zip(mirrored, towards_viewer, strict=True))
        answer += material.specular * held(aligned) ** material.shininess
    if material.model == "blinn-phong":
        halfway = normalized([t + v for t, v in zip(towards_light, towards_viewer, strict=True)])
        aligned = sum(n * h for n, h in zip(normal, halfway, strict=True))
        answer += material.specular * held(aligned) ** (4 * material.shininess)
    return answer
