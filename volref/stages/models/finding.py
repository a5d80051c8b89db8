"""The models of a transfer function, and which row of them holds for a range of values."""

from dataclasses import dataclass

import numpy as np

from volref.arrays import Floats, Indices
from volref.stages.models.columns import C0, C1, C2, CENTER, COLOR_OFF, SIGMA0, SIGMA1, SIGMA_OFF

# The relative error of values that are sampled where a ray enters or leaves.
NEARBY = 1e-12

MOST_BUCKETS = 1 << 16


@dataclass(frozen=True, eq=False)
class Locator:
    """Finds the piece of a value: `below` counts the inner breaks below a bucket, `knot` is the one in it.

    Where buckets would be too many, `scale` is None and the inner breaks are searched.
    """

    low: float
    scale: float | None
    below: Indices
    knot: Floats
    inner: Floats


@dataclass(frozen=True, eq=False)
class Level:
    """Runs of groups of 2^shift pieces: row first + (length - 1) count + first group of the run."""

    shift: int
    first: int
    count: int
    longest: int


@dataclass(frozen=True, eq=False)
class Models:
    """Rows (COLUMNS, rows) of models, and how to find them.

    bends (m + 1,): the values between which the exact rows hold.  blur: how close knots were taken for one.
    most_sigma, most_jump, most_slope: the greatest finite extinction, jump and slope of it.  bent: whether
    any row's colour is. unit_distance is None where the extinction is interpolated.  largest (3,): the
    greatest colour.
    """

    rows: Floats
    locator: Locator
    levels: tuple[Level, ...]
    exact: int
    bends: Floats
    bend_locator: Locator
    blur: float
    most_sigma: float
    most_jump: float
    most_slope: float
    bent: bool
    opaque: bool
    unit_distance: float | None
    largest: Floats


def locator_of(breaks: Floats, low: float, high: float) -> Locator:
    """Return what finds the piece between `breaks` of values from `low` to `high`."""
    inner = breaks[1:-1]
    span = max(high - low, 1e-300)
    gap = float(np.diff(inner).min()) if len(inner) > 1 else span
    buckets = np.ceil(2 * span / gap) + 1 if gap > span / MOST_BUCKETS else 2 * MOST_BUCKETS
    width = span / buckets
    # A bucket of a few ulp could not tell its values apart.
    if buckets > MOST_BUCKETS or width < 16 * np.spacing(max(abs(low), abs(high))):
        return Locator(low, None, np.empty(0, np.intp), np.empty(0), inner)
    # One bucket more on each side takes the values that rounding put outside the bounds.
    edges = low + width * np.arange(-1, int(buckets) + 1)
    below = np.searchsorted(inner, edges - width / 4, side="right")
    knot = np.append(inner, np.inf)[below]
    return Locator(float(edges[0]), 1.0 / width, below, knot, inner)


def piece_of(locator: Locator, values: Floats) -> Indices:
    """Return how many inner breaks lie at or below each value (m,): the index of its piece."""
    if locator.scale is None:
        return np.searchsorted(locator.inner, values, side="right")
    bucket = ((values - locator.low) * locator.scale).astype(np.int32)
    piece = locator.below.take(bucket, mode="clip")
    return np.asarray(piece + (values >= locator.knot.take(bucket, mode="clip")))


def rows_of(models: Models, low: Floats, high: Floats) -> Indices:
    """Return the row that holds for values from `low` to `high`, (m,) each."""
    first, last = piece_of(models.locator, low), piece_of(models.locator, high)
    length = last - first
    level = models.levels[0]
    row = first + length * level.count
    long = np.flatnonzero(length >= level.longest)
    for coarser in models.levels[1:]:
        if len(long) == 0:
            break
        start = first[long] >> coarser.shift
        groups = (last[long] >> coarser.shift) - start
        row[long] = coarser.first + groups * coarser.count + start
        long = long[groups >= coarser.longest]
    return row


def look_up(models: Models, values: Floats) -> tuple[Floats, Floats, Floats]:
    """Return a bound on extinction, up to 1e200, colour (3, m) and its error, for values off by rounding."""
    slack = NEARBY * np.abs(values)
    row = rows_of(models, values - slack, values + slack)
    rows = models.rows
    offset = values - rows[CENTER].take(row)
    reach = np.abs(offset) + slack
    extinction = rows[SIGMA0].take(row) + np.abs(rows[SIGMA1].take(row)) * reach + rows[SIGMA_OFF].take(row)
    c1, c2 = rows[C1].take(row, axis=1), rows[C2].take(row, axis=1)
    color = rows[C0].take(row, axis=1) + (c1 + c2 * offset) * offset
    off = rows[COLOR_OFF].take(row) + (np.abs(c1) + 2 * np.abs(c2) * reach).max(axis=0) * slack
    return np.minimum(extinction, 1e200), color, off
