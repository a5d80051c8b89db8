"""The precision study: errors against a known reference, the frontier, the tables, and what its page says."""

import csv
import io
import json
import math
import re
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import volref.studies.precision.methods as methods
import volref.studies.precision.run as running
from tests.docs.pages import DOCS
from tests.scenes import colorful_transfer, rough_scene
from volref import SceneError, load_scene, render
from volref.planning import HALF_LEVEL
from volref.studies.precision import (
    METHODS,
    SUITES,
    PrecisionReport,
    Subject,
    frontier,
    frontier_check,
    resized,
    run_precision,
    subject_of,
)
from volref.studies.precision.frontier import fastest, reaches
from volref.studies.precision.machine import Machine, processor_name, this_machine
from volref.studies.precision.methods import FAMILIES, TOLERANCES, Answer, Method, chosen_methods
from volref.studies.precision.page import TARGETS
from volref.studies.precision.points import Error, Errors, Point, SceneStudy, errors_of, share_held
from volref.studies.precision.suites import PIXELS, chosen_suites
from volref.studies.rivals import RIVALS

NAMES = [suite.name for suite in SUITES]
HERE = Machine("a processor", 2, "a system", "3.11", "2.1")


def point(seconds, largest, *, method="trapezoid", setting=1.0, resolved=True, rms=None, **claims):
    """A made-up point; claims are bound_kind, bound, held and tolerance."""
    errors = Errors(Error(largest, resolved), Error(rms or largest, resolved), Error(largest, resolved), 0.0)
    known = {"bound_kind": "none", "bound": None, "held": None, "tolerance": None} | claims
    return Point(method, setting, method, errors, seconds, 1, None, 1000, **known)


def certified(seconds, tolerance, bound, *, error=None, held=1.0, method="auto"):
    claims = {"bound_kind": "certified", "bound": bound, "held": held, "tolerance": tolerance}
    return point(seconds, error or bound / 2, method=method, setting=tolerance, **claims)


def study(*points, name="made-up", stopped=()):
    return SceneStudy(name, "a scene", 10, 5, (4, 4, 4), 1e-14, points, stopped)


@cache
def suite_scene(name):
    return chosen_suites([name])[0].make()


def tiny(method="exact", setting=1e-3):
    return chosen_methods([method])[0].run(rough_scene(6, 4), setting)


# --- the suites


def test_the_suites_of_the_issue_are_there_each_small_and_with_a_volume():
    assert {"smooth", "few-kinks", "spiky", "head", "mesh-inside", "wide-angle"} <= set(NAMES)
    for suite in SUITES:
        scene = suite_scene(suite.name)
        assert scene.volume is not None
        assert PIXELS / 2 < scene.width * scene.height <= PIXELS
        assert suite.meaning
        assert not suite.meaning.endswith(".")  # the page adds it


def test_each_suite_asks_what_it_says():
    scenes = {name: suite_scene(name) for name in NAMES}
    assert len(scenes["smooth"].transfer.values) == 256
    assert len(scenes["few-kinks"].transfer.values) == 8
    assert scenes["spiky"].transfer.knot_extinction.max() == 1e4
    assert len(scenes["head"].meshes) == len(scenes["mesh-inside"].meshes) == 1
    low, high = (
        scenes["mesh-inside"].volume.corners.min(axis=0),
        scenes["mesh-inside"].volume.corners.max(axis=0),
    )
    ring = scenes["mesh-inside"].meshes[0].vertices
    assert (ring > low).all()
    assert (ring < high).all()
    wide = scenes["wide-angle"]
    assert wide.camera.fov_y == 110
    eye = wide.camera.world_from_view[:3, 3]
    assert (eye > wide.volume.corners.min(axis=0)).all()
    assert (eye < wide.volume.corners.max(axis=0)).all()
    assert wide.transfer.interpolation == "opacity"
    assert len(set(wide.volume.spacing)) == 2


def test_no_suite_shows_one_colour_only():
    for suite in SUITES:
        image = render(resized(suite_scene(suite.name), (12, 9)), method="march").rgba
        assert np.ptp(image, axis=(0, 1)).max() > 0.1, suite.name


def test_the_ct_of_the_tests_is_a_scene_to_measure_on():
    scene = load_scene(DOCS.parent / "tests" / "data" / "real_ct.json")
    image = render(resized(scene, (12, 9)), method="march").rgba
    assert np.ptp(image[..., 3]) > 0.5


@pytest.mark.parametrize(
    ("size", "small"),
    [
        ((1920, 1080), (96, 54)),
        ((512, 512), (83, 83)),
        ((64, 48), (64, 48)),
        ((7001, 7000), (7001, 7000)),  # no smaller whole numbers have this aspect
    ],
)
def test_a_large_image_is_scaled_to_few_pixels_of_the_same_aspect(size, small):
    scene = resized(rough_scene(*size))
    assert (scene.width, scene.height) == small
    assert resized(scene, (5, 3)).width == 5


def test_an_unknown_suite_or_method_is_refused_with_the_nearest():
    with pytest.raises(SceneError, match=r"got 'smoth'; use 'smooth'"):
        chosen_suites(["smoth"])
    with pytest.raises(SceneError, match=r"got 'exakt'; use 'exact'"):
        chosen_methods(["exakt"])
    assert [suite.name for suite in chosen_suites()] == NAMES


# --- the methods


def test_every_rival_and_every_method_of_volref_is_measured():
    own = ["march", "exact", "auto", "auto-estimate"]
    assert [method.name for method in METHODS] == own + list(RIVALS)
    assert all(method.ladder for method in METHODS)
    for start in FAMILIES:
        assert any(method.name.startswith(start) for method in METHODS), f"no method is of {start}"
    assert {method.family for method in METHODS[4:]} == set(FAMILIES.values())


def test_tolerances_go_from_a_hundredth_to_1e_12_and_hold_half_a_grey_level():
    assert list(TOLERANCES) == sorted(TOLERANCES, reverse=True)
    assert {1e-2, HALF_LEVEL, 1e-12} <= set(TOLERANCES)
    assert np.log10(TOLERANCES[0] / TOLERANCES[-1]) == pytest.approx(10, abs=1e-12)  # of a few ulp


def test_a_method_is_run_as_it_is_named(monkeypatch):
    assert tiny("auto", 1e-3).bound_kind == "certified"
    assert tiny("march", 1.0).bound_kind == "estimate"
    asked = []

    def asking(scene, **words):
        asked.append(words)
        return render(scene, **words)

    monkeypatch.setattr(methods, "render", asking)
    for name in ("march", "exact", "auto", "auto-estimate"):
        tiny(name, 1e-2 if name != "march" else 1.0)
    assert {words.pop("threads") for words in asked} == {1}
    assert asked == [
        {"method": "march", "step": 1.0, "tolerance": 1e-12},
        {"method": "exact", "tolerance": 1e-2, "certified": True},
        {"method": "auto", "tolerance": 1e-2, "certified": True},
        {"method": "auto", "tolerance": 1e-2, "certified": False},
    ]
    rival = tiny("trapezoid", 1.0)
    assert (rival.bound, rival.bound_kind) == (None, "none")
    assert rival.preparation > 0


def test_steps_are_in_units_of_the_least_spacing():
    thin = colorful_transfer(extinction=1e-9)  # so that no ray ends early
    near = rough_scene(6, 4, transfer=thin, spacing=(1.0, 1.0, 2.0))
    far = rough_scene(6, 4, transfer=thin, spacing=(10.0, 10.0, 20.0))
    for name in ("march", "trapezoid"):
        [method] = chosen_methods([name])
        counts = [method.run(scene, 0.5).samples for scene in (near, far)]
        assert counts[0] == pytest.approx(counts[1], rel=0.02)  # the count of a ray is rounded up


# --- errors


def test_errors_are_those_of_a_loop_over_the_pixels():
    difference = np.random.default_rng(0).random((30, 40)) * 0.004
    errors = errors_of(difference, np.zeros((30, 40)))
    pixels = sorted(difference.ravel().tolist())
    assert errors.largest.value == pixels[-1]
    assert errors.rms.value == pytest.approx(math.sqrt(math.fsum(d * d for d in pixels) / 1200), rel=1e-14)
    assert errors.p99.value == pixels[1188]  # the first with 99 % of the 1199 others below it
    assert errors.above_half_level == sum(d > 1 / 510 for d in pixels) / 1200


def test_an_error_below_the_bound_of_the_reference_is_only_known_to_be_at_most_the_sum():
    errors = errors_of(np.full((2, 2), 3e-14), np.full((2, 2), 5e-14))
    for error in (errors.largest, errors.rms, errors.p99):
        assert not error.resolved
        assert error.value == pytest.approx(8e-14, rel=1e-14)  # of a few ulp
    assert str(errors.largest) == "<= 8e-14"
    assert errors_of(np.full((2, 2), 6e-14), np.full((2, 2), 5e-14)).largest == (6e-14, True)


def test_an_image_that_is_no_number_is_infinitely_far_off():
    errors = errors_of(np.array([[np.nan, 0.0]]), np.zeros((1, 2)))
    assert (errors.largest.value, errors.rms.value) == (math.inf, math.inf)
    assert errors.above_half_level == 0.5
    assert errors_of(np.array([[1e200, 0.0]]), np.zeros((1, 2))).rms.value == pytest.approx(1e200 / 2**0.5)


def test_a_bound_holds_up_to_the_bound_of_the_reference():
    difference, bound = np.array([0.10, 0.25, 0.31]), np.full(3, 0.2)
    assert share_held(difference, bound, np.full(3, 0.1)) == pytest.approx(2 / 3)
    assert share_held(difference, bound, np.zeros(3)) == pytest.approx(1 / 3)


# --- the frontier


def test_the_frontier_is_what_no_other_point_beats():
    fast, slow, beaten, level = point(1, 0.5), point(3, 0.01), point(2, 0.6), point(2, 0.5)
    assert frontier([beaten, slow, level, fast]) == (fast, slow)
    assert frontier([]) == ()


def test_the_frontier_of_another_measure_is_another():
    peaked, even = point(1, 0.5, rms=0.01), point(2, 0.4, rms=0.3)
    assert frontier([peaked, even]) == (peaked, even)
    assert frontier([peaked, even], "rms") == (peaked,)


def test_what_was_asked_for_a_tolerance_must_meet_it_by_its_own_bound():
    assert reaches(point(1, 1e-3), 1e-3)
    assert not reaches(point(1, 1.1e-3), 1e-3)
    assert reaches(certified(1, 1e-2, 1e-3), 1e-3)
    assert not reaches(certified(1, 1e-2, 5e-3, error=1e-6), 1e-3)  # true, but nobody could know
    claimed = point(1, 0.5, bound_kind="estimate", bound=1e-6, held=0.2, tolerance=1e-6)
    assert not reaches(claimed, 1e-3)  # claimed, but false


def test_the_fastest_to_an_error_is_the_fastest_that_reaches_it():
    points = [point(1, 0.5), point(3, 1e-4), point(2, 1e-4)]
    assert fastest(points, 1e-3) is points[2]
    assert fastest(points, 1e-9) is None


def test_certified_auto_is_compared_with_certified_images_only():
    scene = study(
        certified(3.0, 1e-2, 9e-3),
        certified(2.0, 1e-2, 9e-3, method="exact"),
        certified(1.5, 1e-4, 9e-5, method="exact"),  # faster, though more was asked of it
        certified(0.5, 0.1, 2e-2, error=1e-9, method="exact"),  # near the truth, but it does not say so
        point(0.1, 1e-6),
    )
    found = frontier_check([scene])
    [check] = found.checks
    assert (check.met, check.held, check.fastest, check.setting, check.ratio) == (
        True,
        1.0,
        "exact",
        1e-4,
        2.0,
    )
    assert (found.met, found.kept, found.held, found.median, found.worst) == (1.0, 1.0, 1.0, 2.0, 2.0)


def test_estimated_auto_is_compared_with_everything_by_hindsight():
    asked = {"bound_kind": "estimate", "held": 0.5, "method": "auto-estimate"}
    scene = study(
        point(3.0, 2e-2, setting=1e-2, tolerance=1e-2, bound=9e-3, **asked),
        point(1.0, 5e-4, setting=1e-3, tolerance=1e-3, bound=2e-3, **asked),
        point(0.5, 1e-3),
        point(0.25, 0.1),
    )
    found = frontier_check([scene], "estimate")
    assert [(check.met, check.fastest, check.ratio) for check in found.checks] == [
        (True, "trapezoid", 6.0),
        (False, "trapezoid", 2.0),
    ]
    assert (found.met, found.kept, found.held, found.median, found.worst) == (0.5, 0.5, 0.5, 4.0, 6.0)
    assert "worst 6.00 (made-up at 1e-02, trapezoid)" in str(found)
    assert found.as_dict()["checks"][0]["scene"] == "made-up"


def test_pixels_weigh_the_same_whatever_image_they_are_in():
    large = SceneStudy("large", "", 30, 5, (4, 4, 4), 1e-14, (certified(1, 1e-2, 9e-3, held=0.5),), ())
    assert frontier_check([study(certified(1, 1e-2, 9e-3)), large]).held == 0.625


def test_a_check_without_auto_is_refused():
    with pytest.raises(SceneError, match="'auto-estimate', got none"):
        frontier_check([study(certified(1, 1e-2, 9e-3))], "estimate")


# --- running it


@pytest.fixture(scope="module")
def report():
    """Two scenes, one of them of the user's own, by three methods."""
    own = Subject("mine", "the scene mine.json", rough_scene(8, 6))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(running, "chosen_methods", lambda names: short(chosen_methods(names)))
        return run_precision([subject_of(SUITES[1], (8, 6)), own], methods=MEASURED, runs=1)


MEASURED = ["march", "auto", "trapezoid"]


def short(methods):
    """The methods with fewer settings, each of which takes its time."""
    return [replace(m, ladder=(m.ladder[0], m.ladder[3], m.ladder[-1])) for m in methods]


def test_every_method_runs_down_its_ladder_on_every_scene(report):
    assert [scene.name for scene in report.scenes] == ["few-kinks", "mine"]
    for scene in report.scenes:
        ladders = [(m.name, s) for m in short(chosen_methods(MEASURED)) for s in m.ladder]
        assert [(p.method, p.setting) for p in scene.points] == ladders
        assert (scene.width, scene.height, scene.stopped) == (8, 6, ())
        assert {p.runs for p in scene.points} == {1}
    assert report.machine == this_machine()


def test_errors_fall_with_the_step_and_certificates_hold(report):
    assert report.passed
    for scene in report.scenes:
        marched = [p.errors.rms.value for p in scene.of("march")]
        assert marched[-1] < marched[0] / 100  # a step of 1/64 at second order would be 1/4096
        assert all(p.held == 1.0 and p.met and p.bound_kind == "certified" for p in scene.of("auto"))
        assert all(p.errors.largest.value <= 2 * p.tolerance for p in scene.of("auto"))
        assert scene.reference <= 1e-12


def test_the_reference_against_itself_is_known_to_its_bound():
    scene = rough_scene(5, 4)
    reference = render(scene, method="exact", tolerance=1e-12)
    [exact] = chosen_methods(["exact"])
    found = running._first_run(scene, exact, 1e-12, reference)
    assert found.errors.largest == (float(reference.bound.max()), False)


def test_settings_are_run_again_round_by_round_and_the_least_time_counts(monkeypatch):
    calls, clock = [], iter(range(1000))
    monkeypatch.setattr(running.time, "process_time", lambda: next(clock))

    def run(_, setting):
        calls.append(setting)
        for _ in range((5, 2, 3)[calls.count(setting) - 1]):
            next(clock)
        return Answer(np.zeros((4, 6, 4)), None, "none", 1, "made-up")

    method = Method("made-up", "Made up", "family", "step", (2.0, 1.0), run)
    subject = Subject("mine", "a scene", rough_scene(6, 4))
    told = []
    found = running.study_scene(subject, [method], 1e9, 3, told.append)
    assert calls == [2.0, 1.0] * 3
    assert [(p.seconds, p.runs) for p in found.points] == [(3, 3), (3, 3)]
    assert told == [0, 1, 2, 3, 4, 5]


def test_a_ladder_ends_after_an_image_that_took_a_tenth_of_the_budget_and_says_so(monkeypatch):
    clock = iter(range(0, 10**6, 30))
    monkeypatch.setattr(running.time, "process_time", lambda: next(clock))

    def answer(preparation):
        return lambda *_: Answer(np.zeros((4, 6, 4)), None, "none", 1, "made-up", preparation)

    slow = Method("slow", "Slow", "family", "step", (2.0, 1.0, 0.25), answer(None))
    tables = Method("tables", "Tables", "family", "step", (2.0, 1.0), answer(29.5))
    subject = Subject("mine", "a scene", rough_scene(6, 4))
    found = running.study_scene(subject, [slow, tables], 200.0, 1, lambda _: None)
    assert [p.method for p in found.points] == ["slow", "tables", "tables"]
    assert found.stopped == ("slow at step 1, step 1/4: step 2 took 30 s",)


def test_progress_ends_at_the_whole():
    told = []
    subject = Subject("mine", "a scene", rough_scene(4, 3))
    run_precision([subject], methods=["trapezoid"], runs=2, progress=lambda *now: told.append(now))
    assert told[0] == (0, 14)
    assert told[-1] == (14, 14)
    assert told == sorted(told)


@pytest.mark.parametrize(
    ("bad", "words"),
    [
        ({"budget": 0.0}, "budget must be above 0"),
        ({"runs": 0}, "runs must be"),
        ({"methods": ["nothing"]}, "method must be one of"),
    ],
)
def test_bad_arguments_are_refused_before_anything_runs(bad, words):
    with pytest.raises(SceneError, match=words):
        run_precision([], **bad)


def test_a_scene_of_meshes_only_is_refused():
    scene = suite_scene("mesh-inside")
    bare = type(scene)(None, None, scene.camera, 4, 3, meshes=scene.meshes)
    with pytest.raises(SceneError, match="scene bare must have a volume"):
        run_precision([Subject("bare", "", bare)])


# --- the machine


def test_the_machine_is_named(tmp_path):
    info = tmp_path / "cpuinfo"
    info.write_text("processor : 0\nmodel name\t: Some  Processor 3000\n\nmodel name\t: other\n")
    assert processor_name(info) == "Some Processor 3000"
    assert processor_name(tmp_path / "none")
    assert np.__version__ in str(this_machine())
    assert str(HERE) == "a processor, 2 cores, a system, Python 3.11, NumPy 2.1"


# --- what the report says


def test_a_broken_certificate_and_a_missed_tolerance_fail_the_report_and_are_named():
    good = certified(1.0, 1e-2, 9e-3)
    for bad, words in (
        (certified(1.0, 1e-3, 9e-4, held=0.98), "auto at 0.001 broke its certificate in 2.00% of the pixels"),
        (certified(1.0, 1e-3, 2e-3), "auto at 0.001 missed its tolerance: bound 0.002"),
    ):
        report = PrecisionReport(HERE, (study(good, bad),), 1.0, 1.0)
        assert not report.passed
        assert report.problems == (f"made-up: {words}",)
        assert words in report.sentence
        assert words in report.markdown()
    assert PrecisionReport(HERE, (study(good),), 1.0, 1.0).passed
    estimate = point(1.0, 0.5, bound_kind="estimate", bound=1.0, held=0.1, tolerance=0.1)
    assert PrecisionReport(HERE, (study(estimate),), 1.0, 1.0).passed  # an estimate may be wrong


def test_json_and_csv_hold_every_point(report):
    document = json.loads(json.dumps(report.as_dict(), allow_nan=False))
    rows = list(csv.DictReader(io.StringIO(report.csv())))
    points = [(scene.name, p) for scene in report.scenes for p in scene.points]
    assert len(rows) == len(points) == sum(len(scene["points"]) for scene in document["scenes"])
    for row, (name, p) in zip(rows, points, strict=True):
        assert (row["scene"], row["method"], float(row["setting"])) == (name, p.method, p.setting)
        assert float(row["seconds"]) == p.seconds
        assert float(row["error_largest"]) == p.errors.largest.value
        assert row["bound"] == ("" if p.bound is None else repr(p.bound))
    assert float(rows[0]["ns_per_sample"]) == pytest.approx(points[0][1].seconds / points[0][1].samples * 1e9)
    assert report.as_dict()["machine"]["numpy"] == np.__version__


def test_numbers_that_json_does_not_have_become_words():
    found = PrecisionReport(HERE, (study(point(1.0, math.inf)),), 1.0, 1.0).as_dict()
    assert found["scenes"][0]["points"][0]["error_largest"] == "inf"


def test_what_is_printed_is_the_frontier(report):
    text = str(report)
    for scene in report.scenes:
        assert f"{scene.name}, 8 x 6: {scene.meaning}" in text
        shown = text.split(f"{scene.name}, 8 x 6")[1].split("\n\n")[0].splitlines()[2:]
        assert len(shown) == len(frontier(scene.points))
    assert text.endswith("6 certified images, every pixel within its bound and every tolerance met")
    left_out = str(PrecisionReport(HERE, (study(point(1, 0.1), stopped=("slow at step 1",)),), 1.0, 1.0))
    assert "  left out: slow at step 1" in left_out


def test_the_table_of_costs_divides_certified_auto_by_the_fastest_rival():
    scene = study(
        certified(3.0, 1e-2, 1e-6),  # that it did more than was asked of it is luck
        certified(4.0, 1e-6, 9e-7),
        point(0.5, 9e-3),
        point(8.0, 5e-7),
    )
    page = PrecisionReport(HERE, (scene,), 1.0, 1.0).markdown()
    assert "| `made-up` | 6.00 | 0.50 | 0.50 | 0.50 | 0.50 | - | - |" in page
    assert "volref loses 1 of these 5 comparisons." in page
    assert "loses most on `made-up` at 1e-2: 6.00 times the 0.50 s of trapezoid, step 1." in page
    assert "- `made-up`: the least that a rival reached is an error of 5e-7." in page


def test_the_table_of_a_scene_has_the_seconds_to_each_error_and_the_fastest_bold():
    scene = study(certified(3.0, 1e-2, 9e-3), point(0.5, 9e-3), point(2.0, 5e-4), stopped=("x at step 1",))
    page = PrecisionReport(HERE, (scene,), 1.0, 1.0).markdown({"made-up": "images/m.svg"})
    assert "| volref auto (`auto`) | 3.0 | - | - | - | - | - | - | 0.004 |" in page
    assert "| trapezoid (`trapezoid`) | **0.50** | **2.0** | **2.0** | - | - | - | - | 0.0005 |" in page
    assert "| volref auto | certified | all | 1 of 1 | 0.5 times |" in page
    assert "](images/m.svg)" in page
    assert "- Left out: x at step 1." in page


# --- the page in docs


@pytest.fixture(scope="module")
def page():
    return (DOCS / "precision.md").read_text(encoding="utf-8")


def test_the_page_has_the_suites_and_methods_of_the_code(page):
    scenes = [*NAMES, "real_ct"]
    assert re.findall(r"^### (.*)$", page, re.MULTILINE) == scenes
    for suite in SUITES:
        assert f"{suite.meaning[0].upper()}{suite.meaning[1:]}." in page
    for section in page.split("\n### ")[1:]:
        assert re.findall(r"^\| [^|]+\(`([\w-]+)`\) \|", section, re.MULTILINE) == [m.name for m in METHODS]
    assert len(re.findall(r"^\| `[\w-]+` \|", page, re.MULTILINE)) == len(scenes)  # what certainty costs


def test_the_words_of_the_page_are_those_of_the_code(page):
    from volref.studies.precision.page import COMMAND, INTRODUCTION, READING

    for text in (READING, *INTRODUCTION.split("{")[:1], INTRODUCTION[INTRODUCTION.index("## Which") :]):
        assert text in page
    assert f"$ {COMMAND}\n" in page
    assert page.count("| --- " * (len(TARGETS) + 1)) == len(SUITES) + 2


def test_every_plot_of_the_page_is_there_and_small(page):
    images = re.findall(r"!\[[^\]]+\]\(([^)]+)\)", page)
    assert len(images) == len(SUITES) + 1
    assert all(0 < (DOCS / image).stat().st_size < 300_000 for image in images)
