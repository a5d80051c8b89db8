import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from volref.truth.digits.lattice import cells_along, corner_samples, cubic_in_cell, exact_point, exact_span

UNIT = exact_point((0, 0, 0)), exact_point((1, 1, 1))
coordinate = st.floats(-3, 3)


def exact_trilinear(samples, fractions):
    """Weighted mean of eight samples, x fastest, in exact arithmetic."""
    total = Fraction(0)
    for corner, sample in enumerate(samples):
        share = Fraction(sample)
        for axis, f in enumerate(fractions):
            share *= f if corner >> axis & 1 else 1 - f
        total += share
    return total


@pytest.mark.parametrize(
    ("origin", "direction", "expected"),
    [
        ((-1, 0.5, 0.5), (1, 0, 0), (1, 2)),
        ((0.5, 0.5, 0.5), (1, 0, 0), (0, 0.5)),  # begins inside
        ((2, 0.5, 0.5), (1, 0, 0), None),  # leaves it behind
        ((-1, 0, 1), (1, 0, 0), (1, 2)),  # along an edge
        ((-1, -0.1, 0.5), (1, 0, 0), None),  # beside it
        ((-1, -1, 0.5), (1, 1, 0), (1, 2)),
        ((-1, 0, 0.5), (1, 1, 0), None),  # touches a corner edge: no length
        ((0.5, 0.5, 0.5), (0, 0, 0), None),
    ],
)
def test_the_span_is_where_the_ray_is_in_the_box(origin, direction, expected):
    if any(direction):
        assert exact_span(exact_point(origin), exact_point(direction), *UNIT, math.inf) == expected


def test_a_surface_ends_the_span():
    ray = exact_point((-1, 0.5, 0.5)), exact_point((1, 0, 0))
    assert exact_span(*ray, *UNIT, 1.25) == (1, 1.25)
    assert exact_span(*ray, *UNIT, 1.0) is None


@given(st.tuples(coordinate, coordinate, coordinate), st.tuples(coordinate, coordinate, coordinate))
def test_cells_fill_the_span_and_hold_their_part_of_the_ray(origin, direction):
    ray = exact_point(origin), exact_point(direction)
    span = Fraction(1, 3), Fraction(11, 4)
    end = span[0]
    for t0, t1, cell in cells_along(*ray, span):
        assert t0 == end < t1
        end = t1
        for o, d, i in zip(*ray, cell, strict=True):
            assert all(i <= o + d * t <= i + 1 for t in (t0, t1))
    assert end == span[1]


def test_samples_outside_are_those_of_the_border():
    values = np.arange(24, dtype=np.uint8).reshape(2, 3, 4)
    assert corner_samples(values, (0, 0, 0)) == [0, 1, 4, 5, 12, 13, 16, 17]
    assert corner_samples(values, (-1, 2, 1)) == [20, 20, 20, 20, 20, 20, 20, 20]
    assert corner_samples(values, (3, 0, 0)) == [3, 3, 7, 7, 15, 15, 19, 19]
    assert corner_samples(values[:1, :1, :1], (0, 0, 0)) == [0] * 8


@given(
    st.lists(st.floats(-1e9, 1e9), min_size=8, max_size=8),
    st.tuples(coordinate, coordinate, coordinate),
    st.tuples(coordinate, coordinate, coordinate),
)
def test_the_cubic_is_the_trilinear_mean_exactly(samples, origin, direction):
    # A cubic is known by four values; the fifth place would show a term that is missing.
    ray = exact_point(origin), exact_point(direction)
    t0, t1, cell = Fraction(1, 3), Fraction(5, 4), (1, -2, 0)
    cubic = cubic_in_cell(samples, cell, *ray, t0, t1)
    for u in (Fraction(0), Fraction(1), Fraction(1, 2), Fraction(1, 7), Fraction(3, 2)):
        t = t0 + u * (t1 - t0)
        fractions = [o + d * t - i for o, d, i in zip(*ray, cell, strict=True)]
        assert sum(c * u**k for k, c in enumerate(cubic)) == exact_trilinear(samples, fractions)


def test_what_cancels_along_the_ray_cancels_exactly():
    # The field 0.1 + 0.3 x - 0.3 y along x = y: in float64 the two do not always cancel.
    samples = [0.1, 0.4, -0.2, 0.1] * 2
    rising = Fraction(0.4) - Fraction(0.1)
    falling = Fraction(-0.2) - Fraction(0.1)
    ray = exact_point((0.1, 0.1, 0.7)), exact_point((0.37, 0.37, 0.11))
    cubic = cubic_in_cell(samples, (0, 0, 0), *ray, Fraction(0), Fraction(1, 3))
    assert cubic[1] == Fraction(0.37) / 3 * (rising + falling)
    assert cubic[2] == (Fraction(0.37) / 3) ** 2 * (Fraction(0.1) - Fraction(0.4) - falling)
    assert cubic[3] == 0
