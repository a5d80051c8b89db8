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

since a Chebyshev coefficient is at most 2 M rho^-j, the first degree that the rule misses is 2 k, and the rule
and the integral of one even Chebyshev polynomial of degree j >= 4 differ by at most 2 + 2/15 (Trefethen 2008,
theorem 4.5; the half is the length of the interval).  On that ellipse |v| <= R = (rho + 1/rho) / 4, which
bounds g, A and t by their coefficients.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np

from volref.arrays import Floats, Indices

# Ellipses in which integrands are bounded, and orders to choose from.
RHOS = (2.5, 5.0, 12.0, 40.0)
ORDERS = (2, 3, 4, 5, 6, 8, 11, 15, 20)

# Beyond this exponent a bound is useless: the piece must be cut first.
MOST_EXPONENT, MOST_DENSITY = 300.0, 1e100


@dataclass(frozen=True, eq=False)
class Emission:
    """Of n pieces: optical depth and opacity, the moments J1 and J2 with the error of J1, all (n,).

    The error of J2 is that of J1 times `reach`, a bound of |g| where the integrand was bounded.
    """

    depth: Floats
    opacity: Floats
    first: Floats
    second: Floats
    error: Floats
    reach: Floats


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


def emission(cubic: Floats, density: Floats, weight: Floats, share: Floats, *, second: bool) -> Emission:
    """Return depth, opacity and moments of pieces with cubics and densities A (4, n).

    The order of each piece is the least whose error of J1 times `weight` (n,) stays below `share` (n,).
    Where none does, the moments are 0 and their error what they may be at most.  `second` asks for J2.
    """
    depth = np.maximum(density[0] + density[2] / 12, 0.0)
    opacity = -np.expm1(-depth)
    order, error = _orders(cubic, density, weight, share)
    n = len(depth)
    first, square = np.zeros(n), np.zeros(n)
    for k in ORDERS:
        chosen = np.flatnonzero(order == k)
        if len(chosen) == 0:
            continue
        if len(chosen) == n:
            first, square = _moments(cubic, density, k, second=second)
        else:
            first[chosen], square[chosen] = _moments(
                cubic.take(chosen, axis=1), density.take(chosen, axis=1), k, second=second
            )
    reach = 0.5 * np.abs(cubic[1]) + 0.25 * np.abs(cubic[2]) + 0.125 * np.abs(cubic[3])
    return Emission(depth, opacity, first, square, np.minimum(error, 2 * reach * opacity), 12 * reach)


def _orders(cubic: Floats, density: Floats, weight: Floats, share: Floats) -> tuple[Indices, Floats]:
    """Return the order of each piece, 0 where none serves, and the error of J1 (n,)."""
    f1, f2, f3 = np.abs(cubic[1:])
    a0, (a1, a2, a3) = np.abs(density[0]), np.abs(density[1:])
    bounds = []
    for rho in RHOS:
        r = (rho + 1 / rho) / 4
        value = ((f3 * r + f2) * r + f1) * r
        change = ((a3 * r + a2) * r + a1) * r
        exponent = np.minimum(a0 * (r - 0.5) + change * ((r + 0.5) / 2), MOST_EXPONENT)
        size = np.minimum(a0 + change, MOST_DENSITY)
        with np.errstate(over="ignore"):  # infinite: of no use, and never chosen
            bounds.append(value * size * np.exp(exponent) * (32 / 15 / (1 - rho**-2)))
    n = len(weight)
    order, error = np.zeros(n, np.intp), np.full(n, np.inf)
    open_ = np.arange(n)
    for k in ORDERS:
        least = bounds[0][open_] * RHOS[0] ** (-2 * k)
        for rho, bound in zip(RHOS[1:], bounds[1:], strict=True):
            np.minimum(least, bound[open_] * rho ** (-2 * k), out=least)
        good = least <= share[open_] / np.maximum(weight[open_], 1e-300)
        order[open_[good]], error[open_[good]] = k, least[good]
        open_ = open_[~good]
        if len(open_) == 0:
            break
    return order, error


def _moments(cubic: Floats, density: Floats, order: int, *, second: bool) -> tuple[Floats, Floats]:
    """Return J1 and J2 by the Gauss rule; nodes come in pairs +x, -x, whose even and odd parts are shared."""
    _, f1, f2, f3 = cubic
    a0, a1, a2, a3 = density
    near = -a0 / 2 + a1 / 8 - a2 / 24 + a3 / 64  # the depth quartic at v = -1/2
    first, square = np.zeros_like(f1), np.zeros_like(f1)
    for x, weight in gauss_pairs(order)[1]:
        xx = x * x
        g_even, g_odd = f2 * xx, (f3 * xx + f1) * x
        a_even, a_odd = a2 * xx + a0, (a3 * xx + a1) * x
        t_even, t_odd = (a3 * (xx / 4) + a1 / 2) * xx - near, (a2 * (xx / 3) + a0) * x
        for sign in (1, -1):
            g = g_even + sign * g_odd
            light = g * (a_even + sign * a_odd)
            light *= np.exp(-(t_even + sign * t_odd))
            light *= weight
            first += light
            if second:
                light *= g
                square += light
    return first, square  # the middle node has g = 0
