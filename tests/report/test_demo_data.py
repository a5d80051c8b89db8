from pathlib import Path

import numpy as np
import pytest
import trimesh

import volref as vr
from data_gen.demo import (
    TOP_MM,
    baked_colors,
    cavities,
    demo_head,
    ply_bytes,
    scene_document,
    vertex_normals,
    write_demo,
)
from volref.io.guard import read_json
from volref.report.demo import DATA

REAL = Path(__file__).parent.parent / "data"
HEAD, WHITE_MATTER = REAL / "mri_mni152_t1_1mm.nii.gz", REAL / "mesh_mni_white_matter.ply"


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("data")
    write_demo(HEAD, WHITE_MATTER, folder)
    return folder


def test_the_files_in_the_package_are_what_the_script_makes(made):
    ours, theirs = vr.load_scene(made / "scene.json"), vr.load_scene(DATA / "scene.json")
    np.testing.assert_array_equal(ours.volume.values, theirs.volume.values)
    np.testing.assert_array_equal(ours.volume.world_from_index, theirs.volume.world_from_index)
    np.testing.assert_array_equal(ours.meshes[0].vertices, theirs.meshes[0].vertices)
    np.testing.assert_array_equal(ours.meshes[0].faces, theirs.meshes[0].faces)
    # One code: exp and sqrt may differ in their last bit between machines, which may turn a rounding.
    np.testing.assert_allclose(ours.meshes[0].colors, theirs.meshes[0].colors, rtol=0, atol=1.001 / 255)
    assert read_json(DATA / "scene.json") == scene_document()


def test_no_voxel_was_moved_or_changed():
    whole, part = vr.load_volume(HEAD), vr.load_scene(DATA / "scene.json").volume
    index = (part.world_from_index[:3, 3] - whole.world_from_index[:3, 3]).astype(int)[::-1]
    cut = whole.values[tuple(slice(i, i + n) for i, n in zip(index, part.values.shape, strict=True))]
    np.testing.assert_array_equal(part.values, cut)


def test_only_air_and_the_top_are_cut_off():
    whole, part = vr.load_volume(HEAD), vr.load_scene(DATA / "scene.json").volume
    below = whole.values[: int(TOP_MM - whole.origin[2]) + 1]
    assert np.count_nonzero(below) == np.count_nonzero(part.values)
    assert part.corners[:, 2].max() == TOP_MM + 0.5 - TOP_MM % 1


def test_a_head_with_no_air_around_it_is_cut_at_the_top_only():
    volume = vr.Volume(np.ones((60, 3, 4), np.uint8), origin=(0, 0, 0))
    assert demo_head(volume).size == (4, 3, 43)


def test_the_surface_lies_inside_the_head_and_rises_out_of_the_volume():
    scene = vr.load_scene(DATA / "scene.json")
    low, high = scene.volume.corners.min(axis=0), scene.volume.corners.max(axis=0)
    vertices = scene.meshes[0].vertices
    assert (vertices.min(axis=0) > low).all()
    assert (vertices.max(axis=0)[:2] < high[:2]).all()
    assert vertices[:, 2].max() > high[2] + 20


def test_a_normal_is_the_sum_of_those_around_weighted_by_area():
    box = trimesh.creation.box((2.0, 3.0, 5.0))
    total = np.zeros((8, 3))
    for face, area, normal in zip(box.faces, box.area_faces, box.face_normals, strict=True):
        for vertex in face:
            total[vertex] += area * normal
    expected = total / np.linalg.norm(total, axis=1, keepdims=True)
    # A few roundings of numbers up to 15 (areas).
    np.testing.assert_allclose(vertex_normals(box.vertices, box.faces), expected, rtol=0, atol=1e-14)


def test_the_file_gives_the_mesh_back_in_its_own_precision(tmp_path):
    sphere = trimesh.creation.icosphere(subdivisions=3, radius=5.0)
    colors = np.linspace(0, 1, sphere.vertices.size).reshape(-1, 3)
    path = tmp_path / "sphere.ply"
    path.write_bytes(ply_bytes(sphere.vertices, sphere.faces, colors))
    back = vr.load_mesh(path)
    np.testing.assert_array_equal(back.faces, sphere.faces)
    np.testing.assert_array_equal(back.vertices, sphere.vertices.astype(np.float32))
    np.testing.assert_allclose(back.colors, colors, rtol=0, atol=0.5001 / 255)  # half a code


def test_a_ridge_lies_more_open_than_a_groove():
    x, y = np.meshgrid(np.arange(40.0), np.arange(40.0), indexing="ij")
    vertices = np.stack([x, y, 3 * np.sin(x * np.pi / 10)], axis=-1).reshape(-1, 3)
    corner = (np.arange(39)[:, None] * 40 + np.arange(39)).reshape(-1)
    faces = np.concatenate(
        [
            np.stack([corner, corner + 40, corner + 1], axis=1),
            np.stack([corner + 1, corner + 40, corner + 41], axis=1),
        ]
    )
    normals = vertex_normals(vertices, faces)
    assert (normals[:, 2] > 0).all()
    cavity = cavities(vertices, faces, normals).reshape(40, 40)
    assert cavity[5, 20] > 0.9
    assert cavity[15, 20] < 0.4


def test_baked_colours_are_colours():
    sphere = trimesh.creation.icosphere(subdivisions=3, radius=20.0)
    colors = baked_colors(sphere.vertices, sphere.faces)
    assert colors.min() >= 0
    assert colors.max() <= 1
    up = sphere.vertices[:, 2] > 15
    down = sphere.vertices[:, 2] < -15
    assert colors[up].mean() > 2 * colors[down].mean()
