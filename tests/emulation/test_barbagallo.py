"""Seed 002 held to a scalar program and closed forms; what each decision costs, by number."""

import dataclasses
from itertools import pairwise

import numpy as np
import pytest

from tests.oracles import barbagallo as oracle
from tests.webgl.scenes import EXAMPLES
from volref import Camera, Scene, TransferFunction, Volume, emulate, render
from volref.emulation.ambiguity import ambiguous
from volref.emulation.catalogue import named
from volref.emulation.device import Device
from volref.emulation.drawing import prepare
from volref.emulation.frames import drawn
from volref.emulation.limit import limit_scene, refined, widened
from volref.emulation.loop.marching import march
from volref.emulation.rays.paths import Ends, paths_of
from volref.emulation.textures.uploads import uploads_of

NAMES = ("barbagallo", "barbagallo-article")
COLORS = [(0.1, 0.2, 0.9), (0.1, 0.9, 1.0), (0.9, 0.7, 0.2), (1.0, 0.3, 0.1)]


def field(size=(9, 8, 7)):
    """Bytes without any symmetry, up to the faces."""
    values = np.random.default_rng(4).integers(0, 256, size[::-1], np.uint8)
    return Volume(values, spacing=tuple(1 / n for n in size))


def seen(volume, width=9, height=7, *, colors=COLORS, fov_y=30.0, **look):
    """From an oblique direction; `near` and `far` may be given."""
    middle = volume.corners.mean(axis=0)
    planes = {"near": 0.1, "far": 9.0} | look
    camera = Camera.look_at(middle + np.array([1.9, 1.1, 1.4]), middle, (0, 0, 1), fov_y, **planes)
    transfer = TransferFunction.from_opacity(np.linspace(0, 255, len(colors)), colors, [0.5] * len(colors))
    return Scene(volume, transfer, camera, width, height)


def block(value, size=(4, 4, 4)):
    """The same byte in every voxel of a unit cube."""
    return Volume(np.full(size[::-1], value, np.uint8), spacing=tuple(1 / n for n in size))


def along_z(volume, colors=((1, 1, 1), (1, 1, 1))):
    """Two by two parallel rays of length 1 within the volume."""
    middle = volume.corners.mean(axis=0)
    camera = Camera.orthographic(middle + np.array([0, 0, 2]), middle, (0, 1, 0), 0.5, 0.5, 4.0)
    transfer = TransferFunction.from_opacity([0, 255], colors, [0.5, 0.5])
    return Scene(volume, transfer, camera, 2, 2)


def exact(name, **groups):
    return named(name).with_switches(output={"format": "exact"}, **groups)


def pixel(name, scene, **groups):
    """What the shader writes at the first pixel, whose iterations are the second thing returned."""
    out = emulate(scene, exact(name, **groups))
    return out.rgba[0, 0], int(out.samples[0, 0])


@pytest.mark.parametrize("name", NAMES)
def test_pixels_are_those_of_the_scalar_program(name):
    scene, pipeline = seen(field()), exact(name)
    out, uploads = emulate(scene, pipeline), uploads_of(scene, pipeline)
    ends = prepare(scene, pipeline, Device()).ends
    program = {
        "png": uploads.volume[::-1, :, 0],
        "table": uploads.table[0],
        "tiles": uploads.tiles,
        "slices": uploads.size[2],
        "steps": 256,
        "cap": {"barbagallo": 887, "barbagallo-article": 512}[name],
        "scale": {"barbagallo": 25.6 / 256, "barbagallo-article": 1.0}[name],
        "adds_alpha": name == "barbagallo-article",
    }
    assert len(ends.pixel) > 20
    for entry, exit_, place in zip(ends.entry.T, ends.exit.T, ends.pixel, strict=True):
        y, x = divmod(int(place), scene.width)
        written, _, count = oracle.walk(list(entry), list(exit_), program)
        assert out.samples[y, x] == count
        # 1e-12: some hundred sums in float64, in another order within a sample.
        np.testing.assert_allclose(out.rgba[y, x], written, rtol=0, atol=1e-12)


def test_the_png_begins_at_its_top_left_and_y_runs_upwards_in_a_tile():
    values = np.arange(6 * 2 * 3, dtype=np.uint8).reshape(6, 2, 3)  # 6 slices, 2 rows, 3 columns
    scene = seen(Volume(values), colors=COLORS[:2])
    pipeline = dataclasses.replace(named("barbagallo"), domain=(0.0, 255.0))
    png = uploads_of(scene, pipeline).volume[::-1, :, 0]
    assert png.tolist() == [
        [3, 4, 5, 9, 10, 11, 15, 16, 17],  # y = 1 of slices 0, 1 and 2
        [0, 1, 2, 6, 7, 8, 12, 13, 14],
        [21, 22, 23, 27, 28, 29, 33, 34, 35],
        [18, 19, 20, 24, 25, 26, 30, 31, 32],
    ]


def test_added_alpha_goes_beyond_1_and_ends_the_ray_with_a_sixth_of_its_light_missing():
    value = 153 / 255
    scene = along_z(block(153))
    written, count = pixel("barbagallo-article", scene)
    light = value + (1 - value) * value  # of the second sample (1 - 0.6) is left; then A = 1.2 ends the ray
    assert count == 2
    np.testing.assert_allclose(written, [light] * 3 + [light * value], atol=1e-12)
    assert light == pytest.approx(0.84)
    written, _ = pixel("barbagallo-article", scene, accumulation={"rule": "over"})
    np.testing.assert_allclose(written[:3], 1.0, atol=1e-6)  # over goes on: 0.4^n is left out


@pytest.mark.parametrize(("rule", "limit"), [("over", 1 - np.exp(-4.0)), ("add-alpha", 0.5)])
def test_with_finer_steps_added_alpha_shows_half_the_light_of_what_is_opaque(rule, limit):
    # dC = (1 - t) dt up to t = 1, where A ends the ray: 1/2.  Over tends to 1 - e^-t; here t = 4.
    scene = along_z(block(204))
    errors = []
    for steps in (32, 64, 128):
        stepping = {"steps": steps, "cap": None}
        opacity = {"rule": "per-step", "factor": 5.0}
        written, _ = pixel(
            "barbagallo-article", scene, stepping=stepping, opacity=opacity, accumulation={"rule": rule}
        )
        errors.append(abs(written[0] - limit))
    assert errors[-1] < 0.04
    # Steps of half the length halve the error, or better.
    assert all(later < 0.6 * earlier for earlier, later in pairwise(errors))


def test_voxels_of_full_opacity_are_black_and_those_below_are_half_dark():
    lit = {}
    for value in (253, 254, 255):
        written, _ = pixel("barbagallo", along_z(block(value), ((1, 1, 1), (1, 1, 1))))
        lit[value] = written[0] / (written[3] / (value / 255))
    # u = value / 255 lies at texel u 256 - 1/2 of 256, the last of which was never filled.
    assert lit[253] == pytest.approx(1.0, abs=1e-12)
    assert lit[254] == pytest.approx(1 - (254 / 255 * 256 - 0.5 - 254), abs=1e-12)
    assert lit[255] == 0.0
    assert lit[254] == pytest.approx(0.5039, abs=1e-4)


def test_a_filled_column_lights_them():
    written, _ = pixel("barbagallo", along_z(block(255)), table={"last_column": "filled"})
    assert written[0] == pytest.approx(written[3], abs=1e-12)
    assert written[0] > 0.99


def test_the_alpha_that_is_written_is_the_value_times_the_alpha_that_was_accumulated():
    written, _ = pixel("barbagallo", along_z(block(128)))
    accumulated, _ = pixel("barbagallo", along_z(block(128)), accumulation={"alpha": "accumulated"})
    assert accumulated[3] > 0.999
    assert written[3] == pytest.approx(128 / 255 * accumulated[3], abs=1e-12)


def test_the_opacity_of_the_transfer_function_does_not_matter():
    scene = seen(field())
    look = TransferFunction.from_opacity(np.linspace(0, 255, 4), COLORS, [0.0, 0.1, 0.2, 0.9])
    other = dataclasses.replace(scene, transfer=look)
    np.testing.assert_array_equal(emulate(scene, "barbagallo").rgba, emulate(other, "barbagallo").rgba)


@pytest.mark.parametrize(("name", "most"), [("barbagallo", 887), ("barbagallo-article", 512)])
def test_at_512_steps_the_cap_of_the_article_cuts_rays_longer_than_1(name, most):
    scene = seen(block(1), 33, 27)
    faint = exact(name, stepping={"steps": 512}, opacity={"factor": 1e-6})
    samples = emulate(scene, faint).samples
    longest = prepare(scene, faint, Device()).paths.length.max()
    assert longest > 1.05
    assert samples.max() == min(most, int(np.ceil(longest * 512)))


@pytest.mark.parametrize(("name", "nan_stored", "held"), [(NAMES[0], "zero", 0), (NAMES[1], "one", 1)])
def test_a_ray_without_a_direction_runs_to_the_cap_as_nan(name, nan_stored, held):
    scene, device = along_z(block(99)), Device(nan_stored=nan_stored)
    drawing = prepare(scene, named(name), device)
    at = drawing.ends.entry
    still = Ends(drawing.ends.pixel, at, at)
    paths = paths_of(still, scene, drawing.pipeline, drawing.box, device)
    drawing = dataclasses.replace(drawing, ends=still, paths=paths)
    marched = march(drawing.program(np.zeros(4)))
    assert (marched.samples == drawing.pipeline.stepping.cap).all()
    assert np.isnan(marched.color).all()
    assert np.isnan(marched.alpha).all()
    assert (drawn(drawing, marched) == held).all()


def test_from_inside_the_box_nothing_is_drawn():
    volume = block(200)
    middle = volume.corners.mean(axis=0)
    camera = Camera.look_at(middle, middle + np.array([1, 0, 0]), (0, 0, 1), 60, 0.01, 9)
    scene = dataclasses.replace(seen(volume), camera=camera)
    for name in NAMES:
        out = emulate(scene, name)
        assert not out.samples.any()
        assert not out.rgba.any()


def test_where_the_far_plane_cuts_off_the_back_the_page_draws_nothing_and_the_article_walks_to_a_corner():
    # The middle of the box is 2.6 away: some rays enter in front of the far plane and leave behind it.
    scene = dataclasses.replace(seen(block(128), 33, 27, far=2.6), background=(0.2, 0.4, 0.6, 1.0))
    page, article = (emulate(scene, name) for name in NAMES)
    cut = (page.passes["back_coordinates"] == 0).all(axis=-1)
    cut &= (page.passes["front_coordinates"] != 0).any(axis=-1)
    assert cut.sum() > 100
    assert not page.samples[cut].any()
    assert not page.rgba[cut].any()
    assert article.samples[cut].all()
    np.testing.assert_array_equal(prepare(scene, named(NAMES[0]), Device()).ends.blank, np.flatnonzero(cut))


def test_a_linear_filter_reads_exits_beside_the_centre_of_the_pixel():
    # A vertex that is snapped takes its varyings along, but not the clip position that they say it has.
    scene = seen(block(128), 33, 27)
    article = named("barbagallo-article")
    nearest = article.with_switches(rays={"filter": "nearest"})
    moved = {}
    for device in ("ideal", "swiftshader"):
        one, two = (prepare(scene, p, Device.named(device)).ends.exit for p in (article, nearest))
        moved[device] = np.abs(one - two).max()
    # 3e-7: some units in the last place of a position, which weights of a linear filter inherit.
    assert moved["ideal"] < 3e-7 * scene.width
    assert moved["swiftshader"] > 1e-4


def test_the_page_tends_to_the_truth_of_what_it_uploads():
    volume = smooth()
    scene = seen(volume, 4, 3)
    pipeline = widened(named("barbagallo")).with_switches(table={"size": 8}, stepping={"steps": 32})
    truth = render(limit_scene(scene, pipeline)).rgba
    assert truth[..., 3].max() > 0.8
    errors = []
    for times in (2, 4, 8):
        finer = refined(scene, pipeline, times).with_switches(accumulation={"alpha": "accumulated"})
        errors.append(np.abs(emulate(scene, finer, "exact").rgba - truth).max())
    # The first order: a (1 - a / 2) for 1 - e^-a.
    assert errors[-1] < 5e-3
    assert all(0.4 < later / earlier < 0.6 for earlier, later in pairwise(errors))


def smooth(side=10):
    """A ball that ends before the faces."""
    z, y, x = np.mgrid[:side, :side, :side] / (side - 1) - 0.5
    ball = np.clip(1.4 - 4 * np.sqrt(x * x + 1.3 * y * y + z * z), 0, 1)
    ball *= 0.8 + 0.2 * np.sin(9 * x + 5 * z)
    return Volume(np.rint(250 * ball).astype(np.uint8), spacing=(1 / side,) * 3)


def test_the_table_is_the_first_row_of_a_canvas_whose_gradient_runs_to_the_far_corner():
    # Pixel (x, y) has its centre at (x + 1/2, y + 1/2), projected on the line from (0, 0) to (255, 19).
    scene = seen(block(1), colors=[(0, 0, 0), (1, 1, 1)])
    table = exact("barbagallo", table={"format": "exact"})
    row = uploads_of(scene, table).table[0]
    along = np.array([255.0, 19.0]) / (255.0**2 + 19.0**2)
    for x in (0, 100, 254):
        assert row[x, 0] == pytest.approx(np.dot((x + 0.5, 0.5), along), abs=1e-12)
    assert not row[255].any()


def test_whether_a_ray_has_a_direction_hangs_on_rounding():
    # Parallel rays along an edge of the box: at one pixel entry and exit are the same.
    scene = EXAMPLES["parallel"].make()
    pipeline, device = exact("barbagallo", stepping={"steps": 4, "cap": 8}), Device.named("swiftshader")
    without = np.isnan(emulate(scene, pipeline, device).rgba).any(axis=-1)
    assert without.any()
    assert ambiguous(scene, pipeline, device)[without].all()
