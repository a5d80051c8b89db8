import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.oracles import scalar
from volref import Camera
from volref.stages.rays import pixel_ndc, pixel_rays

COORDINATE = st.floats(-10, 10)
POINT = st.tuples(COORDINATE, COORDINATE, COORDINATE)


def all_pixels(width, height):
    return np.arange(width * height)


def test_half_pixel_a_single_pixel_looks_along_the_axis():
    camera = Camera.look_at((1, 2, 3), (4, 6, 3), (0, 0, 1), 50.0, 0.1, 10.0)
    rays = pixel_rays(camera, 1, 1, np.array([0]))
    # exact but for the rounding of one normalisation: 2 ulp of 1
    np.testing.assert_allclose(rays.directions[0], [0.6, 0.8, 0.0], rtol=0, atol=4e-16)


def test_half_pixel_two_pixels_lie_a_quarter_of_the_image_from_the_middle():
    camera = Camera.look_at((0, 0, 0), (0, 0, -1), (0, 1, 0), 90.0, 0.1, 10.0)
    rays = pixel_rays(camera, 2, 2, all_pixels(2, 2))
    slopes = rays.directions[:, :2] / -rays.directions[:, 2:]
    # tan(45 degrees) = 1, so the image reaches from -1 to 1; 4 ulp for two normalisations
    np.testing.assert_allclose(slopes, [(-0.5, 0.5), (0.5, 0.5), (-0.5, -0.5), (0.5, -0.5)], rtol=1e-15)


def test_row_zero_is_the_top():
    camera = Camera.look_at((0, 0, 0), (0, 0, -1), (0, 1, 0), 60.0, 0.1, 10.0)
    rays = pixel_rays(camera, 1, 2, all_pixels(1, 2))
    assert rays.directions[0, 1] > 0 > rays.directions[1, 1]


@given(eye=POINT, target=POINT, up=POINT, fov_y=st.floats(1, 170), x=st.integers(0, 6), y=st.integers(0, 4))
def test_perspective_rays_equal_the_scalar_construction(eye, target, up, fov_y, x, y):
    forward = np.subtract(target, eye)
    sine = np.linalg.norm(np.cross(forward, up))
    if (
        sine < 1e-3 * np.linalg.norm(forward) * np.linalg.norm(up)
        or sine == 0
        or np.linalg.norm(forward) < 1e-3
    ):
        return
    camera = Camera.look_at(eye, target, up, fov_y, 0.1, 10.0)
    rays = pixel_rays(camera, 7, 5, np.array([y * 7 + x]))
    origin, direction = scalar.look_at_ray(eye, target, up, fov_y, 7, 5, x, y)
    # The eye comes back through an inverse: a few eps |eye|; the basis loses 3 digits at a sine of 1e-3.
    np.testing.assert_allclose(rays.origins[0], origin, rtol=0, atol=1e-13)
    np.testing.assert_allclose(rays.directions[0], direction, rtol=0, atol=1e-11)


def test_parallel_rays_start_on_the_near_plane_and_share_a_direction():
    camera = Camera.orthographic((0, 0, 5), (0, 0, 0), (0, 1, 0), 4.0, 1.0, 10.0)
    rays = pixel_rays(camera, 4, 2, all_pixels(4, 2))
    # width / height = 2, so the image is 8 wide and 4 high
    np.testing.assert_array_equal(rays.origins[:4, 0], [-3, -1, 1, 3])
    np.testing.assert_array_equal(rays.origins[::4, 1], [1, -1])
    np.testing.assert_array_equal(rays.origins[:, 2], 4.0)
    np.testing.assert_array_equal(rays.directions, np.tile([0, 0, -1.0], (8, 1)))


@pytest.mark.parametrize("clip_z", ["-1..1", "0..1"])
@pytest.mark.parametrize("kind", ["perspective", "orthographic"])
def test_the_matrices_of_a_camera_give_back_its_rays(kind, clip_z):
    place = ((3, 1, 2), (0, 0.5, 0), (0.1, 1, 0))
    build = Camera.look_at if kind == "perspective" else Camera.orthographic
    camera = build(*place, 35.0, 0.5, 20.0, clip_z=clip_z)
    given_matrices = Camera.from_matrices(camera.view_from_world, camera.clip_from_view(6, 4), clip_z=clip_z)
    first, second = (pixel_rays(c, 6, 4, all_pixels(6, 4)) for c in (camera, given_matrices))
    # near comes back from the matrix through a division by a difference: 1e-13 of the far plane
    np.testing.assert_allclose(first.origins, second.origins, rtol=0, atol=1e-12)
    np.testing.assert_allclose(first.directions, second.directions, rtol=0, atol=4e-16)


@pytest.mark.parametrize("last_row", [(0, 0, -1, 0), (0, 0, 0, 1)])
def test_projected_points_lie_on_the_rays_of_their_pixels(last_row):
    # Off-centre, sheared, and for parallel rays oblique.
    matrix = np.array([[1.5, 0.1, 0.2, 0], [0, 2.0, -0.3, 0], [0, 0, -1.02, -0.2], last_row])
    view = Camera.look_at((3, 1, 2), (0, 0.5, 0), (0.1, 1, 0), 35.0, 0.5, 20.0).view_from_world
    width, height = 4, 3
    matrix[0, :2] *= 2.0 / np.linalg.norm(matrix[0, :2]) * height / width
    camera = Camera.from_matrices(view, matrix)
    rays = pixel_rays(camera, width, height, all_pixels(width, height))
    ndc = pixel_ndc(width, height, all_pixels(width, height))
    for distance in (0.0 if camera.is_parallel else 0.5, 7.0):
        points = np.c_[rays.origins + distance * rays.directions, np.ones(12)] @ (matrix @ view).T
        # a handful of roundings of numbers near 10
        np.testing.assert_allclose(points[:, :2] / points[:, 3:], ndc, rtol=0, atol=1e-14)
    np.testing.assert_allclose(np.linalg.norm(rays.directions, axis=1), 1.0, rtol=0, atol=4e-16)
    if camera.is_parallel:  # they start on the near plane
        depth = -(rays.origins @ view[2, :3] + view[2, 3])
        np.testing.assert_allclose(depth, camera.near, rtol=0, atol=1e-14)


@pytest.mark.parametrize("build", [Camera.look_at, Camera.orthographic])
def test_a_ray_is_the_same_to_the_bit_in_any_company(build):
    camera = build((3, 1, 2), (0, 0.5, 0), (0.1, 1, 0), 35.0, 0.5, 20.0)
    together = pixel_rays(camera, 37, 23, all_pixels(37, 23))
    for part in (np.arange(5), np.arange(5, 6), np.arange(300, 851, 3)):
        rays = pixel_rays(camera, 37, 23, part)
        np.testing.assert_array_equal(rays.origins, together.origins[part])
        np.testing.assert_array_equal(rays.directions, together.directions[part])
