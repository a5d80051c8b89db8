"""The first meeting of cubics with an isovalue, against a dense scalar search."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from volref.cubics import evaluate
from volref.records import Pieces
from volref.stages.isosurface import crossing_of_samples, first_crossing

PLACES = np.linspace(-0.5, 0.5, 2001)


def chain(values_at_ends, bends):
    """Pieces of length 1 of one ray, from t = 0 on, that meet at their ends."""
    count = len(bends)
    ray, zero = np.zeros(count, np.intp), np.zeros(count)
    start, end = np.array(values_at_ends[:-1]), np.array(values_at_ends[1:])
    cubic = np.stack([(start + end) / 2 - np.array(bends) / 4, end - start, np.array(bends), zero])
    return Pieces(ray, np.ones(count), cubic, zero, zero, ray, zero), np.arange(count) + 0.5


@settings(max_examples=50)
@given(st.lists(st.floats(-1, 1, width=16), min_size=4, max_size=6), st.integers(0, 1000))
def test_the_first_crossing_is_that_of_a_dense_search(ends, seed):
    bends = np.random.default_rng(seed).normal(size=len(ends) - 1) * 3
    pieces, middle = chain(ends, bends)
    found = first_crossing(pieces, middle, np.zeros(1), 0.25)
    t = (middle[:, None] + PLACES).ravel()
    values = np.concatenate([evaluate(np.repeat(c[:, None], 2001, axis=1), PLACES) for c in pieces.cubic.T])
    above = values > 0.25
    crossed = np.flatnonzero(above != above[0])
    if len(crossed):
        # Two crossings closer than the search's step may come before.
        assert found.t[0] <= t[crossed[0]] + 1e-12
    if np.isfinite(found.t[0]):
        piece = min(int(found.t[0]), len(bends) - 1)
        value = evaluate(pieces.cubic[:, [piece]], np.array([found.t[0] - middle[piece]]))
        assert abs(value[0] - 0.25) < 1e-13
        before = t < found.t[0] - 1e-9
        assert (above[before] == above[0]).all()


def test_earliest_and_latest_are_where_values_are_within_the_error_and_beyond_it():
    pieces, middle = chain([1.0, 0.0], [0.0])
    found = first_crossing(pieces, middle, np.array([0.125]), 0.5)
    assert [x[0].round(12) for x in (found.earliest, found.t, found.latest)] == [0.375, 0.5, 0.625]


def test_a_touch_may_be_a_miss_and_a_near_miss_a_hit():
    pieces, middle = chain([1.0, 1.0], [4.0])  # down to 0 at t = 1/2
    touch = first_crossing(pieces, middle, np.array([1e-9]), 0.0)
    assert (touch.t[0], touch.latest[0]) == (0.5, np.inf)
    miss = first_crossing(pieces, middle, np.array([1e-9]), -1e-10)
    assert (miss.t[0], miss.latest[0]) == (np.inf, np.inf)
    assert 0.49 < miss.earliest[0] < 0.5
    clear = first_crossing(pieces, middle, np.array([1e-9]), -1e-8)
    assert clear.earliest[0] == np.inf


def test_a_ray_that_starts_within_the_error_may_start_on_either_side():
    pieces, middle = chain([0.5, 0.0], [0.0])
    found = first_crossing(pieces, middle, np.array([1e-9]), 0.5)
    assert (found.t[0], found.earliest[0], found.latest[0]) == (0.0, 0.0, np.inf)


def test_a_constant_at_the_isovalue_is_met_for_sure_where_the_ray_is_in_its_cell():
    pieces, middle = chain([0.5, 0.5], [0.0])
    found = first_crossing(pieces, middle, np.array([1e-9]), 0.5)
    assert (found.t[0], found.latest[0]) == (0.0, 0.0)


def test_samples_cross_between_them_at_them_or_not_at_all():
    t = np.repeat(np.array([[0.0], [1.0], [2.0]]), 4, axis=1)
    values = np.array([[0.0, 3.0, 1.0, 5.0], [1.0, 9.0, 3.0, 4.0], [5.0, 9.0, 9.0, 2.0]])
    assert crossing_of_samples(values, t, 3.0).tolist() == [1.5, 0.0, 1.0, 1.5]
    assert crossing_of_samples(values, t, 10.0).tolist() == [np.inf] * 4
