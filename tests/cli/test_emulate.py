"""`volref emulate` and `volref trace --pipeline`: a scene file and a program in, targets out."""

import json

import numpy as np
import pytest
from PIL import Image

import volref as vr
from tests.emulation.scenes import HEIGHT, WIDTH, example
from volref.cli import main

TARGETS = ["mesh_depth", "mesh_color", "back_depth", "front_coordinates", "back_coordinates", "canvas"]


@pytest.fixture
def scene_file(tmp_path):
    path = tmp_path / "scene.json"
    vr.save_scene(example(mesh=True), path)
    return path


@pytest.fixture
def volume_file(tmp_path):
    path = tmp_path / "volume.json"
    vr.save_scene(example(), path)
    return path


def run(capsys, *words):
    status = main([str(word) for word in words])
    out, err = capsys.readouterr()
    return status, out, err


def test_the_png_has_the_bytes_of_the_canvas_and_other_files_its_numbers(volume_file, tmp_path, capsys):
    files = [tmp_path / f"canvas.{suffix}" for suffix in ("png", "npy", "npz")]
    words = [word for file in files for word in ("-o", file)]
    status, out, err = run(capsys, "emulate", volume_file, "--pipeline", "congote2012", *words)
    expected = vr.emulate(vr.load_scene(volume_file), "congote2012")
    assert (status, out) == (0, "")
    assert err.startswith("volref: congote2012 on ideal: at most 200 samples on a ray, ")
    with Image.open(files[0]) as image:
        np.testing.assert_array_equal(np.asarray(image), expected.rgba8)
    np.testing.assert_array_equal(np.load(files[1]), expected.rgba)
    with np.load(files[2]) as arrays:
        np.testing.assert_array_equal(arrays["pass_back_coordinates"], expected.passes["back_coordinates"])


def test_every_target_is_written_twice_in_the_order_of_drawing(scene_file, tmp_path, capsys):
    folder = tmp_path / "new" / "targets"
    words = ("emulate", scene_file, "--pipeline", "arbelaz2016-printed", "--passes", folder, "-q")
    assert run(capsys, *words) == (0, "", "")
    expected = vr.emulate(vr.load_scene(scene_file), "arbelaz2016-printed")
    assert set(expected.passes) == set(TARGETS)
    for number, (name, target) in enumerate(expected.passes.items(), start=1):
        stem = f"{number:02d}_{name}"
        np.testing.assert_array_equal(np.load(folder / f"{stem}.npy"), target)
        with Image.open(folder / f"{stem}.png") as image:
            assert image.size == (WIDTH, HEIGHT)
            # All but the varying are targets of bytes: their pictures are these bytes.
            if name != "front_coordinates":
                np.testing.assert_array_equal(np.asarray(image), np.rint(255 * target))
    assert len(list(folder.iterdir())) == 2 * len(TARGETS)


def test_a_gradient_volume_is_shown_as_its_slices(tmp_path, capsys, volume_file):
    folder = tmp_path / "targets"
    words = ("--jitter", tmp_path / "noise.npy", "--passes", folder)
    np.save(tmp_path / "noise.npy", np.random.default_rng(0).random((2, 5, 7)))
    assert run(capsys, "emulate", volume_file, "--pipeline", "cej2020", *words)[0] == 0
    with Image.open(folder / "01_gradient_volume.png") as image:
        # 11 slices of 12 x 10 in 4 x 3 tiles, value above gradient.
        assert image.size == (4 * 12, 2 * 3 * 10)
    names = sorted(path.stem for path in folder.glob("*.png"))
    assert names == ["01_gradient_volume", "02_frame", "03_running_mean", "04_canvas"]


def test_jitter_is_repeated_over_the_image_and_has_a_frame_for_each_picture(tmp_path, capsys, volume_file):
    noise = np.random.default_rng(1).random((3, 4, 8))
    np.save(tmp_path / "noise.npy", noise)
    words = ("emulate", volume_file, "--pipeline", "vpt-eam", "--jitter", tmp_path / "noise.npy")
    status, out, _ = run(capsys, *words, "-o", tmp_path / "three.npy", "--json")
    tiled = np.tile(noise, (1, 3, 2))
    expected = vr.emulate(vr.load_scene(volume_file), "vpt-eam", None, tiled, 3)
    np.testing.assert_array_equal(np.load(tmp_path / "three.npy"), expected.rgba)
    assert (status, json.loads(out)["frames"]) == (0, 3)
    run(capsys, *words, "-o", tmp_path / "two.npy", "--frames", "2")
    expected = vr.emulate(vr.load_scene(volume_file), "vpt-eam", None, tiled[:2], 2)
    np.testing.assert_array_equal(np.load(tmp_path / "two.npy"), expected.rgba)
    status, _, err = run(capsys, *words, "-o", tmp_path / "four.npy", "--frames", "4")
    assert status == 2
    assert "--frames must be from 1 to 3, which " in err


def test_a_program_and_a_device_of_ones_own_come_from_files(tmp_path, capsys, volume_file):
    mine = vr.pipelines()["texture3d"].with_switches("mine", stepping={"cap": 3})
    (tmp_path / "mine.json").write_text(mine.to_json(), encoding="utf-8")
    phone = vr.Device("phone", weight_bits=4)
    (tmp_path / "phone.json").write_text(phone.to_json(), encoding="utf-8")
    words = ("--pipeline", tmp_path / "mine.json", "--device", tmp_path / "phone.json", "--json", "-q")
    status, out, err = run(capsys, "emulate", volume_file, *words)
    found = json.loads(out)
    assert (status, err) == (0, "")
    assert (found["pipeline"], found["device"], found["samples"]["max"]) == ("mine", "phone", 3)
    assert found["targets"] == {"canvas": [HEIGHT, WIDTH, 4]}
    found = json.loads(run(capsys, "trace", volume_file, "8", "6", *words[:-1])[1])
    assert found["ended"] == "the loop has run 3 times, its cap"


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        ((), "-o must be given, or --passes or --json, got none"),
        (("-o", "canvas.jpg"), "canvas.jpg must end in .png, .exr, .npy, .npz, got '.jpg'"),
        (("-o", "no/canvas.png"), "must lie in a folder that exists"),
        (("-o", "a.png", "-o", "a.png"), "must be named once"),
        (("--passes", "scene.json"), "scene.json must be a folder, got a file"),
        (("-o", "a.png", "--device", "mesa"), "device must be a preset, got 'mesa'"),
        (("-o", "a.png", "--device", "mesa.json"), "mesa.json must be a file that exists"),
        (
            ("-o", "a.png", "--frames", "2"),
            "frames must be 1 for a pipeline that keeps no mean of frames, got 2",
        ),
    ],
)
def test_what_cannot_be_done_is_refused_in_one_line(words, sentence, scene_file, capsys, monkeypatch):
    monkeypatch.chdir(scene_file.parent)
    status, out, err = run(capsys, "emulate", "scene.json", "--pipeline", "texture3d", *words)
    assert (status, out) == (2, "")
    assert sentence in err
    assert err.count("\n") == 1


def test_a_pipeline_that_there_is_not_is_refused(scene_file, capsys):
    assert "the following arguments are required: --pipeline" in run(capsys, "emulate", scene_file)[2]
    status, _, err = run(capsys, "emulate", scene_file, "--pipeline", "congote", "--json")
    assert status == 2
    assert "pipeline must be one of the catalogue, got 'congote'; use one of texture3d, " in err


def test_nothing_is_written_over_unless_told_to(volume_file, tmp_path, capsys):
    words = (
        "emulate",
        volume_file,
        "--pipeline",
        "texture3d",
        "-o",
        tmp_path / "a.png",
        "--passes",
        tmp_path / "p",
    )
    assert run(capsys, *words)[0] == 0
    before = {path: path.read_bytes() for path in tmp_path.rglob("*.*")}
    status, _, err = run(capsys, *words)
    assert status == 2
    assert "a.png must not exist yet, got a file that does; choose another name, or pass --force" in err
    status, _, err = run(capsys, *words[:4], "--passes", tmp_path / "p")
    assert status == 2
    assert "01_canvas.npy must not exist yet" in err
    assert {path: path.read_bytes() for path in tmp_path.rglob("*.*")} == before
    assert run(capsys, *words, "--force")[0] == 0


def test_trace_prints_the_iterations_of_a_program(volume_file, capsys):
    expected = vr.trace(vr.load_scene(volume_file), (8, 6), "x3dom", device="llvmpipe")
    words = ("trace", volume_file, "8", "6", "--pipeline", "x3dom", "--device", "llvmpipe")
    assert run(capsys, *words) == (0, f"{expected}\n", "")
    status, out, _ = run(capsys, *words, "--json")
    assert (status, out) == (0, f"{expected.to_json()}\n")


def test_options_of_the_other_kind_of_trace_are_refused(volume_file, capsys):
    words = ("trace", volume_file, "8", "6")
    assert "--device must be given with --pipeline" in run(capsys, *words, "--device", "exact")[2]
    both = run(capsys, *words, "--step", "1", "--pipeline", "x3dom")
    assert both[0] == 2
    assert "--step must be given without --pipeline" in both[2]
