"""From the loop to the canvas: blends by GL's equations, bytes on every machine, means of frames."""

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from volref import Camera, Pipeline, Scene, TransferFunction, Volume, emulate
from volref.emulation.device import Device
from volref.emulation.groups import Accumulation, Output
from volref.emulation.loop.marching import Marched
from volref.emulation.targets.canvas import (
    cleared,
    draw,
    fragment_colors,
    mean_of_frames,
    missed,
    over_environment,
    store,
    tone_mapped,
)

IDEAL = Device()
MESA, SWIFT = Device.named("llvmpipe"), Device.named("swiftshader")
FLOAT, BYTES = {"format": "exact"}, {"format": "unorm8"}

# Factors of a blend state for colour and alpha, of source and destination (OpenGL ES 3.0, section 4.1.7).
STATES = {
    "none": (("one", "zero"), ("one", "zero")),
    "premultiplied": (("one", "one_minus_src_alpha"), ("one", "one_minus_src_alpha")),
    "straight": (("src_alpha", "one_minus_src_alpha"), ("src_alpha", "one_minus_src_alpha")),
    "additive-alpha": (("src_alpha", "one_minus_src_alpha"), ("one", "one")),
}


def gl(source, behind, blend):
    """What a blend state makes of two colours of four numbers."""
    factors = {"one": 1.0, "zero": 0.0, "src_alpha": source[3], "one_minus_src_alpha": 1 - source[3]}
    channels = [STATES[blend][0]] * 3 + [STATES[blend][1]]
    return [s * factors[f] + d * factors[g] for s, d, (f, g) in zip(source, behind, channels, strict=True)]


def marched(color, alpha, weighted=0.0):
    rays = [np.atleast_1d(np.array(part, dtype=np.float64)) for part in (alpha, weighted)]
    color = np.array(color, dtype=np.float64).reshape(3, -1)
    return Marched(color, *rays, np.ones(len(rays[0]), int), np.zeros(len(rays[0]), bool))


def one_pixel(source, behind, output, device=IDEAL):
    """What a fragment leaves of a canvas of one pixel."""
    canvas = np.array([behind], dtype=np.float64)
    draw(canvas, np.array([0]), np.array([source], dtype=np.float64), Output(**output), device)
    return canvas[0]


unit = st.floats(0, 1)
colors = st.lists(unit, min_size=4, max_size=4)
codes = st.lists(st.integers(0, 255), min_size=4, max_size=4).map(lambda c: [k / 255 for k in c])


@pytest.mark.parametrize("blend", STATES)
@given(source=st.lists(st.floats(0, 3), min_size=4, max_size=4), behind=colors)
def test_a_canvas_of_floats_blends_as_gl_says(blend, source, behind):
    found = one_pixel(source, behind, {"blend": blend, **FLOAT})
    np.testing.assert_allclose(found, gl(source, behind, blend), rtol=1e-15, atol=1e-15)


@pytest.mark.parametrize("blend", STATES)
@given(source=st.lists(st.floats(-1, 3), min_size=4, max_size=4), behind=codes)
def test_a_canvas_of_bytes_holds_fragments_to_0_and_1_blends_and_rounds_once(blend, source, behind):
    held = [min(max(c, 0.0), 1.0) for c in source]
    exact = 255 * np.clip(gl(held, behind, blend), 0, 1)
    found = 255 * one_pixel(source, behind, {"blend": blend, **BYTES})
    np.testing.assert_array_equal(found, np.rint(found))
    # The nearest byte; a float32 on the way is 255 2^-25 off.
    assert np.abs(found - exact).max() <= 0.5 + 1e-5


@pytest.mark.parametrize("blend", STATES)
def test_a_device_that_blends_in_whole_numbers_rounds_each_product(blend):
    rng = np.random.default_rng(2)
    source, behind = rng.integers(0, 256, (2, 400, 4))
    canvas = behind / 255
    draw(canvas, np.arange(400), source / 255, Output(blend=blend, **BYTES), MESA)
    for found, over, under in zip(np.rint(canvas * 255).astype(int), source, behind, strict=True):
        factors = {"one": 255, "zero": 0, "src_alpha": over[3], "one_minus_src_alpha": 255 - over[3]}
        for channel in range(4):
            one, two = (factors[f] for f in STATES[blend][channel == 3])
            front, back = over[channel] * one, under[channel] * two
            whole = (front + (front >> 8) + 128 >> 8) + (back + (back >> 8) + 128 >> 8)
            assert found[channel] == min(whole, 255)


def test_blending_in_whole_numbers_differs_from_floats_where_it_was_measured():
    # A gray of 100 at alpha 128 over 51: 75.6 once rounded is 76; product by product 50 + 25.
    source, behind = [100 / 255, 0, 0, 128 / 255], [51 / 255, 0, 0, 1.0]
    found = [
        one_pixel(source, behind, {"blend": "straight", **BYTES}, device)[0] * 255 for device in (SWIFT, MESA)
    ]
    assert np.rint(found).tolist() == [76, 75]
    # Mesa stores the fragment first: 0.4 of a byte adds nothing, where SwiftShader adds it to 10.3.
    source = [0.4 / 255] * 3 + [0.0]
    stored = [
        one_pixel(source, [10.0 / 255] * 4, {"blend": "premultiplied", **BYTES}, d)[0] * 255
        for d in (SWIFT, MESA)
    ]
    assert np.rint(stored).tolist() == [10, 10]
    source = [100.4 / 255, 0, 0, 0.5]
    # 0.5 is byte 128 by ties to even of 127.5: 50.4 + 25 is 75.2 once rounded, else 50 + 25.
    twice = [
        one_pixel(source, [50 / 255] * 4, {"blend": "straight", **BYTES}, d)[0] * 255 for d in (SWIFT, MESA)
    ]
    assert np.rint(twice).tolist() == [
        75,
        (100 * 128 + (100 * 128 >> 8) + 128 >> 8) + (50 * 127 + (50 * 127 >> 8) + 128 >> 8),
    ]


@pytest.mark.parametrize("device", [SWIFT, MESA])
def test_a_nan_is_what_the_device_makes_of_it_and_a_float_keeps_it(device):
    one = device.nan_stored == "one"
    found = one_pixel([np.nan, 0.5, 2.0, 1.0], [0.2] * 4, {"blend": "none", **BYTES}, device)
    np.testing.assert_allclose(found, [float(one), 128 / 255, 1, 1], atol=1e-7)
    assert np.isnan(one_pixel([np.nan] * 4, [0.2] * 4, {"blend": "premultiplied", "format": "float"})).all()


@pytest.mark.parametrize("blend", ["float", "integer"])
def test_a_device_may_store_a_nan_as_255(blend):
    device = Device("d", nan_stored="one", blend=blend)
    found = one_pixel([np.nan, 0, 0, 1], [0.0] * 4, {"blend": "premultiplied", **BYTES}, device)
    np.testing.assert_array_equal(found, [1, 0, 0, 1])
    assert store(np.array([np.nan]), "unorm8", device) == 1


def test_a_fragment_below_the_threshold_is_discarded_and_one_at_it_drawn():
    canvas = np.zeros((3, 4))
    fragments = np.array([[1, 1, 1, alpha] for alpha in (0.0499, 0.05, 0.8)])
    draw(canvas, np.array([2, 0, 1]), fragments, Output(discard_below=0.05, blend="none", **FLOAT), IDEAL)
    np.testing.assert_array_equal(canvas, [fragments[1], fragments[2], [0] * 4])


def test_what_is_not_a_number_is_discarded_too():
    canvas = np.zeros((1, 4))
    fragment = np.array([[1, 1, 1, np.nan]])
    draw(canvas, np.array([0]), fragment, Output(discard_below=0.0, blend="none", **FLOAT), IDEAL)
    assert not canvas.any()


def test_a_mediump_output_is_a_half_on_devices_that_have_them():
    color = [0.3, 1 / 3, 0.7001, 0.9]
    for device, precision, halves in (
        (MESA, "mediump", True),
        (MESA, "highp", False),
        (SWIFT, "mediump", False),
    ):
        found = one_pixel(color, [0.0] * 4, {"blend": "none", "precision": precision, **FLOAT}, device)
        expected = np.float16(np.float32(color)).astype(float) if halves else color
        np.testing.assert_array_equal(found, expected)


def test_a_canvas_is_cleared_to_the_background_as_it_can_hold_it():
    volume = Volume(np.zeros((2, 2, 2)))
    transfer = TransferFunction.from_opacity([0, 1], [(1, 1, 1)] * 2, [0, 0.5])
    camera = Camera.look_at((0, 0, 9), (0, 0, 0), (0, 1, 0), 30, 1, 20)
    shown = Scene(volume, transfer, camera, 3, 2, background=(0.1, 0.2, 0.3, 0.4))
    canvas = cleared(shown, Output(**BYTES), IDEAL)
    assert canvas.shape == (6, 4)
    # 25.5 and 76.5 lie half-way but for float32, which has both a little above.
    np.testing.assert_array_equal(canvas, np.broadcast_to(np.array([26, 51, 76, 102]) / 255, (6, 4)))
    np.testing.assert_array_equal(cleared(shown, Output(**FLOAT), IDEAL)[0], shown.background)


@pytest.mark.parametrize(("word", "left"), [("clear", 0.25), ("black", (0, 0, 0, 1)), ("transparent", 0.0)])
def test_pixels_without_a_ray_are_what_the_program_leaves_there(word, left):
    canvas = np.full((4, 4), 0.25)
    missed(canvas, np.array([1, 3]), Output(missed=word))
    np.testing.assert_array_equal(canvas[[1, 3]], 0.25)
    np.testing.assert_array_equal(canvas[[0, 2]], np.broadcast_to(left, (2, 4)))


def test_what_the_shader_writes_as_alpha():
    loop = marched([[0.1, 0.6], [0.2, 0.6], [0.3, 0.6]], [0.5, 1.2], [0.4, 0.9])
    for word, alphas in (("accumulated", [0.5, 1.2]), ("weighted", [0.4, 0.9]), ("one", [1.0, 1.0])):
        found = fragment_colors(loop, Accumulation(alpha=word))
        np.testing.assert_array_equal(found, [[0.1, 0.2, 0.3, alphas[0]], [0.6, 0.6, 0.6, alphas[1]]])
    found = fragment_colors(loop, Accumulation(normalize="above-one"))
    np.testing.assert_array_equal(found, [[0.1, 0.2, 0.3, 0.5], [0.6 / 1.2] * 3 + [1.2]])
    found = fragment_colors(loop, Accumulation(normalize="always"))
    np.testing.assert_array_equal(found, [[0.1 / 0.5, 0.2 / 0.5, 0.3 / 0.5, 0.5], [0.6 / 1.2] * 3 + [1.2]])
    empty = fragment_colors(marched([[0.0]] * 3, [0.0], [0.0]), Accumulation(normalize="always"))
    np.testing.assert_array_equal(empty, [[0.0] * 4])


def test_an_environment_is_added_behind_and_nothing_of_it_behind_more_than_all():
    fragments = np.array([[0.1, 0.2, 0.3, 0.5], [0.6, 0.6, 0.6, 1.2]])
    behind = np.array([[0.4, 0.0, 1.0, 0.8]] * 2)
    found = over_environment(fragments, np.array([0.5, 1.2]), behind, Accumulation())
    np.testing.assert_allclose(found, [[0.3, 0.2, 0.8, 0.9], [0.6, 0.6, 0.6, 1.2]], rtol=1e-15)
    found = over_environment(fragments, np.array([0.5, 1.2]), behind, Accumulation(alpha="one"))
    np.testing.assert_allclose(found, [[0.3, 0.2, 0.8, 0.5], [0.6, 0.6, 0.6, 1.2]], rtol=1e-15)


BACKGROUND = (0.25, 0.5, 1.0, 1.0)
FRAGMENT = np.array([0.5, 1.0, 3.0, 0.25])
MAPPED = {
    ("none", 1.0, "none"): [0.5, 1.0, 3.0, 0.25],
    ("reinhard", 1.0, "none"): [1 / 3, 0.5, 0.75, 0.25],
    ("none", 2.0, "none"): [0.5**0.5, 1.0, 3**0.5, 0.25],
    # C + (1 - A) b^gamma, then the root of all.
    ("none", 2.0, "shader"): [(0.5 + 0.75 / 16) ** 0.5, (1 + 0.75 / 4) ** 0.5, 3.75**0.5, 1.0],
    ("none", 2.0, "shader-straight"): [(0.125 + 0.75 / 16) ** 0.5, (0.25 + 0.75 / 4) ** 0.5, 1.5**0.5, 1.0],
    # The tone map squeezes the volume's light, not the background.
    ("reinhard", 1.0, "shader"): [1 / 3 + 0.75 / 4, 0.5 + 0.75 / 2, 1.5, 1.0],
}


@pytest.mark.parametrize(("tone_map", "gamma", "blend"), MAPPED)
def test_light_is_squeezed_laid_over_the_background_and_bent(tone_map, gamma, blend):
    output = Output(tone_map=tone_map, gamma=gamma, blend=blend)
    found = tone_mapped(FRAGMENT, output, BACKGROUND)
    np.testing.assert_allclose(found, MAPPED[tone_map, gamma, blend], rtol=1e-15)


def test_the_artistic_tone_map_has_the_programs_numbers():
    output = Output(tone_map="artistic", low=0.5, mid=1.0, high=2.5, saturation=0.0)
    # Grey 1.5 is half-way between 0.5 and 2.5; mid is a quarter: the exponent is -log2(1/4) = 2.
    np.testing.assert_allclose(
        tone_mapped(FRAGMENT, output, BACKGROUND), [0.25, 0.25, 0.25, 0.25], rtol=1e-12
    )


@pytest.mark.parametrize("times", [0, 2])
def test_a_wrong_number_of_encodings_leaves_the_backgrounds_light_as_it_is(times):
    found = tone_mapped(FRAGMENT, Output(gamma=2.0, blend="shader", encodings=times), BACKGROUND)
    light = [0.5 + 0.75 / 16, 1 + 0.75 / 4, 3.75]
    np.testing.assert_allclose(found[:3], [one ** (0.5**times) for one in light], rtol=1e-15)


def test_light_below_0_is_black_after_a_gamma():
    found = tone_mapped(np.array([-0.5, 0.0, 1.0, 0.5]), Output(gamma=2.2), BACKGROUND)
    np.testing.assert_array_equal(found, [0, 0, 1, 0.5])


def test_light_that_16_bits_cannot_hold_is_infinite_and_then_white():
    found = tone_mapped(np.float16([100.0, 1.0, 0.0, 0.5]), Output(gamma=0.1), BACKGROUND)
    assert found.dtype == np.float16
    np.testing.assert_array_equal(found, [np.inf, 1, 0, 0.5])
    assert one_pixel([np.inf, 0, 0, 1], [0.0] * 4, {"blend": "none", **BYTES})[0] == 1


@pytest.mark.parametrize("device", [IDEAL, SWIFT, Device("d", mix="sum")])
@given(frames=st.lists(st.integers(0, 255), min_size=1, max_size=8))
def test_a_mean_of_frames_in_bytes_is_rounded_at_every_frame(device, frames):
    output = Output(mean_format="unorm8")
    mean, byte, f32 = np.full((1, 4), 0.3), 77, np.float32
    for number, frame in enumerate(frames, start=1):
        mean = mean_of_frames(mean, np.full((1, 4), frame / 255), number, output, device)
        x, y, a = f32(byte) * f32(1 / 255), f32(frame) * f32(1 / 255), f32(1 / number)
        mixed = x * (f32(1) - a) + y * a if device.mix == "sum" else x + (y - x) * a
        byte = int(np.rint(mixed * f32(255)))
        np.testing.assert_array_equal(np.rint(mean * 255), byte)
    if len(frames) == 1:
        assert byte == frames[0]


def test_a_mean_of_floats_is_the_mean():
    frames = np.random.default_rng(3).random((7, 5, 4))
    mean = np.full((5, 4), 0.9)
    for number, frame in enumerate(frames, start=1):
        mean = mean_of_frames(mean, frame, number, Output(format="float", mean_format="float"), IDEAL)
    # Seven float32 of 0..1, each a few digits off.
    np.testing.assert_allclose(mean, frames.mean(axis=0), rtol=0, atol=1e-6)


def test_the_first_frame_replaces_what_the_mean_was_cleared_to_even_if_it_was_large():
    found = mean_of_frames(
        np.full((1, 4), 0.75), np.full((1, 4), 0.1), 1, Output(mean_format="exact", format="exact"), IDEAL
    )
    # x + (y - x) in float32.
    np.testing.assert_allclose(found, 0.1, rtol=0, atol=2**-24)


def small(**more):
    volume = Volume(np.full((4, 4, 4), 200, np.uint8))
    transfer = TransferFunction.from_opacity([0, 255], [(0.9, 0.5, 0.2)] * 2, [0.3] * 2, 2.0)
    camera = Camera.look_at((4, 5, 12), (1.5, 1.5, 1.5), (0, 1, 0), 32, 1, 40)
    return Scene(volume, transfer, camera, 7, 6, **more)


def test_bytes_of_an_image_of_floats_are_those_of_the_image_of_bytes():
    shown = small(background=(0.2, 0.1, 0.4, 1.0))
    program = Pipeline("p").with_switches(output={"format": "float"})
    coarse = emulate(shown, program.with_switches(output={"format": "unorm8"}))
    np.testing.assert_allclose(coarse.rgba8, 255 * emulate(shown, program).rgba, rtol=0, atol=0.5 + 0.51)
    np.testing.assert_array_equal(coarse.rgba8, np.rint(255 * coarse.rgba))
    device = Device("d", nan_stored="one")
    for machine, code in ((IDEAL, 0), (device, 255)):
        out = emulate(shown, program, machine)
        out.rgba[0, 0] = np.nan
        assert (out.rgba8[0, 0] == code).all()


def test_frames_of_a_program_are_averaged_and_its_targets_named_in_order():
    jitter = np.random.default_rng(4).random((3, 6, 7))
    stepping = {"rule": "count", "steps": 6, "end": "count", "jitter": True}
    program = Pipeline("p").with_switches(
        stepping=stepping, output={"format": "exact", "mean_format": "exact"}
    )
    exact = Device.named("exact")
    alone = [
        emulate(small(), program.with_switches(output={"mean_format": None}), exact, jitter[k : k + 1]).rgba
        for k in range(3)
    ]
    out = emulate(small(), program, exact, jitter, 3)
    np.testing.assert_allclose(out.rgba, np.mean(alone, axis=0), rtol=0, atol=1e-15)
    assert list(out.passes) == ["frame", "running_mean", "canvas"]
    np.testing.assert_array_equal(out.passes["frame"], alone[2])
    mapped = program.with_switches(output={"tone_map": "reinhard"})
    bent = emulate(small(), mapped, exact, jitter, 3)
    np.testing.assert_array_equal(bent.passes["running_mean"], out.passes["running_mean"])
    mean = out.passes["running_mean"][..., :3]
    np.testing.assert_allclose(bent.rgba[..., :3], mean / (1 + mean), rtol=1e-15)


@pytest.mark.parametrize(("blend", "kind"), [*itertools.product(STATES, ("unorm8", "float"))])
def test_an_opaque_white_volume_hides_any_background(blend, kind):
    transfer = TransferFunction.from_opacity([0, 255], [(1, 1, 1)] * 2, [1.0] * 2)
    shown = small(background=(0.5, 0.25, 0.0, 0.5))
    shown = Scene(shown.volume, transfer, shown.camera, 7, 6, background=shown.background)
    output = {"blend": blend, "format": kind}
    whole = {"opacity": {"rule": "as-is"}, "stepping": {"last_step": "whole"}}
    out = emulate(shown, Pipeline("p").with_switches(**whole, output=output))
    inside = out.samples > 0
    assert 6 < inside.sum() < 42
    np.testing.assert_array_equal(out.rgba[inside][:, :3], 1.0)
    # Alphas that are added are 1.5, which no byte holds.
    np.testing.assert_array_equal(
        out.rgba[inside][:, 3], 1.5 if (blend, kind) == ("additive-alpha", "float") else 1.0
    )
    # A byte is half a step beside the background.
    apart = np.abs(out.rgba[~inside] - shown.background)
    assert apart.max() <= 0.5 / 255 + 1e-7
