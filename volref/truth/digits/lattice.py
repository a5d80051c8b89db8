"""The field along a ray in exact rational arithmetic.

Every float64 is a fraction, so the planes of the lattice, the points where a ray meets them, and the cubic
that trilinear interpolation makes of the eight samples of a cell are fractions too: nothing is rounded
here.  A field that is constant along a ray is constant to the last bit, which decides on which side of a
jump it lies.

Positions are (x, y, z) in index space, where a sample has whole numbers; t are in world units.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from fractions import Fraction
from itertools import pairwise
from typing import TypeAlias

from volref.arrays import Numbers

Point: TypeAlias = tuple[Fraction, Fraction, Fraction]
Cubic: TypeAlias = tuple[Fraction, Fraction, Fraction, Fraction]
Index: TypeAlias = tuple[int, int, int]


def exact_point(numbers: Iterable[float]) -> Point:
    """Return three float64 numbers as fractions."""
    x, y, z = (Fraction(float(number)) for number in numbers)
    return x, y, z


def exact_span(
    origin: Point, direction: Point, low: Point, high: Point, distance: float
) -> tuple[Fraction, Fraction] | None:
    """Return where the ray is inside the box at 0 <= t <= `distance`; None where that has no length.

    Along an axis with d = 0 the ray is inside for all t if it starts between the faces or on one.

    Examples
    --------
    >>> origin, direction = exact_point((-1.0, 0.25, 0.0)), exact_point((0.5, 0.0, 0.0))
    >>> exact_span(origin, direction, exact_point((0, 0, 0)), exact_point((1, 1, 1)), math.inf)
    (Fraction(2, 1), Fraction(4, 1))
    """
    near, far = [Fraction(0)], [] if math.isinf(distance) else [Fraction(distance)]
    for o, d, a, b in zip(origin, direction, low, high, strict=True):
        if d:
            first, last = sorted(((a - o) / d, (b - o) / d))
            near.append(first)
            far.append(last)
        elif not a <= o <= b:
            return None
    start, end = max(near), min(far)
    return (start, end) if start < end else None


def cells_along(
    origin: Point, direction: Point, span: tuple[Fraction, Fraction]
) -> Iterator[tuple[Fraction, Fraction, Index]]:
    """Yield (t at entry, t at exit, lowest corner) of the cells that the ray passes through, in order.

    A ray in a plane of the lattice belongs to the cells above it; the field is continuous there.

    Examples
    --------
    >>> ray = exact_point((0.5, 0.0, 0.5)), exact_point((1.0, 0.0, 0.0))
    >>> [(float(a), float(b), cell) for a, b, cell in cells_along(*ray, (Fraction(0), Fraction(2)))]
    [(0.0, 0.5, (0, 0, 0)), (0.5, 1.5, (1, 0, 0)), (1.5, 2.0, (2, 0, 0))]
    """
    start, end = span
    crossings = {start, end}
    for o, d in zip(origin, direction, strict=True):
        if d:
            first, last = sorted((o + d * start, o + d * end))
            planes = range(math.floor(first) + 1, math.ceil(last))
            crossings.update((plane - o) / d for plane in planes)
    for t0, t1 in pairwise(sorted(crossings)):
        middle = (t0 + t1) / 2
        i, j, k = (math.floor(o + d * middle) for o, d in zip(origin, direction, strict=True))
        yield t0, t1, (i, j, k)


def corner_samples(values: Numbers, cell: Index) -> list[float]:
    """Return the 8 samples at the corners of a cell, x fastest, those outside clamped to the border.

    Nothing but these samples is converted to float64, which holds them exactly.
    """
    (x0, x1), (y0, y1), (z0, z1) = (
        (min(max(i, 0), n - 1), min(max(i + 1, 0), n - 1))
        for i, n in zip(cell, values.shape[::-1], strict=True)
    )
    return [float(values[z, y, x]) for z in (z0, z1) for y in (y0, y1) for x in (x0, x1)]


def cubic_in_cell(
    samples: Sequence[float], cell: Index, origin: Point, direction: Point, t0: Fraction, t1: Fraction
) -> Cubic:
    """Return the coefficients c of the field c0 + c1 u + c2 u^2 + c3 u^3, u = 0 at t0 to 1 at t1.

    With fractions f, g, h of the cell along x, y, z the field is
    a + b f + c g + d h + e f g + p g h + q h f + r f g h, each coefficient a sum of differences of samples,
    so that what does not vary drops out exactly.  f, g and h are linear in u.

    Examples
    --------
    The field x y in the cell from (0, 0, 0), along its diagonal:

    >>> ray = exact_point((0, 0, 0)), exact_point((1, 1, 1))
    >>> cubic = cubic_in_cell([0, 0, 0, 1, 0, 0, 0, 1], (0, 0, 0), *ray, Fraction(0), Fraction(1))
    >>> [int(c) for c in cubic]
    [0, 0, 1, 0]
    """
    v000, v100, v010, v110, v001, v101, v011, v111 = map(Fraction, samples)
    b, c, d = v100 - v000, v010 - v000, v001 - v000
    e, p, q = v110 - v100 - c, v011 - v001 - c, v101 - v001 - b
    r = (v111 - v011 - v101 + v001) - e
    f, g, h = ((o + d * t0 - i, d * (t1 - t0)) for o, d, i in zip(origin, direction, cell, strict=True))
    fg = _product(f, g)
    total = [v000, Fraction(0), Fraction(0), Fraction(0)]
    for factor, polynomial in (
        *((b, f), (c, g), (d, h)),
        *((e, fg), (p, _product(g, h)), (q, _product(h, f))),
        (r, _product(fg, h)),
    ):
        if factor:
            for power, coefficient in enumerate(polynomial):
                total[power] += factor * coefficient
    c0, c1, c2, c3 = total
    return c0, c1, c2, c3


def _product(left: Sequence[Fraction], right: Sequence[Fraction]) -> list[Fraction]:
    """Return the coefficients of the product of two polynomials."""
    result = [Fraction(0)] * (len(left) + len(right) - 1)
    for i, a in enumerate(left):
        for j, b in enumerate(right):
            result[i + j] += a * b
    return result
