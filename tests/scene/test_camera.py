import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from volref import Camera, SceneError
from volref.scene.camera import look_at_matrix

PLACE = ((3, 1, 2), (0, 0.5, 0), (0.1, 1, 0))


def project(camera, width, height, point):
    clip = camera.clip_from_view(width, height) @ camera.view_from_world @ [*point, 1]
    return clip[:3] / clip[3]


def test_the_view_looks_along_minus_z_with_up_upwards():
    view = look_at_matrix((0, 0, 5), (0, 0, 0), (0, 1, 0))
    assert (view @ [0, 0, 0, 1]).tolist() == [0, 0, -5, 1]
    assert (view @ [1, 2, 5, 1]).tolist() == [1, 2, 0, 1]


def test_the_view_is_a_rotation_of_a_right_handed_world():
    view = look_at_matrix(*PLACE)
    np.testing.assert_allclose(view[:3, :3] @ view[:3, :3].T, np.eye(3), atol=1e-15)
    assert np.linalg.det(view[:3, :3]) == pytest.approx(1.0)


@pytest.mark.parametrize(("clip_z", "least"), [("-1..1", -1.0), ("0..1", 0.0)])
@pytest.mark.parametrize("build", [Camera.look_at, Camera.orthographic])
def test_near_and_far_map_to_the_ends_of_the_clip_range(build, clip_z, least):
    camera = build((0, 0, 0), (0, 0, -1), (0, 1, 0), 40.0, 0.5, 20.0, clip_z=clip_z)
    assert project(camera, 3, 2, (0, 0, -0.5))[2] == pytest.approx(least, abs=1e-14)
    assert project(camera, 3, 2, (0, 0, -20.0))[2] == pytest.approx(1.0, abs=1e-14)


def test_fov_y_is_the_full_vertical_angle():
    camera = Camera.look_at((0, 0, 0), (0, 0, -1), (0, 1, 0), 90.0, 0.1, 10.0)
    assert project(camera, 200, 100, (0, 3, -3))[1] == pytest.approx(1.0)
    assert project(camera, 200, 100, (6, 0, -3))[0] == pytest.approx(1.0)


def test_the_orthographic_height_is_the_height_of_the_image():
    camera = Camera.orthographic((0, 0, 0), (0, 0, -1), (0, 1, 0), 4.0, 0.1, 10.0)
    assert project(camera, 200, 100, (4, 2, -3))[:2].tolist() == [1.0, 1.0]


@pytest.mark.parametrize("clip_z", ["-1..1", "0..1"])
@pytest.mark.parametrize("build", [Camera.look_at, Camera.orthographic])
def test_matrices_tell_their_near_and_far(build, clip_z):
    camera = build(*PLACE, 40.0, 0.5, 20.0, clip_z=clip_z)
    given = Camera.from_matrices(camera.view_from_world, camera.clip_from_view(4, 2), clip_z=clip_z)
    assert given.near == pytest.approx(0.5, rel=1e-12)
    assert given.far == pytest.approx(20.0, rel=1e-12)
    assert given.is_parallel == camera.is_parallel


def test_reversed_depth_and_an_infinite_far_plane_are_understood():
    # WebGPU's usual: clip z = near / depth, 1 at the near plane and 0 at infinity
    matrix = [[2, 0, 0, 0], [0, 2, 0, 0], [0, 0, 0, 0.25], [0, 0, -1, 0]]
    camera = Camera.from_matrices(np.eye(4), matrix, clip_z="0..1")
    assert (camera.near, camera.far) == (0.25, np.inf)


def test_a_transposed_webgl_array_is_recognised():
    camera = Camera.look_at(*PLACE, 40.0, 0.5, 20.0)
    with pytest.raises(SceneError, match="transpose a WebGL array"):
        Camera.from_matrices(camera.view_from_world, camera.clip_from_view(4, 2).T)


def test_aspect_must_agree_with_the_image():
    camera = Camera.look_at(*PLACE, 40.0, 0.5, 20.0)
    given = Camera.from_matrices(camera.view_from_world, camera.clip_from_view(4, 2))
    given.check_aspect(400, 200)
    rounded = Camera.from_matrices(camera.view_from_world, np.float32(camera.clip_from_view(4, 2)))
    rounded.check_aspect(400, 200)
    with pytest.raises(SceneError, match="aspect of the image, got 2 for 300 x 200"):
        given.check_aspect(300, 200)


@pytest.mark.parametrize("number", [10**400, 1e300])
def test_numbers_too_large_for_a_length_are_refused_in_a_short_sentence(number):
    with pytest.raises(SceneError, match=r"camera\.eye must") as refusal:
        Camera.look_at((number, 0, 0), (0, 0, 0), (0, 0, 1), 40.0, 0.5, 20.0)
    assert len(str(refusal.value)) < 200
    with pytest.raises(SceneError, match=r"camera\.near must be"):
        Camera.look_at((5, 0, 0), (0, 0, 0), (0, 0, 1), 40.0, 10**400, 20.0)


ARCBALL = {"target": (1.0, -2.0, 3.0), "distance": 5.0, "fov_y": 30.0, "near": 0.5, "far": 20.0}


def test_the_identity_of_an_arcball_looks_along_minus_z_with_y_upwards():
    camera = Camera.arcball((0, 0, 0, 1), **ARCBALL)
    same = Camera.look_at((1, -2, 8), (1, -2, 3), (0, 1, 0), 30.0, 0.5, 20.0)
    assert np.array_equal(camera.view_from_world, same.view_from_world)
    assert (camera.kind, camera.fov_y, camera.near, camera.far) == ("perspective", 30.0, 0.5, 20.0)


@given(st.lists(st.floats(-2, 2), min_size=4, max_size=4).filter(lambda q: np.linalg.norm(q) > 1e-3))
def test_the_quaternion_of_an_arcball_turns_the_world_as_hamilton_has_it(quaternion):
    """v' = q v q*, by the components of Hamilton's product, then the camera's distance along -z."""

    def product(a, b):
        (ax, ay, az, aw), (bx, by, bz, bw) = a, b
        return (
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
            aw * bw - ax * bx - ay * by - az * bz,
        )

    camera = Camera.arcball(quaternion, **ARCBALL)
    unit = np.array(quaternion) / np.linalg.norm(quaternion)
    world = np.array([0.3, 1.7, -2.2])
    away = (*(world - ARCBALL["target"]), 0.0)
    turned = product(product(unit, away), unit * [-1, -1, -1, 1])
    # Some 20 operations on numbers below 10, each off by half an ulp.
    np.testing.assert_allclose(
        camera.view_from_world @ [*world, 1], np.array([*turned[:3], 1]) - [0, 0, 5, 0], rtol=0, atol=2e-14
    )


@pytest.mark.parametrize(
    ("change", "fragment"),
    [
        ({"quaternion": (0, 0, 0, 0)}, "camera.quaternion must not be zero"),
        ({"quaternion": (0, 0, 1)}, "camera.quaternion must have shape (4)"),
        ({"distance": 0.0}, "camera.distance must be above 0"),
        ({"target": (0, 0, np.inf)}, "camera.target must be finite"),
    ],
)
def test_what_is_no_arcball_is_refused(change, fragment):
    with pytest.raises(SceneError) as refusal:
        Camera.arcball(**({"quaternion": (0, 0, 0, 1)} | ARCBALL | change))
    assert fragment in str(refusal.value)
