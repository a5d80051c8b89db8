"""Seed 004: its gradients, lights and mean of frames held to scalar loops, and its defects by number."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

import volref as vr
from tests.oracles.cej import Pixels, gradient_bytes
from volref.emulation.catalogue import named
from volref.emulation.groups import Lighting, Output
from volref.emulation.loop.noise import hash_jitter
from volref.emulation.loop.opacity import factor_of
from volref.emulation.rays.box import box_of
from volref.emulation.targets.canvas import mean_of_frames
from volref.emulation.textures.gradient_volume import gradient_weights, unpacked, with_gradient
from volref.emulation.textures.uploads import uploads_of

EYE, TARGET, UP, FOV = (20.0, 14.0, 24.0), (3.5, 4.0, 6.0), (0.0, 1.0, 0.0), 30.0
WORKING, PRINTED = named("cej2020"), named("cej2020-printed")
FLOATING = {"format": "float", "mean_format": "float"}


def volume(seed=0, size=(8, 7, 9), spacing=(1.0, 1.3, 1.6)):
    smooth = np.random.default_rng(seed).random(size[::-1])
    return vr.Volume((255 * smooth**2).astype(np.uint8), spacing=spacing)


def scene(lights=(), material=None, *, field=None, width=9, height=7, background=(0.2, 0.3, 0.1, 1.0)):
    transfer = vr.TransferFunction.from_opacity(
        [0, 90, 255], [(0.1, 0.2, 0.9), (0.9, 0.7, 0.2), (1.0, 0.3, 0.1)], [0.0, 0.2, 0.7], 4.0
    )
    camera = vr.Camera.look_at(EYE, TARGET, UP, FOV, 8.0, 60.0)
    return vr.Scene(
        volume() if field is None else field,
        transfer,
        camera,
        width,
        height,
        lights=lights,
        material=material,
        background=background,
    )


LIGHTS = (
    vr.Light.ambient((0.1, 0.2, 0.3)),
    vr.Light.directional((-1.0, -0.5, 0.3), (0.9, 0.8, 0.7)),
    vr.Light.point((10.0, 12.0, 5.0), (1.5, 0.5, 0.5), (2.0, 0.0, 0.01)),
)
MATERIALS = [
    vr.Material("lambert", ambient=0.2, diffuse=0.7),
    vr.Material("phong", ambient=0.2, diffuse=0.5, specular=0.6, shininess=3.0),
    vr.Material("blinn-phong", ambient=0.1, diffuse=0.5, specular=0.6, shininess=2.0, two_sided=True),
]


# Gradients


@pytest.mark.parametrize("zero", ["half", "exact"])
@pytest.mark.parametrize("kernel", ["sobel-bytes", "sobel-bytes-printed"])
@pytest.mark.parametrize("most", [1, 255])
def test_the_gradient_volume_is_the_scalar_loop(zero, kernel, most):
    codes = np.random.default_rng(most).integers(0, most, (5, 4, 6), np.uint8, endpoint=True)
    found = with_gradient(codes[..., None], Lighting(gradient=kernel, zero=zero), "unorm8")
    assert_array_equal(found[..., 0], codes)
    printed, half = kernel.endswith("printed"), zero == "half"
    for z, y, x in np.ndindex(codes.shape):
        assert found[z, y, x, 1:].tolist() == gradient_bytes(codes, x, y, z, printed=printed, half=half)


@given(st.integers(0, 255))
def test_the_misprint_gives_a_constant_field_f_a_gradient_of_minus_f_over_27_along_z(code):
    field = np.full((3, 3, 3, 1), code / 255)
    for kernel, expected in (("sobel-bytes", 0.0), ("sobel-bytes-printed", -code / 255 / 27)):
        found = with_gradient(field, Lighting(gradient=kernel, zero="exact"), "exact")[1, 1, 1, 1:]
        gradient, _ = unpacked(found[:, None], Lighting(zero="exact"))
        # 128 and 127 of the encoding cancel to a few ulp.
        assert_allclose(gradient.ravel(), [0.0, 0.0, expected], rtol=0, atol=1e-15)


def test_the_misprint_turns_the_normal_of_a_bright_constant_region_away_from_z():
    """Byte 123 for 128: the normal of a region that has none is not even (1, 1, 1) / sqrt 3."""
    white = np.full((3, 3, 3, 1), 255, np.uint8)
    found = with_gradient(white, PRINTED.lighting, "unorm8")[1, 1, 1]
    assert found.tolist() == [255, 128, 128, 123]
    gradient, _ = unpacked(found[1:, None] / 255, PRINTED.lighting)
    assert_allclose(gradient.ravel() * 255, [1, 1, -9], rtol=1e-12)  # a few ulp of 1, times 255


def test_the_byte_for_no_gradient_is_read_as_a_gradient_of_1_over_255_in_each_component():
    found = with_gradient(np.zeros((3, 3, 3, 1), np.uint8), PRINTED.lighting, "unorm8")[1, 1, 1]
    gradient, length = unpacked(found[1:, None] / 255, PRINTED.lighting)
    assert_allclose(gradient.ravel(), [1 / 255] * 3, rtol=1e-13)  # 2 c - 1 near 0 has lost two digits
    assert_allclose(length, math.sqrt(3) / 255, rtol=1e-13)
    _, put_right = unpacked(found[1:, None] / 255, WORKING.lighting)
    assert put_right[0] == 0.0


def test_gradients_are_unnormalised_the_steepest_edge_has_the_length_16_over_27():
    edge = np.zeros((3, 3, 3, 1))
    edge[:, :, 2:] = 1.0
    found = with_gradient(edge, WORKING.lighting, "exact")[1, 1, 1, 1:]
    gradient, length = unpacked(found[:, None], WORKING.lighting)
    assert_allclose(length, 16 / 27, rtol=1e-14)  # a few ulp
    assert gradient[0, 0] < 0  # downhill


def test_no_field_has_a_gradient_longer_than_0_679():
    """Along a direction the longest is that of the field that is 1 where the weights along it are above 0."""
    weights = gradient_weights(WORKING.lighting).reshape(3, 27) / 27
    directions = np.random.default_rng(0).normal(size=(3, 50_000))
    directions /= np.linalg.norm(directions, axis=0)
    longest = np.maximum(weights.T @ directions, 0).sum(axis=0).max()
    assert longest == pytest.approx(0.6789, abs=1e-4)  # 50 000 directions are 0.01 apart, and it is a maximum


def test_a_table_of_the_gradient_means_magnitudes_of_the_world():
    """On a ramp of 10 per world unit the program looks up what the transfer function has at 10."""
    ramp = vr.Volume(np.zeros((6, 6, 6)) + 20.0 * np.arange(6), spacing=(2, 2, 2))
    rgba = np.ones((64, 2, 4))
    rgba[..., 0] = (np.arange(64)[:, None] + 0.5) / 64  # red is the magnitude / 40
    shown = dataclasses.replace(scene(field=ramp), transfer=vr.TransferFunction2D(rgba, (0, 100), (0, 40)))
    exact = WORKING.with_switches(volume={"format": "exact"}, table={"format": "exact"})
    uploads = uploads_of(shown, exact)
    _, length = unpacked(uploads.volume[2, 2, 2, 1:, None], exact.lighting)
    rows = (np.arange(256) + 0.5) / 256
    assert np.interp(length[0], rows, uploads.table[:, 128, 0]) == pytest.approx(10 / 40, rel=1e-12)


def test_the_factor_of_a_gradient_opacity_is_in_the_rows_of_the_table():
    look = vr.TransferFunction([0, 100], [(1, 1, 1)] * 2, [1.0, 1.0], gradient_opacity=([0, 20], [0, 1]))
    shown = dataclasses.replace(scene(), transfer=look)
    exact = WORKING.with_switches(table={"format": "exact", "rows": 4, "steepest": 40.0})
    opacity = uploads_of(shown, exact).table[:, 0, 3]
    assert_allclose(opacity / opacity[-1], [0.25, 0.75, 1.0, 1.0], rtol=1e-14)  # at 5, 15, 25 and 35


# Pictures


@pytest.mark.parametrize("pipeline", [WORKING, PRINTED], ids=lambda p: p.name)
@pytest.mark.parametrize("by_gradient", [0.0, 8.0])
@pytest.mark.parametrize("material", [None, *MATERIALS], ids=lambda m: m.model if m else "unlit")
def test_pixels_are_those_of_the_scalar_loop(pipeline, by_gradient, material):
    shown = scene(LIGHTS if material else (), material)
    short = pipeline.with_switches(
        stepping={"steps": 12}, opacity={"by_gradient": by_gradient}, output=FLOATING
    )
    jitter = np.random.default_rng(3).random((1, shown.height, shown.width))
    out = vr.emulate(shown, short, jitter=jitter)
    factor = factor_of(shown, short, box_of(shown))
    printed = pipeline is PRINTED
    judge = Pixels(shown, printed=printed, steps=12, factor=factor, by_gradient=by_gradient)
    for x, y in ((4, 3), (3, 3), (5, 4), (4, 1), (0, 0)):
        color, count = judge.at(EYE, TARGET, UP, FOV, x, y, jitter[0, y, x])
        assert out.samples[y, x] == count
        # Positions are in float32: 1e-7 of the box, times slopes of bytes of 10 per voxel and 9 voxels.
        assert_allclose(out.rgba[y, x], color, rtol=0, atol=2e-5)


def test_on_cubes_of_cubes_lights_in_texture_space_are_lights_in_the_world():
    field = volume(1, (8, 8, 8), (1.5, 1.5, 1.5))
    shown = scene(LIGHTS, MATERIALS[1], field=field)
    there = vr.emulate(shown, WORKING.with_switches(lighting={"space": "texture"}, output=FLOATING))
    here = vr.emulate(shown, WORKING.with_switches(output=FLOATING))
    # Normals of gradients just above the least length differ by rounding alone.
    assert_allclose(there.rgba, here.rgba, rtol=0, atol=1e-6)


def test_lights_in_texture_space_are_skewed_where_the_box_is_no_cube():
    shown = scene(LIGHTS, MATERIALS[1])
    there = vr.emulate(shown, WORKING.with_switches(lighting={"space": "texture"}, output=FLOATING))
    here = vr.emulate(shown, WORKING.with_switches(output=FLOATING))
    assert np.abs(there.rgba - here.rgba).max() > 0.01


def flat_scene(direction):
    """White voxels of one value between lights of one direction, seen as a colour that is only diffuse."""
    field = vr.Volume(np.full((9, 9, 9), 200, np.uint8))
    lights = (vr.Light.directional(direction),)
    shown = scene(
        lights, vr.Material("lambert", ambient=0.0, diffuse=1.0), field=field, background=(0, 0, 0, 1)
    )
    return dataclasses.replace(
        shown, transfer=vr.TransferFunction.from_opacity([0, 255], [(1, 1, 1)] * 2, [0.5] * 2)
    )


def test_flat_regions_are_lit_from_the_corner_1_1_1_with_the_misprint_put_right():
    """Nothing there has a normal, yet light along -(1, 1, 1) is given back in full, as off a wall."""
    half = WORKING.with_switches(lighting={"zero": "half"}, output=FLOATING)
    lit = vr.emulate(flat_scene((-1, -1, -1)), half).rgba[3, 4, 0]
    from_behind = vr.emulate(flat_scene((1, 1, 1)), half).rgba[3, 4, 0]
    exact = vr.emulate(flat_scene((-1, -1, -1)), WORKING.with_switches(output=FLOATING)).rgba[3, 4, 0]
    assert lit > 0.98
    assert from_behind == exact == 0.0


@pytest.mark.parametrize(("slope", "lit"), [(0.0005, False), (0.002, True)])
def test_a_gradient_below_a_thousandth_has_no_direction(slope, lit):
    ramp = vr.Volume(0.5 + slope * (np.arange(9.0) - 4) + np.zeros((9, 9, 9)))
    shown = dataclasses.replace(flat_scene((1, 0, 0)), volume=ramp)
    exact = WORKING.with_switches(volume={"format": "exact"}, output=FLOATING)
    shown = vr.emulate(shown, dataclasses.replace(exact, domain=(0.0, 1.0)))
    assert (shown.rgba[..., 0].max() > 0.3) == lit


def test_a_uniform_light_of_1_leaves_colours_alone_and_no_light_is_taken_for_it():
    bright = vr.emulate(scene((vr.Light.ambient(),), MATERIALS[0]), PRINTED)
    assert_array_equal(bright.rgba, vr.emulate(scene(), PRINTED).rgba)


def test_every_light_with_a_direction_brings_the_ambient_part_along():
    """Two lights behind a surface give it twice the ambient light of one; in volref's model none."""
    material = vr.Material("lambert", ambient=0.3, diffuse=0.0)
    lights = [vr.Light.directional((1, 0, 0))] * 2
    one, two = (
        vr.emulate(
            scene(lights[:n], material, background=(0, 0, 0, 1)), WORKING.with_switches(output=FLOATING)
        ).rgba
        for n in (1, 2)
    )
    assert one[3, 4, 0] > 0.01
    assert_allclose(two[..., :3], 2 * one[..., :3], rtol=1e-6)  # stored in float32


@pytest.mark.parametrize("lights", [(), (vr.Light.ambient(),)])
def test_what_has_no_gradient_at_all_is_left_out_as_published_and_shown_as_put_right(lights):
    """In a texture of floats no gradient is exactly 0, and the code's `mag > 0` leaves it out."""
    shown = dataclasses.replace(flat_scene((-1, -1, -1)), lights=lights)
    printed = PRINTED.with_switches(volume={"format": "float"}, lighting={"gradient": "sobel-bytes"})
    assert not vr.emulate(shown, printed).rgba[..., :3].any()
    assert vr.emulate(shown, WORKING.with_switches(volume={"format": "float"})).rgba[3, 4, 0] > 0.9


def test_where_alpha_exceeds_1_colours_are_divided_and_nothing_lies_behind():
    strong = WORKING.with_switches(stepping={"steps": 1}, opacity={"factor": 50.0}, output=FLOATING)
    white = dataclasses.replace(flat_scene((-1, -1, -1)), lights=(), background=(0.0, 0.0, 1.0, 1.0))
    assert_allclose(vr.emulate(white, strong).rgba[3, 4], 1.0, rtol=1e-6)  # stored in float32


# Frames


def test_a_mean_in_bytes_stalls_where_frames_differ_by_less_than_half_their_number():
    """After 10 frames of code 100, 90 of code 104 change nothing: 3.6 codes below their mean."""
    output, device = Output(mean_format="unorm8"), vr.Device()
    mean = np.zeros((1, 4))
    for number in range(1, 101):
        frame = np.full((1, 4), (100 if number <= 10 else 104) / 255)
        mean = mean_of_frames(mean, frame, number, output, device)
    assert_allclose(mean * 255, 100.0, rtol=1e-12)  # codes, divided and multiplied by 255


def worst_mean(frames):
    """Codes of frames that a greedy search finds: each the one whose rounding loses most, and their mean."""
    output, device = Output(mean_format="unorm8"), vr.Device()
    codes = np.arange(256) / 255
    every = np.repeat(codes[:, None], 4, axis=1)
    mean, total = np.zeros((1, 4)), 0
    for number in range(1, frames + 1):
        after = mean_of_frames(np.repeat(mean, 256, axis=0), every, number, output, device)
        gained = after[:, 0] * 255 - (mean[0, 0] * 255 + (np.arange(256) - mean[0, 0] * 255) / number)
        best = int(np.argmax(gained))
        mean, total = after[best : best + 1], total + best
    return float(mean[0, 0] * 255), total / frames


def test_a_mean_of_n_frames_in_bytes_may_be_off_by_n_plus_1_quarters_of_a_code_and_no_more():
    """n m_n = (n - 1) m_(n-1) + f_n + n e_n with |e_n| <= 1/2: the errors add up to (n + 1) / 4."""
    shown, true = worst_mean(100)
    assert 15.0 < shown - true <= 101 / 4


def test_a_mean_of_jittered_frames_tends_to_what_finer_steps_give():
    """Offsets 0, 1/16, ... of 20 steps are the samples of 320: alike to second order of a step's opacity."""
    shown = scene()
    floating = WORKING.with_switches(
        stepping={"steps": 20}, opacity={"factor": 0.3}, table={"format": "exact"}, output=FLOATING
    )
    fine = vr.emulate(shown, floating.with_switches(stepping={"steps": 320, "offset": 0.5})).rgba
    offsets = ((np.arange(16) + 0.5) / 16)[:, None, None] * np.ones((16, shown.height, shown.width))
    errors = []
    for frames in (1, 4, 16):
        chosen = offsets[16 // frames // 2 :: 16 // frames]
        out = vr.emulate(shown, floating, jitter=chosen, frames=frames)
        errors.append(np.abs(out.rgba - fine).max())
    assert errors[2] < errors[1] < errors[0]
    assert errors[2] < 1e-3


def test_the_mean_in_bytes_is_the_mean_of_the_frames_within_its_bound():
    shown = scene()
    angles = np.random.default_rng(2).uniform(0, 2 * np.pi, 12)
    jitter = np.stack([hash_jitter(shown.width, shown.height, (math.cos(a), math.sin(a))) for a in angles])
    short = WORKING.with_switches(stepping={"steps": 25})
    frames = [vr.emulate(shown, short, jitter=one[None]).passes["frame"] for one in jitter]
    out = vr.emulate(shown, short, jitter=jitter, frames=12)
    assert_array_equal(out.passes["frame"], frames[-1])
    assert_array_equal(out.passes["running_mean"], out.rgba)
    assert np.abs(out.rgba - np.mean(frames, axis=0)).max() * 255 <= 13 / 4


def test_the_noise_is_the_formula_at_pixel_centres_from_the_bottom_up():
    found = hash_jitter(5, 3, (0.6, -0.8))
    for y, x in np.ndindex(found.shape):
        u, v = (x + 0.5) / 5, 1 - (y + 0.5) / 3
        noise = math.sin(u * 0.6 * 79.30408 - v * 0.8 * 79.30408) * 43758.5453
        # An ulp of the argument, 1e-14, times 43758.
        assert found[y, x] == pytest.approx(noise - math.floor(noise), abs=1e-8)


# Other programs with lights


def test_forward_differences_are_one_sided():
    """On a ramp both are its slope; over a ridge central ones are 0 and forward ones are not."""
    lamp, matte = (vr.Light.directional((-1, 0, 0)),), vr.Material("lambert", ambient=0.0, diffuse=1.0)
    x = np.arange(9)
    ramp, ridge = 20.0 * x, 100.0 - 20.0 * abs(x - 4)
    along_z = vr.Camera.orthographic((4, 4, 30), (4, 4, 4), (0, 1, 0), 9.0, 1, 60)
    images = {}
    for name, profile in (("ramp", ramp), ("ridge", ridge)):
        shown = scene(lamp, matte, field=vr.Volume(np.tile(profile, (9, 9, 1))), background=(0, 0, 0, 1))
        white = vr.TransferFunction.from_opacity([0, 255], [(1, 1, 1)] * 2, [0.5] * 2)
        shown = dataclasses.replace(shown, camera=along_z, width=9, height=9, transfer=white)
        for kind in ("central", "forward"):
            program = named("texture3d").with_switches(
                lighting={"model": "lit", "gradient": kind}, volume={"format": "exact"}
            )
            images[name, kind] = vr.emulate(shown, program, vr.Device.named("exact")).rgba[4, 1:8, 0]
    # Light travels along -x, so what rises along x turns away from it, and what falls faces it.
    assert images["ramp", "central"].tolist() == images["ramp", "forward"].tolist() == [0.0] * 7
    lit_central, lit_forward = (images["ridge", kind] > 0.5 for kind in ("central", "forward"))
    assert lit_central.tolist() == [False] * 4 + [True] * 3
    assert lit_forward.tolist() == [False] * 3 + [True] * 4


@pytest.mark.parametrize("spacing", [(1.0, 1.0, 1.0), (1.0, 1.3, 1.6)])
def test_model_lit_with_central_differences_tends_to_volrefs_own_lit_volume(spacing):
    smooth = vr.Volume(
        200 * np.exp(-sum((np.indices((9, 9, 9))[a] - 4) ** 2 / 3 for a in range(3))), spacing=spacing
    )
    shown = scene((*LIGHTS[:2], vr.Light.headlight((0.3, 0.3, 0.3))), MATERIALS[1], field=smooth)
    lit = named("texture3d").with_switches(
        stepping={"length": 0.04},
        volume={"format": "exact"},
        table={"format": "exact", "size": 4096},
        lighting={"model": "lit", "gradient": "central"},
        output={"format": "float"},
    )
    device = vr.Device.named("exact")
    truth = vr.render(shown, method="march", step=0.04, certified=False)
    # Two rules of order 2 and a table of 4096 entries; the border, where shaders and volref have gradients of
    # their own, is all but transparent.
    assert_allclose(vr.emulate(shown, lit, device).rgba, truth.rgba, rtol=0, atol=1e-3)


# Refusals


@pytest.mark.parametrize(
    ("changes", "lights", "sentence"),
    [
        ({"lighting": {"gradient": "none"}}, (), r"pipeline.lighting.gradient must be had for model 'cej'"),
        ({"lighting": {"gradient": "central"}}, (), "without a texture of gradients"),
        ({"volume": {"layout": "atlas"}}, (), "pipeline.lighting.gradient must suit the volume"),
        ({"table": {"order": "pre"}}, (), "pipeline.lighting.gradient must suit the volume"),
        ({}, (vr.Light.headlight(),), "scene.lights must suit lighting model 'cej', got a headlight"),
        ({}, (vr.Light.point((0, 0, 0), attenuation=(1, 1, 0)),), r"got the attenuation \[1.0, 1.0, 0.0\]"),
    ],
)
def test_what_does_not_go_together_is_refused(changes, lights, sentence):
    with pytest.raises(vr.SceneError, match=sentence):
        vr.emulate(scene(lights), WORKING.with_switches(**changes))


def test_transfer_functions_of_the_gradient_are_refused_where_there_is_none():
    table = vr.TransferFunction2D(np.ones((2, 2, 4)), (0, 255), (0, 10))
    with pytest.raises(vr.SceneError, match="must be one of the value alone for pipeline 'texture3d'"):
        vr.emulate(dataclasses.replace(scene(), transfer=table), "texture3d")
