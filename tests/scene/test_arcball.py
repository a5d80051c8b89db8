"""The arcball held to SciPy's rotations and to Shoemake's laws."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from volref import Camera, SceneError
from volref.scene.arcball import arcball_rotation, drag

coordinate = st.floats(-3, 3)
point = st.tuples(coordinate, coordinate)
rules = st.sampled_from(["clamp", "hyperbola"])

# A quaternion of 2 products and 3 sums, then divided: a few ulp of 1; turned into a matrix, a few more.
ROUNDING = 1e-14


def on_the_ball(x, y, outside):
    d = (x * x + y * y) ** 0.5
    if outside == "clamp":
        return np.array([x / d, y / d, 0]) if d > 1 else np.array([x, y, (1 - d * d) ** 0.5])
    z = (1 - d * d) ** 0.5 if d <= 0.5**0.5 else 0.5 / d
    return np.array([x, y, z]) / (d * d + z * z) ** 0.5


@given(point, point, rules)
def test_a_drag_turns_by_twice_the_arc_between_its_ends(start, end, outside):
    p, q = on_the_ball(*start, outside), on_the_ball(*end, outside)
    turned = Rotation.from_quat(arcball_rotation(start, end, outside=outside))
    arc = np.arctan2(np.linalg.norm(np.cross(p, q)), p @ q)
    # At arcs near pi SciPy tells 2 pi - x from x by the sign of w only: compare what is done to vectors.
    axis = np.cross(p, q)
    axis = axis / np.linalg.norm(axis) if np.linalg.norm(axis) > 1e-9 else np.array([0.0, 0.0, 1.0])
    expected = Rotation.from_rotvec(2 * arc * axis)
    # Where the arc is short, so is what its axis is known by: 1e-9 above, and the turn is as small.
    np.testing.assert_allclose(turned.as_matrix(), expected.as_matrix(), rtol=0, atol=1e-8)


@given(point, point, point, rules)
def test_what_a_path_of_drags_does_depends_on_its_ends_only(first, second, third, outside):
    a = Rotation.from_quat(arcball_rotation(first, second, outside=outside))
    b = Rotation.from_quat(arcball_rotation(second, third, outside=outside))
    whole = Rotation.from_quat(arcball_rotation(first, third, outside=outside))
    np.testing.assert_allclose((b * a).as_matrix(), whole.as_matrix(), rtol=0, atol=ROUNDING)


@given(point, point)
def test_clamped_drags_beside_the_ball_turn_about_the_viewing_axis(start, end):
    def rim(x, y):
        length = max((x * x + y * y) ** 0.5, 1e-3)
        return (
            (1.5 * x / length + 1.5, 1.5 * y / length)
            if x > 0
            else (1.5 * x / length - 1.5, 1.5 * y / length)
        )

    x, y, *_ = arcball_rotation(rim(*start), rim(*end))
    assert (x, y) == (0, 0)


def test_ball_and_hyperbola_meet_without_a_step():
    rim = 0.5**0.5
    inside = arcball_rotation((0, 0), (rim * (1 - 1e-9), 0), outside="hyperbola")
    beyond = arcball_rotation((0, 0), (rim * (1 + 1e-9), 0), outside="hyperbola")
    # The points are 1.5e-9 apart, and no slope is above 2 there.
    np.testing.assert_allclose(inside, beyond, rtol=0, atol=4e-9)


@pytest.mark.parametrize("build", [Camera.look_at, Camera.orthographic])
def test_a_drag_to_the_right_brings_what_was_on_the_left_to_the_front(build):
    camera = build((0, 0, 5), (0, 0, 0), (0, 1, 0), 40.0, 0.1, 10.0)
    turned = drag(camera, (200, 100), (200 + 100 * np.sin(np.pi / 4), 100), 400, 200, target=(0, 0, 0))
    # An arc of 45 degrees turns by 90: what was at -x now lies towards the viewer, 4 in front of the eye.
    seen = turned.view_from_world @ [-1, 0, 0, 1]
    np.testing.assert_allclose(seen, [0, 0, -4, 1], rtol=0, atol=ROUNDING)
    assert (turned.kind, turned.fov_y, turned.height) == (camera.kind, camera.fov_y, camera.height)


def test_a_drag_upwards_shows_what_was_below():
    camera = Camera.look_at((0, 0, 5), (0, 0, 0), (0, 1, 0), 40.0, 0.1, 10.0)
    turned = drag(camera, (200, 100), (200, 100 - 100 * np.sin(np.pi / 4)), 400, 200, target=(0, 0, 0))
    np.testing.assert_allclose(turned.view_from_world @ [0, -1, 0, 1], [0, 0, -4, 1], rtol=0, atol=ROUNDING)


@given(point, point)
def test_a_drag_keeps_the_target_where_it_is(start, end):
    camera = Camera.look_at((3, 1, 2), (0, 0.5, 0), (0.1, 1, 0), 40.0, 0.1, 10.0)
    target = np.array([0.7, -0.2, 0.4, 1])
    turned = drag(camera, start, end, 6, 4, target=target[:3])
    np.testing.assert_allclose(
        turned.view_from_world @ target, camera.view_from_world @ target, rtol=0, atol=ROUNDING
    )


def test_the_quaternion_of_a_drag_comes_after_the_one_of_before():
    place = {"target": (1, 2, 3), "distance": 6.0, "fov_y": 30.0, "near": 0.1, "far": 20.0}
    before = Rotation.from_quat((0.3, -0.2, 0.5, 0.8))
    camera = Camera.arcball(before.as_quat(), **place)
    start, end, width, height = (5, 3), (2, 6), 8, 8
    dragged = drag(camera, start, end, width, height, target=place["target"])
    turn = Rotation.from_quat(arcball_rotation((0.25, 0.25), (-0.5, -0.5)))
    expected = Camera.arcball((turn * before).as_quat(), **place)
    np.testing.assert_allclose(
        dragged.view_from_world,
        expected.view_from_world,
        rtol=0,
        atol=10 * ROUNDING,  # lengths of 7
    )


@pytest.mark.parametrize(
    ("call", "fragment"),
    [
        (lambda: arcball_rotation((0, 0, 0), (1, 0)), "start must have shape (2)"),
        (lambda: arcball_rotation((0, 0), (1, np.nan)), "end must be finite"),
        (lambda: arcball_rotation((0, 0), (1, 0), outside="wrap"), "outside must be 'clamp' or 'hyperbola'"),
    ],
)
def test_what_is_no_drag_is_refused_in_one_sentence(call, fragment):
    with pytest.raises(SceneError) as refusal:
        call()
    assert fragment in str(refusal.value)
