"""Stage 5 of the exact integrator: cutting pieces of rays into smaller ones.

n pieces; a cut at u of a piece lies at v = u, from -1/2 to 1/2.  Between cuts u0 < u1 the new piece has the
cubic about its own middle m = (u0 + u1) / 2 with h = u1 - u0:

    f(m + w h) = f(m) + h f'(m) w + h^2 f''(m) / 2 w^2 + h^3 f'''/6 w^3,    w from -1/2 to 1/2
"""

from collections.abc import Callable

import numpy as np

from volref.arrays import Floats, Indices
from volref.records import Pieces

ROUNDOFF = 2.0**-53

# Newton steps to a root from the start on the chord, before the roots that need more are bisected.
NEWTON_STEPS = 4
MOST_STEPS = 80

# The least part that a piece is cut into: one that v can tell from none.
LEAST_PART = 2.0**-50

# Where the derivative is so small that more than this share of a piece may be near an end of its row, that
# share is found by evaluation.
LEAST_SHARE = 1e-9


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


def evaluate(cubic: Floats, v: Floats) -> Floats:
    """Return the values of cubics (4, n) at v (n,)."""
    return np.asarray(((cubic[3] * v + cubic[2]) * v + cubic[1]) * v + cubic[0])


def part(cubic: Floats, start: Floats, end: Floats) -> Floats:
    """Return the cubics (4, n) of the parts from `start` to `end` of pieces, about their own middles."""
    m, h = 0.5 * (start + end), end - start
    c0, c1, c2, c3 = cubic
    out = np.empty_like(cubic)
    out[0] = ((c3 * m + c2) * m + c1) * m + c0
    out[1] = ((3 * c3 * m + 2 * c2) * m + c1) * h
    out[2] = (3 * c3 * m + c2) * (h * h)
    out[3] = c3 * (h * h * h)
    return out


def split_evenly(pieces: Pieces, counts: Indices) -> tuple[Pieces, Indices]:
    """Cut each piece into counts (n,) parts of equal length; return them, and which piece each comes from."""
    of, number = _numbered(counts)
    share = 1.0 / counts.take(of)
    return _parts(pieces, of, number * share - 0.5, (number + 1) * share - 0.5)


def split_geometrically(pieces: Pieces, first: Floats) -> tuple[Pieces, Indices]:
    """Cut each piece from its near end on: the `first` (n,) share of it, then the same, then twice, ..."""
    first = np.maximum(first, LEAST_PART)
    counts = np.where(first < 1, np.ceil(np.log2(1.0 / np.minimum(first, 1.0))), 0).astype(np.intp) + 1
    of, number = _numbered(counts)
    first = first.take(of)
    start = np.where(number == 0, 0.0, np.ldexp(first, number - 1))
    end = np.where(number + 1 == counts.take(of), 1.0, np.ldexp(first, number))
    return _parts(pieces, of, start - 0.5, end - 0.5)


def _numbered(counts: Indices) -> tuple[Indices, Indices]:
    """Return for each of the counts' units which count it belongs to, and its number within."""
    of = np.repeat(np.arange(len(counts)), counts)
    return of, np.arange(len(of)) - np.repeat(np.cumsum(counts) - counts, counts)


def _parts(pieces: Pieces, of: Indices, start: Floats, end: Floats) -> tuple[Pieces, Indices]:
    parent = pieces.cubic.take(of, axis=1)
    length = pieces.length.take(of) * (end - start)
    slack = pieces.slack.take(of) + _rounding_of_parts(parent)
    # What is astray, or near an end of the row, may lie in any one of them.
    astray, edge = (np.minimum(x.take(of) / (end - start), 1.0) for x in (pieces.astray, pieces.edge))
    row = pieces.row.take(of)
    return Pieces(pieces.ray.take(of), length, part(parent, start, end), slack, astray, row, edge), of


def _rounding_of_parts(cubic: Floats) -> Floats:
    """Return what cutting pieces rounds: their change 16 times, and their value twice unless constant."""
    change = np.abs(cubic[1]) + np.abs(cubic[2]) + np.abs(cubic[3])
    return np.asarray(ROUNDOFF * (16 * change + np.where(change > 0, 2 * np.abs(cubic[0]), 0.0)))


def split_at_bends(
    pieces: Pieces,
    places: Floats,
    piece_of: Callable[[Floats], Indices],
    first_row: int,
    *,
    jumps: bool = True,
) -> tuple[Pieces, Indices]:
    """Cut pieces where the value reaches one of `places`, so that each part lies between two of them.

    Returns the parts, and which piece each comes from.

    `piece_of` tells which two: piece j lies between places[j] and places[j + 1].  A part's row becomes
    `first_row` + j, and its slack grows by how far it reaches beyond them, which is rounding.  `jumps` asks
    for tight edges, which matter where what is seen jumps at a place.
    """
    of, start, end = _monotone_parts(pieces.cubic)
    cubic = pieces.cubic.take(of, axis=1)
    first, last = piece_of(evaluate(cubic, start)), piece_of(evaluate(cubic, end))
    counts = np.abs(last - first)
    part_of, number = _numbered(counts + 1)
    inner = number > 0
    rising: Indices = np.where(last > first, 1, -1).take(part_of)
    piece: Indices = first.take(part_of) + rising * number
    crossing: Indices = part_of[inner]
    crossed: Indices = (piece + (rising < 0))[inner]
    root = _roots(
        cubic.take(crossing, axis=1), start.take(crossing), end.take(crossing), places.take(crossed)
    )
    _in_order(root, crossing)
    starts, ends = start.take(part_of), end.take(part_of)
    starts[inner] = root
    ends[np.append(inner[1:], False)] = root
    kept = np.flatnonzero(ends > starts)
    part_of, piece = part_of.take(kept), piece.take(kept)
    starts, ends = starts.take(kept), ends.take(kept)
    cubic = cubic.take(part_of, axis=1)
    of = of.take(part_of)
    slack = pieces.slack.take(of) + _beyond(cubic, starts, ends, places, piece)
    astray = np.minimum(pieces.astray.take(of) / (ends - starts), 1.0)
    length = pieces.length.take(of) * (ends - starts)
    cubic = part(cubic, starts, ends)
    edge = _share_near(cubic, slack, places.take(piece), places.take(piece + 1), tight=jumps)
    return Pieces(pieces.ray.take(of), length, cubic, slack, astray, piece + first_row, edge), of


def _monotone_parts(cubic: Floats) -> tuple[Indices, Floats, Floats]:
    """Return the parts of pieces between critical points: piece, start and end (p,)."""
    n = cubic.shape[1]
    first, second = _critical_points(cubic)
    edges = np.empty((n, 4))
    edges[:, 0], edges[:, 3] = -0.5, 0.5
    edges[:, 1], edges[:, 2] = first, second
    starts, ends = edges[:, :3].reshape(-1), edges[:, 1:].reshape(-1)
    kept = np.flatnonzero(ends > starts)
    return kept // 3, starts[kept], ends[kept]


def _critical_points(cubic: Floats) -> tuple[Floats, Floats]:
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


def _roots(cubic: Floats, low: Floats, high: Floats, target: Floats) -> Floats:
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


def _in_order(roots: Floats, part_of: Indices) -> None:
    """Raise roots that rounding put before the one in front of them, in place."""
    same = part_of[1:] == part_of[:-1]
    while (back := np.flatnonzero(same & (roots[1:] < roots[:-1]))).size:
        roots[back + 1] = roots[back]


def _beyond(cubic: Floats, start: Floats, end: Floats, places: Floats, piece: Indices) -> Floats:
    """Return how far parts reach beyond their two places, with the rounding of cutting them (n,).

    The cubic is monotone on the part but for rounding, so its ends tell.
    """
    at_start, at_end = evaluate(cubic, start), evaluate(cubic, end)
    below = places.take(piece) - np.minimum(at_start, at_end)
    above = np.maximum(at_start, at_end) - places.take(piece + 1)
    return np.asarray(np.maximum(np.maximum(below, above), 0.0) + _rounding_of_parts(cubic))


def _share_near(cubic: Floats, slack: Floats, low: Floats, high: Floats, *, tight: bool) -> Floats:
    """Return the share of monotone pieces where the value is within `slack` of `low` or `high`, (n,).

    Where the derivative stays above d, that is at most 2 slack / d for either.  Elsewhere a monotone cubic
    that changes by D on the piece changes by D w^3 / 4 at least on a share w from an end, since its
    derivative is a square there at worst; or, if it is to be `tight`, the share is the first of some widths
    from an end beyond which the value is further away.
    """
    slack = slack + _rounding_of_parts(cubic)  # of comparing
    least = np.abs(cubic[1]) - np.abs(cubic[2]) - 0.75 * np.abs(cubic[3])
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        share = np.minimum(4 * slack / least, 1.0)
    flat = np.flatnonzero(~((least > 0) & (share < LEAST_SHARE)))
    if len(flat):
        if tight:
            share[flat] = _width_near(cubic[:, flat], slack[flat], low[flat], high[flat])
        else:
            change = np.abs(cubic[1, flat] + 0.25 * cubic[3, flat])
            with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
                share[flat] = np.fmin(2 * np.cbrt(4 * slack[flat] / change), 1.0)
    return np.asarray(share)


def _width_near(cubic: Floats, slack: Floats, low: Floats, high: Floats) -> Floats:
    width = np.zeros(len(slack))
    for end in (-0.5, 0.5):
        found = np.ones(len(slack))
        start = evaluate(cubic, np.full(len(slack), end))
        for trial in 8.0 ** -np.arange(18):
            value = evaluate(cubic, np.full(len(slack), end - np.copysign(trial, end)))
            # The value leaves one place and may approach the other, which the other end answers for.
            place = np.where(np.abs(start - low) < np.abs(start - high), low, high)
            away = np.abs(value - place) > slack
            found = np.where(away, trial, found)
        width += np.where(np.minimum(np.abs(start - low), np.abs(start - high)) > slack, 0.0, found)
    return np.minimum(width, 1.0)
