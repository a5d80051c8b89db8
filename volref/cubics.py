"""Cubics on pieces: their range, turning points and roots.

n cubics c are (4, n): the value at v is the sum of c[j] v^j, for v from -1/2 to 1/2.
"""

import numpy as np

from volref.arrays import Floats, Indices

ROUNDOFF = 2.0**-53

# Newton steps to a root from the start on the chord, before the roots that need more are bisected.
NEWTON_STEPS = 4
MOST_STEPS = 80


def evaluate(cubic: Floats, v: Floats) -> Floats:
    """Return the values of cubics (4, n) at v (n,)."""
    return np.asarray(((cubic[3] * v + cubic[2]) * v + cubic[1]) * v + cubic[0])


def value_range(cubic: Floats) -> tuple[Floats, Floats]:
    """Return bounds (n,) of cubics (4, n) on their pieces: the least and greatest Bernstein coefficient.

    Those of a trilinear field along a ray are means of values in the cell, so they stay within its samples.
    """
    c0, c1, c2, c3 = cubic
    outer, inner = 0.25 * c2, 0.5 * c1
    odd, bend = inner + 0.125 * c3, inner / 3 - 0.125 * c3
    b0, b3 = outer - odd, outer + odd
    b1, b2 = -outer / 3 - bend, bend - outer / 3
    low, high = np.minimum(b0, b3), np.maximum(b0, b3)
    np.minimum(low, np.minimum(b1, b2), out=low)
    np.maximum(high, np.maximum(b1, b2), out=high)
    return low + c0, high + c0


def monotone_parts(cubic: Floats) -> tuple[Indices, Floats, Floats]:
    """Return the parts of pieces between critical points: piece, start and end (p,)."""
    n = cubic.shape[1]
    first, second = critical_points(cubic)
    edges = np.empty((n, 4))
    edges[:, 0], edges[:, 3] = -0.5, 0.5
    edges[:, 1], edges[:, 2] = first, second
    starts, ends = edges[:, :3].reshape(-1), edges[:, 1:].reshape(-1)
    kept = np.flatnonzero(ends > starts)
    return kept // 3, starts[kept], ends[kept]


def critical_points(cubic: Floats) -> tuple[Floats, Floats]:
    """Return the zeros (n,) of the derivative inside the piece, lesser first, 1/2 where there is none.

    a v^2 + 2 b v + c = 0 with a = 3 c3, b = c2, c = c1; q = -(b + sign(b) sqrt(b^2 - a c)) gives both zeros
    q / a and c / q without cancellation (Press et al. 2007, section 5.6).
    """
    a, b, c = 3 * cubic[3], cubic[2], cubic[1]
    # |c| > |2 b| / 2 + |a| / 4 means no zero on the piece: the common case.
    first = np.full(len(a), 0.5)
    second = first.copy()
    some = np.flatnonzero(np.abs(c) <= np.abs(b) + 0.25 * np.abs(a))
    if len(some) == 0:
        return first, second
    a, b, c = a[some], b[some], c[some]
    # Scaled so that no square over- or underflows.
    size = np.maximum(np.maximum(np.abs(a), np.abs(b)), np.abs(c))
    size[size == 0] = 1.0
    a, b, c = a / size, b / size, c / size
    discriminant = b * b - a * c
    q = -(b + np.copysign(np.sqrt(np.maximum(discriminant, 0.0)), b))
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        zeros = np.stack([q / a, c / q])
    inside = (discriminant > 0) & (np.abs(zeros) < 0.5)  # False for NaN
    zeros = np.where(inside, zeros, 0.5)
    first[some], second[some] = zeros.min(axis=0), zeros.max(axis=0)
    return first, second


def roots(cubic: Floats, low: Floats, high: Floats, target: Floats) -> Floats:
    """Return where monotone cubics (4, m) reach `target` between `low` and `high` (m,)."""
    c0, c1, c2, c3 = cubic
    c0 = c0 - target

    def value(u: Floats) -> Floats:
        return np.asarray(((c3 * u + c2) * u + c1) * u + c0)

    f_low, f_high = value(low), value(high)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        u = low + (high - low) * np.clip(np.nan_to_num(f_low / (f_low - f_high), nan=0.5), 0.0, 1.0)
        for _ in range(NEWTON_STEPS):
            u = u - value(u) / ((3 * c3 * u + 2 * c2) * u + c1)
            u = np.fmin(np.fmax(u, low), high)
    scale = np.abs(c0) + np.abs(c1) + np.abs(c2) + np.abs(c3)
    off = np.flatnonzero(~(np.abs(value(u)) <= 16 * ROUNDOFF * scale))
    if len(off):
        u[off] = _bisected(cubic[:, off], low[off], high[off], target[off])
    return u


def _bisected(cubic: Floats, low: Floats, high: Floats, target: Floats) -> Floats:
    """Return the same roots by bisection, for those that Newton's method did not reach."""
    rising = evaluate(cubic, high) >= evaluate(cubic, low)
    for _ in range(MOST_STEPS):
        middle = 0.5 * (low + high)
        if not ((middle > low) & (middle < high)).any():
            break
        above = (evaluate(cubic, middle) >= target) == rising
        low, high = np.where(above, low, middle), np.where(above, middle, high)
    return np.where(np.abs(evaluate(cubic, low) - target) < np.abs(evaluate(cubic, high) - target), low, high)
