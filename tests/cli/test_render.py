"""`volref render`, `plan`, `trace`: a scene file in, images and figures out."""

import json

import numpy as np
import pytest
from PIL import Image

import volref
from tests.scenes import camera_towards, colorful_transfer, rough_scene, rough_volume
from volref import Camera, Scene, load_scene, planning, read_image, save_scene
from volref.cli import main
from volref.cli.options import METHODS
from volref.image import encode_rgba8
from volref.report.figures import levels


def run(capsys, *words):
    status = main([str(word) for word in words])
    out, err = capsys.readouterr()
    return status, out, err


def advised_step(err):
    return err.split("try --step ")[1].split(",")[0]


def line(out):
    """The line that `render` prints of an image."""
    kind = {"certified": "certified", "estimate": "estimated"}[out.bound_kind]
    return f"volref: error <= {levels(out.bound.max())}/255 ({kind}), "


# --- render


def test_every_output_is_the_image_that_the_library_renders(scene_file, tmp_path, capsys):
    targets = [tmp_path / name for name in ("image.npy", "image.npz", "image.png")]
    words = [word for target in targets for word in ("-o", target)]
    status, out, _ = run(capsys, "render", scene_file, *words, "--step", "0.02")
    expected = volref.render(load_scene(scene_file), method="march", step=0.02)
    assert (status, out) == (0, "")
    np.testing.assert_array_equal(np.load(targets[0]), expected.rgba)
    with np.load(targets[1]) as arrays:
        np.testing.assert_array_equal(arrays["rgba"], expected.rgba)
    with Image.open(targets[2]) as image:
        np.testing.assert_array_equal(np.asarray(image), encode_rgba8(expected.rgba))


def test_a_tolerance_that_is_not_met_is_status_1_with_the_figure_and_a_cure_that_works(
    scene_file, tmp_path, capsys
):
    status, out, err = run(capsys, "render", scene_file, "-o", tmp_path / "coarse.npy", "--step", "1")
    worst = volref.render(load_scene(scene_file), method="march", step=1.0).bound.max()
    assert (status, out) == (1, "")
    assert (tmp_path / "coarse.npy").exists()
    assert f"tolerance not met: error {worst:.3g} (estimate) above 0.00196" in err
    step = advised_step(err)
    again = tmp_path / "fine.npy"
    # The error is of second order only once the step is fine: following the advice has to end, not at once.
    for _ in range(4):
        status, _, err = run(capsys, "render", scene_file, "-o", again, "-f", "--step", step)
        if status == 0:
            break
        step = advised_step(err)
    assert status == 0
    # And the other advice: a method that has no step.
    _, _, err = run(capsys, "render", scene_file, "-o", again, "-f", "--step", "1")
    assert "or --method exact, or raise --tolerance" in err
    assert run(capsys, "render", scene_file, "-o", again, "-f", "--method", "exact")[0] == 0


def test_a_tolerance_below_what_ending_rays_early_leaves_says_so(scene_file, tmp_path, capsys):
    words = ("-o", tmp_path / "image.npy", "--step", "0.1", "--tolerance", "1e-9")
    status, _, err = run(capsys, "render", scene_file, *words)
    assert status == 1
    assert "rays end at a transmittance of 1e-06: raise --tolerance" in err


def test_json_holds_the_figures_and_nothing_else_is_on_stdout(scene_file, tmp_path, capsys):
    target = tmp_path / "image.npy"
    status, out, _ = run(capsys, "render", scene_file, "-o", target, "--json", "--step", "0.05", "-j", "1")
    found = json.loads(out)
    expected = volref.render(load_scene(scene_file), method="march", step=0.05)
    assert found["outputs"] == [str(target)]
    assert (found["width"], found["height"], found["threads"]) == (24, 16, 1)
    assert (found["samples"], found["plan"]) == (expected.samples, expected.plan.as_dict())
    assert (found["bound"]["kind"], found["method"]) == ("estimate", "march")
    assert found["bound"]["max"] == expected.bound.max()
    assert found["bound"]["p99"] == np.percentile(expected.bound, 99)
    assert found["met_tolerance"] == (status == 0) == expected.met_tolerance
    assert found["seconds"] > 0


def test_json_is_written_too_when_the_tolerance_is_not_met(scene_file, tmp_path, capsys):
    status, out, err = run(capsys, "render", scene_file, "-o", tmp_path / "a.npy", "--step", "1", "--json")
    assert (status, json.loads(out)["met_tolerance"]) == (1, False)
    assert "tolerance not met" in err


def test_quiet_says_nothing_when_all_is_well(scene_file, tmp_path, capsys):
    words = ("render", scene_file, "-o", tmp_path / "a.npy", "-q", "--step", "0.02")
    assert run(capsys, *words) == (0, "", "")


def test_a_file_that_exists_is_kept_unless_forced(scene_file, tmp_path, capsys):
    target = tmp_path / "image.png"
    target.write_text("mine")
    status, out, err = run(capsys, "render", scene_file, "-o", target)
    assert (status, out, target.read_text()) == (2, "", "mine")
    assert "--force" in err
    assert run(capsys, "render", scene_file, "-o", target, "--force", "--step", "0.02")[0] == 0
    assert read_image(target).shape == (16, 24, 4)


@pytest.mark.parametrize(
    ("outputs", "words"),
    [
        (["image.jpg"], "must end in .png, .exr, .npy, .npz, got '.jpg'"),
        (["image"], "must end in"),
        (["nowhere/image.png"], "a folder that exists"),
        (["image.png", "image.png"], "must be named once"),
    ],
)
def test_an_output_that_cannot_be_written_is_refused_before_the_work(
    outputs, words, scene_file, tmp_path, capsys, monkeypatch
):
    def never(*_, **__):
        raise AssertionError("rendered")

    monkeypatch.setattr("volref.render", never)
    named = [word for name in outputs for word in ("-o", tmp_path / name)]
    status, out, err = run(capsys, "render", scene_file, *named)
    assert (status, out) == (2, "")
    assert words in err
    assert err.count("\n") == 1


def test_another_size_changes_the_image_and_nothing_else(scene_file, tmp_path, capsys):
    target = tmp_path / "image.npy"
    run(capsys, "render", scene_file, "-o", target, "--size", "30x20")
    np.testing.assert_array_equal(np.load(target), volref.render(rough_scene(30, 20), method="auto").rgba)


def test_another_size_is_refused_where_a_projection_matrix_has_its_own_aspect(tmp_path, capsys):
    volume = rough_volume()
    camera = camera_towards(volume)
    given = Camera.from_matrices(camera.view_from_world, camera.clip_from_view(24, 16))
    save_scene(Scene(volume, colorful_transfer(), given, 24, 16), tmp_path / "scene.json")
    status, _, err = run(capsys, "plan", tmp_path / "scene.json", "--size", "32x16")
    assert status == 2
    assert "must have the aspect of the image" in err
    assert run(capsys, "plan", tmp_path / "scene.json", "--size", "48x32")[0] == 0


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("-j", "0"), "threads must be a whole number from 1"),
        (("--step", "0"), "step must be above 0"),
        (("--step", "-1"), "step must be above 0"),
        (("--tolerance", "0"), "tolerance must be above 0"),
        (("--max-seconds", "0"), "max_seconds must be above 0"),
        (("--size", "0x4"), "scene.width must be a whole number from 1"),
    ],
)
def test_numbers_out_of_range_are_refused_by_the_rule_of_the_library(
    words, message, scene_file, tmp_path, capsys
):
    status, out, err = run(capsys, "render", scene_file, "-o", tmp_path / "a.png", *words)
    assert (status, out) == (2, "")
    assert err.startswith(f"volref: {message}")
    assert not (tmp_path / "a.png").exists()


@pytest.mark.parametrize("words", [(), ("--method", "auto"), ("--method", "exact")])
def test_the_error_is_certified_unless_asked_otherwise(words, scene_file, tmp_path, capsys):
    target = tmp_path / "image.npy"
    status, out, err = run(capsys, "render", scene_file, "-o", target, *words)
    expected = volref.render(load_scene(scene_file), method="exact")
    np.testing.assert_array_equal(np.load(target), expected.rgba)
    assert (status, out) == (0, "")
    assert err.startswith(line(expected))
    assert err.endswith(f" s, method exact; wrote {target}\n")
    assert err.count("\n") == 1


def test_json_says_that_the_error_is_certified_and_which_method_answered(scene_file, tmp_path, capsys):
    words = ("render", scene_file, "-o", tmp_path / "a.npy", "--tolerance", "1e-6", "--json")
    status, out, err = run(capsys, *words)
    found, expected = json.loads(out), volref.render(load_scene(scene_file), method="exact", tolerance=1e-6)
    assert (status, found["met_tolerance"], found["tolerance"]) == (0, True, 1e-6)
    assert (found["method"], found["bound"]["kind"]) == ("exact", "certified")
    assert found["bound"]["max"] == expected.bound.max() <= 1e-6
    assert err.startswith(line(expected))


@pytest.mark.parametrize("words", [("--step", "0.3"), ("--step", "0.3", "--method", "auto")])
def test_a_step_asks_for_a_march(words, scene_file, tmp_path, capsys):
    target = tmp_path / "image.npy"
    _, _, err = run(capsys, "render", scene_file, "-o", target, *words)
    expected = volref.render(load_scene(scene_file), method="march", step=0.3)
    np.testing.assert_array_equal(np.load(target), expected.rgba)
    assert err.startswith(line(expected))
    assert " s, method march; wrote " in err


@pytest.mark.parametrize("verb", ["render", "plan"])
def test_the_exact_method_has_no_step(verb, scene_file, tmp_path, capsys):
    target = tmp_path / "image.npy"
    output = ("-o", target) if verb == "render" else ()
    words = (verb, scene_file, *output, "--method", "exact", "--step", "0.3")
    status, out, err = run(capsys, *words)
    assert (status, out) == (2, "")
    assert err == (
        "volref: step must be left out unless method is 'march', got 0.3; pass --method march too\n"
    )
    assert not target.exists()


def test_the_methods_are_those_of_the_library():
    assert METHODS == planning.METHODS


def test_an_estimate_may_be_allowed(scene_file, tmp_path, capsys, monkeypatch):
    asked = []

    def asking(scene, **words):
        asked.append(words)
        return render(scene, **words)

    render = volref.render
    monkeypatch.setattr("volref.render", asking)
    words = ("render", scene_file, "-o", tmp_path / "a.npy", "-f", "--json")
    for more, certified in (((), True), (("--allow-estimate",), False)):
        status, out, _ = run(capsys, *words, *more)
        found = json.loads(out)
        assert (asked[-1]["method"], asked[-1]["certified"]) == ("auto", certified)
        # Which one is cheaper is a matter of the machine; that the tolerance is met is not.
        assert (status, found["met_tolerance"]) == (0, True)
        assert found["bound"]["kind"] == "certified" or not certified


def test_an_image_that_ran_out_of_time_is_written_with_its_certified_error(scene_file, tmp_path, capsys):
    target = tmp_path / "image.npz"
    words = ("render", scene_file, "-o", target, "--max-seconds", "1e-9", "--json")
    status, out, err = run(capsys, *words)
    found = json.loads(out)
    assert (status, found["met_tolerance"], found["bound"]["kind"]) == (1, False, "certified")
    assert "; the time was up: raise --max-seconds or --tolerance" in err
    truth = volref.render(load_scene(scene_file), method="exact", tolerance=1e-9)
    with np.load(target) as arrays:
        error = np.abs(arrays["rgba"] - truth.rgba).max(axis=-1)
        assert (error <= arrays["bound"] + truth.bound).all()
        assert found["bound"]["max"] == arrays["bound"].max()


def test_a_tolerance_beyond_float64_says_so(scene_file, tmp_path, capsys):
    words = ("-o", tmp_path / "image.npy", "--tolerance", "1e-17")
    status, _, err = run(capsys, "render", scene_file, *words)
    assert status == 1
    assert "(certified) above 1e-17" in err
    assert "; float64 cannot tell more: raise --tolerance" in err


# --- plan, trace


def test_plan_prints_the_plan(scene_file, capsys):
    expected = volref.plan(load_scene(scene_file), method="march", step=0.3, tolerance=0.25)
    words = ("plan", scene_file, "--step", "0.3", "--tolerance", "1/4")
    assert run(capsys, *words) == (0, f"{expected}\n", "")
    status, out, err = run(capsys, *words, "--json")
    assert (status, json.loads(out), err) == (0, expected.as_dict(), "")
    exact = volref.plan(load_scene(scene_file), method="exact")
    assert run(capsys, "plan", scene_file) == (0, f"{exact}\n", "")
    either = volref.plan(load_scene(scene_file), method="auto", certified=False)
    assert run(capsys, "plan", scene_file, "--allow-estimate") == (0, f"{either}\n", "")


def test_trace_prints_the_ray(scene_file, capsys):
    expected = volref.trace(load_scene(scene_file), (12, 7), step=0.3)
    words = ("trace", scene_file, "12", "7", "--step", "0.3")
    assert run(capsys, *words) == (0, f"{expected}\n", "")
    status, out, err = run(capsys, *words, "--json")
    assert (status, out, err) == (0, f"{expected.to_json()}\n", "")


def test_a_ray_that_misses_the_volume_says_so(scene_file, capsys):
    assert "ended: the ray misses the volume" in run(capsys, "trace", scene_file, "0", "0")[1]
    status, out, _ = run(capsys, "trace", scene_file, "0", "0", "--json")
    assert (status, json.loads(out)["segments"]) == (0, {})


@pytest.mark.parametrize("pixel", [("24", "0"), ("0", "16"), ("-1", "0")])
def test_a_pixel_outside_the_image_is_refused(pixel, scene_file, capsys):
    status, out, err = run(capsys, "trace", scene_file, *pixel)
    assert (status, out) == (2, "")
    assert err.startswith("volref: pixel ")
