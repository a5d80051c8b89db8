"""Scenes as JSON: every number back bit for bit, and nothing read from outside the folder unless allowed."""

import json

import nibabel
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.bad_files import CAMERA, TRANSFER, TRIANGLE, scene_document
from tests.io.test_meshes import random_mesh
from tests.io.test_transfer import transfers
from volref.errors import FormatError
from volref.io import load_scene, save_scene
from volref.scene import Camera, Scene, Volume

RECORD_FIELDS = {
    "camera": ("view_from_world", "kind", "fov_y", "height", "near", "far", "clip_matrix", "clip_z"),
    "volume": ("values", "spacing", "origin", "direction", "centering"),
    "transfer": ("values", "colors", "extinction", "opacity", "unit_distance"),
}
MESH_FIELDS = ("vertices", "faces", "colors", "uv", "texture", "wrap", "coloring")
PROJECTION = [[1.2, 0, 0.1, 0], [0, 1.6, 0, 0], [0, 0, -1.02, -0.2], [0, 0, -1, 0]]

number = st.floats(-100, 100)


@st.composite
def cameras(draw):
    target = draw(st.tuples(number, number, number))
    eye = (target[0] + draw(st.floats(1, 50)), target[1] + draw(number), target[2])
    near = draw(st.floats(1e-3, 1))
    clip_z = draw(st.sampled_from(["-1..1", "0..1"]))
    look = (eye, target, (0, 0, 1), draw(st.floats(1, 170)), near, near + draw(st.floats(0.1, 1e4)))
    kind = draw(st.sampled_from(["perspective", "orthographic", "matrix"]))
    if kind == "perspective":
        return Camera.look_at(*look, clip_z=clip_z)
    parallel = Camera.orthographic(*look, clip_z=clip_z)
    return parallel if kind == "orthographic" else Camera.from_matrices(parallel.view_from_world, PROJECTION)


@st.composite
def volumes(draw):
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    kind = draw(st.sampled_from([np.uint8, np.int16, np.float32, np.float64]))
    values = (rng.random((2, 3, 4)) * 100).astype(kind)
    turned = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    place = draw(st.tuples(*[st.floats(1e-3, 1e3)] * 3)), draw(st.tuples(number, number, number))
    return Volume(values, *place, turned, draw(st.sampled_from(["cell", "node"])))


@st.composite
def scenes(draw):
    kinds = draw(st.lists(st.sampled_from(["uniform", "vertex", "face", "texture"]), max_size=2))
    meshes = [random_mesh(i, kind) for i, kind in enumerate(kinds)]
    volume = draw(volumes()) if not meshes or draw(st.booleans()) else None
    transfer = None if volume is None else draw(transfers())
    alpha = draw(st.floats(0.1, 1))
    return Scene(volume, transfer, draw(cameras()), 8, 6, meshes, background=(alpha / 3, 0.5, 2.0, alpha))


def assert_same_fields(one, other, names):
    for name in names:
        first, second = getattr(one, name), getattr(other, name)
        same = np.array_equal(first, second) if isinstance(first, np.ndarray) else first == second
        assert same, name
        if isinstance(first, np.ndarray):
            assert first.dtype == second.dtype


def assert_same_scene(one, other):
    for part, names in RECORD_FIELDS.items():
        first, second = getattr(one, part), getattr(other, part)
        assert (first is None) == (second is None)
        if first is not None:
            assert_same_fields(first, second, names)
    for first, second in zip(one.meshes, other.meshes, strict=True):
        assert_same_fields(first, second, MESH_FIELDS)
    assert_same_fields(one, other, ("width", "height", "background"))


@given(scenes())
def test_a_saved_scene_loads_bit_for_bit(tmp_path_factory, scene):
    path = tmp_path_factory.mktemp("scene") / "shot.json"
    save_scene(scene, path)
    assert_same_scene(load_scene(path), scene)


def write(folder, **change):
    (folder / "scene.json").write_text(json.dumps(scene_document(**change)))
    return folder / "scene.json"


def test_a_hand_written_scene_needs_no_more_than_its_parts(tmp_path):
    scene = load_scene(write(tmp_path))
    expected = Camera.look_at((0, 0, 5), (0, 0, 0), (0, 1, 0), 40, 0.1, 100)
    assert_same_fields(scene.camera, expected, RECORD_FIELDS["camera"])
    assert (scene.width, scene.height, scene.background) == (8, 6, (0, 0, 0, 0))
    assert len(scene.meshes) == 1


def test_the_matrices_of_a_program_are_read_rows_first(tmp_path):
    projection = np.array(PROJECTION)
    projection[0, 0] = 1.2  # 8 x 6 pixels: 1.6 / 1.2 = 8 / 6
    view = np.eye(4)
    view[:3, 3] = 1, 2, -5
    camera = {"kind": "matrix", "view_from_world": view.tolist(), "clip_from_view": projection.tolist()}
    again = load_scene(write(tmp_path, camera=camera)).camera
    assert np.array_equal(again.clip_matrix, projection)
    assert again.view_from_world[:3, 3].tolist() == [1, 2, -5]


def test_an_orthographic_camera_is_read(tmp_path):
    camera = {key: value for key, value in CAMERA.items() if key != "fov_y"}
    scene = load_scene(
        write(tmp_path, camera=camera | {"kind": "orthographic", "height": 3, "clip_z": "0..1"})
    )
    assert (scene.camera.kind, scene.camera.height, scene.camera.clip_z) == ("orthographic", 3, "0..1")


VOLUMES = {
    "v.npy": lambda path, values: np.save(path, values),
    "v.npz": lambda path, values: np.savez(path, volume=values),
    "v.nii.gz": lambda path, values: nibabel.save(nibabel.Nifti1Image(values.T, np.eye(4)), path),
    "v.raw": lambda path, values: values.tofile(path),
}
RAW = {"size": [4, 3, 2], "dtype": "int16", "byte_order": "little", "skip": 0, "spacing": [1, 1, 1]}


@pytest.mark.parametrize("name", VOLUMES)
def test_a_scene_names_volumes_of_any_format(tmp_path, name):
    values = np.arange(24, dtype="<i2").reshape(2, 3, 4)
    VOLUMES[name](tmp_path / name, values)
    volume = {"path": name, "origin": [1, 2, 3]} | (RAW if name == "v.raw" else {})
    scene = load_scene(write(tmp_path, volume=volume, transfer=TRANSFER))
    assert np.array_equal(scene.volume.values, values)
    assert scene.volume.origin == (1, 2, 3)


def test_a_scene_names_transfer_functions_in_files(tmp_path):
    np.save(tmp_path / "v.npy", np.zeros((1, 1, 1)))
    np.save(tmp_path / "t.npy", np.full((2, 4), 51, np.uint8))
    (tmp_path / "t.json").write_text(
        json.dumps({"format": "volref-transfer", "format_version": 1} | TRANSFER)
    )
    by_table = {"path": "t.npy", "domain": [0, 4], "unit_distance": 2, "texel_centers": True}
    volume = {"path": "v.npy"}
    assert load_scene(write(tmp_path, volume=volume, transfer=by_table)).transfer.values.tolist() == [1, 3]
    assert load_scene(write(tmp_path, volume=volume, transfer={"path": "t.json"})).transfer.opacity[1] == 0.5


def test_nan_voxels_are_replaced_where_the_scene_says_so(tmp_path):
    np.save(tmp_path / "v.npy", np.full((1, 1, 1), np.nan))
    scene = load_scene(write(tmp_path, volume={"path": "v.npy", "nan": 7}, transfer=TRANSFER))
    assert scene.volume.values.tolist() == [[[7]]]


@pytest.mark.parametrize("way", ["above", "absolute", "link"])
def test_a_file_outside_the_folder_is_read_only_when_allowed(tmp_path, way):
    (tmp_path / "in").mkdir()
    (tmp_path / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    (tmp_path / "in" / "link.obj").symlink_to(tmp_path / "a.obj")
    name = {"above": "../a.obj", "absolute": str(tmp_path / "a.obj"), "link": "link.obj"}[way]
    path = write(tmp_path / "in", meshes=[{"path": name}])
    with pytest.raises(FormatError, match="or pass allow_outside=True"):
        load_scene(path)
    assert len(load_scene(path, allow_outside=True).meshes) == 1


def test_a_path_that_leaves_and_comes_back_is_inside(tmp_path):
    (tmp_path / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    name = f"sub/../../{tmp_path.name}/a.obj"
    assert len(load_scene(write(tmp_path, meshes=[{"path": name}])).meshes) == 1


def test_an_existing_file_of_any_part_stops_the_whole_save(tmp_path):
    scene = load_scene(write(tmp_path))
    (tmp_path / "shot.mesh_0.npz").write_bytes(b"golden")
    with pytest.raises(FormatError, match=r"shot\.mesh_0\.npz must not exist yet"):
        save_scene(scene, tmp_path / "shot.json")
    assert sorted(entry.name for entry in tmp_path.iterdir()) == ["scene.json", "shot.mesh_0.npz"]
    save_scene(scene, tmp_path / "shot.json", overwrite=True)
    assert_same_scene(load_scene(tmp_path / "shot.json"), scene)


def test_a_scene_saved_over_the_files_it_was_read_from_keeps_its_values(tmp_path):
    """The old volume stays mapped while the new one takes its name."""
    scene = Scene(
        Volume(np.arange(24.0).reshape(2, 3, 4)),
        load_scene_transfer(tmp_path),
        load_scene(write(tmp_path)).camera,
        8,
        6,
    )
    save_scene(scene, tmp_path / "shot.json")
    again = load_scene(tmp_path / "shot.json")
    save_scene(again, tmp_path / "shot.json", overwrite=True)
    assert_same_scene(load_scene(tmp_path / "shot.json"), scene)


def load_scene_transfer(folder):
    np.save(folder / "v.npy", np.zeros((1, 1, 1)))
    return load_scene(write(folder, volume={"path": "v.npy"}, transfer=TRANSFER)).transfer


def test_one_mesh_file_with_several_meshes_gives_them_all(tmp_path):
    text = "o a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
    (tmp_path / "a.obj").write_text(text)
    scene = load_scene(write(tmp_path, meshes=[{"path": "a.obj"}, TRIANGLE | {"colors": [1, 0, 0]}]))
    assert [mesh.colors.tolist() for mesh in scene.meshes] == [[0.8, 0.8, 0.8], [1, 0, 0]]


def test_the_pixels_and_faces_of_a_scene_may_be_written_with_a_point(tmp_path):
    faces = {"faces": [[0.0, 1, 2.0]]}
    document = scene_document(width=4.0, height=3.0, meshes=[TRIANGLE | faces])
    (tmp_path / "scene.json").write_text(json.dumps(document))
    scene = load_scene(tmp_path / "scene.json")
    assert (scene.width, scene.height) == (4, 3)
    assert (type(scene.width), type(scene.height)) == (int, int)
    assert scene.meshes[0].faces.tolist() == [[0, 1, 2]]


def test_whole_numbers_of_20_digits_are_the_nearest_floats(tmp_path):
    text = json.dumps(scene_document()).replace('"far": 100', '"far": 100000000000000000000000')
    (tmp_path / "scene.json").write_text(text)
    assert load_scene(tmp_path / "scene.json").camera.far == 1e23
