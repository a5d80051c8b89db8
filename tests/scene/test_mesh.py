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
