"""`volref explain`: an image and a scene in, the fault and an exit status out."""

import json

import numpy as np
import pytest

import volref as vr
from tests.emulation.scenes import example
from volref.cli import main
from volref.io import write_image, write_png

PROGRAM = vr.pipelines()["congote2012"].with_switches("twenty", stepping={"steps": 20})


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with a scene, a program, an image that is right, and one of slices that are mixed by x."""
    folder = tmp_path_factory.mktemp("explain")
    scene = example(opacity=0.9, unit_distance=2.0)
    vr.save_scene(scene, folder / "scene.json")
    (folder / "mine.json").write_text(PROGRAM.to_json(), encoding="utf-8")
    document = vr.Candidates(PROGRAM, {"volume.between": ("z", "x", "none")}).as_dict()
    (folder / "open.json").write_text(json.dumps(document), encoding="utf-8")
    mixed = PROGRAM.with_switches(volume={"between": "x"})
    write_image(folder / "right.png", vr.emulate(scene, PROGRAM).rgba, encoding="none")
    write_image(folder / "wrong.png", vr.emulate(scene, mixed).rgba, encoding="none")
    return folder


@pytest.fixture
def run(folder, capsys, monkeypatch):
    monkeypatch.chdir(folder)

    def running(*words):
        status = main([str(word) for word in words])
        out, err = capsys.readouterr()
        return status, out, err

    return running


STRAIGHT = ("--alpha", "straight", "--singles")


def test_a_right_image_has_no_fault_and_exit_status_0(run, tmp_path):
    words = ("explain", "right.png", "scene.json", "--pipeline", "mine.json", *STRAIGHT)
    status, out, err = run(*words, "--counterfactual", tmp_path / "fault.png")
    assert status == 0
    assert out.startswith("inside: ")
    assert "there is no fault to draw" in err
    assert not (tmp_path / "fault.png").exists()


def test_a_wrong_one_has_its_fault_named_and_drawn(run, tmp_path):
    words = ("explain", "wrong.png", "scene.json", "--pipeline", "mine.json", *STRAIGHT)
    drawn = tmp_path / "fault.npy"
    status, out, err = run(*words, "--counterfactual", drawn, "--top", "1")
    assert status == 1
    first, listed = out.splitlines()
    assert first.startswith("two slices are mixed by x where z belongs, seed 001's eq. 17 (A3-mix-by-x); ")
    assert listed == "A3-mix-by-x  strength 1, 100.0%"
    assert err == f"volref: wrote {drawn}\n"
    mixed = PROGRAM.with_switches(volume={"between": "x"})
    assert np.array_equal(np.load(drawn), vr.emulate(vr.load_scene("scene.json"), mixed).rgba)


def test_json_is_one_document_with_as_many_faults_as_asked_for(run):
    words = ("explain", "wrong.png", "scene.json", "--pipeline", "mine.json", *STRAIGHT)
    status, out, err = run(*words, "--top", "2", "--json")
    document = json.loads(out)
    assert (status, err) == (1, "")
    assert (document["status"], len(document["ranking"])) == ("explained", 2)
    assert document["ranking"][0]["fault"] == "A3-mix-by-x"


def test_open_switches_are_settled(run):
    status, out, _ = run(
        "explain", "wrong.png", "scene.json", "--pipeline", "open.json", "--alpha", "straight"
    )
    assert status == 1
    assert out.startswith("the image is that of volume.between=x; next: ")


def test_a_file_in_the_way_of_the_picture_is_refused_before_the_work(run, tmp_path):
    drawn = tmp_path / "fault.png"
    write_png(drawn, np.zeros((2, 2, 4), np.uint8))
    words = ("explain", "wrong.png", "scene.json", "--pipeline", "mine.json", "--counterfactual", drawn)
    status, out, err = run(*words)
    assert (status, out) == (2, "")
    assert "must not exist yet" in err
