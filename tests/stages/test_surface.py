import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from volref.records import Rays
from volref.scene.mesh import Mesh
from volref.stages.surface import (
    back_sides,
    meet_triangles,
    surface_colors,
    surface_normals,
    texture_colors,
)

EPS = np.finfo(np.float64).eps
DOWN = np.array([[0.0, 0.0, -1.0]])
RIGHT_TRIANGLE = np.array([[[0.0, 0, 0], [4, 0, 0], [0, 4, 0]]])


def straight_down(x, y, height=2.0):
    return Rays(np.array([[x, y, height]]), DOWN)


def texel_by_texel(texture, u, v, wrap):
    """One texture look-up with a scalar loop over the four texels around it."""
    height, width = texture.shape[:2]
    column, row = u * width - 0.5, (1 - v) * height - 0.5
    result = np.zeros(3)
    for dy in (0, 1):
        for dx in (0, 1):
            i, j = math.floor(column) + dx, math.floor(row) + dy
            weight = (1 - abs(column - i)) * (1 - abs(row - j))
            if wrap == "repeat":
                i, j = i % width, j % height
            i, j = min(max(i, 0), width - 1), min(max(j, 0), height - 1)
            result += weight * texture[j, i]
    return result


def test_a_ray_meets_the_plane_of_its_triangle_at_hand_computed_weights():
    distance, weights = meet_triangles(straight_down(1.0, 2.0), RIGHT_TRIANGLE)
    assert distance.tolist() == [2.0]
    assert weights.tolist() == [[0.25, 0.25, 0.5]]


def test_the_side_from_which_a_triangle_is_seen_does_not_matter():
    distance, weights = meet_triangles(straight_down(1.0, 2.0), RIGHT_TRIANGLE[:, ::-1])
    assert distance.tolist() == [2.0]
    assert weights.tolist() == [[0.5, 0.25, 0.25]]


@pytest.mark.parametrize(
    ("x", "y", "nearest"),
    [
        (-1e-6, 1.0, (0, 1)),
        (1.0, -1e-6, (1, 0)),
        (-1e-6, -1e-6, (0, 0)),
        (3.0, 1.0 + 2e-6, (3 - 1e-6, 1 + 1e-6)),
    ],
)
def test_a_ray_that_just_misses_takes_the_nearest_point_of_the_border(x, y, nearest):
    _, weights = meet_triangles(straight_down(x, y), RIGHT_TRIANGLE)
    # Weights are ratios of numbers around 4 with two or three roundings each.
    np.testing.assert_allclose(weights @ RIGHT_TRIANGLE[0, :, :2], [nearest], rtol=0, atol=16 * EPS)
    assert (weights >= 0).all()


def test_a_ray_that_misses_a_needle_keeps_its_place_along_the_needle():
    """Setting the negative weight to 0 and rescaling would jump to the middle corner, 4 units away."""
    needle = np.array([[[0.0, 0, 0], [10, 0, -10], [5, 1e-9, -5]]])
    distance, weights = meet_triangles(straight_down(9.0, 1e-6), needle)
    # The nearest point is 9.0 along the needle up to the needle's own width.
    np.testing.assert_allclose(weights @ needle[0, :, 0], [9.0], rtol=0, atol=1e-8)
    np.testing.assert_allclose(distance, [11.0], rtol=0, atol=1e-8)


def test_a_triangle_in_the_plane_of_the_ray_gives_a_point_of_the_triangle():
    upright = np.array([[[0.0, 0, 0], [0, 0, 1], [0, 1, 0]]])
    distance, weights = meet_triangles(straight_down(0.0, 0.25), upright)
    assert (weights >= 0).all()
    assert weights.sum() == 1.0
    assert 1.0 <= distance[0] <= 2.0


number = st.floats(-10, 10, width=32)


@given(corners=st.tuples(*[st.tuples(number, number, number)] * 3), x=number, y=number)
@settings(max_examples=200, deadline=None)
def test_weights_are_never_negative_and_sum_to_one(corners, x, y):
    distance, weights = meet_triangles(straight_down(x, y, 20.0), np.array([corners], dtype=np.float64))
    assert (weights >= 0).all()
    # Three quotients and two sums.
    assert abs(weights.sum() - 1) <= 4 * EPS
    depths = [20 - corner[2] for corner in corners]
    # A mean of numbers up to 30 with the weights above.
    assert min(depths) - 30 * 8 * EPS <= distance[0] <= max(depths) + 30 * 8 * EPS


@given(first=st.floats(0.05, 1), second=st.floats(0.05, 1), third=st.floats(0.05, 1), turn=st.integers(0, 2))
@settings(max_examples=200, deadline=None)
def test_a_ray_aimed_at_given_weights_finds_them(first, second, third, turn):
    wanted = np.array([first, second, third]) / (first + second + third)
    triangle = np.array([[-1.0, -2, 0.5], [3, 1, -1], [-2, 2.5, 0]])
    origin = np.array([0.3, -0.2, 6.0])
    toward = wanted @ triangle - origin
    rays = Rays(origin[None], (toward / np.linalg.norm(toward))[None])
    order = [(i + turn) % 3 for i in range(3)]
    distance, weights = meet_triangles(rays, triangle[None, order])
    # Volumes are sums of 18 products of numbers up to 8 x 8 x 1; their sum, twice the projected area, is
    # above 10.
    np.testing.assert_allclose(weights[0], wanted[order], rtol=0, atol=18 * 64 * EPS / 10)
    np.testing.assert_allclose(distance[0], np.linalg.norm(toward), rtol=18 * 64 * EPS / 10)


def test_colours_are_one_per_mesh_per_face_or_mixed_from_the_vertices():
    vertices, faces = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0)], [(0, 1, 2), (1, 3, 2)]
    which, weights = np.array([1, 0]), np.array([[0.5, 0.25, 0.25], [0.0, 1.0, 0.0]])
    uniform = Mesh(vertices, faces, colors=(0.5, 0.25, 1))
    per_face = Mesh(vertices, faces, colors=[(1, 0, 0), (0, 1, 0)])
    per_vertex = Mesh(vertices, faces, colors=[(9, 0, 0), (4, 0, 0), (0, 4, 0), (0, 0, 4)])
    assert surface_colors(uniform, which, weights).tolist() == [[0.5, 0.25, 1]] * 2
    assert surface_colors(per_face, which, weights).tolist() == [[0, 1, 0], [1, 0, 0]]
    assert surface_colors(per_vertex, which, weights).tolist() == [[2, 1, 1], [4, 0, 0]]


def test_a_textured_mesh_reads_its_texture_at_the_mixed_coordinates():
    texture = np.arange(12.0).reshape(2, 2, 3)
    mesh = Mesh(
        [(0, 0, 0), (1, 0, 0), (0, 1, 0)],
        [(0, 1, 2)],
        uv=[(0, 0), (1, 0), (0, 1)],
        texture=texture,
        wrap="clamp",
    )
    weights = np.array([[0.5, 0.25, 0.25], [0.0, 0.75, 0.25]])
    # Coordinates (0.25, 0.25), the lower left texel, and (0.75, 0.25), the lower right one.
    assert surface_colors(mesh, np.array([0, 0]), weights).tolist() == texture[1].tolist()


def test_half_a_texel_from_the_edge_is_the_centre_of_the_outer_texel():
    texture = np.random.default_rng(0).random((4, 8, 3))
    for row in range(4):
        for column in range(8):
            uv = np.array([[(column + 0.5) / 8, 1 - (row + 0.5) / 4]])
            for wrap in ("repeat", "clamp"):
                # Sizes are powers of two, so that the place of a centre is exact.
                np.testing.assert_array_equal(texture_colors(texture, uv, wrap), [texture[row, column]])


def test_v_runs_upwards():
    texture = np.array([[[1.0, 0, 0]], [[0, 0, 1.0]]])
    assert texture_colors(texture, np.array([[0.5, 0.9], [0.5, 0.1]]), "clamp").tolist() == [
        [1, 0, 0],
        [0, 0, 1],
    ]


def test_the_edge_of_a_texture_mixes_both_sides_if_it_repeats_and_stays_if_it_is_clamped():
    texture = np.zeros((1, 4, 3))
    texture[0, :, 0] = [1, 2, 4, 8]
    uv = np.array([[0.0, 0.5], [1.0, 0.5], [1.0625, 0.5], [-3.0, 0.5]])
    assert texture_colors(texture, uv, "repeat")[:, 0].tolist() == [4.5, 4.5, 2.75, 4.5]
    assert texture_colors(texture, uv, "clamp")[:, 0].tolist() == [1, 8, 8, 1]


@pytest.mark.parametrize("wrap", ["repeat", "clamp"])
@pytest.mark.parametrize("shape", [(1, 1, 3), (3, 5, 3), (7, 2, 3)])
def test_textures_agree_with_a_loop_over_texels(wrap, shape):
    rng = np.random.default_rng(5)
    texture, uv = rng.random(shape), rng.uniform(-3, 3, (300, 2))
    expected = [texel_by_texel(texture, u, v, wrap) for u, v in uv]
    # An index up to 3 x 7 carries its rounding into the weights.
    np.testing.assert_allclose(texture_colors(texture, uv, wrap), expected, rtol=0, atol=4 * 24 * EPS)


def test_a_coordinate_just_below_zero_repeats_without_leaving_the_texture():
    texture = np.array([[[1.0, 0, 0], [3.0, 0, 0]]])
    uv = np.array([[0.25 - 1e-17, 0.5], [-1e-300, 0.5], [np.nextafter(0.25, 0), 0.5]])
    # The last one is 4 x 2^-55 texels before the centre of texel 0, towards texel 1 on its other side.
    np.testing.assert_allclose(texture_colors(texture, uv, "repeat")[:, 0], [1, 2, 1], rtol=0, atol=4 * EPS)


def test_normals_of_length_one_whatever_the_size_of_triangles_and_vectors():
    for size in (1e-60, 1e-30, 1.0, 1e50):
        mesh = Mesh(size * RIGHT_TRIANGLE[0], [(0, 1, 2)])
        assert surface_normals(mesh, np.array([0]), np.full((1, 3), 1 / 3)).tolist() == [[0.0, 0.0, 1.0]]
    tilted = np.array([(1e-200, 0, 0), (0, 3e50, 4e50), (0, 0, -1)])
    mesh = Mesh(RIGHT_TRIANGLE[0], [(0, 1, 2)], normals=tilted)
    found = surface_normals(mesh, np.zeros(3, int), np.eye(3))
    np.testing.assert_allclose(found, [(1, 0, 0), (0, 0.6, 0.8), (0, 0, -1)], rtol=0, atol=2 * EPS)


def test_vertex_normals_that_cancel_leave_none():
    mesh = Mesh(RIGHT_TRIANGLE[0], [(0, 1, 2)], normals=[(0, 0, 1), (0, 0, -2), (1, 0, 0)])
    assert surface_normals(mesh, np.array([0]), np.array([[0.5, 0.5, 0.0]])).tolist() == [[0.0, 0.0, 0.0]]


def test_the_front_is_the_side_from_which_the_corners_run_counter_clockwise():
    both = np.concatenate([RIGHT_TRIANGLE, RIGHT_TRIANGLE[:, ::-1]])
    assert back_sides(both, np.tile(DOWN, (2, 1))).tolist() == [False, True]
    edge_on = np.array([[1.0, 0.0, 0.0]] * 2)
    assert back_sides(both, edge_on).tolist() == [False, False]


def test_colours_with_alpha_are_interpolated_straight():
    colors = [(1, 0, 0, 1), (0, 1, 0, 0), (0, 0, 1, 0.5)]
    mesh = Mesh(RIGHT_TRIANGLE[0], [(0, 1, 2)], colors, coloring="vertex")
    found = surface_colors(mesh, np.array([0]), np.array([[0.5, 0.25, 0.25]]))
    assert found.tolist() == [[0.5, 0.25, 0.25, 0.625]]
