"""`volref render --frames`: the mean of marches with start offsets."""

import numpy as np
import pytest

from volref import load_scene, render_jittered
from volref.cli import main
from volref.io import write_png

STEP = ("--step", "0.2", "--tolerance", "1")


def run(capsys, scene_file, *words):
    status = main(["render", scene_file, *map(str, words)])
    out, err = capsys.readouterr()
    return status, out, err


def test_frames_have_random_starts_by_their_seed(scene_file, tmp_path, capsys):
    status, _, err = run(capsys, scene_file, "-o", tmp_path / "a.npy", "--frames", "3", "--seed", "7", *STEP)
    expected = render_jittered(load_scene(scene_file), 3, seed=7, step=0.2, tolerance=1.0)
    assert status == 0
    assert "(estimated)" in err
    np.testing.assert_array_equal(np.load(tmp_path / "a.npy"), expected.rgba)


def test_or_from_a_noise_texture(scene_file, tmp_path, capsys):
    codes = np.array([[10, 200], [90, 120]], np.uint8)
    write_png(tmp_path / "noise.png", codes)
    status, _, _ = run(
        capsys, scene_file, "-o", tmp_path / "a.npy", "--jitter", tmp_path / "noise.png", *STEP
    )
    expected = render_jittered(load_scene(scene_file), jitter=codes / 255, step=0.2, tolerance=1.0)
    assert status == 0
    np.testing.assert_array_equal(np.load(tmp_path / "a.npy"), expected.rgba)


@pytest.mark.parametrize(
    ("words", "fragment"),
    [
        (["--seed", "3"], "--seed must be given with --frames"),
        (["--frames", "0"], "frames must be a whole number from 1"),
        (["--frames", "2", "--supersample", "2"], "must be given without --supersample"),
        (["--frames", "2", "--verify", "2"], "must be given without --verify"),
        (["--frames", "2", "--max-seconds", "2"], "must be given without --max-seconds"),
        (["--frames", "2", "--method", "exact"], "must be given without --method exact"),
        (["--frames", "2", "--series", "scans"], "must be given without --series"),
        (["--jitter", "noise.png"], "noise.png must be a file that exists"),
        (["--jitter", "noise.png", "--seed", "1"], "must be given without --seed beside --jitter"),
    ],
)
def test_bad_use_is_one_line(scene_file, tmp_path, capsys, words, fragment):
    status, out, err = run(capsys, scene_file, "-o", tmp_path / "a.png", *words)
    assert (status, out) == (2, "")
    assert fragment in err
    assert err.count("\n") == 1
