"""The stability study: every case holds, and breaks when what it guards is broken."""

import json
import sys

import numpy as np
import pytest

import volref.studies.stability.catalogue as catalogue
import volref.studies.stability.run as running
from tests.docs.pages import DOCS
from volref import image
from volref.cli import main
from volref.errors import SceneError
from volref.phantoms.scenes import homogeneous_scene
from volref.planning import choices
from volref.records import Spans
from volref.scene import camera as camera_module
from volref.scene import mesh as mesh_module
from volref.scene import volume as volume_module
from volref.scene.transform import affine
from volref.stages import classify, composite, sampling, spans, surface, zbuffer
from volref.studies.stability import CASES, Case, run_stability, textbook
from volref.studies.stability.case import Answer, Measured, measured
from volref.studies.stability.pictures import _rendered
from volref.studies.stability.run import run_case
from volref.studies.stability.shader import shader_image
from volref.truth import march

NAMES = [case.name for case in CASES]


@pytest.fixture(scope="module")
def report():
    return run_stability()


# --- the cases


def test_every_case_holds(report):
    assert [result.case.name for result in report.results] == NAMES
    assert not [(r.case.name, r.problem, r.answers) for r in report.results if not r.passed]
    assert report.passed


def test_there_are_more_cases_than_asked_for_each_under_one_name_and_families_in_one_piece():
    assert len(CASES) >= 45
    assert len(set(NAMES)) == len(NAMES)
    families = [case.family for case in CASES]
    assert families == sorted(families, key=families.index)


@pytest.mark.parametrize("case", CASES, ids=NAMES)
def test_each_case_says_what_it_asks_where_the_truth_is_from_and_why_its_limit_is_what_it_is(case):
    assert case.question.endswith(("?", ")?"))
    assert case.error in ("absolute", "relative")
    for words in (case.reference, case.textbook, case.reason):
        assert words
        assert not words.endswith(".")  # the page adds it
        assert "|" not in words  # it would end a cell of the page's tables


def test_the_textbook_formula_is_further_off_than_volref_may_be(report):
    for result in report.results:
        tightest = min(answer.limit for answer in result.answers)
        most = max(answer.error for answer in result.answers)
        assert result.textbook_error > max(tightest, most), result.case.name


def test_scenes_are_answered_by_the_marcher_and_with_a_certificate(report):
    both = [r for r in report.results if [a.who for a in r.answers] == ["march", "exact"]]
    assert len(both) >= 25
    for result in both:
        marched, exact = result.answers
        assert marched.certificate is None
        assert exact.error <= exact.certificate <= exact.limit
    single = {answer.who for r in report.results if len(r.answers) == 1 for answer in r.answers}
    assert single == {"volref", "march"}


# --- the textbook formulas and the shader are fair


def test_each_textbook_formula_is_right_where_nothing_is_hard():
    assert textbook.opacity(np.array(0.5)) == pytest.approx(-np.expm1(-0.5), rel=1e-15)  # 4 ulp
    assert textbook.corrected_opacity(np.array(0.5), 2.0) == 0.75
    assert textbook.logarithmic_opacity(np.array(0.5), 2.0) == pytest.approx(0.75, rel=1e-15)  # 4 ulp
    assert textbook.riemann(0.25, 2) == (0.4375, 0.5625)
    assert textbook.front_to_back(np.array([0.5, 0.5]), 1.0) == (0.75, 0.25)
    for pick in ("minimum", "fmin", "sign"):
        assert textbook.slab((-1.0, 0.5, 0.25), (1.0, 0.125, 0.0625), pick) == (1.0, 2.0)
    assert textbook.lerp(np.float64(1.0), np.float64(3.0), 0.5) == 2.0
    corners = np.arange(8.0)
    assert textbook.weighted_corners(corners, np.array([[0.5], [0.25], [0.75]])) == [4.0]
    assert textbook.window_depth(2.0, 1.0, 3.0) == pytest.approx(2.0, rel=1e-6)  # 8 ulp of float32
    assert textbook.quadratic_root(1.0, 1.0, -2.0) == 1.0
    assert textbook.pack_fract(np.array([0.5, 0.25 + 2.0**-20])) == pytest.approx(
        [0.5, 0.25 + 2.0**-20], abs=2**-24
    )
    triangle = np.array([(-1.0, -1.0, -5.0), (1.0, -1.0, -5.0), (0.0, 1.0, -5.0)])
    assert textbook.distance_by_determinant((0, 0, 0), (0, 0, -1), triangle) == 5.0


def test_the_shader_is_right_where_nothing_is_hard():
    scene, pixels = homogeneous_scene(background=(0.1, 0.2, 0.3, 1.0))
    # float32: chords of 7 from 15 away are off by 1e-6 of that, and so is the optical depth of 2.
    assert np.abs(shader_image(scene) - pixels.reshape(-1, 4)).max() < 1e-5


# --- what the judge lets pass


def case_of(measure):
    return Case("made-up", "Made up", "?", "one", "two", "three", measure)


def verdict(*answers, reference=(1.0, 2.0)):
    found = Measured(np.array(reference), np.array(reference), answers)
    return run_case(case_of(lambda: found))


def test_an_error_at_the_limit_passes_and_one_beyond_it_fails():
    assert verdict(Answer("volref", np.array([1.0, 2.25]), 0.25)).passed
    assert not verdict(Answer("volref", np.array([1.0, 2.26]), 0.25)).passed


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_nan_and_infinity_fail_whatever_the_limit(bad):
    result = verdict(Answer("volref", np.array([bad, 2.0]), 1e300))
    assert not result.passed
    assert result.answers[0].error == np.inf


def test_one_answer_of_two_that_fails_fails_the_case():
    good, bad = Answer("march", np.array([1.0, 2.0]), 0.0), Answer("exact", np.array([1.0, 3.0]), 0.0)
    assert not verdict(good, bad).passed


def test_a_certified_error_must_lie_within_its_own_certificate():
    value, certificate = np.array([1.0, 2.1]), np.array([0.2, 0.2])
    assert verdict(Answer("exact", value, 0.2, certificate)).passed
    assert not verdict(Answer("exact", value, 0.2, np.array([0.2, 0.05]))).passed


def test_a_certificate_beyond_the_limit_fails_though_the_error_is_within():
    assert not verdict(Answer("exact", np.array([1.0, 2.0]), 0.1, np.array([0.0, 0.2]))).passed


def test_a_relative_error_of_zero_is_zero_even_where_the_truth_is_zero():
    found = measured([0.0, 4.0], [1.0, 1.0], [0.0, 5.0], 0.25)
    case = Case("made-up", "Made up", "?", "one", "two", "three", lambda: found, "relative")
    assert run_case(case).passed


def _divide_by_zero():
    return measured(0.0, 0.0, np.array(1.0) / np.array(0.0), 1e300)


def _warn():
    import warnings

    warnings.warn("odd", RuntimeWarning, stacklevel=1)
    return measured(0.0, 0.0, 0.0, 0.0)


def _refuse():
    message = "no"
    raise SceneError(message)


@pytest.mark.parametrize(
    ("measure", "words"),
    [
        (_divide_by_zero, "FloatingPointError: divide"),
        (_warn, "RuntimeWarning: odd"),
        (_refuse, "SceneError: no"),
    ],
)
def test_what_warns_or_raises_fails_and_is_told(measure, words, monkeypatch):
    monkeypatch.setattr(catalogue, "CASES", (case_of(measure),))
    report = run_stability()
    assert not report.passed
    assert report.results[0].problem.startswith(words)
    assert f"FAILED: {words}" in str(report)
    assert words in report.markdown()
    json.dumps(report.as_dict(), allow_nan=False)


# --- what the cases guard: broken on purpose, they fail


def everywhere(monkeypatch, original, broken):
    """Put `broken` in the place of `original` in every module of volref that holds it."""
    for name, module in list(sys.modules.items()):
        if name.startswith("volref"):
            for attribute, value in list(vars(module).items()):
                if value is original:
                    monkeypatch.setattr(module, attribute, broken)


def plain_exponentials(table, strength, length):
    if table.interpolation == "extinction":
        return 1 - np.exp(-strength * length)
    return 1 - (1 - strength) ** (np.asarray(length) / table.unit_distance)


def opacity_as_a_product(_table, strength, length):
    return strength * length


def products_by_the_inverse(pick_low, pick_high):
    def box_spans(origins, directions, low, high):
        with np.errstate(all="ignore"):
            inverse = 1 / directions
            first, second = (low[:, None] - origins) * inverse, (high[:, None] - origins) * inverse
            return Spans(
                np.maximum(pick_low(first, second).max(axis=0), 0), pick_high(first, second).min(axis=0)
            )

    return box_spans


def from_behind_the_eye(origins, directions, low, high):
    found = spans_as_they_are(origins - directions, directions, low, high)
    return Spans(found.t_near - 1, found.t_far - 1)


spans_as_they_are = spans.box_spans


def cut_behind_the_eye(ranges, _begin, end):
    return Spans(np.where(ranges.t_near == 0, -1.0, ranges.t_near), np.minimum(ranges.t_far, end))


def lookup_not_held(table, values, work):
    entry = classify._entries(table, values, work)
    found = table.base[:, entry] + table.slope[:, entry] * (values - table.start[entry])
    return found[:-1], found[-1]


trilinear_as_it_is = sampling.trilinear


def trilinear_in_float32(grid, position, work):
    return trilinear_as_it_is(grid, position, work).astype(np.float32).astype(np.float64)


def trilinear_by_weights(grid, position, _work):
    cell = position.astype(np.int64)
    f = position - cell
    index = cell[0] + cell[1] * grid.strides[1] + cell[2] * grid.strides[0]  # padded: 1 along x
    total = np.zeros(position.shape[1])
    for corner, values in enumerate(grid.corners):
        bits = corner & 1, corner >> 1 & 1, corner >> 2
        weight = np.prod([f[a] if bits[a] else 1 - f[a] for a in range(3)], axis=0)
        total += weight * values[index]
    return total


grid_as_it_is = sampling.padded_grid


def grid_without_clamp(volume, dtype=None):
    grid = grid_as_it_is(volume, dtype)
    padded = grid.corners[0].reshape([n + 2 for n in volume.values.shape])
    for axis in range(3):
        np.moveaxis(padded, axis, 0)[-1] = 0
    return grid


def truncated_codes(unit):
    return np.clip(unit * 255, 0, 255).astype(np.uint8)


def codes_that_wrap(unit):
    return np.rint(unit * 255).astype(np.int64).astype(np.uint8)


def colour_over_alpha(rgba):
    return np.concatenate([rgba[..., :3] / rgba[..., 3:], rgba[..., 3:]], axis=-1)


def gamma_of_anything(linear):
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * np.abs(linear) ** (1 / 2.4) - 0.055)


def whole_steps(ranges, step):
    length = np.maximum(ranges.t_far - ranges.t_near, 0.0)
    counts = np.ceil(length / step).astype(np.intp)
    return counts, np.full(len(counts), step)


def composite_in_float32(transmittance, color, opacity, colors, _work):
    for k, alpha in enumerate(opacity):
        weight = (transmittance * alpha).astype(np.float32)
        transmittance[:] = (transmittance - weight).astype(np.float32)
        color[:] = (color + weight * colors[:, k]).astype(np.float32)


def any_voxels(array, nan):
    del nan
    return array


def view_without_checks(eye, target, up):
    eye, target, up = (np.asarray(v, dtype=np.float64) for v in (eye, target, up))
    forward = (target - eye) / max(np.linalg.norm(target - eye), 1e-300)
    right = np.cross(forward, up)
    right /= max(np.linalg.norm(right), 1e-300)
    rotation = np.stack([right, np.cross(right, forward), -forward]) + 1e-6 * np.eye(3)
    return affine(rotation, -rotation @ eye)


meet_as_it_is = surface.meet_triangles


def depth_for_distance(rays, triangles):
    distance, weights = meet_as_it_is(rays, triangles)
    return distance * np.abs(rays.directions[:, 2]), weights


key_as_it_is = zbuffer._key


def key_in_float32(depth, camera):
    return key_as_it_is(depth, camera).astype(np.float32).astype(np.float64)


def no_area_is_fine(_vertices, faces):
    return np.zeros(len(faces), bool)


def fract_bytes(unit):
    parts = np.modf(np.asarray(unit)[:, None] * 256.0 ** np.arange(3))[0]
    return np.floor(parts * 256).clip(0, 255).astype(np.uint8)


def surface_ignored(ranges, _begin, _distance):
    return ranges


def bounds_of_nothing(*arguments, **options):
    pixels, bounds = _rendered(*arguments, **options)
    return pixels, 0 * bounds


BREAKS = [
    (classify.segment_opacity, plain_exponentials, ["thin-segment", "depth-1e-300-to-1e300"]),
    (classify.segment_opacity, opacity_as_a_product, ["long-steps", "extinction-1e300"]),
    (spans.box_spans, products_by_the_inverse(np.minimum, np.maximum), ["ray-in-a-face", "rays-in-faces"]),
    (spans.box_spans, products_by_the_inverse(np.fmin, np.fmax), ["ray-in-a-face", "direction-1e-310"]),
    (spans.box_spans, from_behind_the_eye, ["camera-inside"]),
    (spans.cut_spans, cut_behind_the_eye, ["camera-on-a-face"]),
    (spans.cut_spans, surface_ignored, ["zero-length-span", "camera-inside-a-mesh"]),
    (classify.classify, lookup_not_held, ["opacity-rounded-above-1", "extinction-rounded-below-0"]),
    (sampling.trilinear, trilinear_in_float32, ["uint32-extremes", "denormal-values"]),
    (sampling.trilinear, trilinear_by_weights, ["constant-field", "constant-field-on-a-jump"]),
    (sampling.padded_grid, grid_without_clamp, ["far-face"]),
    (image.bytes_from_unit, truncated_codes, ["nearly-white"]),
    (image.bytes_from_unit, codes_that_wrap, ["beyond-white"]),
    (image.straight_from_premultiplied, colour_over_alpha, ["straight-colour-at-alpha-0"]),
    (image.encode_srgb, gamma_of_anything, ["negative-light"]),
    (image.bytes24_from_unit, fract_bytes, ["depth-1-in-24-bits"]),
    (march.segments_of, whole_steps, ["step-count"]),
    (composite.composite_block, composite_in_float32, ["weights-and-transmittance", "million-thin-samples"]),
    (volume_module._finite_values, any_voxels, ["nan-and-infinite-voxels", "nan-replaced"]),
    (camera_module.look_at_matrix, view_without_checks, ["up-along-the-view", "up-1e-8-from-the-view"]),
    (surface.meet_triangles, depth_for_distance, ["camera-inside-a-cube", "camera-inside-a-mesh"]),
    (zbuffer._key, key_in_float32, ["a-billionth-in-front"]),
    (mesh_module.degenerate, no_area_is_fine, ["triangle-without-area"]),
    (_rendered, bounds_of_nothing, ["rays-in-lattice-planes", "camera-on-a-voxel"]),
]


@pytest.mark.parametrize(
    ("original", "broken", "name"),
    [(original, broken, name) for original, broken, names in BREAKS for name in names],
    ids=[f"{broken.__name__}-{name}" for _, broken, names in BREAKS for name in names],
)
def test_a_case_fails_when_what_it_guards_is_broken(original, broken, name, monkeypatch):
    everywhere(monkeypatch, original, broken)
    assert not run_stability(only=[name]).passed


def test_rays_that_end_too_early_fail_the_thick_slab(monkeypatch):
    monkeypatch.setattr(choices, "TERMINATION", 1e-3)
    assert not run_stability(only=["optical-depth-40"]).passed


@pytest.mark.parametrize("name", ["spacing-1-1-1e6-across", "spacing-1-1-1e6-along"])
def test_directions_normalised_in_voxels_fail_the_needle(name, monkeypatch):
    world = march.transform_directions

    def normalised(matrix, directions):
        found = world(matrix, directions)
        return found / np.linalg.norm(found, axis=-1, keepdims=True)

    monkeypatch.setattr(march, "transform_directions", normalised)
    assert not run_stability(only=[name]).passed


# --- the report and the page


def test_the_numbers_of_a_case_are_those_of_its_worst_textbook_answer():
    found = measured([1.0, 2.0], [1.5, np.nan], [1.0, 2.0], 0.0)
    result = run_case(case_of(lambda: found))
    assert (result.reference, result.textbook_error, result.answers[0].value) == (2.0, np.inf, 2.0)
    assert result.as_dict()["textbook"] == {"value": "nan", "error": "inf", "formula": "two"}


def names_on(page):
    return [line.split("`")[1] for line in page.splitlines() if line.startswith("| `")]


def test_the_page_in_docs_has_the_cases_of_the_code_and_all_hold():
    page = (DOCS / "stability.md").read_text(encoding="utf-8")
    assert names_on(page) == NAMES
    assert f"{len(NAMES)} of {len(NAMES)} cases hold." in page
    assert "failed" not in page
    for case in CASES:
        for words in (case.question, case.reference, case.textbook, case.reason):
            assert words in page, case.name


def test_the_page_is_what_the_report_writes_but_for_digits(report):
    page = (DOCS / "stability.md").read_text(encoding="utf-8")

    def without_digits(text):
        return [line.split(" | ")[0] if line.startswith("| ") else line for line in text.splitlines()]

    assert without_digits(page) == without_digits(report.markdown())


# --- the command


def run(capsys, *words):
    status = main(["stability", *map(str, words)])
    out, err = capsys.readouterr()
    return status, out, err


@pytest.fixture
def failing(monkeypatch):
    """A study of two cases, of which the second fails."""
    cases = CASES[0], case_of(lambda: measured(1.0, 5.0, 2.0, 0.5))
    monkeypatch.setattr(catalogue, "CASES", cases)


def test_the_command_prints_a_line_per_case_and_ends_well(capsys):
    status, out, err = run(capsys, "--only", "thin-segment", "ray-in-a-face")
    assert (status, err) == (0, "")
    assert [line.split()[0] for line in out.splitlines()] == ["case", "thin-segment", "ray-in-a-face", "2"]
    assert out.endswith("2 of 2 cases hold\n")


@pytest.mark.usefixtures("failing")
def test_the_command_ends_with_1_if_a_case_fails_and_names_it(capsys):
    status, out, _ = run(capsys)
    assert status == 1
    assert "FAILED: volref 1, limit 0.5" in out
    assert out.endswith("1 of 2 cases hold; not: made-up\n")
    assert run(capsys, "-q") == (1, "", "")


@pytest.mark.usefixtures("failing")
def test_json_is_one_document_with_everything(capsys):
    status, out, err = run(capsys, "--json")
    found = json.loads(out)
    assert (status, err, found["passed"], found["cases"]) == (1, "", False, 2)
    assert [result["passed"] for result in found["results"]] == [True, False]
    assert found["results"][1] == {
        "name": "made-up",
        "family": "Made up",
        "question": "?",
        "passed": False,
        "problem": "",
        "reference": {"value": 1.0, "source": "one"},
        "textbook": {"value": 5.0, "error": 4.0, "formula": "two"},
        "answers": [
            {"who": "volref", "value": 2.0, "error": 1.0, "certificate": None, "limit": 0.5, "passed": False}
        ],
        "error": "absolute",
        "reason": "three",
    }


def test_a_family_is_all_its_cases(capsys):
    _, out, _ = run(capsys, "--only", "Encodings", "--json")
    found = [result["name"] for result in json.loads(out)["results"]]
    assert found == [case.name for case in CASES if case.family == "Encodings"]


def test_an_unknown_case_is_refused_with_the_nearest(capsys):
    status, out, err = run(capsys, "--only", "thin-segmet")
    assert (status, out) == (2, "")
    assert err == (
        "volref: the case must be a name or a family of the study, got 'thin-segmet'; use 'thin-segment'\n"
    )


def test_the_list_names_every_case_and_runs_none(capsys, monkeypatch):
    monkeypatch.setattr(running, "run_case", None)
    status, out, _ = run(capsys, "--list")
    assert status == 0
    assert [line.split(":")[0].strip() for line in out.splitlines() if line.startswith("  ")] == NAMES
    _, out, _ = run(capsys, "--list", "--json", "--only", "thin-segment")
    assert json.loads(out) == [
        {"name": "thin-segment", "family": "One segment", "question": CASES[0].question}
    ]


def test_the_page_is_written_once_and_again_only_by_force(tmp_path, capsys, monkeypatch):
    page = tmp_path / "page.md"
    status, _, err = run(capsys, "--only", "thin-segment", "--markdown", page)
    assert (status, err) == (0, f"volref: wrote {page}\n")
    text = page.read_text(encoding="utf-8")
    assert names_on(text) == ["thin-segment"]
    assert run(capsys, "--only", "thin-segment", "--markdown", page, "--force")[0] == 0
    monkeypatch.setattr(running, "run_case", None)  # refused before any case runs
    status, out, err = run(capsys, "--only", "thin-segment", "--markdown", page)
    assert (status, out) == (2, "")
    assert err.startswith(f"volref: {page} must not exist yet")
    assert page.read_text(encoding="utf-8") == text


def test_progress_counts_the_cases():
    seen = []
    run_stability(lambda done, total: seen.append((done, total)), only=["thin-segment", "step-count"])
    assert seen == [(0, 2), (1, 2), (2, 2)]
