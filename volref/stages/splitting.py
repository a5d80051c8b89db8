"""Stage 5 of the exact integrator: cutting pieces of rays into smaller ones.

n pieces; a cut at u of a piece lies at v = u, from -1/2 to 1/2.  Between cuts u0 < u1 the new piece has the
cubic about its own middle m = (u0 + u1) / 2 with h = u1 - u0:

    f(m + w h) = f(m) + h f'(m) w + h^2 f''(m) / 2 w^2 + h^3 f'''/6 w^3,    w from -1/2 to 1/2
"""

from collections.abc import Callable

import numpy as np

from volref.arrays import Floats, Indices
from volref.cubics import evaluate, monotone_parts, roots
from volref.records import Pieces

ROUNDOFF = 2.0**-53

# The least part that a piece is cut into: one that v can tell from none.
LEAST_PART = 2.0**-50

# Where the derivative is so small that more than this share of a piece may be near an end of its row, that
# share is found by evaluation.
LEAST_SHARE = 1e-9


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
    of, start, end = monotone_parts(pieces.cubic)
    cubic = pieces.cubic.take(of, axis=1)
    first, last = piece_of(evaluate(cubic, start)), piece_of(evaluate(cubic, end))
    counts = np.abs(last - first)
    part_of, number = _numbered(counts + 1)
    inner = number > 0
    rising: Indices = np.where(last > first, 1, -1).take(part_of)
    piece: Indices = first.take(part_of) + rising * number
    crossing: Indices = part_of[inner]
    crossed: Indices = (piece + (rising < 0))[inner]
    root = roots(cubic.take(crossing, axis=1), start.take(crossing), end.take(crossing), places.take(crossed))
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
