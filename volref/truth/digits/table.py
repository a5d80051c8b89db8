"""The transfer function as intervals between its distinct knots, in mpmath numbers.

K distinct knots k make K + 1 intervals, counted from below:

    interval     0        1        2        3          0 and K hold the outer knots' numbers
             --------k0-------k1-------k2--------

Interval i begins at knot i - 1 and holds there, so a value on a knot belongs to the interval above it.
Within an interval colour and strength (extinction or opacity) are linear in the value.
"""

from bisect import bisect_left, bisect_right
from dataclasses import dataclass
from itertools import accumulate, pairwise
from typing import Any, TypeAlias

from volref.scene.transfer import TransferFunction

# An mpmath number or context; mpmath has no types.
Number: TypeAlias = Any
Context: TypeAlias = Any


@dataclass(frozen=True)
class Interval:
    """What the table says of values about `start`: strength and colour there, and their slopes.

    `clear` means a strength of 0 all over, `opaque` an opacity of 1 all over.
    """

    start: Number
    strength: Number
    strength_slope: Number
    color: tuple[Number, ...]
    color_slope: tuple[Number, ...]
    clear: bool
    opaque: bool

    def strength_at(self, value: Number) -> Number:
        """Return the strength at a value within the interval."""
        return self.strength + self.strength_slope * (value - self.start)

    def color_at(self, value: Number) -> tuple[Number, ...]:
        """Return the straight colour at a value within the interval."""
        away = value - self.start
        return tuple(c + slope * away for c, slope in zip(self.color, self.color_slope, strict=True))


@dataclass(frozen=True)
class Table:
    """A transfer function: distinct `knots` (K,), `intervals` (K + 1,).

    `unit_distance` is None where the strength is an extinction.  `seen_before[i]` counts the intervals
    below i that are not clear.
    """

    knots: tuple[float, ...]
    intervals: tuple[Interval, ...]
    unit_distance: Number | None
    seen_before: tuple[int, ...]

    def interval_of(self, value: object) -> int:
        """Return the interval to which a number of any kind belongs."""
        return bisect_right(self.knots, value)  # type: ignore[call-overload,no-any-return]

    def is_clear(self, low: float, high: float) -> bool:
        """Tell whether no value from `low` to `high` has a strength above 0, whatever holds at knots."""
        first, last = bisect_left(self.knots, low), bisect_right(self.knots, high)
        return self.seen_before[last + 1] == self.seen_before[first]


def exact_table(mp: Context, transfer: TransferFunction) -> Table:
    """Return the intervals of `transfer`; slopes are rounded to the context's precision, all else is exact.

    Examples
    --------
    >>> from mpmath import mp
    >>> table = exact_table(mp, TransferFunction([1, 2, 2], [(1, 1, 1)] * 3, [0.0, 4.0, 0.5]))
    >>> [float(table.intervals[i].strength) for i in range(3)], table.interval_of(2.0)
    ([0.0, 0.0, 0.5], 2)
    >>> float(table.intervals[1].strength_at(1.5)), table.is_clear(0.0, 0.5)
    (2.0, True)
    """
    strengths = transfer.opacity if transfer.extinction is None else transfer.extinction
    assert strengths is not None
    rows = [
        (value, (strength, *color))
        for value, strength, color in zip(
            transfer.values.tolist(), strengths.tolist(), transfer.colors.tolist(), strict=True
        )
    ]
    is_opacity = transfer.extinction is None
    intervals = [_interval(mp, rows[0], rows[0], is_opacity=is_opacity)]
    intervals += [
        _interval(mp, low, high, is_opacity=is_opacity) for low, high in pairwise(rows) if low[0] < high[0]
    ]
    intervals.append(_interval(mp, rows[-1], rows[-1], is_opacity=is_opacity))
    return Table(
        tuple(sorted({value for value, _ in rows})),
        tuple(intervals),
        mp.mpf(transfer.unit_distance) if is_opacity else None,
        tuple(accumulate((not interval.clear for interval in intervals), initial=0)),
    )


def _interval(
    mp: Context,
    low: tuple[float, tuple[float, ...]],
    high: tuple[float, tuple[float, ...]],
    *,
    is_opacity: bool,
) -> Interval:
    start, ends = mp.mpf(low[0]), list(zip(low[1], high[1], strict=True))
    gap = mp.mpf(high[0]) - start
    slopes = [(mp.mpf(b) - mp.mpf(a)) / gap if a != b else mp.zero for a, b in ends]
    numbers = [mp.mpf(a) for a, _ in ends]
    return Interval(
        start,
        numbers[0],
        slopes[0],
        tuple(numbers[1:]),
        tuple(slopes[1:]),
        clear=ends[0] == (0.0, 0.0),
        opaque=is_opacity and ends[0] == (1.0, 1.0),
    )
