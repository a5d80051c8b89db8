"""`volref golden`: goldens made, checked, shown and drawn again from the command line."""

import json
from xml.etree import ElementTree as ET

import numpy as np
import pytest

import volref as vr
from tests.golden.test_making import SUITE
from volref.cli import main
from volref.io.png import write_png


def run(capsys, *words):
    status = main([str(word) for word in words])
    out, err = capsys.readouterr()
    return status, out, err


@pytest.fixture(scope="module")
def goldens(tmp_path_factory):
    """A folder with two small bundles, and beside it the suite they are made of."""
    folder = tmp_path_factory.mktemp("goldens")
    (folder / "two.json").write_text(json.dumps(SUITE))
    assert main(["golden", "make", str(folder / "two.json"), str(folder / "out"), "-q"]) == 0
    return folder / "out"


@pytest.fixture
def captures(goldens, tmp_path):
    """A folder of canvases that bear the bundles' names, as a machine drew them."""
    (tmp_path / "captures").mkdir()
    for name in ("one", "two"):
        bundle = vr.load_bundle(goldens / name)
        drawn = vr.emulate(bundle.scene, bundle.pipeline, bundle.device)
        write_png(tmp_path / "captures" / f"{name}.png", drawn.rgba8)
    return tmp_path / "captures"


def test_list_names_the_goldens_of_the_suite_that_comes_along(capsys):
    status, out, err = run(capsys, "golden", "list")
    assert (status, err) == (0, "")
    assert len(out.splitlines()) >= 24
    assert out.startswith("texture3d-blobs ")
    document = json.loads(run(capsys, "golden", "list", "--json")[1])
    assert document["recipes"][0]["name"] == "texture3d-blobs"


def test_a_scene_becomes_a_bundle_with_the_program_device_and_size_of_the_options(
    capsys, scene_file, tmp_path
):
    words = ("--pipeline", "texture3d", "--device", "llvmpipe", "--size", "9x6", "--truth", "1/100")
    status, out, err = run(
        capsys, "golden", "make", scene_file, tmp_path / "head", *words, "--title", "A head", "--json"
    )
    assert (status, err) == (0, f"volref: 1 made, 0 kept in {tmp_path / 'head'}\n")
    assert json.loads(out) == {"goldens": [{"folder": str(tmp_path / "head"), "state": "made"}]}
    bundle = vr.load_bundle(tmp_path / "head")
    assert (bundle.name, bundle.title, bundle.device.name) == ("head", "A head", "llvmpipe")
    assert bundle.acceptance.lo.shape == (6, 9, 4)
    assert bundle.bound.max() <= 0.01


def test_a_recipe_and_some_of_a_suite_are_made_and_kept(capsys, goldens, tmp_path):
    (tmp_path / "one.json").write_text(json.dumps(SUITE["recipes"][0]))
    status, out, _ = run(capsys, "golden", "make", tmp_path / "one.json", goldens, "--json")
    assert (status, json.loads(out)["goldens"][0]["state"]) == (0, "kept")
    words = (
        "golden",
        "make",
        goldens.parent / "two.json",
        tmp_path / "out",
        "--only",
        "two",
        "-j",
        "1",
        "-q",
    )
    assert run(capsys, *words) == (0, "", "")
    assert [entry.name for entry in (tmp_path / "out").iterdir()] == ["two"]


def test_what_is_there_stays_unless_force_is_given(capsys, scene_file, tmp_path):
    words = ("golden", "make", scene_file, tmp_path / "a", "--pipeline", "x3dom", "--size", "4x4", "-q")
    assert run(capsys, *words)[0] == 0
    status, _, err = run(capsys, *words)
    assert status == 2
    assert "pass --force" in err
    assert run(capsys, *words, "--force")[0] == 0


def test_right_images_pass_and_wrong_ones_fail_with_status_1(capsys, goldens, captures):
    status, out, _ = run(capsys, "golden", "check", goldens, captures)
    assert status == 0
    assert [line.partition(":")[0] for line in out.splitlines()] == ["one", "two"]
    assert run(capsys, "golden", "check", goldens / "one", captures / "one.png")[0] == 0
    status, out, _ = run(capsys, "golden", "check", goldens / "one", captures / "two.png")
    assert status == 1
    assert out.startswith("one: outside: ")


def test_verdicts_come_as_json_and_as_junit(capsys, goldens, captures, tmp_path):
    np.save(captures / "two.npy", np.ones((6, 8, 4)))  # .npy is looked for before .png
    words = ("golden", "check", goldens, captures, "--junit", tmp_path / "out.xml", "--json")
    status, out, _ = run(capsys, *words)
    verdicts = json.loads(out)["verdicts"]
    assert status == 1
    assert [(verdict["name"], verdict["passed"]) for verdict in verdicts] == [("one", True), ("two", False)]
    assert verdicts[1]["candidate"] == str(captures / "two.npy")
    (suite,) = ET.parse(tmp_path / "out.xml").getroot()
    assert (suite.get("tests"), suite.get("failures")) == ("2", "1")
    assert [case.get("name") for case in suite] == ["one", "two"]
    assert suite[1].find("failure").get("message") == verdicts[1]["message"]
    assert run(capsys, *words)[0] == 2, "the file is there"
    assert run(capsys, *words, "--force")[0] == 1


def test_a_report_has_every_image_and_the_status_of_check(capsys, goldens, captures, tmp_path):
    page = tmp_path / "page.html"
    status, _, err = run(capsys, "golden", "report", goldens, captures, "-o", page, "--title", "Nightly")
    assert status == 0
    assert "2 passed, 0 failed" in err
    text = page.read_text(encoding="utf-8")
    assert "Nightly" in text
    assert vr.load_bundle(goldens / "one").manifest["recipe_sha256"] in text


def test_bundles_are_drawn_again_and_held_to_the_bit(capsys, goldens):
    status, out, err = run(capsys, "golden", "verify", goldens)
    assert status == 0
    assert out.splitlines() == ["one: the same to the bit", "two: the same to the bit"]
    assert "2 the same to the bit, 0 within their intervals, 0 differ" in err
    document = json.loads(run(capsys, "golden", "verify", goldens / "one", "--json", "-q")[1])
    assert document["goldens"][0]["status"] == "equal"


@pytest.mark.parametrize(
    "words",
    [
        ("make", "{scene}", "{out}"),
        ("make", "{scene}", "{out}", "--pipeline", "unreal"),
        ("make", "volref", "{out}", "--pipeline", "x3dom"),
        ("make", "volref", "{out}", "--only", "texture3d-blob"),
        ("make", "none.json", "{out}"),
        ("make", "volref", "{out}", "--only", "x3dom-blobs", "-j", "0"),
        ("check", "{goldens}"),
        ("check", "{goldens}", "{scene}"),
        ("check", "{goldens}", "{empty}"),
        ("check", "{scene}", "{scene}"),
        ("verify", "{empty}"),
        ("verify", "{scene}"),
        ("list", "{scene}"),
        ("report", "{goldens}", "{goldens}"),
    ],
)
def test_bad_use_is_one_line_and_status_2(capsys, goldens, scene_file, tmp_path, words):
    (tmp_path / "empty").mkdir()
    places = {"scene": scene_file, "out": tmp_path / "out", "goldens": goldens, "empty": tmp_path / "empty"}
    status, out, err = run(capsys, "golden", *(word.format(**places) for word in words))
    assert (status, out, err.count("\n")) == (2, "", 1), err
    assert not (tmp_path / "out").exists()
