"""Stage 6 for interpolated opacity: depth and emission of pieces whose extinction is -log1p(-opacity) / d0.

n pieces, v from -1/2 to 1/2, k nodes.  On a piece between two bends the opacity a(v) = a0 + a1 g(v) is a
cubic, so the extinction is analytic up to where the opacity reaches 1.  With h = length / d0 and l(v) = -h
log1p(-a(v)),

    depth  tau = integral of l,      J1 = integral of g l e^-t(v) dv,     t(v) = integral of l from -1/2 to v

are taken at the Gauss nodes, t(v) as the integral of the polynomial through l at the nodes.  In an ellipse of
semi-axes' sum rho (see `quadrature`) where q = |a1| max|g| / (1 - a0) < 1, |l - l(0)| <= N = -h log1p(-q), so

    |error of tau| <= 32/15 N rho^-2k / (1 - rho^-2)
    |error of t|   <= (1 + Lambda) 2 N rho^(1-k) / (rho - 1) = P

where Lambda <= k sqrt(k max(w) / 2), w the weights on [-1, 1], bounds the sum of the magnitudes of the
Lagrange polynomials: by Cauchy-Schwarz and the reproducing kernel, sum l_j^2 / w_j = sum (n + 1/2) P_n^2 <=
k^2 / 2.

Where the opacity reaches 1 at a point, the depth has a logarithmic singularity but is finite: for a
polynomial p of degree 3, mean log|p| >= log max|p| - 3 * 1.28 (each factor |v - r| loses at most 1.2785
against its greatest value, at r = 0.218 of the interval).  Pieces so short that this does not matter are not
integrated.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np

from volref.arrays import Booleans, Floats, Indices

ROUNDOFF = 2.0**-53

RHOS = (3.0, 8.0, 25.0, 80.0, 300.0)
ORDERS = (3, 4, 6, 8, 11, 15, 20)
MOST_EXPONENT = 300.0

# Stands for the bound where the ellipse reaches beyond opacity 1; finite, so that it can be multiplied by 0.
FAR = 1e100

# The loss of the mean logarithm of a cubic against that of its maximum.
LOGARITHM_LOSS = 3.84

# A piece is not cut where nothing of it is further from opaque than this many times its doubt: a part of a
# quarter of it may be, for a cubic, 1/64 as far.
LEAST_CLEAR = 100.0

# The depth that stands for that of an opaque piece, and the greatest that a bound of a depth is taken for:
# what comes through it is 0 in float64.
OPAQUE, MOST_DEPTH = 800.0, 1600.0


@dataclass(frozen=True, eq=False)
class CurvedEmission:
    """Of n pieces, (n,) each: depth and its error, J1 and its error.

    settled: False where no rule serves and the piece should be cut: J1 is only between bounds, and the depth
    may be, too.
    """

    depth: Floats
    depth_error: Floats
    first: Floats
    error: Floats
    settled: Booleans


@cache
def _rule(order: int) -> tuple[Floats, Floats, Floats, float]:
    """Return nodes and weights on [-1/2, 1/2], the matrix of partial integrals (k, k), and 1 + Lambda.

    The polynomial through values y at the nodes is the sum of (n + 1/2) (sum_j w_j P_n(x_j) y_j) P_n, and P_n
    integrates to (P_(n+1) - P_(n-1)) / (2 n + 1).
    """
    x, w = np.polynomial.legendre.leggauss(order)
    legendre = np.polynomial.legendre.legvander(x, order)
    partial = np.empty((order, order))
    partial[0] = x + 1
    for n in range(1, order):
        partial[n] = (legendre[:, n + 1] - legendre[:, n - 1]) / (2 * n + 1)
    scaled = (np.arange(order) + 0.5)[:, None] * legendre[:, :order].T * w
    lebesgue = order * np.sqrt(order * w.max() / 2)
    return x / 2, w / 2, partial.T @ scaled / 2, 1.0 + float(lebesgue)


def curved_emission(
    cubic: Floats,
    opacity: Floats,
    clear: Floats,
    slope: Floats,
    slack: Floats,
    scale: Floats,
    weight: Floats,
    share: Floats,
) -> CurvedEmission:
    """Return depth and J1 of pieces with cubics (4, n) and opacities `opacity` + `slope` g(v).

    `clear` (n,) is 1 - `opacity`, with all its digits where that is small.  `slack` is how far the value may
    be off, `scale` is length / unit distance.  The order of each piece is the least whose error of depth
    stays below `share` and that of J1 times `weight` too.
    """
    n = len(scale)
    reach = 0.5 * np.abs(cubic[1]) + 0.25 * np.abs(cubic[2]) + 0.125 * np.abs(cubic[3])
    dense = clear < 0.5
    middle = -scale * _log_clear(opacity, clear, dense)
    order, depth_error, error = _orders(cubic, middle, clear, slope, scale, weight, share)
    order[(clear <= 0) & (slope == 0)] = 0  # opaque throughout
    settled = order > 0
    order[~settled] = ORDERS[-1]
    depth, first = np.zeros(n), np.zeros(n)
    for k in ORDERS:
        for chosen in (np.flatnonzero((order == k) & dense), np.flatnonzero((order == k) & ~dense)):
            if len(chosen):
                depth[chosen], first[chosen] = _integrals(
                    cubic[:, chosen],
                    (clear if dense[chosen[0]] else opacity)[chosen],
                    slope[chosen],
                    scale[chosen],
                    k,
                    dense=bool(dense[chosen[0]]),
                )
    most, faint = clear + np.abs(slope) * reach, opacity + np.abs(slope) * reach
    off = np.where(slope == 0, 0.0, np.abs(slope) * slack + 8 * ROUNDOFF * np.where(dense, most, faint))
    least = clear - np.abs(slope) * reach
    with np.errstate(divide="ignore", invalid="ignore"):
        moved = np.where(off == 0, 0.0, np.where(least > 2 * off, scale * (off / (least - off)), FAR))
    depth_error += moved + 64 * ROUNDOFF * depth
    result = CurvedEmission(depth, depth_error, first, error, settled)
    _bracket(result, cubic, clear, slope, off, scale, reach)
    return result


def _log_clear(opacity: Floats, clear: Floats, dense: Booleans) -> Floats:
    """Return log(1 - opacity), finite, with all its digits at both ends."""
    return np.where(dense, np.log(np.maximum(clear, 1e-300)), np.log1p(-np.minimum(opacity, 0.75)))


def _orders(
    cubic: Floats,
    middle: Floats,
    clear: Floats,
    slope: Floats,
    scale: Floats,
    weight: Floats,
    share: Floats,
) -> tuple[Indices, Floats, Floats]:
    """Return order, error of the depth and of J1, (n,) each; where no order serves, 0 and the last one's."""
    f1, f2, f3 = np.abs(cubic[1:])
    n = len(scale)
    order, depth_error, error = np.zeros(n, np.intp), np.full(n, FAR), np.full(n, FAR)
    inner = 0.5 * f1 + 0.25 * f2 + 0.125 * f3
    for rho in RHOS:
        r = (rho + 1 / rho) / 4
        value = ((f3 * r + f2) * r + f1) * r
        q = np.abs(slope) * value / np.maximum(clear, 1e-300)
        change = np.where(q < 0.99, -scale * np.log1p(-np.minimum(q, 0.99)), FAR)
        exponent = np.minimum(middle * (r - 0.5) + change * (r + 0.5), MOST_EXPONENT)
        with np.errstate(invalid="ignore", over="ignore"):
            light = value * (middle + change) * np.exp(exponent)
        for k in ORDERS:
            tail = (32 / 15) * rho ** (-2 * k) / (1 - rho**-2)
            drift = np.minimum(_rule(k)[3] * 2 * change * (rho ** (1 - k) / (rho - 1)), 1.0)
            of_first = light * tail + inner * np.minimum(middle + change, 1.0) * np.expm1(drift)
            of_depth = change * tail
            if k == ORDERS[-1]:
                with np.errstate(over="ignore"):
                    better = (order == 0) & (of_depth + of_first * weight < depth_error + error * weight)
                depth_error[better], error[better] = of_depth[better], of_first[better]
            good = (of_depth <= share) & (of_first * weight <= share) & ((order == 0) | (k < order))
            order[good], depth_error[good], error[good] = k, of_depth[good], of_first[good]
    return order, depth_error, error


def _integrals(
    cubic: Floats, middle: Floats, slope: Floats, scale: Floats, order: int, *, dense: bool
) -> tuple[Floats, Floats]:
    """Return depth and J1.

    `middle` is what is clear in the middle if the pieces are `dense`, else the opacity there.
    """
    nodes, weights, partial, _ = _rule(order)
    values = [((cubic[3] * v + cubic[2]) * v + cubic[1]) * v for v in nodes]
    if dense:
        lost = [-scale * np.log(np.clip(middle - slope * g, 1e-300, 1.0)) for g in values]
    else:
        lost = [-scale * np.log1p(-np.clip(middle + slope * g, 0.0, 1 - ROUNDOFF)) for g in values]
    depth, first = np.zeros_like(scale), np.zeros_like(scale)
    for i, (g, amount) in enumerate(zip(values, lost, strict=True)):
        depth += weights[i] * amount
        until = np.zeros_like(scale)
        for j, other in enumerate(lost):
            until += partial[i, j] * other
        first += weights[i] * g * amount * np.exp(-until)
    return depth, first


def _bracket(
    result: CurvedEmission,
    cubic: Floats,
    clear: Floats,
    slope: Floats,
    off: Floats,
    scale: Floats,
    reach: Floats,
) -> None:
    """Fill in, in place, J1 where no rule served, depths whose bounds are closer, and opaque pieces."""
    open_ = np.flatnonzero(~result.settled | (result.depth_error >= FAR))
    if len(open_) == 0:
        return
    cubic, clear, slope, off, scale = (x[..., open_] for x in (cubic, clear, slope, off, scale))
    half = reach[open_]
    odd = 0.5 * cubic[1] + 0.125 * cubic[3]
    ends = [0.25 * cubic[2] - odd, 0.0 * odd, 0.25 * cubic[2] + odd]
    somewhere = np.maximum.reduce([clear - slope * g for g in ends]) - off
    # A part of a piece may be clear nowhere beyond doubt: then its depth has no bound, and cutting makes it
    # worse.
    result.settled[open_] = somewhere < LEAST_CLEAR * off
    nearest = clear - np.abs(slope) * half - off
    farthest = np.minimum(clear + np.abs(slope) * half + off, 1.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        low = -scale * np.log(farthest)
        high = np.where(nearest > 0, -np.log(nearest), np.inf)
        high = scale * np.fmin(high, np.where(somewhere > 0, LOGARITHM_LOSS - np.log(somewhere), np.inf))
    high = np.minimum(high, MOST_DEPTH)
    low = np.minimum(low, high)
    # Where the clear part falls to 0 along a straight line, the mean of -log is 1 more than at its greatest.
    guess = np.where(nearest > 0, 0.5 * (low + high), np.minimum(low + scale, high))
    between = np.maximum(high - guess, guess - low) + 16 * ROUNDOFF * high
    closer = ~(result.depth_error[open_] < between)
    result.depth[open_[closer]] = guess[closer]
    result.depth_error[open_[closer]] = between[closer]
    most = half * np.minimum(high, 1.0)
    unknown = ~(result.error[open_] < most)
    result.first[open_[unknown]] = 0.0
    result.error[open_[unknown]] = most[unknown]
    # An opaque piece shows the colour at its near end.
    opaque = (clear <= 0) & (slope == 0)
    opaque_ones = open_[opaque]
    result.depth[opaque_ones] = OPAQUE
    result.first[opaque_ones] = ends[0][opaque]
    result.depth_error[opaque_ones] = result.error[opaque_ones] = 0.0
    result.settled[opaque_ones] = True
