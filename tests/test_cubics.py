"""Cubics on pieces; cutting pieces at their roots is held in tests/stages/test_splitting.py."""

from fractions import Fraction

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from volref.cubics import critical_points, evaluate, monotone_parts, roots, value_range

coefficient = st.one_of(st.just(0.0), st.floats(-4, 4, width=32), st.floats(-1e-12, 1e-12))
cubic = st.tuples(*[coefficient] * 4).map(lambda c: np.array(c).reshape(4, 1))
PLACES = np.linspace(-0.5, 0.5, 41)


def slope(c, v):
    return Fraction(c[1]) + 2 * Fraction(c[2]) * v + 3 * Fraction(c[3]) * v * v


@given(cubic)
def test_the_derivative_is_0_at_a_critical_point_to_rounding(c):
    size = float(np.abs(c[1:]).sum())
    for (v,) in critical_points(c):
        if v < 0.5:
            # Twice the root of the roundoff where two zeros nearly coincide, and flat there.
            assert abs(slope(c[:, 0].tolist(), Fraction(v))) <= 2.0**-48 * size + 1e-300


@given(cubic)
def test_a_cubic_is_monotone_between_the_ends_of_its_parts(c):
    _, start, end = monotone_parts(c)
    assert start[0] == -0.5
    assert end[-1] == 0.5
    assert (start[1:] == end[:-1]).all()
    size = 2.0**-48 * float(np.abs(c).sum()) + 1e-300
    for a, b in zip(start, end, strict=True):
        values = evaluate(np.repeat(c, 9, axis=1), np.linspace(a, b, 9))
        steps = np.diff(values) * np.sign(values[-1] - values[0])
        assert (steps >= -size).all()


@given(cubic)
def test_no_value_lies_outside_the_range(c):
    low, high = value_range(c)
    values = evaluate(np.repeat(c, len(PLACES), axis=1), PLACES)
    size = 2.0**-50 * float(np.abs(c).sum()) + 1e-300  # what underflows
    assert low[0] - size <= values.min()
    assert values.max() <= high[0] + size


@given(cubic, st.floats(0, 1))
def test_a_root_has_the_value_asked_for(c, share):
    _, start, end = monotone_parts(c)
    parts = np.repeat(c, len(start), axis=1)
    first, last = evaluate(parts, start), evaluate(parts, end)
    target = first + share * (last - first)
    u = roots(parts, start, end, target)
    assert (u >= start).all()
    assert (u <= end).all()
    assert (np.abs(evaluate(parts, u) - target) <= 2.0**-48 * np.abs(c).sum() + 1e-300).all()
