"""Mip levels by differences over quads, held to numbers counted by hand."""

import numpy as np
import pytest

import volref as vr
from volref.emulation.catalogue import named
from volref.emulation.device import Device
from volref.emulation.drawing import prepare
from volref.emulation.loop.marching import Program, march
from volref.emulation.rays.box import box_of
from volref.emulation.rays.entering import faces
from volref.emulation.rays.paths import paths_of
from volref.emulation.rays.quads import beyond, lanes_of, rays_in_quads
from volref.emulation.textures.mipmaps import classified_in_quads, level_of_detail, levels_of
from volref.stages.textures import Texture
from volref.workspace import Workspace

MIPS = {"filter": "linear-mipmap"}


def scene_of(values):
    volume = vr.Volume(values, spacing=tuple(1 / n for n in values.shape[::-1]))
    camera = vr.Camera.look_at((2.2, 1.6, 1.9), (0.4, 0.4, 0.4), (0, 0, 1), 30, 0.1, 9)
    look = vr.TransferFunction.from_opacity([0, 128, 255], [(0, 0, 1), (1, 1, 0), (1, 0, 0)], [0.5] * 3)
    return vr.Scene(volume, look, camera, 21, 15)


def row(*numbers):
    return Texture(np.array(numbers, dtype=np.float64)[None, :, None])


def test_levels_of_bytes_are_rounded_each_time():
    # (1 + 2) / 2 = 1.5 is 2; (2 + 4) / 2 = 3 of the rounded ones, where of the others it is 2.75.
    levels = levels_of(row(*(np.array([1, 2, 3, 5]) / 255)), narrow=True)
    assert [np.rint(level.texels[0, :, 0] * 255).tolist() for level in levels] == [[1, 2, 3, 5], [2, 4], [3]]
    floats = levels_of(row(1, 2, 3, 5), narrow=False)
    assert [level.texels[0, :, 0].tolist() for level in floats] == [[1, 2, 3, 5], [1.5, 4], [2.75]]


def test_a_quad_has_one_level_by_the_larger_of_two_differences_from_its_lower_left_lane():
    # 8 texels 0..7, halved to 0.5, 2.5, 4.5 and 6.5.  Lanes 0 to 3 lie at texels 2, 3, 4.4 and 7 (centres):
    # the difference of lane 2, 2.4, is the larger one; lane 3 does not count.
    levels = levels_of(row(*range(8)), narrow=False)
    texel = np.array([2.0, 3.0, 4.4, 7.0])
    found = classified_in_quads(levels, (texel + 0.5) / 8, Device(), Workspace())[0]
    level = np.log2(2.4) - 1
    # Halving leaves a ramp where it is, but for its ends, which are held.
    once, twice = np.clip(texel, 0.5, 6.5), np.clip(texel, 1.5, 5.5)
    np.testing.assert_allclose(found, once + level * (twice - once), atol=1e-12)


@pytest.mark.parametrize(("rho", "bits"), [(1.0, 0.0), (2.0, 1.0), (8.0, 3.0), (1.5, 0.5664)])
def test_swiftshaders_level_is_a_line_between_powers_of_two_to_the_quarter(rho, bits):
    # 1.5^4 = 5.0625 = 4 (1 + 0.265625): (2 + 0.265625) / 4 = 0.5664, where log2 1.5 is 0.5850.
    found = level_of_detail(np.array([rho]), Device.named("swiftshader"))[0]
    assert found == pytest.approx(bits, abs=5e-5)
    assert level_of_detail(np.array([rho]), Device())[0] == pytest.approx(np.log2(rho), abs=1e-12)


def test_quads_hold_every_fragment_once_and_helpers_on_the_plane_of_its_triangle():
    scene = scene_of(np.zeros((4, 4, 4), np.uint8))
    box = box_of(scene)
    fragments = faces(scene, box, Device(), "back")
    lanes = lanes_of(fragments, scene, box)
    assert sorted(lanes.pixel[lanes.drawn]) == sorted(fragments.pixel)
    assert len(lanes.pixel) % 4 == 0
    assert not lanes.drawn.all()
    # One coordinate is that of a face, for helpers too, which lie beyond the edges.
    flat = (lanes.varyings == 0) | (np.abs(lanes.varyings - 1) < 1e-12)
    assert flat.any(axis=0).all()
    helpers = lanes.varyings[:, ~lanes.drawn]
    assert ((helpers < -1e-9) | (helpers > 1 + 1e-9)).any()
    # Lines of sight meet the planes where the rasteriser says so.
    x, y = fragments.pixel % scene.width, scene.height - 1 - fragments.pixel // scene.width
    np.testing.assert_allclose(beyond(box, fragments.triangle, x, y, scene), fragments.varyings, atol=1e-9)


def test_where_the_value_is_the_same_everywhere_mip_levels_change_nothing():
    scene = scene_of(np.full((4, 4, 4), 77, np.uint8))
    plain, mipped = (vr.emulate(scene, named("barbagallo").with_switches(table=t)) for t in ({}, MIPS))
    np.testing.assert_array_equal(plain.rgba, mipped.rgba)
    np.testing.assert_array_equal(plain.samples, mipped.samples)


def test_where_it_is_rough_they_do_and_the_number_of_samples_stays():
    scene = scene_of(np.random.default_rng(0).integers(0, 256, (6, 6, 6), np.uint8))
    plain, mipped = (vr.emulate(scene, named("barbagallo").with_switches(table=t)) for t in ({}, MIPS))
    assert np.abs(plain.rgba - mipped.rgba).max() > 0.02
    np.testing.assert_array_equal(plain.samples, mipped.samples)
    np.testing.assert_array_equal(plain.rgba[..., 3], mipped.rgba[..., 3])  # the value is not looked up


def test_other_rays_than_those_of_front_faces_are_refused():
    with pytest.raises(vr.SceneError, match="linear-mipmap"):
        vr.emulate(scene_of(np.zeros((4, 4, 4), np.uint8)), named("texture3d").with_switches(table=MIPS))


def test_a_single_ray_is_refused():
    scene = scene_of(np.zeros((4, 4, 4), np.uint8))
    drawing = prepare(scene, named("barbagallo").with_switches(table=MIPS), Device())
    with pytest.raises(vr.SceneError, match="single rays"):
        march(drawing.program(np.zeros(scene.width * scene.height)), rays=np.array([0]))


def test_lanes_that_have_left_the_loop_stay_at_their_last_sample():
    scene, device = scene_of(np.full((4, 4, 4), 9, np.uint8)), Device()
    drawing = prepare(scene, named("barbagallo").with_switches(table=MIPS, stepping={"steps": 16}), device)
    ends, _ = rays_in_quads(scene, drawing.pipeline, drawing.box, device, drawing.targets)
    paths = paths_of(ends, scene, drawing.pipeline, drawing.box, device)
    places = []
    loop = Program(drawing.textures, drawing.rule, paths, np.zeros(len(ends.pixel), np.float32))
    marched = march(loop, lambda sample: places.append(sample.position.copy()))
    last = marched.samples - 1
    assert last.min() < len(places) - 1
    at_last = np.array(places)[last, :, np.arange(len(last))]
    np.testing.assert_array_equal(places[-1].T, at_last)
