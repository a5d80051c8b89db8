import hashlib
import json

import numpy as np
import pytest
import trimesh

import volref as vr
from data_gen.__main__ import main
from data_gen.catalogue import CATALOGUE
from data_gen.files import write_items
from volref.phantoms import fields, meshes, storms, transfer

SMALL = ["linear_ramp", "gaussian_blobs", "filaments", "storm_box", "torus_mesh", "plane_mesh", "tf_spiky"]


def digests(folder):
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in folder.iterdir()}


def test_a_second_run_writes_the_same_bytes(tmp_path, capsys):
    for run in ("one", "two"):
        assert main([str(tmp_path / run), *SMALL]) == 0
    assert digests(tmp_path / "one") == digests(tmp_path / "two")
    printed = capsys.readouterr().out.split()
    assert len(printed) == 2 * len(digests(tmp_path / "one"))


def test_another_seed_changes_what_is_seeded_and_nothing_else(tmp_path):
    for seed in ("1", "2"):
        assert main([str(tmp_path / seed), "linear_ramp", "gaussian_blobs", "--seed", seed]) == 0
    one, two = digests(tmp_path / "1"), digests(tmp_path / "2")
    assert {name for name in one if one[name] != two[name]} == {
        "gaussian_blobs.npy",
        "gaussian_blobs.about.json",
    }


def test_what_is_written_loads_with_volref(tmp_path):
    assert main([str(tmp_path), "marschner_lobb", "tf_spiky", "torus_mesh", "filaments"]) == 0
    want, volume = fields.marschner_lobb(), vr.load_volume(tmp_path / "marschner_lobb.npy")
    assert (volume.values == want.values).all()
    assert (volume.spacing, volume.origin, volume.centering) == (want.spacing, want.origin, "node")
    assert vr.load_volume(tmp_path / "filaments.npy").spacing == (1.0, 1.0, 2.0)
    table = vr.load_transfer(tmp_path / "tf_spiky.json")
    assert (table.extinction == transfer.spiky().extinction).all()
    assert len(vr.load_mesh(tmp_path / "torus_mesh.ply").faces) == len(meshes.torus_mesh().faces)


def test_each_item_says_that_it_is_made_up_and_its_seed(tmp_path):
    assert main([str(tmp_path), "marschner_lobb", "filaments", "--seed", "7"]) == 0
    about = {
        name: json.loads((tmp_path / f"{name}.about.json").read_text())
        for name in ("marschner_lobb", "filaments")
    }
    assert all(record["made_up"] for record in about.values())
    assert (about["marschner_lobb"]["seed"], about["filaments"]["seed"]) == (None, 7)


def test_a_radar_volume_comes_back_in_codes(tmp_path):
    scan = storms.sample_polar(storms.make_storm(1), 600.0, azimuths=12, gates=20, gate_length=5000.0)
    list(write_items(tmp_path, {"scan": (CATALOGUE["storm_polar"], scan)}, 1, force=False))
    record = json.loads((tmp_path / "scan.npz.json").read_text())
    arrays = np.load(tmp_path / "scan.npz")
    dbz = arrays["codes"] * record["gain"] + record["offset"]
    assert np.abs(dbz - scan.dbz).max() <= 0.25 + 1e-12  # half a code, and its rounding
    assert (arrays["range_m"] == scan.range_m).all()
    assert (arrays["time_s"] == scan.time_s).all()


@pytest.mark.slow
def test_everything_in_the_list_can_be_written(tmp_path):
    assert main([str(tmp_path)]) == 0
    assert all(any(tmp_path.glob(f"{name}*")) for name in CATALOGUE)
    assert len(np.load(tmp_path / "storm_polar_03.npz")["codes"]) == 14


def test_meshes_come_back_through_another_reader(tmp_path):
    assert main([str(tmp_path), "torus_mesh", "plane_mesh"]) == 0
    torus = trimesh.load_mesh(tmp_path / "torus_mesh.ply", process=False)
    want = meshes.torus_mesh()
    assert torus.is_watertight
    assert (torus.faces == want.faces).all()
    assert (torus.vertices == want.vertices).all()
    plane = trimesh.load_mesh(tmp_path / "plane_mesh.obj", process=False)
    assert (plane.visual.uv == meshes.plane_mesh().uv).all()
    assert plane.visual.material.image.size == (32, 32)


def test_nothing_is_overwritten_unless_forced(tmp_path, capsys):
    (tmp_path / "sphere.npy.json").write_text("mine")
    assert main([str(tmp_path), "linear_ramp", "sphere"]) == 2
    error = capsys.readouterr().err
    assert "sphere.npy.json must not exist yet, got a file that does; choose another name" in error
    assert error.count("\n") == 1
    assert [path.name for path in tmp_path.iterdir()] == ["sphere.npy.json"]
    assert main([str(tmp_path), "sphere", "--force"]) == 0
    assert (tmp_path / "sphere.npy.json").read_text() != "mine"


def test_an_interrupted_write_leaves_no_file(tmp_path, monkeypatch):
    def full_disk(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("pathlib.Path.replace", full_disk)
    assert main([str(tmp_path), "sphere"]) == 2
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ([], "OUT must be a folder, got none; name one, or pass --list"),
        (["OUT", "sphre"], "NAME must be in the list, got 'sphre'; pass --list to see it"),
        (["OUT", "sphere", "--seed", "-1"], "--seed must be at least 0, got -1; give another"),
    ],
)
def test_bad_use_is_one_sentence_and_exit_code_2(arguments, sentence, tmp_path, capsys):
    arguments = [str(tmp_path / "new") if a == "OUT" else a for a in arguments]
    assert main(arguments) == 2
    assert capsys.readouterr().err == f"data_gen: {sentence}\n"
    assert not (tmp_path / "new").exists()


def test_an_unknown_option_is_one_sentence_and_exit_code_2(capsys):
    with pytest.raises(SystemExit) as stop:
        main(["--sead", "1"])
    assert stop.value.code == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_a_file_in_the_place_of_the_folder_is_refused(tmp_path, capsys):
    (tmp_path / "file").write_text("")
    assert main([str(tmp_path / "file"), "sphere"]) == 2
    assert "OUT must be a folder, got the file" in capsys.readouterr().err


def test_the_list_names_everything_once(capsys):
    assert main(["--list"]) == 0
    names = [line.split()[0] for line in capsys.readouterr().out.splitlines()]
    assert names == list(CATALOGUE)
