"""Stage: the greatest, the least and the mean value along rays.

R rays, n pieces of them (see `volref.records.Pieces`), S samples of each ray.

Within one cell the trilinear field is a cubic along a ray.  Its extremes lie at the ends of the piece or
where its derivative is 0, and its mean over v from -1/2 to 1/2 is c0 + c2 / 12: both in closed form.

The truth may be off from the cubics by each piece's slack, and, near the ends of pieces, where the ray may
already be in the next cell, by `off` (R,).
"""

from dataclasses import dataclass

import numpy as np

from volref.arrays import Floats, Indices
from volref.cubics import critical_points, evaluate
from volref.records import Pieces, first_of_each

ROUNDOFF = 2.0**-53

# Roundings of a cubic's value, and of what a critical point that is off by rounding takes off it, of at most
# the sizes of its changing coefficients each.
EVALUATION = 24


@dataclass(frozen=True, eq=False)
class Estimates:
    """Values (R,), and between which the truth lies."""

    value: Floats
    least: Floats
    most: Floats

    def negative(self) -> "Estimates":
        """Return what is known of the negative values."""
        return Estimates(-self.value, -self.most, -self.least)

    def within(self, low: float, high: float) -> "Estimates":
        """Return what is known if all values lie from `low` to `high`."""
        return Estimates(*(np.clip(x, low, high) for x in (self.value, self.least, self.most)))


def greatest_of(cubic: Floats) -> tuple[Floats, Floats]:
    """Return the greatest value (n,) of cubics (4, n) on their pieces, and the v (n,) where it is.

    Examples
    --------
    v - v^2 is greatest at its far end, v - 4 v^2 at 1/8:

    >>> most, v = greatest_of(np.array([[0.0, 0.0], [1.0, 1.0], [-1.0, -4.0], [0.0, 0.0]]))
    >>> most.tolist(), v.tolist()
    ([0.25, 0.0625], [0.5, 0.125])
    """
    at = np.full(cubic.shape[1], -0.5)
    most = evaluate(cubic, at)
    for v in (np.full(cubic.shape[1], 0.5), *critical_points(cubic)):
        value = evaluate(cubic, v)
        at = np.where(value > most, v, at)
        np.maximum(most, value, out=most)
    return most, at


def greatest_along(pieces: Pieces, here: Floats, sharp: Floats, off: Floats, known: Floats) -> Estimates:
    """Return the greatest value along rays, of pieces whose cubics are greatest at `here` (n,).

    sharp (n,): the same with less rounding.  Some values `known` (R,), off by `off` at most, are on the rays;
    pieces that cannot exceed those may be missing, and they stand for a ray without any.

    Where a ray surely is in the cell but for the share `astray` of its piece, its greatest value is at least
    that of the cubic less what the cubic can change there; else less `off`.
    """
    ray, cubic = pieces.ray, pieces.cubic
    slack = slack_of_extremes(pieces)
    change = np.abs(cubic[1]) + np.abs(cubic[2]) + 0.75 * np.abs(cubic[3])
    edge = np.where(pieces.astray < 1, np.minimum(pieces.astray * change, off.take(ray)), off.take(ray))
    value, least, most = known.copy(), known - off, known.copy()
    value[ray] = -np.inf
    for result, found in ((value, sharp), (least, here - slack - edge), (most, here + slack)):
        _raise_each(result, ray, found)
    return Estimates(value, least, most + off)


def slack_of_extremes(pieces: Pieces) -> Floats:
    """Return how far the greatest values of pieces' cubics may be off (n,): slack, and evaluation."""
    change = np.abs(pieces.cubic[1:]).sum(axis=0)
    size = EVALUATION * change + np.where(change > 0, 2 * np.abs(pieces.cubic[0]), 0.0)
    return np.asarray(pieces.slack + ROUNDOFF * size)


def near_greatest(pieces: Pieces, here: Floats, off: Floats) -> Indices:
    """Return the pieces that change at all, and whose greatest values `here` (n,) may be their ray's."""
    slack = slack_of_extremes(pieces) + off.take(pieces.ray)
    least = np.full(len(off), -np.inf)
    _raise_each(least, pieces.ray, here - slack)
    changes = pieces.cubic[1:].any(axis=0)
    return np.flatnonzero(changes & (here + slack >= least.take(pieces.ray)))


def _raise_each(most: Floats, ray: Indices, values: Floats) -> None:
    """Raise most (R,) to the greatest of the values (n,) of each ray, in place."""
    first = first_of_each(ray)
    rays = ray.take(first)
    if len(first):
        most[rays] = np.maximum(most[rays], np.maximum.reduceat(values, first))


def mean_along(pieces: Pieces, off: Floats) -> Estimates:
    """Return the mean value along rays whose pieces are all there; 0, off by infinity, where there are none.

    It is taken of the differences from the first piece's middle, so that rounding is of the size of these.
    """
    count = len(off)
    first = first_of_each(pieces.ray)
    level = np.zeros(count)
    level[pieces.ray.take(first)] = pieces.cubic[0].take(first)
    difference = pieces.cubic[0] - level.take(pieces.ray) + pieces.cubic[2] / 12

    def summed(values: Floats) -> Floats:
        return np.asarray(np.bincount(pieces.ray, pieces.length * values, count), dtype=np.float64)

    length = np.bincount(pieces.ray, pieces.length, count)
    size, number = summed(np.abs(difference)), np.bincount(pieces.ray, minlength=count)
    change = np.abs(pieces.cubic[1:]).sum(axis=0)
    slack = summed(pieces.slack + ROUNDOFF * np.where(change > 0, np.abs(pieces.cubic[0]), 0.0))
    with np.errstate(invalid="ignore", divide="ignore"):
        value = level + np.where(length > 0, summed(difference) / length, 0.0)
        error = (slack + ROUNDOFF * (2 * number + 8) * size) / length
    error += off + np.where(size > 0, 2 * ROUNDOFF * np.abs(value), 0.0)
    error = np.where(length > 0, error, np.inf)
    return Estimates(value, value - error, value + error)


def reduced_samples(mode: str, values: Floats, lengths: Floats) -> Floats:
    """Return the value (R,) that samples (S, R) of segments of `lengths` (S, R) reduce to in `mode`.

    For volumes whose value is known at points only: "mip", "minip" or "average".  Segments without a length
    do not count; a ray without any has NaN.

    Examples
    --------
    >>> values, lengths = np.array([[1.0], [5.0], [9.0]]), np.array([[3.0], [1.0], [0.0]])
    >>> [reduced_samples(mode, values, lengths).item() for mode in ("mip", "minip", "average")]
    [5.0, 1.0, 2.0]
    """
    inside = lengths > 0
    total = lengths.sum(axis=0)
    if mode == "average":
        result = np.divide(
            (values * lengths).sum(axis=0), total, out=np.full(len(total), np.nan), where=total > 0
        )
        return np.asarray(result)
    sign = 1.0 if mode == "mip" else -1.0
    most = np.where(inside, sign * values, -np.inf).max(axis=0)
    return np.asarray(np.where(total > 0, sign * most, np.nan))
