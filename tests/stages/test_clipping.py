from fractions import Fraction

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from volref.scene.camera import Camera
from volref.stages.clipping import clip_triangles, project

NEAR, FAR, BAND = 1.0, 50.0, 1000.0
EYE = {"eye": (0, 0, 0), "target": (0, 0, -1), "up": (0, 1, 0)}
PERSPECTIVE = Camera.look_at(**EYE, fov_y=60.0, near=NEAR, far=FAR)
PARALLEL = Camera.orthographic(**EYE, height=4.0, near=NEAR, far=FAR)
OFF_CENTRE = Camera.from_matrices(
    np.eye(4), [[1.5, 0, 0.3, 0], [0, 2.0, -0.2, 0], [0, 0, -1.02, -2.02], [0, 0, -1, 0]]
)

coordinate = st.floats(-2000, 2000, width=32)
vertex = st.tuples(coordinate, coordinate, st.floats(-20, 40, width=32))


def triangle_mesh(*triangles):
    vertices = np.array([corner for triangle in triangles for corner in triangle], dtype=np.float64).T
    return vertices, np.arange(3 * len(triangles)).reshape(-1, 3).T


@pytest.mark.parametrize("camera", [PERSPECTIVE, PARALLEL, OFF_CENTRE])
def test_projected_vertices_are_the_homogeneous_pixels_of_the_matrices(camera):
    points = np.random.default_rng(0).uniform(-5, 5, (50, 3))
    clip = np.c_[points, np.ones(50)] @ (camera.clip_from_view(64, 48) @ camera.view_from_world).T
    expected = [(clip[:, 0] + clip[:, 3]) * 32, (clip[:, 3] - clip[:, 1]) * 24, -points[:, 2]]
    # Three products and sums of numbers up to 20, times half the width: a dozen eps of 640.
    np.testing.assert_allclose(project(points, camera, 64, 48), expected, rtol=0, atol=12 * 640 * 2.3e-16)


def test_pixel_centres_lie_at_a_half():
    points = np.array([[-0.75, 0.5, -1.0], [0.75, -0.5, -1.0]])
    camera = Camera.look_at(**EYE, fov_y=90.0, near=0.1, far=9.0)
    x, y, depth = project(points * np.array([2.0, 1.0, 1.0]), camera, 4, 2)
    # cot(45 degrees) is 1 to one eps.
    np.testing.assert_allclose(x / depth, [0.5, 3.5], rtol=1e-15)
    np.testing.assert_allclose(y / depth, [0.5, 1.5], rtol=1e-15)


def test_a_point_projects_to_the_same_bits_wherever_it_stands_in_the_array():
    point = np.array([0.1, 0.7, -3.3])
    for count in range(1, 40):
        vertices = project(np.tile(point, (count, 1)), PERSPECTIVE, 640, 480)
        assert (vertices == vertices[:, :1]).all()


def test_triangles_that_cross_nothing_are_handed_on_untouched():
    vertices, corners = triangle_mesh([(0, 0, 2), (9, 0, 2), (0, 9, 3)])
    result, result_corners, source = clip_triangles(vertices, corners, PERSPECTIVE, BAND)
    assert result is vertices
    assert result_corners is corners
    assert source.tolist() == [0]


@pytest.mark.parametrize(
    ("depths", "count"), [((2, 2, 2), 1), ((0, 2, 2), 2), ((0, 0, 2), 1), ((0, 0, 0), 0)]
)
@pytest.mark.parametrize("turn", range(3))
def test_a_triangle_becomes_as_many_as_its_corners_before_the_near_plane_say(depths, count, turn):
    corners = [(0, 0, depths[0]), (9, 0, depths[1]), (0, 9, depths[2])]
    vertices, faces = triangle_mesh(corners[turn:] + corners[:turn])
    _, result, source = clip_triangles(vertices, faces, PERSPECTIVE, BAND)
    assert result.shape == (3, count)
    assert source.tolist() == [0] * count


def test_corners_on_a_plane_are_inside():
    vertices, faces = triangle_mesh([(0, 0, NEAR), (BAND * NEAR, 0, NEAR), (0, -BAND * FAR, FAR)])
    assert clip_triangles(vertices, faces, PERSPECTIVE, BAND)[0] is vertices


def test_triangles_beyond_the_far_plane_are_dropped_and_those_across_it_kept_whole():
    beyond = [(0, 0, 60), (1, 0, 60), (0, 1, 70)]
    across = [(0, 0, 40), (1, 0, 60), (0, 1, 70)]
    vertices, faces = triangle_mesh(beyond, across)
    _, result, source = clip_triangles(vertices, faces, PERSPECTIVE, BAND)
    assert source.tolist() == [1]
    assert result[:, 0].tolist() == [3, 4, 5]


def test_unused_vertices_can_be_divided_by_their_depth():
    vertices, faces = triangle_mesh([(1, 1, 0), (0, 0, 2), (2, 2, -3)], [(0, 0, 2), (1, 0, 2), (0, 1, 2)])
    result, _, _ = clip_triangles(vertices, faces, PERSPECTIVE, BAND)
    assert (result[2] >= NEAR).all()


def cut_vertices(camera, *triangle):
    """Return the corners of what is left of one triangle as a set of exact tuples."""
    vertices, corners, _ = clip_triangles(*triangle_mesh(triangle), camera, BAND)
    return {tuple(vertices[:, i].tolist()) for i in corners.ravel()}


def inside_distances(camera, point):
    x, y, depth = point
    reach = BAND * (1 if camera.is_parallel else depth)
    return [depth - Fraction(NEAR), reach - x, reach + x, reach - y, reach + y]


def part_inside(camera, start, end):
    """Return how much of a segment is inside, 0 to 1 (Liang and Barsky 1984), one plane at a time."""
    low, high = Fraction(0), Fraction(1)
    for at_start, at_end in zip(inside_distances(camera, start), inside_distances(camera, end), strict=True):
        if at_start < 0 and at_end < 0:
            return 0
        if at_start < 0:
            low = max(low, at_start / (at_start - at_end))
        if at_end < 0:
            high = min(high, at_start / (at_start - at_end))
    return high - low


def exact_polygon(camera, triangle):
    """Cut one triangle in fractions, vertex by vertex (Sutherland and Hodgman 1974)."""
    polygon = list(triangle)
    for plane in range(5):
        result = []
        for start, end in zip(polygon, polygon[1:] + polygon[:1], strict=True):
            a, b = inside_distances(camera, start)[plane], inside_distances(camera, end)[plane]
            if a >= 0:
                result.append(start)
            if (a < 0) != (b < 0):
                result.append([p + a / (a - b) * (q - p) for p, q in zip(start, end, strict=True)])
        polygon = result
    return polygon


def area_vector(a, b, c):
    (x1, y1, z1), (x2, y2, z2) = ([q - p for p, q in zip(a, other, strict=True)] for other in (b, c))
    return np.array([y1 * z2 - z1 * y2, z1 * x2 - x1 * z2, x1 * y2 - y1 * x2]) / 2


@pytest.mark.parametrize("camera", [PERSPECTIVE, PARALLEL], ids=["perspective", "parallel"])
@given(a=vertex, b=vertex, c=vertex, d=vertex)
@settings(max_examples=100, deadline=None)
def test_two_triangles_get_bit_equal_points_on_their_common_edge(camera, a, b, c, d):
    ends = [[Fraction(number) for number in end] for end in (a, b)]
    # A part this long has two ends that differ after rounding.
    assume(a != b and part_inside(camera, *ends) > Fraction(1, 1000))
    common = cut_vertices(camera, a, b, c) & cut_vertices(camera, d, b, a)
    on_both = [end for end in common if part_inside(camera, *ends) and near_line(end, a, b)]
    assert len(on_both) >= 2


def near_line(point, a, b):
    """Say whether a point is on the line a-b to rounding: sine of the angle below 1e-9."""
    along, across = np.subtract(b, a), np.subtract(point, a)
    return np.linalg.norm(np.cross(along, across)) <= 1e-9 * np.linalg.norm(along) * 4000


@pytest.mark.parametrize("camera", [PERSPECTIVE, PARALLEL], ids=["perspective", "parallel"])
@given(a=vertex, b=vertex, c=vertex)
@settings(max_examples=100, deadline=None)
def test_what_is_left_has_exactly_the_area_inside(camera, a, b, c):
    assume(min(corner[2] for corner in (a, b, c)) <= FAR)
    vertices, corners, _ = clip_triangles(*triangle_mesh((a, b, c)), camera, BAND)
    pieces = [vertices[:, triangle].T.tolist() for triangle in corners.T]
    polygon = exact_polygon(camera, [[Fraction(number) for number in corner] for corner in (a, b, c)])
    exact = [area_vector(polygon[0], *polygon[i : i + 2]) for i in range(1, len(polygon) - 1)]
    expected = np.sum(exact, axis=0).astype(float) if exact else np.zeros(3)
    found = np.sum([area_vector(*piece) for piece in pieces], axis=0) if pieces else np.zeros(3)
    # Coordinates up to 4000 (2000 twice: an edge), off by up to four eps each after five cuts, in products.
    np.testing.assert_allclose(found, expected, rtol=0, atol=100 * 4000**2 * np.finfo(float).eps)


def test_what_is_left_is_inside():
    rng = np.random.default_rng(1)
    vertices = np.stack([*rng.uniform(-9e4, 9e4, (2, 900)), rng.uniform(-20, 40, 900)])
    faces = np.arange(900).reshape(3, 300)
    for camera in (PERSPECTIVE, PARALLEL):
        result, corners, source = clip_triangles(vertices, faces, camera, BAND)
        x, y, depth = result[:, corners]
        assert len(np.unique(source)) > 30
        assert (depth >= NEAR).all()
        reach = BAND * (1 if camera.is_parallel else depth)
        # A cut point is off by a few eps of the ends of its edge, up to 9e4, five times.
        assert (np.maximum(np.abs(x), np.abs(y)) <= reach + 50 * 9e4 * np.finfo(float).eps).all()


def test_a_plane_that_reaches_far_behind_the_camera_is_cut_at_the_near_plane_itself():
    """The cut point is 1e9 units from its inner end, where one rounding is larger than near."""
    camera = Camera.look_at(**EYE, fov_y=60.0, near=1e-9, far=1e12)
    vertices, faces = triangle_mesh([(0, 0, 1e9), (1e-6, 0, -1e9), (0, 1e-6, -1e9)])
    result, corners, _ = clip_triangles(vertices, faces, camera, BAND)
    assert np.sort(result[2, corners].ravel())[0] == 1e-9
