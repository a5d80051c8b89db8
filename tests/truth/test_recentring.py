"""Spans about their own middle: the errors that are stated hold against exact fractions."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from volref.stages.spans import box_spans, cut_spans
from volref.truth.digits.lattice import exact_point, exact_span
from volref.truth.recentring import recentred_spans

LOW, HIGH = np.full(3, -0.5), np.full(3, 3.5)

small = st.one_of(st.just(0.0), st.floats(-1.0, 1.0), st.floats(-1e-9, 1e-9))
place = st.one_of(st.floats(-0.5, 3.5), st.sampled_from([-0.5, 0.0, 1.0, 3.5, 3.4999999988266173]))


def assert_ends_hold(origin, direction):
    origins, directions = (np.array(x, float).reshape(3, 1) for x in (origin, direction))
    known = cut_spans(box_spans(origins, directions, LOW, HIGH), 0.0, np.array([np.inf]))
    if not known.t_far[0] > known.t_near[0]:
        return
    spans, ends = recentred_spans(LOW, HIGH, origins, directions, known, 0.0, np.array([np.inf]))[2:]
    middle = Fraction(0.5 * (known.t_near[0] + known.t_far[0]))
    truth = exact_span(*(exact_point(x) for x in (origin, direction, LOW, HIGH)), np.inf)
    near, far, at_near, at_far = (float(x[0]) for x in (spans.t_near, spans.t_far, ends.t_near, ends.t_far))
    length = 0 if truth is None else truth[1] - truth[0]
    assert abs(far - near - length) <= at_near + at_far + 2.0**-52 * far
    if truth is not None and far > near:
        assert abs(Fraction(near) + middle - truth[0]) <= at_near
        assert abs(Fraction(far) + middle - truth[1]) <= at_far


def test_a_ray_that_leaves_by_an_edge_may_leave_by_either_face():
    # Both faces at t = 5: the one that the ray hardly moves towards is 1e-6 off.
    assert_ends_hold(
        (2.323711654355868, 0.34237649541523507, 3.4999999988266173),
        (2.3525766912882640e-01, 6.2236069767700131e-10, 2.3467657979935134e-10),
    )


@given(st.tuples(place, place, place), st.tuples(small, small, small), st.sampled_from([0.0, 5.0, 1e3]))
def test_the_ends_of_any_ray_are_within_their_errors(target, direction, away):
    if max(map(abs, direction)) < 1e-10:
        direction = (0.0, 1.0, 0.5)
    origin = [p - away * d for p, d in zip(target, direction, strict=True)]
    assert_ends_hold(origin, direction)


@pytest.mark.slow
def test_thousands_of_rays_by_edges_are():
    rng = np.random.default_rng(0)
    for _ in range(3000):
        direction = rng.normal(size=3) * rng.choice([1.0, 1e-4, 1e-9], 3)
        corner = np.where(rng.random(3) < 0.5, rng.choice([-0.5, 3.5], 3), 4 * rng.random(3) - 0.5)
        away = rng.choice([0.0, 5.0]) / np.abs(direction).max()
        assert_ends_hold((corner - away * direction).tolist(), direction.tolist())
