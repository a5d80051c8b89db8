"""A cell cut into pieces: monotone, and each within one interval of the table.

The field in the cell is a cubic c0 + c1 u + c2 u^2 + c3 u^3 on 0 <= u <= 1, its coefficients mpmath
numbers.  It is cut where its derivative is 0, which leaves it monotone in between, so that it meets a knot
at most once there, and where it meets the knots.
"""

from bisect import bisect_left, bisect_right
from collections.abc import Iterator, Sequence
from itertools import pairwise

from volref.truth.digits.table import Context, Number


def monotone_pieces(
    mp: Context, cubic: Sequence[Number], knots: Sequence[float]
) -> Iterator[tuple[Number, Number, int]]:
    """Yield (u at the start, u at the end, interval of the table) of the pieces of a cubic, in order.

    The cubic must not be constant.

    Examples
    --------
    u - u^2 rises from 0 to 1/4 and falls again:

    >>> from mpmath import mp
    >>> cuts = monotone_pieces(mp, [mp.mpf(c) for c in (0, 1, -1, 0)], [0.1875, 3.0])
    >>> [(float(a), float(b), interval) for a, b, interval in cuts]
    [(0.0, 0.25, 0), (0.25, 0.5, 1), (0.5, 0.75, 1), (0.75, 1.0, 0)]
    """
    for a, b in pairwise([mp.zero, *turning_points(mp, cubic), mp.one]):
        first, last = evaluate(cubic, a), evaluate(cubic, b)
        low, high = min(first, last), max(first, last)
        below = bisect_right(knots, low)
        inner = range(below, bisect_left(knots, high))
        cuts = [meeting(mp, cubic, mp.mpf(knots[i]), a, b) for i in inner]
        intervals = range(below, below + len(cuts) + 1)
        if first > last:
            cuts.reverse()
            intervals = intervals[::-1]
        for (u, v), interval in zip(pairwise([a, *cuts, b]), intervals, strict=True):
            if u < v:
                yield u, v, interval


def evaluate(polynomial: Sequence[Number], u: Number) -> Number:
    """Return the value of a polynomial, coefficients from the constant on."""
    result = polynomial[-1]
    for coefficient in polynomial[-2::-1]:
        result = result * u + coefficient
    return result


def turning_points(mp: Context, cubic: Sequence[Number]) -> list[Number]:
    """Return where in 0 < u < 1 the derivative c1 + 2 c2 u + 3 c3 u^2 is 0, in order.

    With q = -(c2 + sign(c2) sqrt(c2^2 - 3 c1 c3)) the two are q / (3 c3) and c1 / q: no difference of like
    numbers, and right as c3 goes to 0.
    """
    _, c1, c2, c3 = cubic
    square = c2 * c2 - 3 * c1 * c3
    if square < 0:
        return []
    q = -(c2 + mp.sqrt(square) * (1 if c2 >= 0 else -1))
    quotients = [(q, 3 * c3), (c1, q)]
    return sorted({top / bottom for top, bottom in quotients if bottom and 0 < top / bottom < 1})


def meeting(mp: Context, cubic: Sequence[Number], level: Number, a: Number, b: Number) -> Number:
    """Return where in a <= u <= b the cubic, monotone there and `level` between its ends, is `level`.

    float64 finds where to begin.
    """
    shifted = (cubic[0] - level, *cubic[1:])
    near = _root([float(c) for c in shifted], float(a), float(b), float((a + b) / 2), 2.0**-52)
    begin = mp.mpf(near) if a < near < b else (a + b) / 2
    return _root(shifted, a, b, begin, mp.eps)


def _root(cubic: Sequence[Number], a: Number, b: Number, u: Number, eps: Number) -> Number:
    """Return the root of a cubic between a and b, where it has opposite signs, from a first guess u.

    Newton's steps, as long as they stay within the bracket that the signs leave and shrink by half each;
    else the bracket is halved, until the value is no more than the rounding of its own evaluation.
    """
    slope = [i * c for i, c in enumerate(cubic)][1:]
    rises = evaluate(cubic, a) < evaluate(cubic, b)
    rounding = 4 * eps * sum(map(abs, cubic))
    last = b - a
    while True:
        value = evaluate(cubic, u)
        if abs(value) <= rounding:
            return u
        if (value > 0) == rises:
            b = u
        else:
            a = u
        steepness = evaluate(slope, u)
        step = -value / steepness if steepness else last
        if not (a < u + step < b and 2 * abs(step) <= last):
            step = (a + b) / 2 - u
        u, last = u + step, abs(step)
        if not a < u < b:
            return u
