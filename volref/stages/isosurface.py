r"""Stage: where rays first meet an isovalue.

R rays, n pieces of them (see `volref.records.Pieces`), front to back.

The field along a ray is continuous, so the ray starts on one side of the isovalue and meets it where its
cubics first reach the other side, or touch it.  Where the truth, which is off by at most w from the cubics,
can meet it, is known from two more levels: not before the cubics come within w of the isovalue, and surely
where they lie beyond it by w.

    value     \            w above the isovalue: not before here    earliest
               \
    isovalue ---\------    the hit                                  t
                 \
                  \        w below: not after here                   latest
"""

from dataclasses import dataclass

import numpy as np

from volref.arrays import Floats, Indices
from volref.cubics import evaluate, monotone_parts, roots, value_range
from volref.records import Pieces, first_of_each

ROUNDOFF = 2.0**-53


@dataclass(frozen=True, eq=False)
class Crossing:
    """Where rays (R,) first meet the isovalue, +inf where they do not.

    The truth is met no earlier than `earliest` (+inf: never), and no later than `latest` (+inf: perhaps
    never).
    """

    t: Floats
    earliest: Floats
    latest: Floats


def first_crossing(pieces: Pieces, middle: Floats, off: Floats, isovalue: float) -> Crossing:
    """Return where rays first meet `isovalue`; the pieces have t `middle` (n,) in their middles.

    The truth is off from the cubics by their slack and `off` (R,).  Pieces may be missing whose values all
    lie further from the isovalue.  A ray that starts above it meets it from above; one that starts at it
    meets it there.
    """
    count = len(off)
    found = Crossing(*(np.full(count, np.inf) for _ in range(3)))
    if len(pieces.ray) == 0:
        return found
    cubic = pieces.cubic.copy()
    cubic[0] -= isovalue
    size = np.abs(cubic).sum(axis=0)
    width = pieces.slack + off.take(pieces.ray) + 8 * ROUNDOFF * size
    first = first_of_each(pieces.ray)
    start = evaluate(cubic[:, first], np.full(len(first), -0.5))
    side = np.ones(count)
    side[pieces.ray.take(first)] = np.where(start < 0, -1.0, 1.0)
    cubic *= side.take(pieces.ray)
    near = np.flatnonzero(value_range(cubic)[0] <= width)
    levels = (width, np.zeros(len(width)), -width)
    for t, level in zip((found.earliest, found.t, found.latest), levels, strict=True):
        _meet(
            t,
            pieces.ray.take(near),
            cubic[:, near],
            middle.take(near),
            pieces.length.take(near),
            level.take(near),
        )
    # Where the ray starts within w of it, the true one may start on the other side.
    either = np.abs(start) <= width.take(first)
    found.latest[pieces.ray.take(first[either])] = np.inf
    # Constant at the isovalue: met where the ray surely is in that cell.
    flat = np.flatnonzero((size == 0) & (pieces.slack == 0) & (pieces.astray < 1))
    sure = middle.take(flat) + (pieces.astray.take(flat) - 0.5) * pieces.length.take(flat)
    np.minimum.at(found.latest, pieces.ray.take(flat), sure)
    return found


def _meet(t: Floats, ray: Indices, cubic: Floats, middle: Floats, length: Floats, level: Floats) -> None:
    """Set t (R,) to where cubics (4, n) that come from above first fall to their levels (n,), in place."""
    of, start, end = monotone_parts(cubic)
    cubic, level = cubic.take(of, axis=1), level.take(of)
    at_start, at_end = evaluate(cubic, start), evaluate(cubic, end)
    below = np.flatnonzero(np.minimum(at_start, at_end) <= level)
    hits = below.take(first_of_each(ray.take(of.take(below))))
    v = roots(cubic.take(hits, axis=1), start.take(hits), end.take(hits), level.take(hits))
    v = np.where(at_start.take(hits) <= level.take(hits), start.take(hits), v)
    piece = of.take(hits)
    t[ray.take(piece)] = middle.take(piece) + v * length.take(piece)


def crossing_of_samples(values: Floats, t: Floats, isovalue: float) -> Floats:
    """Return where values (S, R) at t (S, R), straight between them, first meet `isovalue`; +inf: nowhere.

    For volumes whose value is known at points only.  Nothing is met next to a sample that is NaN.

    Examples
    --------
    >>> t = np.array([[0.0], [1.0], [2.0]])
    >>> crossing_of_samples(np.array([[0.0], [1.0], [5.0]]), t, 3.0).tolist()
    [1.5]
    """
    above = values - isovalue
    meets = np.signbit(above[1:]) != np.signbit(above[:-1])
    meets |= above[1:] == 0
    meets &= ~(np.isnan(above[1:]) | np.isnan(above[:-1]))
    rays = np.arange(values.shape[1])
    first = meets.argmax(axis=0)
    before, after = above[first, rays], above[first + 1, rays]
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(before == after, 0.0, before / (before - after))
    met = t[first, rays] + share * (t[first + 1, rays] - t[first, rays])
    return np.where(above[0] == 0, t[0], np.where(meets.any(axis=0), met, np.inf))
