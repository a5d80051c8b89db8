from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st
from mpmath import mp, mpf

from volref.truth.digits.pieces import evaluate, meeting, monotone_pieces, turning_points

coefficient = st.floats(-2, 2) | st.sampled_from([0.0, 1e-30, 1e-300, 1.0])
KNOTS = tuple(k / 4 for k in range(-36, 37))  # beyond all values: at most 8 in size
ROUNDING = mpf(10) ** -55  # of cubics with coefficients up to 2, at 60 digits


@pytest.fixture(autouse=True)
def _sixty_digits():
    with mp.workdps(60):
        yield


@given(st.tuples(coefficient, coefficient, coefficient, coefficient).filter(lambda c: any(c[1:])))
def test_pieces_are_monotone_fill_the_cell_and_keep_to_their_interval(numbers):
    with mp.workdps(60):
        cubic = [mpf(c) for c in numbers]
        end = mpf(0)
        for start, stop, interval in monotone_pieces(mp, cubic, KNOTS):
            assert start == end < stop
            end = stop
            values = [evaluate(cubic, start + (stop - start) * k / 8) for k in range(9)]
            rises = values[-1] > values[0]
            assert all((b > a) == rises or abs(b - a) <= ROUNDING for a, b in pairwise(values))
            assert all(mpf(KNOTS[interval - 1]) - ROUNDING <= v for v in values)
            assert all(v <= mpf(KNOTS[interval]) + ROUNDING for v in values)
        assert end == 1


@pytest.mark.parametrize(
    ("cubic", "expected"),
    [
        ((0, 1, 0, 0), []),
        ((0, 1, -1, 0), [0.5]),
        ((0, 1, -1, 1e-90), [0.5]),  # the other one is at 1e90
        ((0, 9, -18, 12), [0.5]),  # a saddle: both at 1/2
        ((0, -0.1875, 0.9375, -1), [0.125, 0.5]),  # -3 (u - 1/8) (u - 1/2)
        ((0, 0, 1, 0), []),  # at the end of the cell
    ],
)
def test_turning_points_are_where_the_derivative_is_0(cubic, expected):
    found = turning_points(mp, [mpf(c) for c in cubic])
    assert [float(u) for u in found] == pytest.approx(expected, rel=0, abs=1e-15)  # float64 of `expected`


@given(st.integers(1, 7), st.floats(0.01, 0.99), st.floats(-1, 1))
def test_a_knot_is_met_to_the_last_digits(power, place, bend):
    # A rising cubic through 0 at `place`, flat there to 10^-power.
    with mp.workdps(60):
        u = mpf(place)
        steep = mpf(10) ** -power
        # (v - u) (steep + (v - u)^2 + small): its derivative is positive.
        cubic = [-u * (steep + u * u), steep + 3 * u * u, -3 * u, mpf(1)]
        found = meeting(mp, [cubic[0] + bend, *cubic[1:]], mpf(bend), mpf(0), mpf(1))
        # An error e of the value moves the root by e / steepness.
        assert abs(found - u) <= mpf(10) ** -57 / steep


def test_roots_that_nearly_coincide_are_both_found():
    with mp.workdps(60):
        apart = mpf(2) ** -60
        # (u - 1/2)^2 = (apart / 2)^2 at 1/2 -+ apart / 2
        cubic = [mpf(1) / 4 - apart * apart / 4, mpf(-1), mpf(1), mpf(0)]
        cuts = [start for start, _, _ in monotone_pieces(mp, cubic, (0.0,))][1:]
        for found, expected in zip(cuts, (0.5 - apart / 2, mpf(0.5), 0.5 + apart / 2), strict=True):
            assert abs(found - expected) <= mpf(10) ** -40  # 10^-60 / apart


def test_a_field_that_touches_a_knot_stays_on_its_side():
    cubic = [mpf(0), mpf(4), mpf(-4), mpf(0)]  # 4 u (1 - u) rises to 1
    assert [interval for _, _, interval in monotone_pieces(mp, cubic, (1.0,))] == [0, 0]
    cubic = [mpf(1), mpf(-4), mpf(4), mpf(0)]  # falls to 0
    assert [interval for _, _, interval in monotone_pieces(mp, cubic, (0.0,))] == [1, 1]


def test_values_of_1e300_and_1e_minus_300_are_cut_as_well():
    for scale in (mpf(10) ** 300, mpf(10) ** -300):
        cubic = [mpf(0), scale, mpf(0), mpf(0)]
        cuts = list(monotone_pieces(mp, cubic, (float(scale) / 4,)))
        assert [float(b) for _, b, _ in cuts] == [0.25, 1.0]
