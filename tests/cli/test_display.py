"""What `volref render` shows people: tone mapping of PNG, and several rays per pixel."""

import numpy as np
import pytest
from PIL import Image

import volref
from volref import load_scene
from volref.cli import main
from volref.image import encode_rgba8

MARCH = ("--step", "0.1", "--tolerance", "1")


def run(capsys, *words):
    status = main([str(word) for word in words])
    out, err = capsys.readouterr()
    return status, out, err


@pytest.mark.parametrize(
    ("words", "operator", "options", "encoding"),
    [
        (["--tone-map", "reinhard", "--exposure", "4"], "reinhard", {"exposure": 4.0}, "srgb"),
        (["--gamma", "2.2"], "linear", {"gamma": 2.2}, "none"),
        (
            ["--tone-map", "artistic:low=0.1,saturation=1/2", "--gamma", "2.2"],
            "artistic",
            {"low": 0.1, "saturation": 0.5, "gamma": 2.2},
            "none",
        ),
    ],
)
def test_a_png_is_mapped_and_the_exact_image_is_not(
    scene_file, tmp_path, capsys, words, operator, options, encoding
):
    targets = "-o", tmp_path / "a.png", "-o", tmp_path / "a.npy"
    status, _, _ = run(capsys, "render", scene_file, *targets, *MARCH, *words)
    exact = volref.render(load_scene(scene_file), method="march", step=0.1, tolerance=1).rgba
    assert status == 0
    np.testing.assert_array_equal(np.load(tmp_path / "a.npy"), exact)
    with Image.open(tmp_path / "a.png") as image:
        shown = encode_rgba8(volref.tone_map(exact, operator, **options), encoding)
        np.testing.assert_array_equal(np.asarray(image), shown)


def test_supersample_renders_that_many_rays_per_pixel(scene_file, tmp_path, capsys):
    status, _, err = run(capsys, "render", scene_file, "-o", tmp_path / "a.npy", "--supersample", "2")
    assert status == 0
    assert "(certified)" in err
    np.testing.assert_array_equal(
        np.load(tmp_path / "a.npy"), volref.supersample(load_scene(scene_file), 2).rgba
    )


@pytest.mark.parametrize(
    ("words", "fragment"),
    [
        (["--tone-map", "aces"], "operator must be 'linear' or"),
        (["--tone-map", "hable:whit=3"], "must be given what 'hable' has, got whit"),
        (["--tone-map", "hable:white"], "must be NAME or NAME:KEY=NUMBER"),
        (["--gamma", "0"], "gamma must be above 0"),
        (["--supersample", "0"], "factor must be a whole number from 1 to 64"),
        (["--supersample", "2", "--verify", "3"], "--verify must be given without --supersample"),
    ],
)
def test_bad_use_is_one_line_and_leaves_no_file(scene_file, tmp_path, capsys, words, fragment):
    try:
        status, out, err = run(capsys, "render", scene_file, "-o", tmp_path / "a.png", *words)
    except SystemExit as end:  # argparse ends by itself
        status, (out, err) = end.code, capsys.readouterr()
    assert (status, out) == (2, "")
    assert fragment in err
    assert not (tmp_path / "a.png").exists()
