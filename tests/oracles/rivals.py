"""The rivals again, one ray and one sample at a time, as textbooks write them.

They share no code with volref: spans, interpolation and the walk through the table are those of `scalar`.
Every function takes `Ray` and returns (transmittance, [r, g, b]) of what lies in the volume.
"""

import math
from dataclasses import dataclass
from functools import cache
from itertools import pairwise

import numpy as np

from tests.oracles import scalar


@dataclass
class Ray:
    """A ray in index space: point(t) = start + t slope for t from t_near to t_far."""

    values: object
    transfer: object
    start: list
    slope: list
    t_near: float
    t_far: float

    def value(self, t):
        return scalar.trilinear(self.values, [a + t * b for a, b in zip(self.start, self.slope, strict=True)])

    def paint(self, value):
        """Extinction and colour of a value."""
        table = self.transfer
        knots = list(table.values)
        color = [scalar.table_value(knots, list(column), value) for column in table.colors.T]
        if table.extinction is not None:
            return scalar.table_value(knots, list(table.extinction), value), color
        opacity = scalar.table_value(knots, list(table.opacity), value)
        sigma = 2.0**20 if opacity == 1 else min(-math.log1p(-opacity), 2.0**20)
        return sigma / table.unit_distance, color

    def at(self, t):
        return self.paint(self.value(t))


def ray_of(volume, transfer, origin, direction):
    """The ray of a world ray in an axis-aligned volume, None where it misses."""
    scale = [1 / s for s in volume.spacing]
    start = [(o - c) * s for o, c, s in zip(origin, volume.origin, scale, strict=True)]
    slope = [d * s for d, s in zip(direction, scale, strict=True)]
    low, high = ([float(x) for x in bound] for bound in volume.index_bounds)
    span = scalar.box_span(start, slope, low, high)
    return span and Ray(volume.values, transfer, start, slope, *span)


def cuts(ray, step):
    edges = [ray.t_near]
    while edges[-1] + step < ray.t_far:
        edges.append(ray.t_near + len(edges) * step)
    return pairwise([*edges, ray.t_far])


def front_to_back(segments):
    """Composite (passed, [r, g, b]) of each segment."""
    through, light = 1.0, [0.0, 0.0, 0.0]
    for passed, glow in segments:
        light = [c + through * g for c, g in zip(light, glow, strict=True)]
        through *= passed
    return through, light


def riemann(ray, step, place):
    def segment(a, b):
        sigma, color = ray.at(a + place * (b - a))
        alpha = min(sigma * (b - a), 1.0)
        return 1 - alpha, [alpha * c for c in color]

    return front_to_back(segment(a, b) for a, b in cuts(ray, step))


def exponential(ray, step, place):
    def segment(a, b):
        sigma, color = ray.at(a + place * (b - a))
        passed = math.exp(-sigma * (b - a))
        return passed, [(1 - passed) * c for c in color]

    return front_to_back(segment(a, b) for a, b in cuts(ray, step))


def trapezoid(ray, step):
    def segment(a, b):
        (sigma_a, color_a), (sigma_b, color_b) = ray.at(a), ray.at(b)
        passed = math.exp(-(b - a) * (sigma_a + sigma_b) / 2)
        pairs = zip(color_a, color_b, strict=True)
        return passed, [(b - a) / 2 * (sigma_a * p + sigma_b * q * passed) for p, q in pairs]

    return front_to_back(segment(a, b) for a, b in cuts(ray, step))


def preintegrated(ray, step, size, order):
    """Each entry that is looked up is integrated anew, by 300 midpoints."""
    low, high = float(np.min(ray.values)), float(np.max(ray.values))
    spacing = (high - low) / (size - 1)
    bulge = steepest(ray) * step / 2

    def segment(a, b):
        front, back = ray.value(a), ray.value(b)
        bent = (ray.value((a + b) / 2) - (front + back) / 2) / bulge if order == 2 else 0.0
        light = [0.0] * 4
        for i, wi in corners((front - low) / spacing, size):
            for j, wj in corners((back - low) / spacing, size):
                for k, wk in ((math.copysign(bulge, bent), abs(bent)), (0.0, 1 - abs(bent))):
                    if wi * wj * wk > 0:
                        entry = entry_of(ray, low + i * spacing, low + j * spacing, k, step)
                        light = [s + wi * wj * wk * e for s, e in zip(light, entry, strict=True)]
        alpha = 1 - (1 - light[3]) ** ((b - a) / step)
        share = alpha / light[3] if light[3] > 0 else 0.0
        return 1 - alpha, [share * c for c in light[:3]]

    return front_to_back(segment(a, b) for a, b in cuts(ray, step))


def corners(place, size):
    first = min(int(place), size - 2)
    return (first, first + 1 - place), (first + 1, place - first)


def entry_of(ray, front, back, bulge, step, parts=300):
    """[r, g, b, alpha] of a segment whose value goes from `front` to `back`, bent by `bulge`."""
    u = (np.arange(parts) + 0.5) / parts
    value = front + (back - front) * u + 4 * bulge * u * (1 - u)
    value = np.clip(value, np.min(ray.values), np.max(ray.values))
    sigma, color = zip(*(ray.paint(v) for v in value), strict=True)
    depth = np.array(sigma) * step / parts
    weight = np.exp(-(np.cumsum(depth) - depth)) * -np.expm1(-depth)
    return [*(weight @ np.array(color)), weight.sum()]


def steepest(ray):
    """The greatest slope of a ray's value: by the corner of the box of slopes that is longest."""
    values = np.asarray(ray.values, dtype=float)
    per_axis = [np.abs(np.diff(values, axis=axis)).max() for axis in (2, 1, 0)]
    return math.hypot(*per_axis) * math.hypot(*ray.slope)  # for equal spacings


def cell_edges(ray):
    faces = set()
    for a, b, count in zip(ray.start, ray.slope, np.shape(ray.values)[::-1], strict=True):
        faces |= {t for plane in range(count) if b and ray.t_near < (t := (plane - a) / b) < ray.t_far}
    return sorted({ray.t_near, ray.t_far, *faces})


def gauss_piece(ray, a, b, count):
    """Optical depth and light of one piece; depths within it by integrating Lagrange's polynomials."""
    x, w = np.polynomial.legendre.leggauss(count)
    x, w = (x + 1) / 2, w / 2
    painted = [ray.at(a + (b - a) * node) for node in x]
    sigma = np.array([s * (b - a) for s, _ in painted])
    light = np.zeros(3)
    for i in range(count):
        before = sum(before_node(count)[i][j] * sigma[j] for j in range(count))
        light += w[i] * sigma[i] * math.exp(-max(before, 0.0)) * np.array(painted[i][1])
    return float(w @ sigma), light


@cache
def before_node(count):
    """Integrals from 0 to node i of the Lagrange polynomial of node j."""
    x = (np.polynomial.legendre.leggauss(count)[0] + 1) / 2
    return [[lagrange(x, j).integ()(node) for j in range(count)] for node in x]


def lagrange(x, j):
    polynomial = np.polynomial.Polynomial([1.0])
    for k, node in enumerate(x):
        if k != j:
            polynomial *= np.polynomial.Polynomial([-node, 1.0]) / (x[j] - node)
    return polynomial


def cell_gauss(ray, parts, count):
    segments = []
    for a, b in pairwise(cell_edges(ray)):
        for k in range(parts):
            piece = a + (b - a) * k / parts, a + (b - a) * (k + 1) / parts
            depth, light = gauss_piece(ray, *piece, count)
            segments.append((math.exp(-depth), light))
    return front_to_back(segments)


def halving(ray, tolerance, count, least_share=1e-3):
    whole = ray.t_far - ray.t_near

    def accepted(a, b, depth, light, level):
        m = (a + b) / 2
        (front, front_light), (back, back_light) = (
            gauss_piece(ray, a, m, count),
            gauss_piece(ray, m, b, count),
        )
        both = front_light + math.exp(-front) * back_light
        off = max(abs(math.exp(-depth) - math.exp(-front - back)), np.abs(light - both).max())
        if off <= tolerance * max((b - a) / whole, least_share) or level == 40:
            return [(math.exp(-front - back), both)]
        return accepted(a, m, front, front_light, level + 1) + accepted(m, b, back, back_light, level + 1)

    segments = []
    for a, b in pairwise(cell_edges(ray)):
        segments += accepted(a, b, *gauss_piece(ray, a, b, count), 0)
    return front_to_back(segments)


def by_name(name):
    """Return the scalar form of a rival as a function of (ray, setting)."""
    if name.startswith("preintegrated"):
        order, size = 2 if "parabola" in name else 1, int(name.rsplit("-", 1)[1])
        return lambda ray, step: preintegrated(ray, step, size, order)
    if name.startswith("cell-gauss"):
        return lambda ray, parts: cell_gauss(ray, parts, int(name[-1]))
    if name.startswith("halving"):
        return lambda ray, tolerance: halving(ray, tolerance, int(name[-1]))
    if name == "trapezoid":
        return trapezoid
    rule = riemann if name.endswith("riemann") else exponential
    place = 0.0 if name.startswith("left") else 0.5
    return lambda ray, step: rule(ray, step, place)
