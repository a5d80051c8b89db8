from bisect import bisect_right

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mpmath import mp, mpf

from volref.scene import TransferFunction
from volref.truth.digits.table import exact_table

COLORS = [(0.2, 0.0, 1.0), (0.2, 0.4, 1.0), (1.0, 0.6, 0.1), (0.9, 0.9, 0.3)]


def test_between_knots_the_table_is_linear_and_beyond_them_constant():
    table = exact_table(mp, TransferFunction([1, 2, 4], COLORS[:3], [0.5, 1.5, 0.5]))
    for value, strength, red in ((0, 0.5, 0.2), (1.5, 1.0, 0.2), (3, 1.0, 0.6), (9, 0.5, 1.0)):
        interval = table.intervals[table.interval_of(value)]
        assert float(interval.strength_at(mpf(value))) == strength
        assert float(interval.color_at(mpf(value))[0]) == pytest.approx(red, rel=0, abs=2e-16)  # an ulp of 1


def test_a_jump_belongs_to_the_interval_above():
    table = exact_table(mp, TransferFunction([1, 1], COLORS[:2], [0.5, 2.0]))
    assert len(table.intervals) == 2
    assert [table.intervals[table.interval_of(v)].strength for v in (np.nextafter(1, 0), 1.0)] == [0.5, 2.0]


def test_clear_and_opaque_intervals_are_known():
    table = exact_table(mp, TransferFunction([0, 1, 2, 3], COLORS, opacity=[0, 0, 1, 1]))
    assert [interval.clear for interval in table.intervals] == [True, True, False, False, False]
    assert [interval.opaque for interval in table.intervals] == [False, False, False, True, True]
    dense = exact_table(mp, TransferFunction([0, 1], COLORS[:2], [1.0, 1.0]))
    assert not any(interval.opaque for interval in dense.intervals)  # an extinction of 1 is not opaque


knots = st.lists(st.tuples(st.integers(0, 6), st.sampled_from([0.0, 0.5])), min_size=1, max_size=6)


@given(knots, st.floats(-1, 7), st.floats(0, 3))
def test_a_range_is_clear_only_if_nothing_in_it_is_seen(rows, low, width):
    rows = sorted(rows, key=lambda row: row[0])
    rows = [row for i, row in enumerate(rows) if i < 2 or rows[i - 2][0] != row[0]]
    values, strengths = zip(*rows, strict=True)
    table = exact_table(mp, TransferFunction(values, [(1, 1, 1)] * len(rows), strengths))

    def strength(value):
        i = bisect_right(values, value)
        if i in (0, len(values)):
            return strengths[0 if i == 0 else -1]
        return np.interp(value, values[i - 1 : i + 1], strengths[i - 1 : i + 1])

    ends = [low, low + width, *(v for v in values if low <= v <= low + width)]
    places = {(1 - f) * a + f * b for a in ends for b in ends for f in (0, 1e-9, 0.5)}
    if table.is_clear(low, low + width):
        assert not any(strength(place) for place in places)
    elif width > 0 and not any(v in (low, low + width) for v in values):
        assert any(strength(place) for place in places)  # knots at the very ends are taken for seen
