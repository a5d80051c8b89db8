"""Extremes and means of pieces of rays, and of samples, against scalar loops."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from volref.cubics import evaluate
from volref.records import Pieces, first_of_each
from volref.stages.reductions import (
    Estimates,
    greatest_along,
    greatest_of,
    mean_along,
    near_greatest,
    reduced_samples,
)

PLACES = np.linspace(-0.5, 0.5, 1001)


def pieces_of(seed, count=12):
    rng = np.random.default_rng(seed)
    ray = np.sort(rng.integers(0, 5, count))
    slack = rng.choice([0.0, 1e-15], count)
    astray = rng.choice([0.0, 1e-12, 1.0], count)
    cubic = rng.normal(size=(4, count)) * rng.choice([0.0, 1.0], (4, count))
    return Pieces(ray, rng.random(count) + 0.1, cubic, slack, astray, ray, slack)


def dense(cubic):
    """Values (n, places) of cubics."""
    return np.stack([evaluate(cubic, np.full(cubic.shape[1], v)) for v in PLACES], axis=1)


@given(st.integers(0, 10_000))
def test_the_greatest_value_of_a_cubic_is_above_all_samples_and_taken_where_it_is_said(seed):
    cubic = pieces_of(seed).cubic
    most, at = greatest_of(cubic)
    assert (most >= dense(cubic).max(axis=1)).all()
    np.testing.assert_array_equal(evaluate(cubic, at), most)


@given(st.integers(0, 10_000))
def test_the_greatest_value_along_a_ray_is_that_of_its_pieces(seed):
    pieces = pieces_of(seed)
    here, _ = greatest_of(pieces.cubic)
    off, known = np.full(6, 1e-9), np.full(6, -20.0)
    found = greatest_along(pieces, here, here, off, known)
    for ray in range(6):
        its = pieces.ray == ray
        assert found.value[ray] == (here[its].max() if its.any() else -20.0)
        assert found.least[ray] <= found.value[ray] <= found.most[ray] - 1e-9
        # Off by the slack, the rounding of values of a few units, and what may lie in the next cell.
        assert found.most[ray] - found.least[ray] <= 2e-9 + 1e-12


@given(st.integers(0, 10_000))
def test_pieces_that_are_not_near_the_greatest_cannot_be_it(seed):
    pieces = pieces_of(seed)
    here, _ = greatest_of(pieces.cubic)
    near = near_greatest(pieces, here, np.full(6, 0.5))
    for k in range(len(here)):
        most = here[pieces.ray == pieces.ray[k]].max()
        assert (k in near) or here[k] < most - 0.9 or not pieces.cubic[1:, k].any()
        assert (k not in near) or here[k] > most - 1.1


@given(st.integers(0, 10_000))
def test_the_mean_along_a_ray_is_that_of_its_pieces_by_length(seed):
    pieces = pieces_of(seed)
    found = mean_along(pieces, np.zeros(6))
    for ray in range(6):
        its = pieces.ray == ray
        if not its.any():
            assert found.most[ray] == np.inf
            continue
        # Simpson's rule is exact for cubics.
        ends = [evaluate(pieces.cubic[:, its], np.full(its.sum(), v)) for v in (-0.5, 0.0, 0.5)]
        means = (ends[0] + 4 * ends[1] + ends[2]) / 6
        truth = (means * pieces.length[its]).sum() / pieces.length[its].sum()
        assert found.value[ray] == pytest.approx(truth, abs=1e-14)


def test_the_mean_of_a_constant_is_that_constant_exactly_and_certainly():
    ray = np.zeros(7, np.intp)
    cubic = np.zeros((4, 7))
    cubic[0] = 0.1
    pieces = Pieces(ray, np.linspace(0.1, 0.9, 7), cubic, np.zeros(7), np.zeros(7), ray, np.zeros(7))
    found = mean_along(pieces, np.zeros(1))
    assert (found.value[0], found.least[0], found.most[0]) == (0.1, 0.1, 0.1)


def test_the_mean_is_off_by_what_lies_in_the_next_cell_and_by_the_slack_of_its_pieces():
    pieces = pieces_of(3)
    slack = dataclasses.replace(pieces, slack=pieces.slack + 0.25)
    some = np.unique(pieces.ray)
    close, next_cell, loose = (
        mean_along(what, np.full(6, off)).most[some]
        for what, off in ((pieces, 0.0), (pieces, 0.5), (slack, 0.0))
    )
    np.testing.assert_allclose(next_cell - close, 0.5, rtol=0, atol=1e-12)
    np.testing.assert_allclose(loose - close, 0.25, rtol=0, atol=1e-12)


def test_samples_reduce_as_their_segments_say():
    values = np.array([[1.0, 7.0], [5.0, 8.0], [9.0, 9.0]])
    lengths = np.array([[3.0, 0.0], [1.0, 0.0], [0.0, 0.0]])
    assert reduced_samples("mip", values, lengths)[0] == 5.0
    assert reduced_samples("minip", values, lengths)[0] == 1.0
    assert reduced_samples("average", values, lengths)[0] == 2.0
    assert np.isnan([reduced_samples(mode, values, lengths)[1] for mode in ("mip", "minip", "average")]).all()


def test_estimates_turn_round_with_their_sign_and_stay_within_limits():
    found = Estimates(np.array([2.0]), np.array([1.0]), np.array([4.0]))
    negative, held = found.negative(), found.within(1.5, 3.0)
    assert (negative.value[0], negative.least[0], negative.most[0]) == (-2.0, -4.0, -1.0)
    assert (held.value[0], held.least[0], held.most[0]) == (2.0, 1.5, 3.0)


def test_the_first_piece_of_each_ray_is_where_its_number_changes():
    assert first_of_each(np.array([2, 2, 5])).tolist() == [0, 2]
    assert first_of_each(np.empty(0, np.intp)).tolist() == []
