"""What `volref info` prints: worked values, and JSON throughout."""

import json

import h5py
import numpy as np
import pytest
import trimesh

from tests.bad_files import TRANSFER, scene_document
from volref.errors import FormatError
from volref.io import describe_file, load_mesh, save_mesh, save_volume, write_image, write_png
from volref.io.info import is_watertight
from volref.scene import Mesh, Volume


def describe(path, **statement):
    about = describe_file(path, **statement)
    assert json.loads(json.dumps(about, allow_nan=False)) == about
    return about


def test_a_volume_states_its_place_and_range(tmp_path):
    values = np.arange(24, dtype=np.int16).reshape(2, 3, 4) - 5
    save_volume(Volume(values, (1, 2, 3)), tmp_path / "v.npz")
    about = describe(tmp_path / "v.npz")
    assert about["kind"] == "volume"
    assert (about["size"], about["dtype"], about["memory_bytes"]) == ([4, 3, 2], "int16", 48)
    assert about["value_range"] == [-5, 18]
    assert about["bounds"] == [[-0.5, -1, -1.5], [3.5, 5, 4.5]]  # half a voxel beyond the outer centres


def test_the_real_files_are_described():
    head = describe("tests/data/mri_mni152_t1_1mm.nii.gz")
    assert (head["kind"], head["size"], head["origin"]) == ("volume", [197, 233, 189], [-98, -134, -72])
    nut = describe("tests/data/mesh_nut.ply")["meshes"][0]
    assert (nut["vertices"], nut["faces"], nut["watertight"]) == (523, 1046, True)
    assert describe("tests/data/mesh_teapot_uv.obj")["meshes"][0]["watertight"] is False


@pytest.mark.parametrize("name", ["mesh_nut.ply", "mesh_mni_white_matter.ply"])
def test_watertight_agrees_with_trimesh(name):
    theirs = trimesh.load_mesh(f"tests/data/{name}")
    mesh = load_mesh(f"tests/data/{name}")
    assert is_watertight(mesh) == theirs.is_watertight
    opened = Mesh(mesh.vertices, mesh.faces[1:])
    assert not is_watertight(opened)


def test_scenes_transfer_functions_images_and_tables_are_told_apart(tmp_path):
    (tmp_path / "s.json").write_text(json.dumps(scene_document()))
    (tmp_path / "t.json").write_text(
        json.dumps({"format": "volref-transfer", "format_version": 1} | TRANSFER)
    )
    np.save(tmp_path / "t.npy", np.zeros((256, 4), np.uint8))
    np.save(tmp_path / "v.npy", np.zeros((2, 3, 5), np.uint8))
    write_image(tmp_path / "i.npy", np.zeros((2, 3, 4)))
    write_image(tmp_path / "i.npz", np.ones((2, 3, 4)))
    write_png(tmp_path / "i.png", np.full((2, 3, 4), 255, np.uint8))
    save_volume(Volume(np.zeros((2, 3, 5), np.uint8)), tmp_path / "a.png")
    save_mesh(load_mesh("tests/data/mesh_nut.ply"), tmp_path / "m.npz")
    kinds = {path.name: describe(path)["kind"] for path in tmp_path.iterdir() if path.name != "a.png.json"}
    assert kinds == {
        "s.json": "scene",
        "t.json": "transfer",
        "t.npy": "table",
        "v.npy": "volume",
        "i.npy": "image",
        "i.npz": "image",
        "i.png": "image",
        "a.png": "volume",
        "m.npz": "mesh",
    }
    scene = describe(tmp_path / "s.json")
    assert (scene["camera"], scene["volume"], len(scene["meshes"])) == ("perspective", None, 1)
    assert describe(tmp_path / "i.png")["stored"] == "3 x 2 pixels, 8-bit RGBA"
    assert describe(tmp_path / "t.json")["knots"] == 2


def test_a_raw_file_is_described_with_its_statement(tmp_path):
    (tmp_path / "v.raw").write_bytes(bytes(range(24)))
    stated = {"size": (4, 3, 2), "dtype": "uint8", "byte_order": "little", "skip": 0, "spacing": (1, 1, 1)}
    assert describe(tmp_path / "v.raw", **stated)["value_range"] == [0, 23]


def test_an_unknown_file_is_refused(tmp_path):
    (tmp_path / "a.xyz").write_text("x")
    with pytest.raises(FormatError, match="must be a volume, mesh, scene"):
        describe_file(tmp_path / "a.xyz")


def test_an_npy_volume_4_across_with_its_sidecar_is_a_volume(tmp_path):
    save_volume(Volume(np.zeros((2, 3, 4), np.uint8)), tmp_path / "v.npy")
    assert describe(tmp_path / "v.npy")["size"] == [4, 3, 2]
    (tmp_path / "v.npy.json").unlink()
    assert describe(tmp_path / "v.npy")["kind"] == "image"


def test_radars_and_the_transfer_functions_of_other_programs_are_told_apart(tmp_path):
    radar = describe("tests/data/radar_knmi_denhelder_20110610.npz")
    assert (radar["kind"], radar["sweeps"], radar["value_range"]) == ("radar", 14, [-31.5, 66.5])
    presets = describe("tests/data/tf_slicer_presets.json")
    assert (presets["kind"], presets["program"], len(presets["names"])) == ("transfers", "Slicer", 26)
    assert "Cool to Warm" in describe("tests/data/tf_paraview_colormaps.json")["names"]
    with h5py.File(tmp_path / "scan.h5", "w") as file:
        file.create_group("dataset1")
    with pytest.raises(FormatError, match=r"scan.h5"):
        describe_file(tmp_path / "scan.h5")
    with h5py.File(tmp_path / "box.h5", "w") as file:
        file["density"] = np.zeros((3, 4, 5))
        file["density"].attrs["spacing"] = (1.0, 1.0, 1.0)
    assert describe_file(tmp_path / "box.h5")["kind"] == "volume"
