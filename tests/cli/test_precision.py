"""`volref precision`."""

import csv
import json
import sys
from pathlib import Path

import pytest

import volref.studies.orders as orders
import volref.studies.precision.run as running
from volref.cli import main
from volref.cli.verb import DIFFERS
from volref.report import plots
from volref.studies.orders import Observation
from volref.studies.precision import METHODS, SUITES, frontier, run_precision
from volref.studies.precision.points import SceneStudy

QUICK = ("--size", "6x4", "--methods", "trapezoid", "--budget", "0.001")


def run(capsys, *words):
    status = main(["precision", *map(str, words)])
    out, err = capsys.readouterr()
    return status, out, err


def refused(capsys, *words):
    status, out, err = run(capsys, *words)
    assert (status, out) == (2, "")
    assert err.startswith("volref: ")
    assert err.count("\n") == 1
    return err


@pytest.fixture
def unmeasured(monkeypatch):
    """Fail if anything is measured: what is wrong is to be told before."""

    def measured(*_, **__):
        pytest.fail("it was measured")

    monkeypatch.setattr(running, "study_scene", measured)


def test_it_prints_what_no_other_method_beats_on_a_scene_of_the_users(scene_file, capsys):
    status, out, err = run(capsys, scene_file, *QUICK)
    assert (status, err) == (0, "")
    assert "scene, 6 x 4: the scene scene.json\n" in out
    assert "  trapezoid, step 1/16 " in out
    assert out.endswith("no certified images\n")


def test_json_is_the_report(scene_file, capsys):
    status, out, err = run(capsys, scene_file, *QUICK, "--json")
    found = json.loads(out)
    assert (status, err, found["passed"], found["budget"]) == (0, "", True, 0.001)
    [scene] = found["scenes"]
    assert (scene["name"], scene["width"], scene["height"]) == ("scene", 6, 4)
    assert [p["setting"] for p in scene["points"]] == [4, 2, 1, 0.5, 0.25, 0.125, 0.0625]


def test_suites_come_first_and_then_the_files(scene_file, capsys):
    _, out, _ = run(capsys, scene_file, "--suite", "few-kinks", *QUICK, "--json")
    assert [scene["name"] for scene in json.loads(out)["scenes"]] == ["few-kinks", "scene"]


def test_all_is_every_suite(capsys, monkeypatch):
    seen = []

    def nothing(subject, *_):
        seen.append(subject.name)
        return SceneStudy(subject.name, subject.meaning, 1, 1, (1, 1, 1), 0.0, (), ())

    monkeypatch.setattr(running, "study_scene", nothing)
    assert run(capsys, "--all", *QUICK)[0] == 0
    assert seen == [suite.name for suite in SUITES]


def test_a_scene_keeps_its_aspect_on_few_pixels_unless_a_size_is_given(scene_file, capsys, monkeypatch):
    file = Path(scene_file)
    file.write_text(json.dumps(json.loads(file.read_text()) | {"width": 2400, "height": 1600}))
    sizes = []

    def nothing(subject, *_):
        sizes.append((subject.scene.width, subject.scene.height))
        return SceneStudy(subject.name, subject.meaning, 1, 1, (1, 1, 1), 0.0, (), ())

    monkeypatch.setattr(running, "study_scene", nothing)
    run(capsys, scene_file)
    run(capsys, scene_file, "--size", "20x10")
    assert sizes == [(99, 66), (20, 10)]


def test_files_are_written_and_named(scene_file, tmp_path, capsys):
    csv_file, page, plot = (tmp_path / name for name in ("a.csv", "a.md", "a.svg"))
    words = (scene_file, *QUICK, "--csv", csv_file, "--markdown", page, "--plot", plot)
    status, _, err = run(capsys, *words)
    assert (status, err) == (0, f"volref: wrote {plot}, {csv_file}, {page}\n")
    with csv_file.open() as file:
        assert len(list(csv.DictReader(file))) == 7
    assert "### scene\n" in page.read_text()
    assert "](a.svg)" in page.read_text()
    assert plot.read_bytes().startswith(b"<?xml")
    assert run(capsys, *words, "-q", "--force") == (0, "", "")


def test_a_plot_is_named_as_seen_from_the_page(scene_file, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(plots, "save_precision_plot", lambda study, path, **_: path.write_text(study.name))
    for folder in ("pages", "images"):
        (tmp_path / folder).mkdir()
    page, plot = tmp_path / "pages" / "p.md", tmp_path / "images" / "p.svg"
    run(capsys, scene_file, "--suite", "few-kinks", *QUICK, "--markdown", page, "--plot", plot)
    for name in ("scene", "few-kinks"):
        assert f"](../images/p-{name}.svg)" in page.read_text()
        assert (tmp_path / "images" / f"p-{name}.svg").read_text() == name


@pytest.mark.usefixtures("unmeasured")
def test_bad_use_is_told_before_anything_is_measured(scene_file, tmp_path, capsys):
    assert "name a SCENE, --suite NAME or --all" in refused(capsys)
    assert "got 'smoth'; use 'smooth'" in refused(capsys, "--suite", "smoth")
    assert "got 'exakt'; use 'exact'" in refused(capsys, scene_file, "--methods", "exakt")
    assert "got 'scene' twice" in refused(capsys, scene_file, scene_file)
    assert "must end in .svg or .png" in refused(capsys, scene_file, "--plot", tmp_path / "a.pdf")
    assert "create it first" in refused(capsys, scene_file, "--csv", tmp_path / "none" / "a.csv")
    for option, name in (("--csv", "a.csv"), ("--markdown", "a.md"), ("--plot", "a.svg")):
        (tmp_path / name).write_text("mine")
        assert "pass --force" in refused(capsys, scene_file, option, tmp_path / name)
        assert (tmp_path / name).read_text() == "mine"
    assert "budget must be above 0" in refused(capsys, scene_file, "--budget", "0")


def test_a_missed_tolerance_is_status_1_and_the_files_are_written_all_the_same(
    scene_file, tmp_path, capsys, monkeypatch
):
    monkeypatch.setattr(SceneStudy, "problems", ("scene: auto at 1e-12 missed its tolerance: bound 1",))
    status, out, _ = run(capsys, scene_file, *QUICK, "--csv", tmp_path / "a.csv")
    assert status == DIFFERS
    assert "auto at 1e-12 missed its tolerance" in out
    assert (tmp_path / "a.csv").exists()


def test_the_list_names_suites_and_methods(capsys):
    status, out, _ = run(capsys, "--list")
    assert status == 0
    names = [line.split()[0] for line in out.splitlines()]
    assert names == ["suites", *(s.name for s in SUITES), "methods", *(m.name for m in METHODS)]
    found = json.loads(run(capsys, "--list", "--json")[1])
    assert [s["name"] for s in found["suites"]] == [s.name for s in SUITES]
    assert [m["name"] for m in found["methods"]] == [m.name for m in METHODS]


def test_the_orders_are_printed_expected_and_observed(capsys, monkeypatch):
    seen = (Observation("trapezoid", "smooth", (0.5, 0.25), (0.04, 0.01), 2.0, 2),)
    monkeypatch.setattr(orders, "observe_orders", lambda: seen)
    status, out, _ = run(capsys, "--orders")
    assert status == 0
    assert "| trapezoid | step | 2: 2.00 |" in out
    assert json.loads(run(capsys, "--orders", "--json")[1])[0]["order"] == 2.0


def test_progress_is_shown_on_a_terminal_only(scene_file, capsys, monkeypatch):
    assert run(capsys, scene_file, *QUICK)[2] == ""
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    status, _, err = run(capsys, scene_file, *QUICK)
    assert status == 0
    assert "precision" in err
    assert run(capsys, scene_file, *QUICK, "-q") == (0, "", "")


def test_the_command_and_the_library_say_the_same(scene_file, capsys):
    from volref import load_scene
    from volref.studies.precision import Subject, resized

    found = json.loads(run(capsys, scene_file, *QUICK, "--json")[1])
    subject = Subject("scene", "the scene scene.json", resized(load_scene(scene_file), (6, 4)))
    report = run_precision([subject], methods=["trapezoid"], runs=1)
    errors = [p["error_largest"] for p in found["scenes"][0]["points"]]
    assert errors == [p.errors.largest.value for p in report.scenes[0].points]
    assert frontier(report.scenes[0].points)
