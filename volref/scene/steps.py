"""Sorted numbers that are searched without a search: an even grid says about where one lies.

The grid has cells so narrow that few numbers share one; those of the cell are compared one by one.
"""

from dataclasses import dataclass

import numpy as np

from volref.arrays import Floats, Indices

# Cells per number, and cells at most.
CELLS_EACH, MOST_CELLS = 16, 1 << 16

# With more numbers in one cell than this a search is as fast.
MOST_TURNS = 4


@dataclass(frozen=True, eq=False)
class Steps:
    """Sorted numbers (K,), ending in +inf, and of the cells of an even grid how many numbers come `before`.

    turns: how many numbers a cell has at most.
    """

    numbers: Floats
    low: float
    scale: float
    before: Indices
    turns: int

    def count_up_to(self, values: Floats) -> Indices:
        """Return how many of the numbers are at or below each of `values` (n,), which are finite.

        Examples
        --------
        >>> steps_of(np.array([0.5, 1.5, 1.5, 40.0])).count_up_to(np.array([-9.0, 0.5, 1.6, 99.0])).tolist()
        [0, 1, 3, 4]
        """
        if self.turns > MOST_TURNS:
            return np.searchsorted(self.numbers, values, side="right")
        count = self.before.take(_cells(values, self.low, self.scale, len(self.before)))
        for _ in range(self.turns):
            count += self.numbers.take(count) <= values
        return count


def steps_of(numbers: Floats) -> Steps:
    """Return sorted finite `numbers` (K,), K >= 1, laid out for searching."""
    low, width = float(numbers[0]), float(numbers[-1] - numbers[0])
    cells = min(CELLS_EACH * len(numbers), MOST_CELLS)
    scale = cells / width if width > cells * np.finfo(np.float64).tiny else 0.0
    # Numbers and values find their cells in the same way, so that rounding does them no harm.
    cell = _cells(numbers, low, scale, cells)
    before = np.searchsorted(cell, np.arange(cells), side="left")
    turns = int(np.bincount(cell).max())
    return Steps(np.append(numbers, np.inf), low, scale, before, turns)


def _cells(values: Floats, low: float, scale: float, count: int) -> Indices:
    place = values - low
    place *= scale
    np.clip(place, 0, count - 1, out=place)
    # float64 to int32 to int64 is faster than directly
    return place.astype(np.int32).astype(np.intp)
