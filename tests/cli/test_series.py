"""`volref render --series`: frames and animated PNG of the same view."""

import json

import numpy as np
import pytest
from PIL import Image, ImageSequence

import volref
from tests.scenes import rough_scene, rough_volume
from volref import load_scene, load_series, save_scene, save_volume
from volref.cli import main
from volref.image import encode_rgba8

MARCH = ("--step", "0.2", "--tolerance", "1")


@pytest.fixture
def folder(tmp_path):
    save_scene(rough_scene(12, 8), tmp_path / "scene.json")
    (tmp_path / "scans").mkdir()
    for i in range(3):
        save_volume(rough_volume(i), tmp_path / "scans" / f"{i}.npy")
    return tmp_path


def run(capsys, folder, *words):
    status = main(["render", str(folder / "scene.json"), *map(str, words)])
    out, err = capsys.readouterr()
    return status, out, err


def expected(folder, times, moments, interpolation, **options):
    scene, series = load_scene(folder / "scene.json"), load_series(folder / "scans", times)
    options = {"method": "march", "step": 0.2, "tolerance": 1} | options
    return [
        out.rgba
        for _, out in volref.render_series(scene, series, moments, interpolation=interpolation, **options)
    ]


def animated(path):
    with Image.open(path) as image:
        return [np.asarray(frame.convert("RGBA")) for frame in ImageSequence.Iterator(image)]


def test_one_file_for_each_volume_and_one_film_of_all(folder, capsys):
    outputs = "-o", folder / "f_%02d.npy", "-o", folder / "film.png"
    status, out, err = run(capsys, folder, "--series", folder / "scans", *outputs, *MARCH)
    images = expected(folder, None, None, "nearest")
    assert (status, out) == (0, "")
    assert "volref: 3 frames, error <= " in err
    assert sorted(path.name for path in folder.glob("f_*")) == ["f_00.npy", "f_01.npy", "f_02.npy"]
    for i, (image, shown) in enumerate(zip(images, animated(folder / "film.png"), strict=True)):
        assert np.array_equal(np.load(folder / f"f_{i:02d}.npy"), image)
        assert np.array_equal(shown, encode_rgba8(image))


def test_frames_between_the_volumes_are_mixed_in_time(folder, capsys):
    words = "--times", "0,60,90", "--interpolate", "2", "-o", folder / "f_%d.npy", "--json"
    status, out, _ = run(capsys, folder, "--series", folder / "scans", *words, *MARCH)
    moments = [0, 30, 60, 75, 90]
    images = expected(folder, [0, 60, 90], moments, "linear")
    document = json.loads(out)
    assert status == 0
    assert [frame["time"] for frame in document["frames"]] == moments
    assert document["frames"][1]["bound"]["kind"] == "estimate"
    for i, image in enumerate(images):
        assert np.array_equal(np.load(folder / f"f_{i}.npy"), image)


def test_files_are_taken_as_named_and_times_may_be_a_start_and_a_step(folder, capsys):
    files = [folder / "scans" / f"{i}.npy" for i in (2, 0)]
    words = "--times", "600:120", "-o", folder / "f_%d.npy", "--json", *MARCH
    status, out, _ = run(capsys, folder, "--series", *files, *words)
    assert status == 0
    assert [frame["time"] for frame in json.loads(out)["frames"]] == [600, 720]
    assert np.array_equal(np.load(folder / "f_0.npy"), expected(folder, None, [2], "nearest")[0])


def test_tone_mapping_and_several_rays_go_with_it(folder, capsys):
    words = "-o", folder / "film.apng", "--supersample", "2", "--tone-map", "reinhard", "--gamma", "2"
    status, _, _ = run(capsys, folder, "--series", folder / "scans", *words, *MARCH)
    images = expected(folder, None, None, "nearest", factor=2)
    assert status == 0
    for image, shown in zip(images, animated(folder / "film.apng"), strict=True):
        mapped = volref.tone_map(image, "reinhard", gamma=2.0)
        assert np.array_equal(shown, encode_rgba8(mapped, "none"))


def test_a_tolerance_that_a_frame_misses_is_status_1(folder, capsys):
    words = "-o", folder / "film.png", "--step", "1", "-q"
    status, _, err = run(capsys, folder, "--series", folder / "scans", *words)
    assert status == 1
    assert err.startswith("volref: tolerance not met in 3 of 3 frames: error up to")
    assert (folder / "film.png").exists()


def test_nothing_is_rendered_if_a_frame_exists_already(folder, capsys):
    (folder / "f_2.png").write_text("mine")
    words = "--series", folder / "scans", "-o", folder / "f_%d.png", *MARCH
    status, _, err = run(capsys, folder, *words)
    assert status == 2
    assert "f_2.png must not exist yet" in err
    assert not (folder / "f_0.png").exists()
    assert run(capsys, folder, *words, "--force")[0] == 0
    assert (folder / "f_2.png").read_bytes() != b"mine"


@pytest.mark.parametrize(
    ("words", "fragment"),
    [
        (["-o", "film.gif"], "-o must be a name such as frame_%03d.png"),
        (["-o", "one.npz"], "-o must be a name such as frame_%03d.png"),
        (["-o", "f_%d_%d.png"], "-o must be a name such as frame_%03d.png"),
        (["-o", "f_%s.png"], "-o must be a name such as frame_%03d.png"),
        (["-o", "a.png", "-o", "b.png"], "-o must name one animated PNG"),
        (["-o", "nowhere/a.png"], "must lie in a folder that exists"),
        (["-o", "a.png", "--interpolate", "0"], "--interpolate must be at least 1"),
        (["-o", "a.png", "--fps", "0"], "--fps must be from 1/65 to 1000"),
        (["-o", "a.png", "--times", "0,1"], "series.times must have shape (3), got (2)"),
        (["-o", "a.png", "--times", "0:0"], "series.times must rise"),
        (["-o", "a.png", "--verify", "2"], "--verify must be given without --series"),
    ],
)
def test_bad_use_is_one_line_before_the_work(folder, capsys, monkeypatch, words, fragment):
    monkeypatch.chdir(folder)
    status, out, err = run(capsys, folder, "--series", folder / "scans", *words)
    assert (status, out) == (2, "")
    assert fragment in err
    assert err.count("\n") == 1
    assert sorted(path.name for path in folder.iterdir()) == ["scans", "scene.json", "scene.volume.npy"]


@pytest.mark.parametrize("word", ["--times", "--interpolate", "--fps"])
def test_what_belongs_to_a_series_is_refused_without_one(folder, capsys, word):
    status, _, err = run(capsys, folder, "-o", folder / "a.png", word, "1")
    assert status == 2
    assert f"{word} must be given with --series" in err
