import math

import numpy as np
import pytest
import trimesh

from volref.errors import SceneError
from volref.phantoms import meshes

BENT = [(0, 0, 0), (0, 0, 2), (1, 0, 3), (3, 1, 3)]
CLOSED = {
    "box": meshes.box_mesh((1, 2, 3), (4, 5, 6)),
    "sphere": meshes.sphere_mesh(2.0, (1, 0, 0)),
    "coarsest sphere": meshes.sphere_mesh(subdivisions=0),
    "torus": meshes.torus_mesh(),
    "tube": meshes.tube_mesh(),
    "bent tube": meshes.tube_mesh(BENT, 0.4, sides=12),
}


def as_trimesh(mesh):
    return trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)


@pytest.mark.parametrize("name", CLOSED)
def test_a_body_is_closed_and_wound_outwards(name):
    body = as_trimesh(CLOSED[name])
    assert body.is_watertight
    assert body.is_winding_consistent
    assert body.volume > 0
    assert CLOSED[name].dropped == 0


def test_a_box_has_its_edges():
    box = as_trimesh(CLOSED["box"])
    assert box.volume == 6.0  # exact: small whole numbers
    assert box.bounds.tolist() == [[3.5, 4.0, 4.5], [4.5, 6.0, 7.5]]


def test_the_vertices_of_a_sphere_lie_on_it():
    distance = np.linalg.norm(CLOSED["sphere"].vertices - (1, 0, 0), axis=1)
    assert distance == pytest.approx(2.0, rel=4 * np.finfo(float).eps)  # a norm and a shift by 1


def test_the_volume_of_a_sphere_converges_at_second_order_from_below():
    exact = 4 / 3 * math.pi
    gaps = [exact - as_trimesh(meshes.sphere_mesh(subdivisions=k)).volume for k in (2, 3, 4, 5)]
    assert min(gaps) > 0
    assert np.log2(np.array(gaps[:-1]) / gaps[1:]) == pytest.approx(2.0, abs=0.1)


def test_the_volume_of_a_torus_converges_at_second_order_from_below():
    exact = 2 * math.pi**2 * 0.3**2
    counts = [(24, 12), (48, 24), (96, 48), (192, 96)]
    gaps = [exact - as_trimesh(meshes.torus_mesh(segments=a, sides=b)).volume for a, b in counts]
    assert min(gaps) > 0
    assert np.log2(np.array(gaps[:-1]) / gaps[1:]) == pytest.approx(2.0, abs=0.1)


def test_a_straight_tube_is_a_prism():
    prism = 2.0 * 12 * 0.3**2 * math.sin(2 * math.pi / 24)
    # Some 100 signed volumes of size 0.01 are added.
    assert as_trimesh(CLOSED["tube"]).volume == pytest.approx(prism, rel=1e-14)


def test_a_bent_tube_keeps_its_radius_along_its_bends():
    mesh = CLOSED["bent tube"]
    rings = mesh.vertices[:-2].reshape(len(BENT), 12, 3)
    distance = np.linalg.norm(rings - np.array(BENT)[:, None], axis=2)
    assert distance == pytest.approx(0.4, rel=1e-14)  # unit vectors to a few ulp


def test_a_plane_shows_its_texture_upright():
    mesh = meshes.plane_mesh(2, 1)
    top_left = int(np.argmin(mesh.vertices @ (1, -1, 0)))
    assert mesh.uv[top_left].tolist() == [0.0, 1.0]
    assert mesh.texture[0, 0].tolist() == [0.9, 0.9, 0.9]
    assert as_trimesh(mesh).face_normals.tolist() == [[0, 0, 1], [0, 0, 1]]


def test_bad_bodies_are_refused():
    with pytest.raises(SceneError, match="tube_radius must be below radius"):
        meshes.torus_mesh(1.0, 1.0)
    with pytest.raises(SceneError, match="path must have at least two corners"):
        meshes.tube_mesh([(0, 0, 0), (0, 0, 0)])
    with pytest.raises(SceneError, match="sides must be a whole number from 3"):
        meshes.tube_mesh(sides=2)
