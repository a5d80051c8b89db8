"""Lit and classified rays, one sample at a time, in plain Python floats: the judge of the marcher's fields.

It shares no code with volref: its own matrices, gradients, lights and compositing, written from the papers
(Lambert 1760; Phong 1975; Blinn 1977; Sobel and Feldman 1968) and the definitions in the scene's docstrings.
"""

import functools
import itertools
import math
from types import SimpleNamespace

from tests.oracles.lookup import bilinear_2d, piecewise
from tests.oracles.scalar import box_span, cross, normalized, segment_opacity, table_value

TRIPLES = list(itertools.product((-1, 0, 1), repeat=3))
CORNERS = list(itertools.product((0, 1), repeat=3))


def dot(a, b):
    return sum(x * y for x, y in zip(a, b, strict=True))


def length_of(a):
    return math.hypot(*a)


DEFAULT = SimpleNamespace(
    model="phong", ambient=0.1, diffuse=0.7, specular=0.2, shininess=10.0, two_sided=False
)


def lit_color(lights, material, point, normal, viewer, color):
    """Red, green and blue of one point; `normal` is [0, 0, 0] where there is none."""
    if material.two_sided and dot(normal, viewer) < 0:
        normal = [-x for x in normal]
    result = [0.0, 0.0, 0.0]
    for light in lights:
        if light.kind == "ambient":
            for c in range(3):
                result[c] += material.ambient * light.color[c] * color[c]
            continue
        towards, strength = arriving(light, point, viewer)
        facing = dot(normal, towards)
        if facing <= 0:
            continue
        shine = 0.0
        if material.model != "lambert" and material.specular > 0:
            shine = highlight(material.model, normal, towards, viewer) ** material.shininess
        for c in range(3):
            lamp = light.color[c] * strength
            result[c] += lamp * (material.diffuse * facing * color[c] + material.specular * shine)
    return result


def arriving(light, point, viewer):
    """Unit direction to the light and how much of it arrives."""
    if light.kind == "headlight":
        return list(viewer), 1.0
    if light.kind == "directional":
        return [-x for x in light.direction.tolist()], 1.0
    way = [a - b for a, b in zip(light.position.tolist(), point, strict=True)]
    d = length_of(way)
    c0, c1, c2 = light.attenuation
    strength = 1 / (c0 + c1 * d + c2 * d**2)
    return ([x / d for x in way] if d > 0 else [0.0, 0.0, 0.0]), strength


def highlight(model, normal, towards, viewer):
    if model == "phong":
        twice = 2 * dot(normal, towards)
        return max(dot([twice * n - t for n, t in zip(normal, towards, strict=True)], viewer), 0.0)
    halfway = [t + v for t, v in zip(towards, viewer, strict=True)]
    length = length_of(halfway)
    return max(dot(normal, halfway) / length, 0.0) if length > 0 else 0.0


def clamped(values, x, y, z):
    """The sample at whole numbers, beyond the border the outermost."""
    nz, ny, nx = len(values), len(values[0]), len(values[0][0])
    return values[min(max(z, 0), nz - 1)][min(max(y, 0), ny - 1)][min(max(x, 0), nx - 1)]


def weighted(index, of_voxel):
    """Trilinear mean of what `of_voxel(x, y, z)` says of the eight samples around, a list."""
    low = [math.floor(i) for i in index]
    total = None
    for bits in CORNERS:
        share = 1.0
        for i, a, bit in zip(index, low, bits, strict=True):
            share *= i - a if bit else 1 - (i - a)
        here = of_voxel(*(a + bit for a, bit in zip(low, bits, strict=True)))
        scaled = [share * h for h in here]
        total = scaled if total is None else [t + s for t, s in zip(total, scaled, strict=True)]
    return total


def central_difference(values, x, y, z):
    """Half the difference of the neighbours along each axis; of a voxel beyond the border the outermost's."""
    nz, ny, nx = len(values), len(values[0]), len(values[0][0])
    x, y, z = (min(max(i, 0), n - 1) for i, n in ((x, nx), (y, ny), (z, nz)))
    return [
        (clamped(values, x + 1, y, z) - clamped(values, x - 1, y, z)) / 2,
        (clamped(values, x, y + 1, z) - clamped(values, x, y - 1, z)) / 2,
        (clamped(values, x, y, z + 1) - clamped(values, x, y, z - 1)) / 2,
    ]


def sobel_difference(values, x, y, z):
    """Sobel's operator on the 27 samples around, so scaled that a ramp of slope 1 has the gradient 1."""
    nz, ny, nx = len(values), len(values[0]), len(values[0][0])
    x, y, z = (min(max(i, 0), n - 1) for i, n in ((x, nx), (y, ny), (z, nz)))
    total = [0.0, 0.0, 0.0]
    for step in TRIPLES:
        sample = clamped(values, x + step[0], y + step[1], z + step[2])
        for axis in range(3):
            others = [2 - abs(s) for k, s in enumerate(step) if k != axis]
            total[axis] += step[axis] * others[0] * others[1] * sample / 32
    return total


def correlated(values, kernel, x, y, z):
    """Sum of kernel[z + 1][y + 1][x + 1] times the samples around, clamped."""
    total = 0.0
    for dx, dy, dz in TRIPLES:
        total += float(kernel[dz + 1][dy + 1][dx + 1]) * clamped(values, x + dx, y + dy, z + dz)
    return total


def cell_slope(values, index):
    """Gradient of the trilinear mean itself: along an axis the mean of the four edges' differences."""
    low = [math.floor(i) for i in index]
    part = [i - a for i, a in zip(index, low, strict=True)]
    total = [0.0, 0.0, 0.0]
    for axis, bits in itertools.product(range(3), itertools.product((0, 1), repeat=2)):
        share, ends = 1.0, []
        others = [k for k in range(3) if k != axis]
        for k, bit in zip(others, bits, strict=True):
            share *= part[k] if bit else 1 - part[k]
        for side in (0, 1):
            corner = [a + (side if k == axis else bits[others.index(k)]) for k, a in enumerate(low)]
            ends.append(clamped(values, *corner))
        total[axis] += share * (ends[1] - ends[0])
    return total


def inverse(columns):
    """The rows of the inverse of the 3 x 3 matrix with these columns, by Cramer's rule."""
    a, b, c = columns
    rows = [cross(b, c), cross(c, a), cross(a, b)]
    determinant = dot(a, rows[0])
    return [[x / determinant for x in row] for row in rows]


class Place:
    """Where a volume lies: to and from index space, written out from spacing, origin and direction."""

    def __init__(self, volume):
        direction = volume.direction.tolist()
        spacing = [float(s) for s in volume.spacing]
        self.columns = [[direction[row][k] * spacing[k] for row in range(3)] for k in range(3)]
        self.rows = inverse(self.columns)
        self.origin = [float(o) for o in volume.origin]

    def index_point(self, point):
        return self.index_vector([p - o for p, o in zip(point, self.origin, strict=True)])

    def index_vector(self, vector):
        return [dot(row, vector) for row in self.rows]

    def world_gradient(self, gradient):
        """The chain rule: each index counts with its own gradient in the world, a row of the inverse."""
        return [sum(g * row[axis] for g, row in zip(gradient, self.rows, strict=True)) for axis in range(3)]


class Look:
    """How a scene's volume looks at one index point: straight colour and strength."""

    def __init__(self, scene):
        self.scene, self.place = scene, Place(scene.volume)
        self.values = scene.volume.values.tolist()
        self.opacity_table = getattr(scene.transfer, "rgba", None) is not None
        voxelwise = {"central": central_difference, "sobel": sobel_difference}.get(scene.gradient)
        self.voxel_gradient = functools.cache(lambda *at: voxelwise(self.values, *at))
        self.voxel_look = functools.cache(lambda *at: self.one_dimensional(clamped(self.values, *at)))

    def value(self, index):
        return weighted(index, lambda *at: [clamped(self.values, *at)])[0]

    def gradient(self, index):
        """World gradient."""
        if self.scene.gradient == "analytic":
            return self.place.world_gradient(cell_slope(self.values, index))
        return self.place.world_gradient(weighted(index, self.voxel_gradient))

    def one_dimensional(self, value):
        transfer = self.scene.transfer
        strength = transfer.opacity if transfer.extinction is None else transfer.extinction
        columns = [*transfer.colors.T.tolist(), strength.tolist()]
        return [table_value(transfer.values.tolist(), column, value) for column in columns]

    def at(self, index, point, viewer):
        scene = self.scene
        if scene.classification == "pre":
            return weighted(index, self.voxel_look)
        if scene.classification == "per-slice":
            below = math.floor(index[2])
            nz = len(self.values)
            slices = [[*index[:2], float(min(max(z, 0), nz - 1))] for z in (below, below + 1)]
            low, high = (self.one_dimensional(self.value(place)) for place in slices)
            return [a + (index[2] - below) * (b - a) for a, b in zip(low, high, strict=True)]
        return self.post(index, point, viewer)

    def post(self, index, point, viewer):
        scene, transfer = self.scene, self.scene.transfer
        value, gradient = self.value(index), self.gradient(index)
        steepness = length_of(gradient)
        if self.opacity_table:
            rgba, domains = transfer.rgba.tolist(), (transfer.value_domain, transfer.magnitude_domain)
            found = bilinear_2d(rgba, *domains, value, steepness)
        else:
            found = self.one_dimensional(value)
            if transfer.gradient_opacity is not None:
                at, factors = (column.tolist() for column in transfer.gradient_opacity)
                found[3] *= piecewise(at, factors, steepness)
        material = scene.material or DEFAULT
        if scene.lights and material.model != "unlit":
            normal = [-g / steepness for g in gradient] if steepness > 0 else [0.0, 0.0, 0.0]
            found[:3] = lit_color(scene.lights, material, point, normal, viewer, found[:3])
        return found


def lit_ray(look, origin, direction, step):
    """Premultiplied RGBA of one world ray through a scene, by the midpoint rule on equal segments."""
    scene, place = look.scene, look.place
    low, high = ([float(x) for x in bound] for bound in scene.volume.index_bounds)
    span = box_span(place.index_point(origin), place.index_vector(direction), low, high)
    viewer = [-d for d in direction]
    count, length = segments(span, step)
    transmittance, color = 1.0, [0.0, 0.0, 0.0]
    for k in range(count):
        t = span[0] + (k + 0.5) * length
        point = [o + t * d for o, d in zip(origin, direction, strict=True)]
        *shade, strength = look.at(place.index_point(point), point, viewer)
        opacity = opacity_of(scene.transfer, strength, length)
        color = [c + transmittance * opacity * s for c, s in zip(color, shade, strict=True)]
        transmittance *= 1 - opacity
    behind = scene.background
    rgb = [c + transmittance * b for c, b in zip(color, behind, strict=False)]
    return [*rgb, 1 - transmittance + transmittance * behind[3]]


def segments(span, step):
    """How many segments a span has, a multiple of three, and how long they are."""
    if span is None:
        return 0, 0.0
    length = span[1] - span[0]
    count = 3 * math.ceil(length / (3 * step) * (1 - 1e-12))
    return count, length / count


def opacity_of(transfer, strength, length):
    if transfer.interpolation == "extinction":
        return -math.expm1(-strength * length)
    return 1.0 if strength >= 1 else -math.expm1(math.log1p(-strength) * length / transfer.unit_distance)


def orthographic_ray(eye, target, up, view_height, near, width, height, x, y):
    """Origin on the near plane and unit direction through the centre of pixel (x, y)."""
    forward = normalized([t - e for t, e in zip(target, eye, strict=True)])
    right = normalized(cross(forward, up))
    above = cross(right, forward)
    across = (2 * (x + 0.5) / width - 1) * view_height / 2 * width / height
    upward = (1 - 2 * (y + 0.5) / height) * view_height / 2
    origin = [
        e + near * f + across * r + upward * u for e, f, r, u in zip(eye, forward, right, above, strict=True)
    ]
    return origin, forward


def radar_ray(radar, transfer, value_at, box, origin, direction, step, background):
    """Premultiplied RGBA of one world ray through a radar; `value_at` says None where there is no data."""
    span, columns = box_span(origin, direction, *box), transfer.colors.T.tolist()
    count, length = segments(span, step)
    transmittance, color = 1.0, [0.0, 0.0, 0.0]
    for k in range(count):
        t = span[0] + (k + 0.5) * length
        value = value_at(radar, [o + t * d for o, d in zip(origin, direction, strict=True)])
        if value is None:
            continue
        opacity = segment_opacity(transfer, value, length)
        shade = [table_value(transfer.values.tolist(), column, value) for column in columns]
        color = [c + transmittance * opacity * s for c, s in zip(color, shade, strict=True)]
        transmittance *= 1 - opacity
    rgb = [c + transmittance * b for c, b in zip(color, background, strict=False)]
    return [*rgb, 1 - transmittance + transmittance * background[3]]
