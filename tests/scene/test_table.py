"""Transfer functions as pieces, against the table evaluated in exact rational arithmetic."""

from bisect import bisect_right
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from volref import TransferFunction
from volref.scene.table import CLOSE, LEAST_BEND, STRENGTH, table_pieces, without_straight_breaks

U = Fraction(1, 2**53)
COLORS = [(0.2, 0.0, 1.0), (0.2, 0.4, 1.0), (1.0, 0.6, 0.1), (0.9, 0.9, 0.3), (0.1, 0.9, 0.3)]


def channels_at(transfer, value):
    """The four channels at `value`, exactly; at a jump those of the later knot."""
    knots = transfer.values.tolist()
    strength = transfer.opacity if transfer.extinction is None else transfer.extinction
    columns = *transfer.colors.T, strength
    k = bisect_right(knots, value)
    if k in (0, len(knots)):
        return [Fraction(column[0 if k == 0 else -1]) for column in columns]
    low, high = Fraction(knots[k - 1]), Fraction(knots[k])
    share = (value - low) / (high - low)
    return [Fraction(c[k - 1]) + share * (Fraction(c[k]) - Fraction(c[k - 1])) for c in columns]


def at(pieces, value):
    """The channels of the pieces at `value`, exactly, their greatest size on the piece, and its number."""
    j = int(np.searchsorted(pieces.breaks[1:-1], float(value), side="right"))
    a, b = Fraction(pieces.breaks[j]), Fraction(pieces.breaks[j + 1])
    left, right = ([Fraction(x) for x in side[:, j]] for side in (pieces.left, pieces.right))
    share = (value - a) / (b - a)
    line = [x + share * (y - x) for x, y in zip(left, right, strict=True)]
    return line, [max(abs(x), abs(y)) for x, y in zip(left, right, strict=True)], j


@st.composite
def tables(draw, *, extinction=None):
    """Tables of up to 12 knots about -1..2, some of them jumps, with plateaus and straight runs."""
    knots = sorted(draw(st.lists(st.integers(-64, 128), min_size=1, max_size=8, unique=True)))
    knots = sorted(knots + draw(st.lists(st.sampled_from(knots), max_size=3, unique=True)))
    values = np.array(knots) / 64.0 * draw(st.sampled_from([1.0, 1 / 3, 1e3]))
    number = st.one_of(st.just(0.0), st.just(1.0), st.integers(0, 999).map(lambda k: k / 999))
    colors = [[draw(number) for _ in range(3)] for _ in knots]
    strength = np.array([draw(number) for _ in knots])
    if draw(st.booleans()) if extinction is None else extinction:
        return TransferFunction(values, colors, strength * draw(st.sampled_from([1.0, 1e4, 1e-6])))
    return TransferFunction(values, colors, opacity=strength)


ranges = st.tuples(st.floats(-1.5, 2.5), st.floats(0.0, 2.0)).map(lambda x: (x[0], x[0] + x[1]))


@given(tables(), ranges, st.lists(st.floats(0.0, 1.0), min_size=1, max_size=8))
def test_pieces_are_the_table(transfer, bounds, shares):
    low, high = bounds
    pieces = table_pieces(transfer, low, high)
    assert pieces.blur == 0.0
    inside = [v for v in transfer.values if low <= v <= high]
    for value in [*inside, *np.nextafter(inside, -np.inf), *(low + (high - low) * np.array(shares))]:
        if not low <= value <= high:
            continue
        value = Fraction(float(value))
        found, size, _ = at(pieces, value)
        for a, b, most in zip(found, channels_at(transfer, value), size, strict=True):
            # Outer ends lie between two knots: three roundings there; all others are knots.
            assert abs(a - b) <= 4 * U * most


@given(tables(), ranges)
def test_breaks_rise_and_reach_beyond_the_range(transfer, bounds):
    pieces = table_pieces(transfer, *bounds)
    assert (np.diff(pieces.breaks) > 0).all()
    assert pieces.left.shape == pieces.right.shape == (4, len(pieces.breaks) - 1)
    assert pieces.breaks[0] < bounds[0]
    assert pieces.breaks[-1] > bounds[1]


def test_a_jump_has_both_of_its_sides():
    step = TransferFunction([0.5, 0.5], COLORS[:2], [1.0, 3.0])
    pieces = table_pieces(step, 0.0, 1.0)
    assert pieces.breaks.tolist() == [-1.0, 0.5, 2.0]
    assert pieces.left[STRENGTH].tolist() == pieces.right[STRENGTH].tolist() == [1.0, 3.0]
    assert pieces.left[:3, 1].tolist() == list(COLORS[1])


def test_beyond_the_outer_knots_they_hold():
    transfer = TransferFunction([0.0, 1.0], COLORS[:2], [1.0, 3.0])
    for bounds in ((5.0, 6.0), (-6.0, -5.0)):
        pieces = table_pieces(transfer, *bounds)
        end = 3.0 if bounds[0] > 0 else 1.0
        assert pieces.left[STRENGTH].tolist() == pieces.right[STRENGTH].tolist() == [end]


@pytest.mark.parametrize("size", [1e6, 1e12, 1e20])
@pytest.mark.parametrize("side", [-1, 1])
def test_a_far_knot_of_great_size_does_not_cancel(size, side):
    # The extinction falls by 1 per unit of value; the far knot is as large as it is far.
    values, extinction = ([-size, 1.0], [size + 1.0, 0.0]) if side < 0 else ([0.0, size], [0.0, size])
    transfer = TransferFunction(values, COLORS[:2], extinction)
    pieces = table_pieces(transfer, 0.25, 0.5)
    for value in (0.25, 0.375, 0.5):
        found = at(pieces, Fraction(value))[0][STRENGTH]
        exact = channels_at(transfer, Fraction(value))[STRENGTH]
        assert abs(found - exact) <= 8 * U * 2  # the piece reaches to where it is 2


# --- knots that lie close


def close_knots(*offsets, size=1.0):
    """Knots that many ulp above `size`, of strength rising with each, between two far ones."""
    ulp = np.spacing(size)
    values = [0.0, *(size + k * ulp for k in offsets), 4 * size]
    strength = [1.0, *(2.0 + i for i in range(len(offsets))), 1.0]
    colors = [COLORS[i % 5] for i in range(len(values))]
    return TransferFunction(values, colors, strength)


def test_close_knots_become_a_jump_that_remembers_what_it_hides():
    transfer = TransferFunction(
        [0.0, 1.0, 1.0 + 2.0**-52, 1.0 + 2.0**-51, 2.0], COLORS, [1.0, 1.0, 50.0, 0.5, 0.5]
    )
    pieces = table_pieces(transfer, 0.0, 2.0)
    assert pieces.blur == 2.0**-51
    where = pieces.breaks.tolist().index(1.0)
    assert pieces.right[STRENGTH, where - 1] == 1.0
    assert pieces.left[STRENGTH, where] == 0.5
    assert pieces.hidden[STRENGTH, where] == 50.0
    most, least = np.max(COLORS[1:4], axis=0), np.min(COLORS[1:4], axis=0)
    assert pieces.hidden[:3, where].tolist() == (most - least).tolist()
    assert np.delete(pieces.hidden, where, axis=1).max() == 0.0


def test_a_hidden_spike_is_no_straight_break():
    transfer = TransferFunction(
        [0.0, 1.0, 1.0 + 2.0**-52, 1.0 + 2.0**-51, 2.0], [COLORS[0]] * 5, [0, 0, 50.0, 0, 0]
    )
    straight, _ = without_straight_breaks(table_pieces(transfer, 0.0, 2.0))
    assert 1.0 in straight.breaks.tolist()
    assert straight.hidden[STRENGTH, straight.breaks.tolist().index(1.0)] == 50.0


@pytest.mark.parametrize("size", [1.0, 1e-200, 1e300])
def test_knots_are_close_within_2_to_the_minus_47_of_the_values(size):
    ulp = np.spacing(size) / size
    near, far = int(CLOSE / ulp * 0.99), int(CLOSE / ulp * 1.01) + 1
    assert table_pieces(close_knots(0, near, size=size), 0.0, size).blur > 0
    assert table_pieces(close_knots(0, far, size=size), 0.0, size).blur == 0


@given(st.lists(st.integers(0, 40), min_size=2, max_size=5, unique=True))
def test_away_from_close_knots_pieces_are_the_table_within_the_blur(offsets):
    transfer = close_knots(*sorted(offsets))
    pieces = table_pieces(transfer, 0.0, 4.0)
    blur = Fraction(pieces.blur)
    for value in (0.1, 0.9, 1.5, 3.9):
        found, size, j = at(pieces, Fraction(value))
        slopes = [
            abs(Fraction(b) - Fraction(a)) for a, b in zip(pieces.left[:, j], pieces.right[:, j], strict=True)
        ]
        width = Fraction(pieces.breaks[j + 1]) - Fraction(pieces.breaks[j])
        for a, b, most, slope in zip(
            found, channels_at(transfer, Fraction(value)), size, slopes, strict=True
        ):
            assert abs(a - b) <= slope / width * blur + 4 * U * most


# --- breaks without a bend


@given(tables(), ranges, st.lists(st.floats(0.0, 1.0), min_size=1, max_size=8))
def test_removing_straight_breaks_changes_no_more_than_it_says(transfer, bounds, shares):
    pieces = table_pieces(transfer, *bounds)
    straight, off = without_straight_breaks(pieces)
    assert set(straight.breaks.tolist()) <= set(pieces.breaks.tolist())
    for share in shares:
        value = Fraction(bounds[0]) + Fraction(share) * (Fraction(bounds[1]) - Fraction(bounds[0]))
        before, _, j = at(pieces, value)
        after, size, k = at(straight, value)
        seen = pieces.left[STRENGTH, j] > 0 or pieces.right[STRENGTH, j] > 0
        for channel in range(4):
            if seen or channel == STRENGTH:
                # The distance is measured in float64: some ulp of the ends.
                assert (
                    abs(before[channel] - after[channel]) <= Fraction(off[channel, k]) + 4 * U * size[channel]
                )


@given(tables(), ranges)
def test_no_more_than_2_to_the_minus_50_is_off(transfer, bounds):
    straight, off = without_straight_breaks(table_pieces(transfer, *bounds))
    size = np.maximum(straight.left, straight.right)
    if not (transfer.colors == 0).all():
        # Several breaks of a straight run may add theirs.
        assert (off[STRENGTH] <= 12 * LEAST_BEND * size[STRENGTH] + 1e-300).all()


def test_breaks_along_a_straight_line_are_removed():
    line = TransferFunction(np.arange(5), np.arange(5)[:, None] * [0.1, 0.2, 0.0], np.arange(5) * 0.25)
    straight, off = without_straight_breaks(table_pieces(line, 0.5, 3.5))
    assert straight.breaks.tolist() == [0.0, 4.0]
    assert off.max() <= 4 * float(U)  # 0.1 k is rounded


@pytest.mark.parametrize("channel", range(4))
def test_a_bend_in_any_channel_keeps_a_break(channel):
    table = np.ones((4, 3))
    table[channel, 1] += 1e-12
    bent = TransferFunction([0.0, 1.0, 2.0], table[:3].T, table[3])
    straight, _ = without_straight_breaks(table_pieces(bent, 0.0, 2.0))
    assert 1.0 in straight.breaks.tolist()


def test_a_bend_of_an_ulp_does_not():
    bent = TransferFunction([0.0, 1.0, 2.0], np.ones((3, 3)), [1.0, 1.0 + 2.0**-52, 1.0])
    straight, off = without_straight_breaks(table_pieces(bent, 0.25, 1.75))
    assert 1.0 not in straight.breaks.tolist()
    assert off[STRENGTH].tolist() == [2.0**-52]


def test_colours_of_what_cannot_be_seen_do_not_keep_a_break():
    transfer = TransferFunction([0.0, 1.0, 1.0, 2.0, 3.0], COLORS, [0.0, 0.0, 0.0, 0.0, 1.0])
    straight, _ = without_straight_breaks(table_pieces(transfer, 0.0, 3.0))
    assert 1.0 not in straight.breaks.tolist()
    assert 2.0 in straight.breaks.tolist()
