"""Stage 6 of the exact integrator: optical depth and emission of pieces, and how far they may be off.

n pieces, v from -1/2 to 1/2 along each.  With the value f(v) = f0 + g(v), the model's extinction times the
piece's length is the cubic A(v) >= 0, and

    optical depth   tau = integral of A = A0 + A2 / 12                           (exact)
    emission        c(f0) (1 - e^-tau) + c' J1 + c''/2 J2,   Jk = integral of g^k A e^-t(v) dv

with t(v) the depth from the near end, a quartic, and c', c'' the derivatives of the model's colour at f0.
Only J1 and J2 need quadrature, and they carry the change of colour along the piece only.

The remainder of the k-point Gauss rule, k >= 2, for an integrand bounded by M in the ellipse with foci at the
ends and the sum of semi-axes rho (as a multiple of half the length) is at most

    1/2 * 64/15 * M rho^(-2 k) / (1 - rho^-2)

since a Chebyshev coefficient is at most 2 M rho^-j, the first degree that the rule misses is 2 k, and the
rule and the integral of one even Chebyshev polynomial of degree j >= 4 differ by at most 2 + 2/15 (Trefethen
2008, theorem 4.5; the half is the length of the interval).  On that ellipse |v| <= R = (rho + 1/rho) / 4,
which bounds g, A and t by their coefficients.
"""

from dataclasses import dataclass
from functools import cache
from itertools import pairwise

import numpy as np

from volref.arrays import Floats, Indices

# Ellipses in which integrands are bounded: one that serves most pieces, and others for what is left.
RHO = 6.0
RHOS = (2.5, 12.0, 40.0)

# Odd orders only: g is 0 at their middle node, which then costs nothing.
ORDERS = (3, 5, 7, 9, 13, 21)

# Beyond this exponent a bound is useless: the piece must be cut first.
MOST_EXPONENT, MOST_DENSITY = 300.0, 1e100


@dataclass(frozen=True, eq=False)
class Moments:
    """Of n pieces: the moments J1 and J2 and the error of J1, (n,) each; J2 is 0 where it was not asked for.

    The error of J2 is that of J1 times the greatest |g| in the ellipse, at most `REACH` times that on the
    piece.
    """

    first: Floats
    second: Floats
    error: Floats


# (rho + 1/rho) / 2 for the widest ellipse, to the third power: how much further a cubic may reach there.
REACH = ((RHOS[-1] + 1 / RHOS[-1]) / 2) ** 3


@cache
def gauss_pairs(order: int) -> tuple[float, tuple[tuple[float, float], ...]]:
    """Return the weight of the middle node, 0 if there is none, and the pairs (x, weight) on [-1/2, 1/2].

    Examples
    --------
    >>> gauss_pairs(2)[0], [(round(12 * x * x, 12), weight) for x, weight in gauss_pairs(2)[1]]
    (0.0, [(1.0, 0.5)])
    """
    nodes, weights = np.polynomial.legendre.leggauss(order)
    pairs = tuple((float(x) / 2, float(w) / 2) for x, w in zip(nodes, weights, strict=True) if x > 1e-9)
    return float(weights[order // 2]) / 2 if order % 2 else 0.0, pairs


def moments(cubic: Floats, density: Floats, limit: Floats, *, second: bool) -> Moments:
    """Return the moments of pieces with cubics and densities A (4, n); `second` asks for J2.

    The order of each piece is the least whose error of J1 stays below `limit` (n,).  Where none does, the
    moments are those of the highest, if its error is less than what they can be at all, and else 0.
    """
    order, error = _orders(cubic, density, limit)
    first, square = np.zeros_like(limit), np.zeros_like(limit)
    for index, k in enumerate(ORDERS):
        chosen = np.flatnonzero(order == index)
        if len(chosen) == len(limit):
            first, square = _moments(cubic, density, k, second=second)
        elif len(chosen):
            parts = cubic.take(chosen, axis=1), density.take(chosen, axis=1)
            first[chosen], square[chosen] = _moments(*parts, k, second=second)
    return Moments(first, square, error)


def _remainder(cubic: Floats, density: Floats, rho: float) -> Floats:
    """Return the remainder of J1 times rho^2k (n,), infinite where it is of no use."""
    r = (rho + 1 / rho) / 4
    value: Floats = np.abs(cubic[3]) * r
    value += np.abs(cubic[2])
    value *= r
    value += np.abs(cubic[1])
    value *= r
    change: Floats = np.abs(density[3]) * r
    change += np.abs(density[2])
    change *= r
    change += np.abs(density[1])
    change *= r
    exponent = density[0] * (r - 0.5)
    exponent += change * ((r + 0.5) / 2)
    np.minimum(exponent, MOST_EXPONENT, out=exponent)
    np.exp(exponent, out=exponent)
    change += density[0]
    np.minimum(change, MOST_DENSITY, out=change)
    change *= 32 / 15 / (1 - rho**-2)
    with np.errstate(over="ignore"):
        value *= change
        value *= exponent
    return np.asarray(value)


def _orders(cubic: Floats, density: Floats, limit: Floats) -> tuple[Indices, Floats]:
    """Return the index of each piece's order, len(ORDERS) where none serves, and the error of J1 (n,)."""
    error = _remainder(cubic, density, RHO)
    index = np.zeros(len(limit), np.intp)
    scaled = RHO ** (2 * ORDERS[0]) * np.minimum(limit, MOST_DENSITY)
    for lower, upper in pairwise(ORDERS[:4]):
        index += error > scaled
        scaled *= RHO ** (2 * (upper - lower))
    error *= (RHO ** (-2.0 * np.array(ORDERS[:4])))[index]
    left = np.flatnonzero(index >= 2)
    if len(left):
        index[left], error[left] = _searched(
            cubic.take(left, axis=1), density.take(left, axis=1), limit.take(left)
        )
    return index, error


def _searched(cubic: Floats, density: Floats, limit: Floats) -> tuple[Indices, Floats]:
    """Return the same, by the best of all ellipses."""
    bounds = [(rho, _remainder(cubic, density, rho)) for rho in (RHO, *RHOS)]
    index, error = np.full(len(limit), len(ORDERS), np.intp), np.full(len(limit), np.inf)
    for number, k in reversed(list(enumerate(ORDERS))):
        least: Floats = np.minimum.reduce([bound * rho ** (-2 * k) for rho, bound in bounds])
        good = least <= limit
        index[good], error[good] = number, least[good]
        if number == len(ORDERS) - 1:
            depth = np.maximum(density[0] + density[2] / 12, 0.0)
            reach = 0.5 * np.abs(cubic[1]) + 0.25 * np.abs(cubic[2]) + 0.125 * np.abs(cubic[3])
            most = reach * -np.expm1(-depth)
            useful = ~good & (least < most)
            index[useful], error[useful] = number, least[useful]
            none = ~good & ~useful
            error[none] = most[none]
    return index, error


def _moments(cubic: Floats, density: Floats, order: int, *, second: bool) -> tuple[Floats, Floats]:
    """Return J1 and J2 by the Gauss rule; nodes come in pairs +x, -x, whose even and odd parts are shared."""
    _, f1, f2, f3 = cubic
    a0, a1, a2, a3 = density
    near = a0 / 2 - a1 / 8 + a2 / 24 - a3 / 64  # minus the depth quartic at v = -1/2
    first, square = np.zeros_like(f1), np.zeros_like(f1)
    for x, weight in gauss_pairs(order)[1]:
        xx = x * x
        g_even, g_odd = f2 * xx, (f3 * xx + f1) * x
        a_even, a_odd = a2 * (xx * weight) + a0 * weight, (a3 * xx + a1) * (x * weight)
        t_even, t_odd = (a3 * (xx / 4) + a1 / 2) * xx + near, (a2 * (xx / 3) + a0) * x
        for combine in (np.add, np.subtract):
            light = combine(t_even, t_odd)
            np.negative(light, out=light)
            np.exp(light, out=light)
            light *= combine(a_even, a_odd)
            g = combine(g_even, g_odd)
            light *= g
            first += light
            if second:
                light *= g
                square += light
    return first, square  # the middle node has g = 0
