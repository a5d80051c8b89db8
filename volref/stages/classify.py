"""Stage 4: from the value of the field to colour and opacity.

n samples; values, opacities and lengths are (n,), colours (3, n).

A transfer function is piecewise linear.  To find the piece of a value without a search, its range is cut
into equal buckets, so narrow that none holds more than one knot; a bucket then has two pieces, below and
from its knot on:

    knots         |    |              |    |         each bucket: at most one |
    buckets    [    ][    ][    ][    ][    ]
    entries     0 1   2 3   4 5   6 7   8 9          entry = 2 bucket + (value >= knot)
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from volref.arrays import Booleans, Floats, Indices
from volref.scene.transfer import TransferFunction
from volref.workspace import Workspace

# Two buckets per narrowest gap up to this many; a narrower gap is searched for instead.
MOST_BUCKETS = 1 << 16


@dataclass(frozen=True, eq=False)
class Table:
    """A transfer function laid out for lookup, for values in a known range.

    Entry e stands for one linear piece: channel c is `base[c][e] + slope[c][e] (value - start[e])`.  The
    channels are the colours that were asked for and, as the last, extinction or opacity (`interpolation`).
    `knots` holds the knot of each bucket, or, where buckets would be too many (`scale` is None), all distinct
    knots; None: buckets begin at knots, and each has one entry.
    """

    interpolation: str
    unit_distance: float
    low: float
    scale: float | None
    knots: Floats | None
    start: Floats
    base: Floats
    slope: Floats


def lookup_table(
    transfer: TransferFunction,
    value_bounds: tuple[float, float],
    *,
    colors: Sequence[int] = (0, 1, 2),
    dtype: np.typing.DTypeLike = np.float64,
) -> Table:
    """Return the table of `transfer` for values within `value_bounds`, whose ends may be off by rounding.

    `colors` are the channels to look up, 0 to 2 for red, green and blue; values and results are in `dtype`.
    """
    strength = transfer.opacity if transfer.extinction is None else transfer.extinction
    channels = np.concatenate([transfer.colors.T[list(colors)], np.asarray(strength)[None]])
    knots, start, base, slope = _pieces(transfer.values, channels)
    low, high = value_bounds
    narrow = np.dtype(dtype)

    def table(low: float, scale: float | None, knots: Floats | None, entry: Indices | slice) -> Table:
        # The channels at a start that was rounded are those at the rounded start.
        rounded = start[entry].astype(narrow)
        shifted = base[:, entry] + slope[:, entry] * (rounded - start[entry])
        return Table(
            transfer.interpolation,
            transfer.unit_distance,
            low,
            scale,
            None if knots is None else knots.astype(narrow),
            rounded,
            shifted.astype(narrow),
            slope[:, entry].astype(narrow),
        )

    # The nearest two knots on each side of the range count too: they may share a bucket with each other.
    near = knots[max(np.searchsorted(knots, low) - 2, 0) : np.searchsorted(knots, high, side="right") + 2]
    gap = float(np.diff(near).min()) if len(near) > 1 else max(high - low, 1.0)
    ulp = float(np.finfo(narrow).eps) * max(abs(low), abs(high), 1e-300)
    even = _even_buckets(near, low, high, gap, ulp) if len(knots) == len(transfer.values) else None
    if even is not None:
        begins, length = even
        return table(begins[0], 1.0 / length, None, np.searchsorted(knots, begins + length / 2, side="right"))
    buckets = int(min(np.ceil(2 * (high - low) / gap) + 1, MOST_BUCKETS + 1))
    width = (high - low) / buckets if high > low else gap / 2
    # A bucket of a few ulp, or one with no finite inverse, could not tell its values apart.
    if buckets > MOST_BUCKETS or width < max(16 * ulp, 1e-300):
        return table(low, None, knots, slice(None))
    # One bucket more on each side takes the values that rounding put outside the bounds.
    edges = low + width * np.arange(-1, buckets + 2)
    below = np.searchsorted(knots, edges[:-1] - width / 4, side="right")
    has_knot = below < len(knots)
    knot = np.where(has_knot, knots[np.minimum(below, len(knots) - 1)], np.inf)
    knot = np.where(knot <= edges[1:] + width / 4, knot, np.inf)
    entry = np.stack([below, np.where(np.isfinite(knot), below + 1, below)], axis=1).ravel()
    return table(edges[0], 1.0 / width, knot, entry)


def _even_buckets(
    near: Floats, low: float, high: float, gap: float, ulp: float
) -> tuple[Floats, float] | None:
    """Return where buckets from below `low` to beyond `high` begin, and their width, if each knot begins one.

    None if the knots `near` do not lie on a grid as wide as the narrowest gap or an eighth of it.  The grid
    begins some ulp early, so that a knot is never found in the bucket below it: there it would not be exact.
    """
    early = 8 * ulp
    for parts in range(1, 9):
        width = gap / parts
        if (high - low) / width > MOST_BUCKETS or width < 64 * early:
            return None
        place = (near - near[0]) / width
        if np.abs(place - np.rint(place)).max() * width <= ulp:
            first = np.floor((low - near[0]) / width) - 1
            count = int(np.ceil((high - near[0]) / width) - first) + 2
            return near[0] - early + width * (first + np.arange(count)), width
    return None


def _pieces(values: Floats, channels: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Return the distinct knots (K,) and start, base, slope of the K + 1 pieces between and beyond them."""
    knots, first = np.unique(values, return_index=True)
    last = np.append(first[1:], len(values)) - 1  # at a jump the later knot holds from the value on
    at_knot = channels[:, last]
    before_next = channels[:, np.append(first[1:], len(values) - 1)]
    gap = np.append(np.diff(knots), 1.0)
    with np.errstate(over="ignore"):
        slope = (before_next - at_knot) / gap
    slope[~np.isfinite(slope)] = 0.0  # knots so close that they are a jump
    slope[:, -1] = 0.0
    start = np.concatenate([knots[:1], knots])
    base = np.concatenate([channels[:, :1], at_knot], axis=1)
    slope = np.concatenate([np.zeros((len(channels), 1)), slope], axis=1)
    return knots, start, base, slope


def classify(table: Table, values: Floats, work: Workspace) -> tuple[Floats, Floats]:
    """Return the straight colours (c, n) that the table holds, and the extinction or opacity (n,), of values.

    At a knot they are the knot's own numbers, exactly.  Between knots the strength may be rounded past
    theirs, so it is held to at least 0, and an opacity to at most 1, beyond which it has no logarithm.  The
    result lies in `work` until the next call.
    """
    n, dtype = len(values), values.dtype
    entry = _entries(table, values, work)
    offset = work.get("offset", n, dtype)
    np.take(table.start, entry, out=offset, mode="wrap")
    np.subtract(values, offset, out=offset)
    result: Floats = work.get("classified", len(table.base) * n, dtype).reshape(-1, n)
    at_start = work.get("at start", n, dtype)
    for base, slope, out in zip(table.base, table.slope, result, strict=True):
        np.take(slope, entry, out=out, mode="wrap")
        np.multiply(out, offset, out=out)
        np.take(base, entry, out=at_start, mode="wrap")
        np.add(out, at_start, out=out)
    np.maximum(result[-1], dtype.type(0), out=result[-1])
    if table.interpolation == "opacity":
        np.minimum(result[-1], dtype.type(1), out=result[-1])
    return result[:-1], result[-1]


def _entries(table: Table, values: Floats, work: Workspace) -> Indices:
    if table.scale is None:
        assert table.knots is not None
        return np.searchsorted(table.knots, values, side="right")
    n = len(values)
    place = work.get("place", n, values.dtype)
    np.subtract(values, values.dtype.type(table.low), out=place)
    np.multiply(place, values.dtype.type(table.scale), out=place)
    entry: Indices = work.get("entry", n, np.intp)
    narrow = work.get("narrow entry", n, np.int32)  # float64 to int32 to int64 is faster than directly
    np.copyto(narrow, place, casting="unsafe")
    np.copyto(entry, narrow)
    if table.knots is None:
        return entry
    np.take(table.knots, entry, out=place, mode="wrap")
    from_knot: Booleans = work.get("from knot", n, np.bool_)
    np.greater_equal(values, place, out=from_knot)
    np.add(entry, entry, out=entry)
    np.add(entry, from_knot, out=entry)
    return entry


class Strength(Protocol):
    """What says how strength is meant: a `Table`, a transfer function, or a field."""

    @property
    def interpolation(self) -> str:
        """It is an "extinction" per world unit or an "opacity" per unit distance."""

    @property
    def unit_distance(self) -> float:
        """The world length for which an opacity is meant."""


def segment_opacity(table: Strength, strength: Floats, length: float | Floats) -> Floats:
    """Overwrite `strength`, the extinction or opacity of samples, with the opacity of their segments.

    The extinction of a segment of `length` l is taken as constant: opacity = 1 - e^(-extinction l) from
    extinction, and 1 - (1 - opacity)^(l / unit_distance) from the opacity of a unit distance.  Both are
    evaluated as -expm1(...), which keeps faint opacities exact (1 - e^-x has lost all digits at 1e-17);
    an opacity of 1 stays 1.  Half the unit distance, the usual step, needs only a root:
    1 - sqrt(1 - a) = a / (1 + sqrt(1 - a)).
    """
    if table.interpolation == "opacity":
        ratio = np.asarray(length) / table.unit_distance
        if ratio.ndim == 0 and ratio == 1.0:
            return strength
        if ratio.ndim == 0 and ratio == 0.5:
            root: Floats = np.sqrt(1 - strength)
            return np.divide(strength, 1 + root, out=strength)
        np.multiply(strength, -1, out=strength)
        with np.errstate(divide="ignore"):
            np.log1p(strength, out=strength)
        np.multiply(strength, np.negative(ratio, dtype=strength.dtype), out=strength)
    else:
        np.multiply(strength, length, out=strength)
    return opacity_of_depth(strength)


def opacity_of_depth(depth: Floats) -> Floats:
    """Overwrite optical depths with their opacities 1 - e^-depth, and return them.

    In float64 as -expm1(-depth).  In float32 as 2 t / (1 + t) with t = tanh(depth / 2), which is the same, as
    exact for faint ones, and three times as fast in NumPy.

    Examples
    --------
    >>> opacity_of_depth(np.array([1e-300, np.inf])).tolist()
    [1e-300, 1.0]
    """
    if depth.dtype == np.float32:
        np.multiply(depth, np.float32(0.5), out=depth)
        np.tanh(depth, out=depth)
        np.divide(depth, depth + 1, out=depth)
        return np.add(depth, depth, out=depth)
    # Not np.negative: on a view whose stride is 64 bytes NumPy 2.4.6 computes it wrongly in place.
    np.multiply(depth, -1, out=depth)
    np.expm1(depth, out=depth)
    return np.multiply(depth, -1, out=depth)
