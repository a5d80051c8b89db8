import contextlib
import dataclasses
import io
import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import volref as vr
from tests.report.pages import Page
from volref.errors import FormatError, SceneError
from volref.image import decode_rgba8, encode_rgba8
from volref.report.demo import DATA, FILES, REPEAT_PYTHON, demo_scene, run_demo
from volref.report.pictures import NEUTRAL
from volref.truth.meshes.surfaces import visible_surface

SIDE = 48

# A short step in mm, a sixth of the default.
FINE = 1 / 12

# Pixels (x, y) of the small image: on the bare surface above the volume, on the surface within it, in the
# volume beside the surface, and beside everything.
BARE, INSIDE, GLASS, OUTSIDE = (22, 12), (28, 33), (22, 41), (2, 2)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("demo") / "made" / "on the way"


@pytest.fixture(scope="module")
def found(folder):
    return run_demo(folder, width=SIDE, height=SIDE, threads=1)


@pytest.fixture(scope="module")
def rgba(found):
    return np.load(Path(found["page"]).with_name("demo.npy"))


@pytest.fixture(scope="module")
def scene():
    return demo_scene(SIDE, SIDE)


@pytest.fixture(scope="module")
def out(scene):
    return vr.render(scene, threads=2)


def at(array, pixel):
    return array[pixel[1], pixel[0]]


def nearest_hit(mesh, origin, direction):
    """Distance from `origin` to the nearest triangle (Moeller and Trumbore 1997), +inf for none."""
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    first, second, apart = b - a, c - a, origin - a
    p, q = np.cross(direction, second), np.cross(apart, first)
    determinant = (p * first).sum(axis=1)
    u, v = (p * apart).sum(axis=1) / determinant, (q @ direction) / determinant
    t = (q * second).sum(axis=1) / determinant
    return np.where((u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0), t, np.inf).min()


def test_a_run_writes_every_file_and_says_where(folder, found):
    assert sorted(path.name for path in folder.iterdir()) == sorted(FILES)
    assert found["files"] == [str(folder / name) for name in FILES]
    assert found["page"] == str(folder / "demo.html")
    json.dumps(found, allow_nan=False)


def test_a_second_run_refuses_to_write_over_the_first(folder, rgba):
    before = (folder / "demo.npy").read_bytes()
    with pytest.raises(FormatError, match=r"demo.png must not exist yet.*overwrite=True"):
        run_demo(folder, width=8, height=8)
    assert (folder / "demo.npy").read_bytes() == before
    assert rgba.shape == (SIDE, SIDE, 4)


def test_a_file_in_the_way_is_found_before_anything_is_rendered_or_written(tmp_path):
    told = []
    (tmp_path / "error.png").write_text("mine")
    with pytest.raises(FormatError, match=r"error.png must not exist yet"):
        run_demo(tmp_path, width=8, height=8, progress=lambda done, _: told.append(done))
    assert told == []
    assert [path.name for path in tmp_path.iterdir()] == ["error.png"]


def test_told_to_it_does(tmp_path):
    (tmp_path / "demo.png").write_text("old")
    run_demo(tmp_path, width=8, height=8, threads=1, overwrite=True)
    with Image.open(tmp_path / "demo.png") as image:
        assert image.size == (8, 8)


def test_a_folder_that_is_a_file_is_refused_in_one_sentence(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(
        FormatError, match=r"file must be a folder that can be written to, got .*; name another"
    ):
        run_demo(tmp_path / "file", width=8, height=8, threads=1)


def test_a_size_that_is_none_is_refused_before_anything_is_written(tmp_path):
    with pytest.raises(SceneError, match=r"scene\.width must be a whole number"):
        run_demo(tmp_path / "new", width=0, height=8)
    assert not (tmp_path / "new").exists()


def test_progress_is_told(tmp_path):
    told = []
    run_demo(tmp_path, width=8, height=8, threads=1, progress=lambda done, total: told.append((done, total)))
    assert told == [(1, 1)]


def test_the_array_is_the_working_space_image(rgba):
    assert rgba.shape == (SIDE, SIDE, 4)
    assert rgba.dtype == np.float64
    # Premultiplied over an opaque background: alpha 1 but for the rounding of each segment, a few thousand.
    np.testing.assert_allclose(rgba[..., 3], 1.0, rtol=0, atol=4000 * np.finfo(np.float64).eps)


def test_the_png_is_the_array_in_srgb(folder, rgba):
    with Image.open(folder / "demo.png") as image:
        codes = np.asarray(image)
    np.testing.assert_array_equal(codes, encode_rgba8(rgba))
    # Half a level, and an sRGB curve no steeper than 1/0.44 towards linear light at its bright end.
    np.testing.assert_allclose(decode_rgba8(codes), rgba, rtol=0, atol=0.5 / 255 / 0.43)


def test_the_figures_are_those_of_the_image(out, found, rgba):
    np.testing.assert_array_equal(out.rgba, rgba)
    assert found["error_max"] == out.bound.max()
    assert found["met_tolerance"] == out.met_tolerance
    assert found["samples"] == out.samples
    assert found["threads"] == 1
    assert 0 < found["seconds"] < found["seconds_in_all"]


def test_the_error_of_the_demo_is_certified_below_half_a_level(found):
    assert (found["error_kind"], found["method"]) == ("certified", "exact")
    assert found["met_tolerance"]
    assert found["error_max"] <= 0.5 / 255


@pytest.mark.parametrize("pixel", [BARE, INSIDE, GLASS, OUTSIDE, (12, 30), (36, 20), (40, 26), (7, 20)])
def test_a_pixel_of_the_image_is_the_sum_along_its_ray(scene, out, rgba, pixel):
    fine, coarse = (np.array(vr.trace(scene, pixel, step=step).head["rgba"]) for step in (FINE, 3 * FINE))
    # The certificate; the sum's own error, an eighth of what a third of the step changes; and a rounding for
    # each of at most a few thousand segments.
    atol = at(out.bound, pixel) + np.abs(fine - coarse).max() + 4000 * np.finfo(np.float64).eps
    np.testing.assert_allclose(at(rgba, pixel), fine, rtol=0, atol=atol)


@pytest.mark.parametrize("pixel", [BARE, INSIDE, GLASS, OUTSIDE])
def test_the_surface_is_where_the_ray_first_meets_a_triangle(scene, pixel):
    traced = vr.trace(scene, pixel)
    mesh = scene.meshes[0]
    expected = nearest_hit(mesh, np.array(traced.head["origin"]), np.array(traced.head["direction"]))
    found = at(visible_surface(scene).distance, pixel)
    # Both divide rounded products of numbers up to 400 mm: 1e-9 mm leaves them 1000 eps of room.
    assert found == expected or found == pytest.approx(expected, abs=1e-9)
    assert np.isfinite(found) == (pixel in (BARE, INSIDE))


def test_the_surface_is_bare_above_the_volume_and_veiled_within(scene, rgba):
    bare, inside = (vr.trace(scene, pixel) for pixel in (BARE, INSIDE))
    np.testing.assert_array_equal(at(rgba, BARE)[:3], bare.head["surface"]["color"])
    top = scene.volume.origin[2] + scene.volume.size[2] - 0.5
    surface = np.array(bare.head["origin"]) + bare.head["surface"]["distance"] * np.array(
        bare.head["direction"]
    )
    assert surface[2] > top
    reached = inside.table["transmittance"][-1] - inside.table["weight"][-1]
    assert 0.05 < reached < 0.95
    assert inside.head["ended"] == "the ray meets an opaque surface"


def test_the_surface_shows_through_the_volume(scene, rgba):
    without = vr.render(dataclasses.replace(scene, meshes=()), threads=1)
    seen = np.abs(without.rgba - rgba).max(axis=-1) > 10 / 255
    veiled = seen & (np.abs(without.rgba[..., :3] - scene.background[:3]).max(axis=-1) > 10 / 255)
    assert veiled.mean() > 0.15  # of the image's pixels: the part of the surface that lies in the volume


def test_beside_the_head_is_the_background(scene, rgba):
    assert at(rgba, OUTSIDE).tolist() == list(scene.background)


def test_the_maps_show_a_surface_only_where_there_is_one(found, scene):
    with Image.open(Path(found["page"]).with_name("depth.png")) as image:
        depth = np.asarray(image)[:SIDE]
    neutral = (depth == NEUTRAL).all(axis=-1)
    np.testing.assert_array_equal(neutral, np.isinf(visible_surface(scene).distance))


def test_the_page_shows_the_error_the_time_and_the_notice(folder, found):
    page = Page((folder / "demo.html").read_text(encoding="utf-8"))
    assert page.texts("strong") == [found["message"]]
    assert f"{found['seconds']:.2f} s" in found["message"]
    assert "Copyright (C) 1993-2009 Louis Collins" in " ".join(page.texts("pre"))
    assert page.texts("code")[0] == f"volref demo --size {SIDE}x{SIDE}"


def test_the_python_on_the_page_makes_the_picture(found, rgba):
    page = Page(Path(found["page"]).read_text(encoding="utf-8"))
    code = page.texts("code")[-1]
    assert code == REPEAT_PYTHON.format(width=SIDE, height=SIDE, x=SIDE // 2, y=SIDE // 2)
    made = {}
    with contextlib.redirect_stdout(io.StringIO()) as printed:
        exec(code, made)
    np.testing.assert_array_equal(made["out"].rgba, rgba)
    assert printed.getvalue().startswith("(48, 48, 4)")


def test_the_data_are_small_and_have_their_notice():
    files = {path.name: path for path in DATA.iterdir()}
    assert set(files) == {"head.npz", "white_matter.ply", "scene.json", "NOTICE.txt"}
    assert sum(path.stat().st_size for path in files.values()) <= 3_000_000
    notice = " ".join(files["NOTICE.txt"].read_text(encoding="utf-8").split())
    assert "Permission to use, copy, modify, and distribute this software and its documentation" in notice
    assert (
        "injury to subjects or patients resulting from the use or misuse of this software package." in notice
    )
    assert "Colours baked" in notice
