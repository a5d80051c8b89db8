import dataclasses
import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import volref as vr
from tests.emulation.scenes import example
from tests.oracle.made_up import ROUNDINGS, acceptance_of, byte_intervals, encoded, sent
from volref.io import write_png
from volref.oracle import readings

SEEDS = st.integers(0, 10**6)
ALPHAS = ("premultiplied", "straight", "ignored")
ENCODINGS = ("none", "srgb", "gamma2.2")
FLOATS = vr.Pipeline("floats").with_switches(output={"format": "float"})
CLEAR = np.zeros((2, 3, 4), np.uint8)


@pytest.fixture(scope="module")
def drawn():
    """A canvas of bytes that no turn and no exchange of channels leaves as it is, with its intervals."""
    out = vr.emulate(example(), "congote2012")
    return out.rgba8, acceptance_of(out.rgba, out.rgba)


@given(SEEDS, st.sampled_from(ALPHAS), st.sampled_from(ENCODINGS), st.sampled_from(list(ROUNDINGS)))
def test_a_canvas_inside_its_intervals_passes_in_whatever_bytes_it_is_delivered(seed, alpha, encoding, way):
    canvas, acceptance = byte_intervals(seed)
    numbers = sent(canvas / 255, alpha, encoding)
    for levels, kind in ((255, np.uint8), (65535, np.uint16)):
        # A code that the quotient misses by the last bit is still that code.
        scaled = np.round(np.clip(numbers, 0, 1) * levels, 9)
        codes = ROUNDINGS[way](scaled).astype(kind)
        assert vr.check(codes, acceptance, alpha=alpha, encoding=encoding).status == "inside"


@given(SEEDS, st.sampled_from(ALPHAS), st.sampled_from(ENCODINGS), st.sampled_from(["<f2", "<f4", ">f8"]))
def test_a_canvas_inside_its_intervals_passes_in_whatever_floats_it_is_delivered(seed, alpha, encoding, kind):
    canvas, acceptance = byte_intervals(seed)
    # Shaders and tools compute in float32.
    numbers = sent((canvas / 255).astype(np.float32), alpha, encoding).astype(np.float32).astype(kind)
    assert vr.check(numbers, acceptance, alpha=alpha, encoding=encoding).status == "inside"


def test_every_code_passes_as_the_float_that_shaders_read_it_as():
    codes = np.repeat(np.arange(256, dtype=np.uint8).reshape(16, 16, 1), 4, axis=2)
    exact = acceptance_of(codes / 255, codes / 255)
    assert vr.check(codes * np.float32(1 / 255), exact).status == "inside"


@given(SEEDS, st.sampled_from(ENCODINGS))
def test_colours_above_alpha_pass_whether_a_tool_holds_them_to_1_or_not(seed, encoding):
    canvas = byte_intervals(seed)[0]
    canvas[..., :3] = 255
    full = acceptance_of(canvas / 255, canvas / 255)
    straight = sent(canvas / 255, "straight", encoding)
    for numbers in (straight, np.minimum(straight, 1)):
        assert vr.check(numbers, full, alpha="straight", encoding=encoding).passed
        codes = np.rint(255 * np.minimum(numbers, 1)).astype(np.uint8)
        assert vr.check(codes, full, alpha="straight", encoding=encoding).passed
    assert vr.check(canvas.astype(np.uint8), full).passed


@settings(max_examples=40)
@given(SEEDS, st.data())
def test_a_code_outside_is_found_wherever_it_is(seed, data):
    canvas, acceptance = byte_intervals(seed)
    y, x, channel = (data.draw(st.integers(0, n - 1)) for n in canvas.shape)
    lo, hi = (round(255 * end[y, x, channel]) for end in (acceptance.lo, acceptance.hi))
    wrong = data.draw(st.sampled_from([code for code in range(256) if not lo <= code <= hi]))
    canvas[y, x, channel] = wrong
    found = vr.check(canvas.astype(np.uint8), acceptance)
    assert found.status == "outside"
    assert np.argwhere(found.outside).tolist() == [[y, x]]
    far = max(lo - wrong, wrong - hi)
    assert (found.worst.x, found.worst.y) == (x, y)
    assert found.worst.channel == ("red", "green", "blue", "alpha")[channel]
    # Codes k/255, each half a unit in the last place off, and their difference.
    assert found.worst.excess == pytest.approx(far / 255, abs=2**-52)
    assert found.excess[y, x] == found.worst.excess
    assert f"pixel ({x}, {y}), {found.worst.channel} {wrong}/255, {far}/255 " in found.message


@settings(max_examples=40)
@given(SEEDS, st.data(), st.sampled_from(ENCODINGS))
def test_a_straight_colour_more_than_a_code_outside_is_found(seed, data, encoding):
    canvas, acceptance = byte_intervals(seed)
    codes = np.rint(255 * sent(canvas / 255, "straight", encoding)).astype(np.uint8)
    y, x = (data.draw(st.integers(0, n - 1)) for n in canvas.shape[:2])
    alpha = canvas[y, x, 3] / 255
    if alpha == 0:
        return
    straight = np.minimum(np.array([acceptance.lo[y, x, 0], acceptance.hi[y, x, 0]]) / alpha, 1)
    low, high = 255 * encoded(straight, encoding)
    wrong = [code for code in range(256) if not low - 1 <= code <= high + 1]
    if wrong:
        codes[y, x, 0] = data.draw(st.sampled_from(wrong))
        assert not vr.check(codes, acceptance, alpha="straight", encoding=encoding).passed


def test_colour_and_alpha_must_come_from_one_canvas():
    lo, hi = np.full((1, 1, 4), 100 / 255), np.full((1, 1, 4), 200 / 255)
    acceptance = acceptance_of(lo, hi)
    # Red 128/255 of alpha 200/255 is 100.4/255; of alpha 100/255, 50.2/255, which is below its interval.
    image = np.array([[[128, 128, 128, 200]]], np.uint8)
    assert vr.check(image, acceptance, alpha="straight").passed
    image[..., 3] = 100
    assert vr.check(image, acceptance, alpha="straight").worst.channel == "red"


def test_numbers_read_before_the_canvas_rounds_pass_if_its_rounding_would():
    acceptance = acceptance_of(np.full((1, 1, 4), 100 / 255), np.full((1, 1, 4), 101 / 255))
    for code, passes in ((99.49, False), (99.51, True), (101.49, True), (101.51, False)):
        assert vr.check(np.full((1, 1, 4), code / 255), acceptance).passed is passes
    # Floats that are bytes have been rounded already: by how much is told in whole ones.
    found = vr.check(np.full((1, 1, 4), np.float32(102 / 255)), acceptance)
    assert "red 102/255, 1/255 above what is accepted, 100/255 to 101/255" in found.message
    stored = dataclasses.replace(acceptance, pipeline=FLOATS)
    assert not vr.check(np.full((1, 1, 4), 99.9 / 255), stored).passed


@given(SEEDS, st.sampled_from(ALPHAS), st.sampled_from(ENCODINGS), st.sampled_from(list(ROUNDINGS)))
def test_a_canvas_of_floats_passes_in_bytes_whose_alpha_was_rounded_too(seed, alpha, encoding, way):
    canvas = np.random.default_rng(seed).random((4, 5, 4))
    canvas[..., :3] *= canvas[..., 3:]
    codes = ROUNDINGS[way](255 * sent(canvas, alpha, encoding)).astype(np.uint8)
    acceptance = acceptance_of(canvas, canvas, pipeline=FLOATS)
    assert vr.check(codes, acceptance, alpha=alpha, encoding=encoding).passed


def test_what_is_known_of_alpha_narrows_what_a_rounded_one_leaves_open():
    end = np.array([[[0.25, 0.25, 0.25, 0.5]]])
    acceptance = acceptance_of(end, end, pipeline=FLOATS)
    # Straight, it is half, 127.5/255, rounded either way; divided by 129/255 it would be 126/255.
    for code, passes in ((126, False), (127, True), (128, True), (129, False)):
        image = np.array([[[code, code, code, 128]]], np.uint8)
        assert vr.check(image, acceptance, alpha="straight").passed is passes


def test_light_above_1_passes_whether_a_tool_holds_it_to_1_before_it_encodes_it_or_not():
    end = np.full((1, 1, 4), 2.0)
    acceptance = acceptance_of(end, end, pipeline=FLOATS)
    for light in (1.0, 2.0):
        image = np.full((1, 1, 3), encoded(np.array(light), "srgb"))
        assert vr.check(image, acceptance, encoding="srgb").passed


def test_a_canvas_of_straight_colours_is_delivered_as_it_is_or_multiplied():
    program = vr.Pipeline("vtk").with_switches(accumulation={"normalize": "always"}, output={"blend": "none"})
    end = np.array([[[200, 100, 50, 128]]]) / 255
    acceptance = acceptance_of(end, end, pipeline=program)
    straight = np.array([[[200, 100, 50, 128]]], np.uint8)
    assert vr.check(straight, acceptance).passed
    assert vr.check(straight, acceptance, alpha="straight").passed
    multiplied = np.array([[[100, 50, 25, 128]]], np.uint8)
    assert vr.check(multiplied, acceptance, alpha="premultiplied").passed
    assert not vr.check(multiplied, acceptance).passed


TURNS = {
    "upside down": lambda image: image[::-1],
    "mirrored left to right": lambda image: image[:, ::-1],
    "turned by 180 degrees": lambda image: image[::-1, ::-1],
    "BGR, not RGB": lambda image: image[..., [2, 1, 0, 3]],
    "without the canvas's alpha": lambda image: np.dstack([image[..., :3], np.full_like(image[..., 0], 255)]),
    "straight, its colours divided by alpha": lambda image: as_bytes(sent(image / 255, "straight", "none")),
    "encoded as sRGB": lambda image: as_bytes(sent(image / 255, "premultiplied", "srgb")),
    "straight, its colours divided by alpha and encoded with gamma 2.2": lambda image: as_bytes(
        sent(image / 255, "straight", "gamma2.2")
    ),
    "encoded as sRGB after its colours were multiplied by alpha": lambda image: as_bytes(
        np.dstack([encoded(image[..., :3] / 255, "srgb"), image[..., 3] / 255])
    ),
    "decoded from sRGB": lambda image: np.dstack([decoded(image[..., :3] / 255), image[..., 3] / 255]),
    "upside down and straight, its colours divided by alpha": lambda image: as_bytes(
        sent(image[::-1] / 255, "straight", "none")
    ),
}


def as_bytes(numbers):
    return np.rint(255 * np.clip(numbers, 0, 1)).astype(np.uint8)


def decoded(code):
    return np.where(code <= 0.04045, code / 12.92, ((code + 0.055) / 1.055) ** 2.4)


@pytest.mark.parametrize("name", TURNS)
def test_an_image_that_would_be_inside_if_read_otherwise_is_recognised(name, drawn):
    canvas, acceptance = drawn
    found = vr.check(TURNS[name](canvas), acceptance)
    assert found.status == "outside"
    assert found.recognised.startswith(f"the image seems to be {name}: read so, every pixel lies inside")
    assert found.message.endswith(f"{found.recognised[1:]}.")


def test_a_word_that_would_put_the_image_inside_is_named_and_does(drawn):
    canvas, acceptance = drawn
    straight = as_bytes(sent(canvas / 255, "straight", "srgb"))
    found = vr.check(straight, acceptance)
    assert "(pass alpha='straight', encoding='srgb' if that is meant)" in found.message
    assert vr.check(straight, acceptance, alpha="straight", encoding="srgb").passed
    # And the other way round.
    back = vr.check(canvas, acceptance, alpha="straight")
    assert "(pass alpha='premultiplied' if that is meant)" in back.message


def test_a_turned_image_with_another_fault_is_still_recognised_and_a_plain_fault_is_not(drawn):
    canvas, acceptance = drawn
    turned = canvas[::-1].copy()
    turned[6, 8] = 255
    assert "upside down: read so, all but 1 pixels lie inside" in vr.check(turned, acceptance).message
    assert vr.check(np.minimum(canvas, 40), acceptance).recognised == ""


@pytest.mark.parametrize("name", ["upside down", "turned by 180 degrees", "BGR, not RGB"])
def test_a_large_image_is_recognised_as_a_small_one_is(name, drawn):
    image = np.tile(drawn[0], (21, 11, 1))[:-1]  # an odd number of rows
    image[:12] //= 2  # so that no turn leaves it as it is
    tiled = acceptance_of(image / 255, image / 255)
    assert image.size // 4 > 2 * readings.ENOUGH_PIXELS
    turned = TURNS[name](image).copy()
    found = vr.check(turned, tiled)
    assert found.recognised.startswith(f"the image seems to be {name}: read so, every pixel lies inside")
    turned[100, 50] = 255
    assert "read so, all but 1 pixels lie inside" in vr.check(turned, tiled).message


def test_an_image_of_another_size_is_refused_with_what_its_size_tells():
    acceptance = acceptance_of(np.zeros((2, 3, 4)), np.zeros((2, 3, 4)))
    sizes = {
        (
            4,
            6,
            4,
        ): "candidate must be 3 x 2 pixels as the scene, got 6 x 4; that is a device pixel ratio of 2",
        (3, 2, 4): "got 2 x 3; its axes are swapped",
        (5, 5, 4): "got 5 x 5; draw the scene at its own size",
    }
    for shape, sentence in sizes.items():
        with pytest.raises(vr.SceneError, match=sentence):
            vr.check(np.zeros(shape, np.uint8), acceptance)


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"candidate": np.zeros((2, 3, 2), np.uint8)}, "candidate must be an image .* got uint8 of shape"),
        ({"candidate": np.zeros((2, 3, 4), np.int64)}, "of uint8, uint16 or floats, got int64"),
        ({"candidate": np.zeros((0, 3, 4))}, "of shape"),
        ({"alpha": "additive"}, "alpha must be 'premultiplied' or 'straight' or 'ignored', got 'additive'"),
        ({"encoding": "linear"}, "encoding must be 'srgb' or 'gamma2.2' or 'none', got 'linear'"),
        (
            {"candidate": CLEAR[..., :3], "alpha": "straight"},
            "alpha must be 'ignored' for an image without alpha, got 'straight'",
        ),
        ({"mask": np.zeros((3, 2))}, "mask must be 3 x 2 pixels as the image, got 2 x 3"),
        ({"mask": 1.0}, "mask must be 3 x 2 pixels as the image, got one number"),
    ],
)
def test_what_cannot_be_judged_is_refused_in_one_sentence(given, sentence):
    acceptance = acceptance_of(np.zeros((2, 3, 4)), np.zeros((2, 3, 4)))
    with pytest.raises(vr.SceneError, match=sentence):
        vr.check(**{"candidate": CLEAR, "acceptance": acceptance, **given})


def test_what_is_not_a_number_is_outside_and_is_said():
    image = np.zeros((2, 3, 4))
    image[1, 2, 0], image[0, 1, 3] = np.inf, np.nan
    found = vr.check(image, acceptance_of(np.zeros((2, 3, 4)), np.ones((2, 3, 4))))
    assert np.argwhere(found.outside).tolist() == [[0, 1], [1, 2]]
    assert "the worst is pixel (1, 0), alpha nan, which is no number" in found.message


@pytest.mark.parametrize("no_number", [np.nan, np.inf, -np.inf])
def test_an_alpha_that_is_no_number_is_outside_whatever_its_colours_were_divided_by(no_number):
    image = np.full((2, 3, 4), 0.5)
    image[0, 1] = (0.5, 0.5, 0.0, no_number)
    found = vr.check(image, acceptance_of(np.zeros((2, 3, 4)), np.ones((2, 3, 4))), alpha="straight")
    assert np.argwhere(found.outside).tolist() == [[0, 1]]
    assert f"the worst is pixel (1, 0), alpha {no_number}, which is no number" in found.message
    plain = json.loads(json.dumps(found.as_dict(), allow_nan=False))
    assert (plain["worst"]["excess"], plain["worst"]["value"]) == (None, None)


def test_the_pixels_of_a_mask_are_left_out_of_everything(drawn, tmp_path):
    canvas, acceptance = drawn
    overlaid, mask = canvas.copy(), np.zeros(canvas.shape[:2], np.bool_)
    overlaid[2:4, 3:9] = 255
    mask[2:4, 3:9] = True
    assert not vr.check(overlaid, acceptance).passed
    found = vr.check(overlaid, acceptance, mask=mask)
    assert found.passed
    assert found.message.endswith("; 12 pixels are left out by the mask.")
    assert not found.judged[mask].any()
    assert (found.candidate == found.nominal)[mask].all()
    # Upside down, the mask lies where the overlay lies in the image.
    assert vr.check(overlaid[::-1], acceptance, mask=mask[::-1]).recognised.startswith(
        "the image seems to be u"
    )
    write_png(tmp_path / "mask.png", (255 * mask).astype(np.uint8))
    assert vr.check(overlaid, acceptance, mask=tmp_path / "mask.png").message == found.message
    nothing = vr.check(canvas, acceptance, mask=np.ones_like(mask))
    assert (nothing.status, nothing.passed) == ("not comparable", False)


def test_a_mask_in_colour_marks_what_is_neither_black_nor_transparent():
    acceptance = acceptance_of(np.zeros((1, 3, 4)), np.zeros((1, 3, 4)))
    mask = np.array([[[0, 0, 0, 255], [255, 0, 0, 0], [255, 0, 0, 255]]], np.uint8)
    assert vr.check(CLEAR[:1], acceptance, mask=mask).left_out.tolist() == [[False, False, True]]


def test_files_are_read_as_they_are(drawn, tmp_path):
    canvas, acceptance = drawn
    vr.write_image(tmp_path / "a.npy", canvas / 255)
    write_png(tmp_path / "rgba.png", canvas)
    write_png(tmp_path / "rgb.png", np.ascontiguousarray(canvas[..., :3]))
    vr.write_image(tmp_path / "a.exr", canvas / 255)
    for name in ("a.npy", "rgba.png", "rgb.png", "a.exr"):
        assert vr.check(tmp_path / name, acceptance).passed, name
        assert vr.check(str(tmp_path / name), acceptance).passed, name
    with pytest.raises(vr.FormatError, match=r"no\.png must be a file that exists"):
        vr.check(tmp_path / "no.png", acceptance)
    (tmp_path / "a.txt").write_text("no image")
    with pytest.raises(vr.FormatError, match="must end in"):
        vr.check(tmp_path / "a.txt", acceptance)


def test_a_grey_image_is_judged_in_its_three_channels():
    end = np.full((2, 2, 4), 80 / 255)
    assert vr.check(np.full((2, 2), 80, np.uint8), acceptance_of(end, end)).passed


def test_what_is_drawn_where_nothing_should_be_counts_as_drawn():
    acceptance = acceptance_of(np.zeros((2, 3, 4)), np.zeros((2, 3, 4)))
    assert vr.check(CLEAR, acceptance).message == "inside: nothing is to be drawn, and nothing is."
    image = CLEAR.copy()
    image[0, 0, 3] = 9
    assert "1 of 1 drawn pixels lie outside" in vr.check(image, acceptance).message


def test_what_only_coarse_filters_allow_passes_with_a_warning():
    end = np.full((2, 3, 4), 100 / 255)
    coarse = acceptance_of(end - 5 / 255, end + 5 / 255)
    asked = []

    def low_quality():
        asked.append(1)
        return coarse

    acceptance = acceptance_of(end, end, low_quality=low_quality)
    assert vr.check(np.full((2, 3, 4), 100, np.uint8), acceptance).status == "inside"
    assert asked == []  # dear, and not needed
    found = vr.check(np.full((2, 3, 4), 104, np.uint8), acceptance)
    assert (found.status, found.passed) == ("inside only with low-quality filtering", True)
    assert "linear filters of 4 bits" in found.message.lower()
    assert vr.check(np.full((2, 3, 4), 106, np.uint8), acceptance).status == "outside"


def test_intervals_of_no_use_let_nothing_pass_but_still_catch():
    acceptance = acceptance_of(np.zeros((1, 1, 4)), np.full((1, 1, 4), 0.9), advice="probe the device first")
    found = vr.check(np.full((1, 1, 4), 9, np.uint8), acceptance)
    assert (found.status, found.passed) == ("not comparable", False)
    assert found.message.endswith("Probe the device first.")
    assert vr.check(np.full((1, 1, 4), 255, np.uint8), acceptance).status == "outside"


def test_a_tolerance_that_somebody_chose_is_called_unjustified():
    image = np.full((2, 2, 4), 77, np.uint8)
    chosen = vr.Acceptance.unjustified(image, 2 / 255)
    for step, passed in ((0, True), (2, True), (-2, True), (3, False), (-3, False)):
        found = vr.check((image.astype(int) + step).astype(np.uint8), chosen)
        assert found.passed is passed
        assert found.status == f"{'inside' if passed else 'outside'} an unjustified tolerance"
        assert found.message.startswith(found.status)
    with pytest.raises(vr.SceneError, match="tolerance must be at least 0"):
        vr.Acceptance.unjustified(image, -1)


def test_a_tolerance_around_whole_numbers_of_unknown_range_is_refused():
    with pytest.raises(vr.errors.SceneError, match="image must be of uint8, uint16 or floats, got int64"):
        vr.Acceptance.unjustified(np.full((2, 2, 4), 100, np.int64), 0.1)


def test_the_cause_comes_after_the_verdict_and_the_verdict_is_plain_data(drawn):
    canvas, acceptance = drawn
    found = vr.check(canvas[:, ::-1], acceptance, cause="the camera is mirrored.")
    assert found.message.endswith("inside. The camera is mirrored.")
    assert str(found) == found.message
    assert not found
    plain = json.loads(json.dumps(found.as_dict(), allow_nan=False))
    assert plain["outside"] == np.count_nonzero(found.outside)
    assert (
        plain["metrics"]["max"]
        == found.metrics.max
        == np.abs(canvas[:, ::-1] / 255 - acceptance.nominal).max()
    )


def test_every_correct_image_of_a_program_is_inside():
    scene = example()
    acceptance = vr.accept(scene, "arbelaz2016", "swiftshader")
    image = vr.emulate(scene, "arbelaz2016", vr.Device.named("swiftshader")).rgba8
    found = vr.check(image, acceptance)
    assert found.passed, found
    assert found.metrics.identical
