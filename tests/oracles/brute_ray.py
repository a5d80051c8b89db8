"""The emission-absorption integral of a ray through a volume by nested adaptive quadrature (mpmath).

Point-wise and slow: the field is a weighted mean of eight samples, the table a search; cells are found by
walking, knots by looking for changes of side at 200 places in a cell, and the rest is `mp.quad`.
"""

from bisect import bisect_right
from itertools import pairwise

from mpmath import mp, mpf

from tests.oracles.ray_integral import ray_integral

PLACES = 200


def brute_ray(volume, transfer, origin, direction, t_near, t_far, digits=25):
    """Return [r, g, b, alpha] over nothing, of the index-space ray from t_near to t_far."""
    with mp.workdps(digits + 15):
        edges = [mpf(t_near), *_faces(origin, direction, t_near, t_far), mpf(t_far)]
        total, depth = [mpf(0)] * 3, mpf(0)
        for a, b in pairwise(edges):
            field = _interpolated(lambda t: trilinear(volume, origin, direction, t), a, b)
            for u, v in pairwise([a, *_crossings(field, transfer, a, b), b]):
                row = bisect_right(transfer.values.tolist(), field((u + v) / 2))
                channels = [_channel(transfer, field, column, row) for column in range(4)]
                found = ray_integral(
                    [lambda t, c=c, u=u: c(u + t) for c in channels[:3]],
                    lambda t, c=channels[3], u=u: _extinction(transfer, c(u + t)),
                    v - u,
                )
                total = [c + mp.exp(-depth) * f for c, f in zip(total, found[:3], strict=True)]
                depth -= mp.log1p(-found[3])
        return [*total, -mp.expm1(-depth)]


def trilinear(volume, origin, direction, t):
    """The field at t, samples outside clamped to the border."""
    cells, fractions = [], []
    for o, d in zip(origin, direction, strict=True):
        place = mpf(o) + t * mpf(d)
        cells.append(int(mp.floor(place)))
        fractions.append(place - cells[-1])
    total = mpf(0)
    for bits in [(i, j, k) for i in (0, 1) for j in (0, 1) for k in (0, 1)]:
        share = mpf(1)
        for bit, f in zip(bits, fractions, strict=True):
            share *= f if bit else 1 - f
        x, y, z = (min(max(c + bit, 0), n - 1) for c, bit, n in zip(cells, bits, volume.size, strict=True))
        total += share * mpf(float(volume.values[z, y, x]))
    return total


def _faces(origin, direction, t_near, t_far):
    crossings = set()
    for o, d in zip(origin, direction, strict=True):
        if d:
            crossings |= {(k - mpf(o)) / mpf(d) for k in range(-2, 100)}
    return sorted(t for t in crossings if t_near < t < t_far)


def _interpolated(field, a, b):
    """Return the cubic through the field at four places inside a..b: along a ray it is one there."""
    nodes = [a + (b - a) * mpf(k) / 5 for k in range(1, 5)]
    values = [field(t) for t in nodes]

    def cubic(t):
        total = mpf(0)
        for i, node in enumerate(nodes):
            share = values[i]
            for j, other in enumerate(nodes):
                if i != j:
                    share *= (t - other) / (node - other)
            total += share
        return total

    return cubic


def _crossings(field, transfer, a, b):
    found = []
    places = [a + (b - a) * mpf(k) / PLACES for k in range(PLACES + 1)]
    for knot in sorted(set(transfer.values.tolist())):
        for u, v in pairwise(places):
            if (field(u) < knot) != (field(v) < knot):
                found.append(_bisected(lambda t, k=knot: field(t) < k, u, v))
    return sorted(found)


def _bisected(side, u, v):
    first = side(u)
    for _ in range(int(mp.prec)):
        middle = (u + v) / 2
        u, v = (middle, v) if side(middle) == first else (u, middle)
    return (u + v) / 2


def _channel(transfer, field, column, row):
    """Return a column of the table (red, green, blue, strength) as a function of t, in one row of it."""
    strengths = transfer.opacity if transfer.extinction is None else transfer.extinction
    numbers = strengths.tolist() if column == 3 else transfer.colors[:, column].tolist()
    knots = transfer.values.tolist()
    if row in (0, len(knots)):
        constant = mpf(numbers[0 if row == 0 else -1])
        return lambda _t: constant
    low, high = mpf(knots[row - 1]), mpf(knots[row])
    a, b = mpf(numbers[row - 1]), mpf(numbers[row])
    return lambda t: a + (b - a) * (field(t) - low) / (high - low)


def _extinction(transfer, strength):
    if transfer.extinction is not None:
        return strength
    return -mp.log1p(-strength) / mpf(transfer.unit_distance)
