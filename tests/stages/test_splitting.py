"""Cutting pieces of rays: every law is checked in exact rational arithmetic.

n pieces with cubics (4, n) in v from -1/2 to 1/2.
"""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from volref.cubics import evaluate, value_range
from volref.records import Pieces
from volref.stages.splitting import (
    LEAST_PART,
    part,
    split_at_bends,
    split_evenly,
    split_geometrically,
)

U = Fraction(1, 2**53)
HALF = Fraction(1, 2)
VS = [Fraction(k, 8) - HALF for k in range(9)]

coefficient = st.one_of(
    st.just(0.0),
    st.floats(-4.0, 4.0, width=32),
    st.builds(lambda m, e: m * 10.0**e, st.floats(-1.0, 1.0, width=32), st.integers(-17, 3)),
)
few = settings(max_examples=30)  # fractions are slow


def from_roots(scale, *roots):
    """Coefficients, lowest first, of scale times the product of (v - root), rounded to float64."""
    cubic = [Fraction(scale)]
    for root in map(Fraction, roots):
        cubic = [a - root * b for a, b in zip([Fraction(0), *cubic], [*cubic, Fraction(0)], strict=True)]
    return [float(c) for c in cubic] + [0.0] * (4 - len(cubic))


SPECIAL = {
    "constant": [0.25, 0.0, 0.0, 0.0],
    "constant on a place": [0.5, 0.0, 0.0, 0.0],
    "straight": [0.5, 1.0, 0.0, 0.0],
    "falling": [0.5, -1.0, 0.0, 0.0],
    "hardly rising": [0.5, 1e-17, 0.0, 0.0],
    "a parabola that touches a place": [0.5, 0.0, 1.0, 0.0],
    "one that just misses it": [0.5 + 1e-16, 0.0, 1.0, 0.0],
    "one that just crosses it": [0.5 - 1e-16, 0.0, 1.0, 0.0],
    "a double root inside": [0.5, 0.0, 0.0, 0.0],
    "flat in the middle": [0.5, 0.0, 0.0, 8.0],
    "three crossings of one place": [0.5, -0.5, 0.0, 4.0],
    "critical points at the ends": [0.5, -3.0, 0.0, 4.0],
    "tiny third degree": [0.5, 1e-3, 0.3, 1e-18],
    "tiny throughout": [0.5, 3e-17, -2e-17, 5e-17],
    "far from 0": [1e8, 1.0, 0.5, -0.25],
    "underflowing squares": [0.5, 1e-200, 1e-200, -1e-200],
    "overflowing squares": [0.5, 1e200, -1e200, 1e200],
    "double root": from_roots(1.0, 0.21, 0.21, -0.4),
    "roots at both ends": from_roots(2.0, -0.5, 0.5, 0.1),
    "triple root": from_roots(8.0, 0.125, 0.125, 0.125),
}


@st.composite
def cubics(draw):
    """Some cubics (4, n), random and special ones; random ones about a place in half of the cases."""
    columns = draw(
        st.lists(
            st.one_of(
                st.tuples(*[coefficient] * 4).map(list),
                st.tuples(st.just(0.5), *[coefficient] * 3).map(list),
                st.sampled_from(list(SPECIAL.values())),
            ),
            min_size=1,
            max_size=4,
        )
    )
    return np.array(columns).T


def pieces_of(cubic, slack=0.0, astray=0.0):
    n = cubic.shape[1]
    full = [np.full(n, x) for x in (slack, astray)]
    return Pieces(np.arange(n), np.linspace(1.0, 2.0, n), cubic, *full, np.full(n, -1), np.zeros(n))


def exact(cubic, v):
    """The value of one cubic, exactly."""
    c0, c1, c2, c3 = (Fraction(float(c)) for c in cubic)
    return ((c3 * v + c2) * v + c1) * v + c0


def size(cubic):
    return sum(abs(Fraction(float(c))) for c in cubic[1:])


def rounding(cubic):
    """What evaluating in float64 may lose: half an ulp of the value and a few of what is added to it."""
    return U * abs(Fraction(float(cubic[0]))) + 8 * U * size(cubic)


# --- the range of values


@given(cubics())
def test_every_value_lies_in_the_range(cubic):
    low, high = value_range(cubic)
    for j, column in enumerate(cubic.T):
        slack = rounding(column)
        for v in VS:
            assert Fraction(low[j]) - slack <= exact(column, v) <= Fraction(high[j]) + slack


@given(cubics())
def test_the_range_is_at_most_five_times_as_wide_as_the_values(cubic):
    # The Bernstein coefficients of the Chebyshev polynomial of degree 3 are 1, -5, 5, -1: the worst there is.
    low, high = value_range(cubic)
    for j, column in enumerate(cubic.T):
        values = [exact(column, Fraction(k, 64) - HALF) for k in range(65)]
        width = max(values) - min(values)
        # Between 65 places a cubic may rise a little further: 2 / 64^2 of its second derivative at most.
        missed = size(column) / 256
        assert Fraction(high[j]) - Fraction(low[j]) <= 5 * (width + missed) + 2 * rounding(column)


def test_the_range_of_the_chebyshev_polynomial_is_five_times_as_wide():
    low, high = value_range(np.array([[0.0], [-6.0], [0.0], [32.0]]))  # T_3(2 v)
    assert (low[0], high[0]) == (-5.0, 5.0)


def test_the_range_of_a_straight_line_is_that_of_its_ends():
    low, high = value_range(np.array([[3.0, 3.0], [2.0, -2.0], [0.0, 0.0], [0.0, 0.0]]))
    assert (low.tolist(), high.tolist()) == ([2.0, 2.0], [4.0, 4.0])


def test_the_range_of_a_parabola_reaches_as_far_as_its_tangents_at_the_ends_meet():
    # v^2: 1/4 at both ends; the tangents meet at -1/4, a degree more gives -1/4 / 3.
    low, high = value_range(np.array([[0.0], [0.0], [1.0], [0.0]]))
    assert high[0] == 0.25
    assert low[0] == pytest.approx(-0.25 / 3, rel=1e-15)  # one division


# --- parts


@given(cubics(), st.floats(-0.5, 0.5), st.floats(-0.5, 0.5))
def test_a_part_has_the_values_of_the_whole(cubic, a, b):
    start, end = min(a, b), max(a, b)
    n = cubic.shape[1]
    found = part(cubic, np.full(n, start), np.full(n, end))
    for j, column in enumerate(cubic.T):
        for w in VS:
            v = Fraction(start) + (w + HALF) * (Fraction(end) - Fraction(start))
            off = abs(exact(found[:, j], w) - exact(column, v))
            assert off <= 2 * rounding(column)


def assert_same_values(parts, of, starts, ends, pieces):
    """The parts' cubics are those of their pieces, but for what their slack has grown by."""
    for j, piece in enumerate(of):
        grown = Fraction(parts.slack[j]) - Fraction(pieces.slack[piece])
        for w in VS:
            v = starts[j] + (w + HALF) * (ends[j] - starts[j])
            off = abs(exact(parts.cubic[:, j], w) - exact(pieces.cubic[:, piece], v))
            assert off <= grown, (j, float(off), float(grown))


@few
@given(cubics(), st.integers(1, 7))
def test_even_parts_have_the_values_of_the_whole_within_their_slack(cubic, count):
    pieces = pieces_of(cubic)
    counts = count + np.arange(cubic.shape[1])
    parts, of = split_evenly(pieces, counts)
    assert of.tolist() == np.repeat(np.arange(len(counts)), counts).tolist()
    assert parts.ray.tolist() == of.tolist()
    number = [Fraction(i) for k in counts for i in range(k)]
    starts = [i / Fraction(int(counts[p])) - HALF for i, p in zip(number, of, strict=True)]
    ends = [start + 1 / Fraction(int(counts[p])) for start, p in zip(starts, of, strict=True)]
    assert_same_values(parts, of, starts, ends, pieces)
    for piece, length in enumerate(pieces.length):
        # Each length is rounded twice.
        assert parts.length[of == piece].sum() == pytest.approx(length, rel=4e-16 * (2 + counts[piece]))


@given(cubics(), st.floats(1e-18, 1.5))
def test_geometric_parts_begin_with_the_first_and_at_most_double(cubic, first):
    pieces = pieces_of(cubic)
    parts, of = split_geometrically(pieces, np.full(cubic.shape[1], first))
    least = min(max(first, LEAST_PART), 1.0)
    for piece, length in enumerate(pieces.length):
        share = parts.length[of == piece] / length
        # Starts and ends are differences from -1/2: rounded to 2^-54.
        assert share[0] == pytest.approx(least, rel=1e-15, abs=2.0**-53)
        assert share.sum() == pytest.approx(1.0, rel=1e-14)
        in_front = np.cumsum(share)[:-1]
        assert (share[1:] <= in_front * (1 + 1e-12) + 2.0**-52).all()
        assert (share[1:-1] >= in_front[:-1] * (1 - 1e-12) - 2.0**-52).all()  # the last takes what is left


@few
@given(cubics(), st.floats(2.0**-10, 1.0, width=32))
def test_geometric_parts_have_the_values_of_the_whole_within_their_slack(cubic, first):
    pieces = pieces_of(cubic)
    parts, of = split_geometrically(pieces, np.full(cubic.shape[1], first))
    ends = [Fraction(0)] * len(of)
    for j, piece in enumerate(of):
        behind = j > 0 and of[j - 1] == piece
        ends[j] = min(ends[j - 1] * 2 if behind else Fraction(max(first, LEAST_PART)), Fraction(1))
    starts = [ends[j - 1] if j and of[j - 1] == of[j] else Fraction(0) for j in range(len(of))]
    assert_same_values(parts, of, [s - HALF for s in starts], [e - HALF for e in ends], pieces)


def test_what_is_astray_or_near_an_edge_may_lie_in_any_part():
    whole = pieces_of(np.array([[0.0], [1.0], [0.0], [0.0]]), astray=0.1)
    parts, _ = split_evenly(whole, np.array([4]))
    assert parts.astray.tolist() == [0.4] * 4
    parts, _ = split_evenly(whole, np.array([20]))
    assert parts.astray.tolist() == [1.0] * 20
    parts, _ = split_geometrically(whole, np.array([0.25]))
    assert parts.astray.tolist() == [0.4, 0.4, 0.2]


# --- at bends


def searched(places):
    return lambda values: np.searchsorted(places[1:-1], values, side="right")


@st.composite
def cases(draw):
    """Pieces and places to cut them at, all values between the outer ones."""
    cubic = draw(cubics())
    inner = draw(st.lists(st.one_of(st.just(0.5), st.floats(-2.0, 2.0)), max_size=4, unique=True))
    low, high = value_range(cubic)
    reach = 2 * max(abs(low).max(), abs(high).max(), 2.0)
    slack = draw(st.sampled_from([0.0, 1e-16, 1e-12, 2.0**-10]))
    return pieces_of(cubic, slack), np.array([-reach, *sorted(inner), reach])


def special_case(name, slack):
    cubic = np.array([SPECIAL[name]]).T
    reach = 2 * max(np.abs(value_range(cubic)).max(), 1.0)
    return pieces_of(cubic, slack), np.array([-reach, 0.25, 0.5, 0.75, reach])


def assert_cut_at_bends(pieces, places):
    parts, of = split_at_bends(pieces, places, searched(places), 100)
    assert (np.diff(of) >= 0).all()
    for j, piece in enumerate(of):
        row = parts.row[j] - 100
        low, high, slack = (Fraction(float(x)) for x in (places[row], places[row + 1], parts.slack[j]))
        assert parts.slack[j] >= pieces.slack[piece]
        assert parts.length[j] > 0
        for v in VS:
            value = exact(parts.cubic[:, j], v)
            assert low - slack <= value <= high + slack, (j, float(v))
    for piece, length in enumerate(pieces.length):
        mine = of == piece
        # Each part's length is rounded twice, to an ulp of the share.
        assert abs(parts.length[mine].sum() / length - 1) <= 2.0**-52 * (2 + mine.sum())
        start = Fraction(0)
        for j in np.flatnonzero(mine):
            end = start + Fraction(parts.length[j]) / Fraction(float(length))
            grown = Fraction(parts.slack[j]) - Fraction(pieces.slack[piece])
            # The place of a part is known from the lengths before it, to a few ulp of 1.
            steepest = size(pieces.cubic[:, piece]) * 3
            for w in VS[::4]:
                v = start - HALF + (w + HALF) * (end - start)
                off = abs(exact(parts.cubic[:, j], w) - exact(pieces.cubic[:, piece], v))
                assert off <= grown + steepest * 16 * U
            start = end
    return parts, of


@few
@given(cases())
def test_parts_lie_between_their_places_and_have_the_values_of_the_whole(case):
    assert_cut_at_bends(*case)


@pytest.mark.parametrize("slack", [0.0, 1e-15, 1e-4])
@pytest.mark.parametrize("name", SPECIAL)
def test_special_cubics_are_cut_at_bends(name, slack):
    pieces, places = special_case(name, slack)
    parts, _ = assert_cut_at_bends(pieces, places)
    assert_edges(parts, places)


def near_width(cubic, place, end, slack):
    """How much of a monotone piece from its end (-1/2 or 1/2) on is within slack of `place`, exactly."""

    def is_near(width):
        return abs(exact(cubic, end + width if end < 0 else end - width) - place) <= slack

    if not is_near(Fraction(0)):
        return Fraction(0)
    if is_near(Fraction(1)):
        return Fraction(1)
    low, high = Fraction(0), Fraction(1)
    for _ in range(40):
        middle = (low + high) / 2
        low, high = (middle, high) if is_near(middle) else (low, middle)
    return low


def assert_edges(parts, places):
    for j in range(len(parts.ray)):
        row = parts.row[j] - 100
        slack, cubic = Fraction(parts.slack[j]), parts.cubic[:, j]
        near = Fraction(0)
        for end in (-HALF, HALF):
            distance = {p: abs(exact(cubic, end) - Fraction(float(p))) for p in places[row : row + 2]}
            nearest = min(distance, key=distance.get)
            near += near_width(cubic, Fraction(float(nearest)), end, slack)
        # 40 halvings tell the width to 2^-40 of the piece.
        assert Fraction(parts.edge[j]) >= min(near, Fraction(1)) - Fraction(1, 2**39), (j, float(near))


@few
@given(cases())
def test_the_edge_is_all_of_a_part_that_is_within_slack_of_a_place(case):
    parts, _ = split_at_bends(*case, searched(case[1]), 100)
    assert_edges(parts, case[1])


@given(cases())
def test_the_edge_is_not_much_more_than_that(case):
    pieces, places = case
    parts, _ = split_at_bends(pieces, places, searched(places), 100)
    c0, c1, c2, c3 = np.abs(parts.cubic)
    least = c1 - c2 - 0.75 * c3
    steep = (least > 0) & (parts.edge < 1)
    # The search may add what rounding of the values makes unsure: some ulp of them.
    slack = parts.slack + 2.0**-48 * (c0 + c1 + c2 + c3)
    # Two ends, each within slack / d for the least slope d: a factor of 2 or that of 8 of the search more.
    assert (parts.edge[steep] <= 2 * 8 * slack[steep] / least[steep] + 2 * 8.0**-17).all()


def test_a_rising_line_is_cut_where_it_meets_the_places():
    line = pieces_of(np.array([[0.5], [1.0], [0.0], [0.0]]))  # from 0 to 1
    places = np.array([-9.0, 0.25, 0.5, 9.0])
    parts, of = split_at_bends(line, places, searched(places), 7)
    assert parts.row.tolist() == [7, 8, 9]
    assert of.tolist() == [0, 0, 0]
    assert parts.length.tolist() == [0.25, 0.25, 0.5]
    assert parts.cubic[0].tolist() == [0.125, 0.375, 0.75]
    assert parts.cubic[1].tolist() == [0.25, 0.25, 0.5]


def test_a_falling_line_meets_them_in_the_other_order():
    line = pieces_of(np.array([[0.5], [-1.0], [0.0], [0.0]]))
    places = np.array([-9.0, 0.25, 0.5, 9.0])
    parts, _ = split_at_bends(line, places, searched(places), 7)
    assert parts.row.tolist() == [9, 8, 7]
    assert parts.length.tolist() == [0.5, 0.25, 0.25]


def test_a_wave_crosses_one_place_three_times():
    wave = pieces_of(np.array([SPECIAL["three crossings of one place"]]).T)  # at 0 and +-sqrt(1/8)
    places = np.array([-9.0, 0.5, 9.0])
    parts, _ = split_at_bends(wave, places, searched(places), 0)
    rows = parts.row[np.append(True, parts.row[1:] != parts.row[:-1])]
    assert rows.tolist() == [0, 1, 0, 1]
    crossing = np.cumsum(parts.length)[np.flatnonzero(np.diff(parts.row))] - 0.5
    # Newton's method ends within a few ulp.
    assert crossing == pytest.approx([-(0.125**0.5), 0.0, 0.125**0.5], abs=1e-15)


@given(cubics())
def test_evaluation_is_within_its_rounding(cubic):
    for v in (-0.5, -0.3, 0.0, 0.49):
        values = evaluate(cubic, np.full(cubic.shape[1], v))
        for value, column in zip(values, cubic.T, strict=True):
            assert abs(Fraction(value) - exact(column, Fraction(v))) <= rounding(column)
