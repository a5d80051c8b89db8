import numpy as np
from hypothesis import given
from hypothesis import strategies as st

import volref as vr
from tests.oracles import scalar
from volref.records import Rays, Spans
from volref.stages.spans import box_spans, clip_spans, cut_spans

LOW, HIGH = np.array([-0.5, -0.5, -0.5]), np.array([3.5, 2.5, 1.5])

# Whole and half numbers hit faces, edges and corners; the rest lies anywhere.
PLACE = st.one_of(st.sampled_from([-3.0, -0.5, 0.0, 1.5, 2.5, 3.5, 5.0]), st.floats(-6, 6))
SLOPE = st.one_of(st.sampled_from([-1.0, -0.0, 0.0, 1.0, 1e-300, -1e-300]), st.floats(-2, 2))
TRIPLE_PLACE, TRIPLE_SLOPE = st.tuples(PLACE, PLACE, PLACE), st.tuples(SLOPE, SLOPE, SLOPE)


def one_span(origin, direction):
    spans = box_spans(np.array([origin], float).T, np.array([direction], float).T, LOW, HIGH)
    return float(spans.t_near[0]), float(spans.t_far[0])


@given(origin=TRIPLE_PLACE, direction=TRIPLE_SLOPE)
def test_spans_equal_the_scalar_slab_test(origin, direction):
    if not any(direction):
        return
    t_near, t_far = one_span(origin, direction)
    expected = scalar.box_span(origin, direction, LOW.tolist(), HIGH.tolist())
    if expected is None:
        assert not t_near < t_far
    else:
        assert (t_near, t_far) == expected  # the same two divisions: equal to the bit


def test_a_ray_along_a_face_is_inside():
    assert one_span((-2, -0.5, 0), (1, 0, 0)) == (1.5, 5.5)


def test_a_ray_along_an_edge_is_inside_whatever_the_sign_of_zero():
    assert one_span((-2, -0.5, 1.5), (1, 0.0, -0.0)) == (1.5, 5.5)
    assert one_span((-2, -0.5, 1.5), (1, -0.0, 0.0)) == (1.5, 5.5)


def test_a_parallel_ray_beside_the_box_misses():
    t_near, t_far = one_span((-2, -0.6, 0), (1, 0, 0))
    assert not t_near < t_far


def test_a_camera_inside_the_box_starts_at_zero():
    assert one_span((1.5, 1, 0.5), (1, 0, 0)) == (0.0, 2.0)


def test_a_box_behind_the_camera_is_missed():
    t_near, t_far = one_span((9, 1, 0.5), (1, 0, 0))
    assert not t_near < t_far


@given(offset=st.floats(-1e-9, 1e-9))
def test_the_chord_near_an_edge_changes_continuously(offset):
    # A ray at 45 degrees through the edge x = 3.5, y = 2.5: hit or miss is chance, the chord is not.
    origin, direction = (4.5 - offset, 1.5 - offset, 0.5), (-np.sqrt(0.5), np.sqrt(0.5), 0.0)
    t_near, t_far = one_span(origin, direction)
    assert max(t_far - t_near, 0) <= 2 * np.sqrt(2) * abs(offset) + 4e-15  # geometry, and 8 ulp of t = 1.4


def test_a_surface_ends_the_span_exactly_at_its_distance():
    spans = Spans(np.array([1.0, 1.0, 1.0]), np.array([4.0, 4.0, 4.0]))
    cut = cut_spans(spans, 0.0, np.array([2.5, np.inf, 0.5]))
    assert cut.t_far.tolist() == [2.5, 4.0, 0.5]
    assert cut.t_near.tolist() == [1.0, 1.0, 1.0]


def test_clipped_rays_stay_in_front_of_every_plane():
    random = np.random.default_rng(3)
    planes = [vr.Plane(random.normal(size=3), random.normal(size=3)) for _ in range(3)]
    directions = random.normal(size=(400, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    rays = Rays(random.normal(size=(400, 3)) * 3, directions)
    spans = clip_spans(rays, planes)
    t = np.linspace(0, 20, 2001)
    points = rays.origins[:, None] + t[:, None] * rays.directions[:, None]
    kept = np.all([plane.height(points) >= 0 for plane in planes], axis=0)
    inside = (t >= spans.t_near[:, None]) & (t <= spans.t_far[:, None])
    # They may differ where a sample lies on a plane to rounding, which none of these does.
    assert (kept == inside).all()
    assert 0.05 < kept.mean() < 0.6


def test_a_ray_along_a_plane_is_kept_in_it_and_in_front_of_it_only():
    plane = vr.Plane((0, 0, 1), (0, 0, 1))
    origins = np.array([[0.0, 0, 1], [0, 0, 2], [0, 0, 0.5]])
    spans = clip_spans(Rays(origins, np.tile([1.0, 0, 0], (3, 1))), [plane])
    assert (spans.t_near < spans.t_far).tolist() == [True, True, False]
