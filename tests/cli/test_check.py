"""`volref accept` and `volref check`: an image and a scene in, a verdict and an exit status out."""

import json
import shlex
import sys

import numpy as np
import pytest
from PIL import Image

import volref as vr
from tests.emulation.scenes import HEIGHT, WIDTH, example
from volref.cli import main
from volref.io import write_png

DRAW = """\
import sys
import volref as vr
from volref.io import write_png
scene = vr.load_scene(sys.argv[1])
if len(sys.argv) > 3 and scene.width < 8:
    raise SystemExit("too small for me")
faulty = vr.pipelines()["texture3d"].with_switches("faulty", volume={"filter": "nearest"})
write_png(sys.argv[2], vr.emulate(scene, faulty).rgba8)
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with a scene, its intervals, an image that is right, and one that is not."""
    folder = tmp_path_factory.mktemp("check")
    scene = example()
    vr.save_scene(scene, folder / "scene.json")
    right = vr.emulate(scene, "texture3d").rgba8
    write_png(folder / "right.png", right)
    write_png(folder / "wrong.png", np.ascontiguousarray(right[::-1]))
    vr.save_acceptance(vr.accept(scene, "texture3d"), folder / "right.npz")
    (folder / "draw.py").write_text(DRAW, encoding="utf-8")
    return folder


@pytest.fixture
def run(folder, capsys, monkeypatch):
    monkeypatch.chdir(folder)

    def running(*words):
        status = main([str(word) for word in words])
        out, err = capsys.readouterr()
        return status, out, err

    return running


SCENE = ("scene.json", "--pipeline", "texture3d")


def test_accept_tells_how_tight_the_intervals_are_and_why(run, tmp_path):
    status, out, err = run("accept", *SCENE, "-o", tmp_path / "mine.npz")
    assert status == 0
    assert out.startswith("program    texture3d on ideal, 1 frame\n")
    assert f"image      {WIDTH} x {HEIGHT}, " in out
    assert err == f"volref: wrote {tmp_path / 'mine.npz'}\n"
    loaded = vr.load_acceptance(tmp_path / "mine.npz")
    assert all(f"\n  {cause} " in out for cause in loaded.causes)
    assert f"width      p50 {loaded.percentile(50):.3g}/255, p99 {loaded.percentile(99):.3g}/255\n" in out


def test_accept_has_its_figures_as_json(run):
    status, out, _ = run("accept", *SCENE, "--device", "llvmpipe", "--json")
    found = json.loads(out)
    acceptance = vr.accept(example(), "texture3d", "llvmpipe")
    assert (status, found["device"], found["advice"], found["output"]) == (0, "llvmpipe", "", None)
    assert found["widths"]["p99"] == acceptance.percentile(99) / 255
    assert set(found["causes"]) == set(acceptance.causes)


def test_the_exit_status_is_the_verdict_whether_the_scene_or_a_file_is_asked(run):
    for against in (SCENE, ("right.npz",)):
        status, out, err = run("check", "right.png", *against)
        assert (status, err) == (0, "")
        assert out.startswith("inside: all ")
        status, out, err = run("check", "wrong.png", *against)
        assert (status, err) == (1, "")
        assert out.startswith("outside: ")
        assert "The image seems to be upside down" in out


def test_json_has_the_verdict_and_nothing_else(run):
    status, out, _ = run("check", "wrong.png", "right.npz", "--json")
    found = json.loads(out)
    verdict = vr.check("wrong.png", vr.load_acceptance("right.npz"))
    assert status == 1
    assert found == json.loads(json.dumps(verdict.as_dict()))


def test_pictures_and_a_page_are_written_and_not_over_others(run, tmp_path):
    words = ("check", "wrong.png", "right.npz", "--images", tmp_path / "why", "--page", tmp_path / "why.html")
    status, _, err = run(*words)
    assert status == 1
    assert err == f"volref: wrote 4 pictures to {tmp_path / 'why'}\nvolref: wrote {tmp_path / 'why.html'}\n"
    names = sorted(path.stem for path in (tmp_path / "why").iterdir())
    assert names == ["candidate", "difference", "nominal", "overlay"]
    with Image.open(tmp_path / "why" / "nominal.png") as image, Image.open("right.png") as right:
        # Enlarged by a whole factor: every pixel is a square of its colour.
        factor = image.width // WIDTH
        assert image.size == (factor * WIDTH, factor * HEIGHT)
        np.testing.assert_array_equal(np.asarray(image)[::factor, ::factor], np.asarray(right)[..., :3])
    status, out, err = run(*words)
    assert (status, out) == (2, "")
    assert "must not exist yet" in err
    assert run(*words, "--force")[0] == 1


def test_alpha_encoding_and_mask_are_passed_on(run, tmp_path):
    canvas = np.asarray(Image.open("right.png")) / 255
    straight = np.where(canvas[..., 3:] > 0, canvas / np.where(canvas[..., 3:] > 0, canvas[..., 3:], 1), 0)
    straight[..., :3] = straight[..., :3] ** (1 / 2.2)
    straight[..., 3] = canvas[..., 3]
    image = np.rint(255 * straight).astype(np.uint8)
    image[:2, :3] = 255
    mask = np.zeros(image.shape[:2], np.uint8)
    mask[:2, :3] = 1
    write_png(tmp_path / "image.png", image)
    write_png(tmp_path / "mask.png", mask)
    words = ("check", tmp_path / "image.png", "right.npz", "--alpha", "straight", "--encoding", "gamma2.2")
    assert run(*words)[0] == 1
    status, out, _ = run(*words, "--mask", tmp_path / "mask.png")
    assert status == 0
    assert "6 pixels are left out by the mask" in out


def test_a_wrong_image_is_shrunk_to_the_smallest_scene_that_the_program_draws_wrong(run, tmp_path):
    words = ["check", tmp_path / "image.png", *SCENE, "--shrink", tmp_path / "small.json", "--trials", "6"]
    command = f"{shlex.quote(sys.executable)} draw.py {{scene}} {{out}}"
    run("emulate", *SCENE[:1], "--pipeline", "congote2012", "-q", "-o", tmp_path / "image.png")
    status, _, err = run(*words, "--command", command)
    assert status == 1
    small = vr.load_scene(tmp_path / "small.json")
    voxels = " x ".join(map(str, small.volume.size))
    knots = len(small.transfer.values)
    expected = f"{small.width} x {small.height} pixels, {voxels} voxels, {knots} knots"
    assert err.endswith(f"volref: wrote {tmp_path / 'small.json'}: {expected}\n")
    assert small.width * small.height < WIDTH * HEIGHT


def test_a_program_that_cannot_draw_the_scene_is_told_from_one_that_draws_it_wrong(run, tmp_path):
    words = ["check", "wrong.png", *SCENE, "--shrink", tmp_path / "small.json", "--trials", "3", "--command"]
    python = shlex.quote(sys.executable)
    status, _, err = run(*words, f"{python} -c 'raise SystemExit(\"no GPU\")' {{scene}} {{out}}")
    assert status == 2
    assert "--command must draw the scene, got exit status 1 and no image (no GPU)" in err
    assert "got No such file or directory for 'nothing'" in run(*words, "nothing {scene} {out}")[2]
    # Smaller scenes that it refuses are no failures of the kind looked for.
    assert run(*words, f"{python} draw.py {{scene}} {{out}} picky")[0] == 1
    assert vr.load_scene(tmp_path / "small.json").width >= 8


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("check", "right.png", "scene.json"), "--pipeline must be given with a scene, got none"),
        (("check", "right.png", "right.npz", "--device", "ideal"), "--device must be left out for intervals"),
        (("check", "right.png", "right.npz", "--size", "2x2"), "--size must be left out for intervals"),
        (("check", "no.png", "right.npz"), "no.png must be a file that exists"),
        (
            ("check", "right.png", "wrong.png"),
            "SCENE must be a scene (.json) or intervals (.npz), got wrong.png",
        ),
        (("check", "right.png", *SCENE, "--size", "32x24"), "candidate must be 32 x 24 pixels as the scene"),
        (("check", "right.png", "right.npz", "--alpha", "none"), "argument --alpha: invalid choice: 'none'"),
        (("check", "right.png", "right.npz", "--images", "right.png"), "right.png must be a folder"),
        (("check", "right.png", *SCENE, "--shrink", "a.json"), "--command must be given with the other one"),
        (("check", "right.png", *SCENE, "--command", "a"), "--shrink must be given with the other one"),
        (
            ("check", "right.png", *SCENE, "--shrink", "a.json", "--command", "draw {scene}"),
            "--command must hold {scene} and {out}",
        ),
        (
            ("check", "right.png", *SCENE, "--shrink", "a.txt", "--command", "draw"),
            "a.txt must end in .json",
        ),
        (
            ("check", "right.png", *SCENE, "--shrink", "a.json", "--command", "d", "--mask", "right.png"),
            "--mask must be left out with --shrink",
        ),
        (
            ("check", "right.png", "right.npz", "--shrink", "a.json", "--command", "{scene} {out}"),
            "--shrink must be left out for intervals from a file",
        ),
        (("accept", *SCENE, "-o", "a.png"), "a.png must end in .npz, got '.png'"),
        (("accept", *SCENE, "-o", "right.npz"), "right.npz must not exist yet"),
        (("accept", "scene.json"), "the following arguments are required: --pipeline"),
    ],
)
def test_what_cannot_be_done_is_refused_in_one_line(words, sentence, run):
    status, out, err = run(*words)
    assert (status, out) == (2, "")
    assert sentence in err
    assert err.count("\n") == 1
