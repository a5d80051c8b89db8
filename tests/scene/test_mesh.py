import dataclasses

import numpy as np
import pytest

from volref import Mesh, SceneError

QUAD = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
HALVES = [(0, 1, 2), (0, 2, 3)]


def test_degenerate_triangles_are_dropped_with_their_colours_and_counted():
    faces = [(0, 1, 2), (0, 0, 2), (0, 2, 3)]
    mesh = Mesh(QUAD, faces, colors=[(1, 0, 0), (0, 1, 0), (0, 0, 1)])
    assert mesh.dropped == 1
    assert mesh.faces.tolist() == [list(half) for half in HALVES]
    assert mesh.colors.tolist() == [[1, 0, 0], [0, 0, 1]]


def test_triangles_on_a_line_are_degenerate_however_rounded():
    direction = np.array([0.1, 0.7, 0.3])
    points = np.outer([0, 1 / 3, 0.9], direction)  # each coordinate off by up to half an ulp
    with pytest.raises(SceneError, match="a triangle with an area, got 1 without"):
        Mesh(points, [(0, 1, 2)])


def test_small_and_thin_triangles_are_kept():
    assert Mesh(np.multiply(QUAD, 1e-30), HALVES).dropped == 0
    assert Mesh(np.multiply(QUAD, (1, 1e-12, 1)), HALVES).dropped == 0


@pytest.mark.parametrize(
    ("colors", "coloring"),
    [((1, 0, 0), "uniform"), (np.zeros((4, 3)), "vertex"), (np.zeros((2, 3)), "face")],
)
def test_the_shape_of_the_colours_tells_what_they_belong_to(colors, coloring):
    assert Mesh(QUAD, HALVES, colors).coloring == coloring


def test_as_many_vertices_as_faces_leave_it_open():
    tetrahedron = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
    faces = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]
    with pytest.raises(SceneError, match="could belong to vertices or faces"):
        Mesh(tetrahedron, faces, np.zeros((4, 3)))
    assert Mesh(tetrahedron, faces, np.zeros((4, 3)), coloring="face").coloring == "face"


def test_a_texture_of_bytes_is_divided_by_255_and_never_decoded():
    texture = np.full((2, 2, 3), 51, np.uint8)
    mesh = Mesh(QUAD, HALVES, uv=[(0, 0), (1, 0), (1, 1), (0, 1)], texture=texture)
    assert mesh.coloring == "texture"
    assert (mesh.texture == 0.2).all()


@pytest.mark.parametrize(
    ("faces", "more"),
    [
        ([[0, 1, 2], [0, 1]], {}),
        (HALVES, {"colors": [[0, 0, 1], [0, 1]]}),
        (HALVES, {"uv": [(0, 0)] * 4, "texture": [[[0, 0, 1]], [[0, 0, 1], [0, 0, 1]]]}),
    ],
)
def test_ragged_rows_are_refused_in_one_sentence(faces, more):
    with pytest.raises(SceneError, match="must be an array, got rows of different lengths"):
        Mesh(QUAD, faces, **more)


def test_a_mesh_is_transparent_if_its_opacity_or_any_alpha_is_below_one():
    uv = [(0, 0), (1, 0), (1, 1), (0, 1)]
    assert not Mesh(QUAD, HALVES).transparent
    assert not Mesh(QUAD, HALVES, (1, 0, 0, 1)).transparent
    assert Mesh(QUAD, HALVES, opacity=0.5).transparent
    assert Mesh(QUAD, HALVES, (1, 0, 0, 0.5)).transparent
    assert Mesh(QUAD, HALVES, np.full((4, 4), 0.5)).transparent
    codes = np.full((2, 2, 4), 255, np.uint8)
    assert not Mesh(QUAD, HALVES, uv=uv, texture=codes).transparent
    codes[0, 0, 3] = 254
    assert Mesh(QUAD, HALVES, uv=uv, texture=codes).transparent


def test_normals_of_vertices_that_no_triangle_uses_do_not_matter():
    normals = np.zeros((5, 3))
    normals[:4, 2] = 7
    mesh = Mesh([*QUAD, (9, 9, 9)], HALVES, lit=True, normals=normals)
    assert mesh.normals.tolist() == normals.tolist()


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"opacity": 0}, "mesh.opacity must be above 0, got 0"),
        ({"opacity": 1.5}, "mesh.opacity must be at most 1, got 1.5"),
        ({"opacity": np.nan}, "mesh.opacity must be finite"),
        ({"colors": (1, 0, 0, 255)}, "mesh.colors must have alphas of at most 1, got 255"),
        ({"colors": (1, 0, -1, 0)}, "mesh.colors must be at least 0, got -1"),
        ({"normals": np.ones((3, 3))}, r"mesh.normals must have shape \(4, 3\)"),
        ({"normals": [(0, 0, 1), (0, 0, 0), (0, 0, 1), (0, 0, 1)]}, "must not be 0, got .* at vertex 1"),
        ({"sides": "outer"}, "mesh.sides must be 'both' or 'front' or 'back', got 'outer'"),
        ({"back_color": (1, 0, 0, 1)}, r"mesh.back_color must have shape \(3\)"),
        ({"back_color": (1, -1, 0)}, "mesh.back_color must be at least 0, got -1"),
    ],
)
def test_what_a_mesh_cannot_be_is_refused_in_one_sentence(options, sentence):
    with pytest.raises(SceneError, match=sentence):
        Mesh(QUAD, HALVES, **options)


def test_a_mesh_from_elsewhere_can_be_given_another_look():
    mesh = Mesh(QUAD, HALVES, np.eye(4)[:, :3], back_color=(1, 0, 0))
    glass = dataclasses.replace(mesh, opacity=0.25, lit=True)
    assert (glass.opacity, glass.lit, glass.transparent) == (0.25, True, True)
    assert glass.coloring == "vertex"
    assert glass.colors.tolist() == mesh.colors.tolist()
    assert glass.back_color.tolist() == [1, 0, 0]
