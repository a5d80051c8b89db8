import dataclasses
import json
import math
import re
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from tests.oracles.image_metrics import (
    delta_e_2000_of_greys,
    lightness_of_grey_code,
    percentile,
    ssim_by_loop,
)
from volref.errors import SceneError
from volref.oracle.metrics import (
    LEVEL,
    compare,
    delta_e_2000,
    difference_image,
    structural_similarity,
)

# Sharma, Wu and Dalal (2005), table 1: L*, a*, b* of two colours, Delta E 2000.  Pair 14 has its own test.
SHARMA = [
    (50.0000, 2.6772, -79.7751, 50.0000, 0.0000, -82.7485, 2.0425),
    (50.0000, 3.1571, -77.2803, 50.0000, 0.0000, -82.7485, 2.8615),
    (50.0000, 2.8361, -74.0200, 50.0000, 0.0000, -82.7485, 3.4412),
    (50.0000, -1.3802, -84.2814, 50.0000, 0.0000, -82.7485, 1.0000),
    (50.0000, -1.1848, -84.8006, 50.0000, 0.0000, -82.7485, 1.0000),
    (50.0000, -0.9009, -85.5211, 50.0000, 0.0000, -82.7485, 1.0000),
    (50.0000, 0.0000, 0.0000, 50.0000, -1.0000, 2.0000, 2.3669),
    (50.0000, -1.0000, 2.0000, 50.0000, 0.0000, 0.0000, 2.3669),
    (50.0000, 2.4900, -0.0010, 50.0000, -2.4900, 0.0009, 7.1792),
    (50.0000, 2.4900, -0.0010, 50.0000, -2.4900, 0.0010, 7.1792),
    (50.0000, 2.4900, -0.0010, 50.0000, -2.4900, 0.0011, 7.2195),
    (50.0000, 2.4900, -0.0010, 50.0000, -2.4900, 0.0012, 7.2195),
    (50.0000, -0.0010, 2.4900, 50.0000, 0.0009, -2.4900, 4.8045),
    (50.0000, -0.0010, 2.4900, 50.0000, 0.0011, -2.4900, 4.7461),
    (50.0000, 2.5000, 0.0000, 50.0000, 0.0000, -2.5000, 4.3065),
    (50.0000, 2.5000, 0.0000, 73.0000, 25.0000, -18.0000, 27.1492),
    (50.0000, 2.5000, 0.0000, 61.0000, -5.0000, 29.0000, 22.8977),
    (50.0000, 2.5000, 0.0000, 56.0000, -27.0000, -3.0000, 31.9030),
    (50.0000, 2.5000, 0.0000, 58.0000, 24.0000, 15.0000, 19.4535),
    (50.0000, 2.5000, 0.0000, 50.0000, 3.1736, 0.5854, 1.0000),
    (50.0000, 2.5000, 0.0000, 50.0000, 3.2972, 0.0000, 1.0000),
    (50.0000, 2.5000, 0.0000, 50.0000, 1.8634, 0.5757, 1.0000),
    (50.0000, 2.5000, 0.0000, 50.0000, 3.2592, 0.3350, 1.0000),
    (60.2574, -34.0099, 36.2677, 60.4626, -34.1751, 39.4387, 1.2644),
    (63.0109, -31.0961, -5.8663, 62.8187, -29.7946, -4.0864, 1.2630),
    (61.2901, 3.7196, -5.3901, 61.4292, 2.2480, -4.9620, 1.8731),
    (35.0831, -44.1164, 3.7933, 35.0232, -40.0716, 1.5901, 1.8645),
    (22.7233, 20.0904, -46.6940, 23.0331, 14.9730, -42.5619, 2.0373),
    (36.4612, 47.8580, 18.3852, 36.2715, 50.5065, 21.2231, 1.4146),
    (90.8027, -2.0831, 1.4410, 91.1528, -1.6435, 0.0447, 1.4441),
    (90.9257, -0.5406, -0.9208, 88.6381, -0.8985, -0.7239, 1.5381),
    (6.7747, -0.2908, -2.4247, 5.8714, -0.0985, -2.2286, 0.6377),
    (2.0776, 0.0795, -1.1350, 0.9033, -0.0636, -0.5514, 0.9082),
]

# The table has 4 decimals, so half a unit of the last; 1e-9 for the arithmetic.
SHARMA_TOLERANCE = 0.5e-4 + 1e-9

# colour-science has the sRGB matrix of IEC 61966-2-1, rounded to 4 decimals: a grey keeps a chroma of at most
# 0.013 after the factor 1 + G of the formula, which adds 0.013^2 / (2 x 5) to a Delta E of 5 or more.
GREY_TOLERANCE = 2e-5

# A sum of 121 terms of at most 1 is off by at most 121 x 2^-53; the variances lose that much to cancellation
# and are divided by C2 = 9e-4: 5 such terms give 8e-11.
SSIM_TOLERANCE = 1e-10

IMAGES = st.tuples(st.integers(1, 13), st.integers(1, 13)).flatmap(
    lambda size: st.tuples(*(arrays(np.float64, (*size, 4), elements=st.floats(0, 2)) for _ in range(2)))
)


def noise(*shape, seed=1):
    return np.random.default_rng(seed).random(shape)


def premultiplied_noise(height, width, seed=1):
    image = noise(height, width, 4, seed=seed)
    image[..., :3] *= image[..., 3:]
    return image


# --- laws


@pytest.mark.parametrize("shape", [(12, 14), (12, 14, 3), (12, 14, 4), (1, 1, 4)])
@pytest.mark.parametrize("encoding", ["linear", "srgb"])
def test_an_image_compared_with_itself_is_perfect(shape, encoding):
    found = compare(noise(*shape), noise(*shape), encoding=encoding)
    assert found.identical
    assert (found.max, found.rms, found.p50, found.p95, found.p99, found.share_above_level) == (0,) * 6
    assert found.psnr == math.inf
    assert found.ssim == (1.0 if shape[0] >= 11 else None)
    nothing = None if len(shape) == 2 else 0.0
    assert (found.delta_e_mean, found.delta_e_p95, found.delta_e_max) == (nothing,) * 3


@given(IMAGES)
@settings(max_examples=60, deadline=None)
def test_exchanging_the_images_changes_nothing_but_the_order_of_the_worst_values(pair):
    a, b = pair
    there, back = compare(a, b), compare(b, a)
    exact = [name for name in there.as_dict() if not name.startswith(("delta_e", "worst_values"))]
    assert [there.as_dict()[name] for name in exact] == [back.as_dict()[name] for name in exact]
    assert there.worst_values == back.worst_values[::-1]


def test_delta_e_does_not_depend_on_the_order_of_the_images():
    a, b = premultiplied_noise(12, 12, seed=1), premultiplied_noise(12, 12, seed=2)
    there, back = compare(a, b), compare(b, a)
    # Only rounding in a formula of some 50 operations on numbers of about 100; none of these pairs of hues
    # is exactly opposite, where the formula jumps (see the test of Sharma's pair 14).
    assert there.delta_e_mean == pytest.approx(back.delta_e_mean, rel=1e-12)
    assert there.delta_e_max == pytest.approx(back.delta_e_max, rel=1e-12)


@given(IMAGES)
@settings(max_examples=60, deadline=None)
def test_the_measures_are_in_their_natural_order(pair):
    found = compare(*pair)
    assert 0 <= found.p50 <= found.p95 <= found.p99 <= found.max
    assert 0 <= found.rms <= found.max * (1 + 1e-12)  # a mean of squares of at most max, rounded
    assert found.ssim is None or found.ssim <= 1 + SSIM_TOLERANCE
    assert found.identical == (pair[0] == pair[1]).all()


@given(IMAGES)
@settings(max_examples=30, deadline=None)
def test_turning_both_images_upside_down_changes_no_difference(pair):
    upright, turned = compare(*pair), compare(*(image[::-1] for image in pair))
    for name in ("max", "p50", "p95", "p99", "share_above_level"):
        assert getattr(upright, name) == getattr(turned, name)


# --- each measure against a slow formula


def test_differences_and_percentiles_are_those_of_a_loop_over_the_pixels():
    a, b = noise(5, 7, 4, seed=3), noise(5, 7, 4, seed=4)
    found = compare(a, b)
    largest = [
        max(abs(p - q) for p, q in zip(first, second, strict=True))
        for first, second in zip(a.reshape(-1, 4).tolist(), b.reshape(-1, 4).tolist(), strict=True)
    ]
    squares = [(p - q) ** 2 for p, q in zip(a.ravel().tolist(), b.ravel().tolist(), strict=True)]
    assert found.max == max(largest)  # exact: the same subtraction
    # 140 terms, each off by 2^-53 relative: 2e-14, and the logarithm adds no more.
    assert found.rms == pytest.approx(math.sqrt(sum(squares) / len(squares)), rel=1e-13)
    assert found.psnr == pytest.approx(10 * math.log10(len(squares) / sum(squares)), rel=1e-12)
    for part, got in ((0.5, found.p50), (0.95, found.p95), (0.99, found.p99)):
        assert got == pytest.approx(percentile(largest, part), rel=1e-15)  # one interpolation, 4 ulp
    assert found.share_above_level == sum(one > LEVEL for one in largest) / len(largest)


@pytest.mark.parametrize(("height", "width"), [(11, 11), (12, 15)])
def test_ssim_is_that_of_a_loop_over_windows(height, width):
    a = noise(height, width, 1, seed=5)
    b = np.clip(a + 0.2 * (noise(height, width, 1, seed=6) - 0.5), 0, 1)
    expected = ssim_by_loop(a[..., 0].tolist(), b[..., 0].tolist())
    assert 0.5 < expected < 0.99  # a case that says something
    assert structural_similarity(a, b) == pytest.approx(expected, abs=SSIM_TOLERANCE)


def test_ssim_of_colours_is_the_mean_over_the_channels():
    a, b = noise(11, 12, 3, seed=7), noise(11, 12, 3, seed=8)
    each = [ssim_by_loop(a[..., k].tolist(), b[..., k].tolist()) for k in range(3)]
    found = compare(a, b, encoding="srgb")
    assert found.ssim == pytest.approx(sum(each) / 3, abs=SSIM_TOLERANCE)


def test_ssim_of_two_flat_images_is_its_luminance_term():
    a, b = np.full((11, 11), 0.3), np.full((11, 11), 0.6)
    expected = (2 * 0.3 * 0.6 + 1e-4) / (0.3**2 + 0.6**2 + 1e-4)
    assert compare(a, b, encoding="srgb").ssim == pytest.approx(expected, abs=SSIM_TOLERANCE)


def test_every_pixel_of_an_image_counts_in_ssim():
    flat = np.full((13, 12, 3), 0.5)
    for y, x in np.ndindex(13, 12):
        other = flat.copy()
        other[y, x] = 0.9
        assert compare(flat, other, encoding="srgb").ssim < 1


@pytest.mark.parametrize("pair", SHARMA)
def test_delta_e_2000_is_that_of_the_published_pairs(pair):
    got = delta_e_2000(np.array(pair[:3]), np.array(pair[3:6]))
    assert float(got) == pytest.approx(pair[6], abs=SHARMA_TOLERANCE)


def test_delta_e_2000_of_exactly_opposite_hues_is_one_of_its_two_limits():
    # Pair 14: the hues differ by 180 degrees up to the last bit of atan2, and the formula jumps there.  The
    # table has 4.8045; its neighbours 13 and 15 have 4.8045 and 4.7461.
    got = float(delta_e_2000(np.array([50, -0.001, 2.49]), np.array([50, 0.001, -2.49])))
    assert min(abs(got - 4.8045), abs(got - 4.7461)) <= SHARMA_TOLERANCE


@pytest.mark.parametrize(("code_a", "code_b"), [(0.0, 1.0), (0.2, 0.3), (0.02, 0.5)])
def test_delta_e_of_grey_code_values_is_the_lightness_term(code_a, code_b):
    a, b = np.full((1, 2, 3), code_a), np.full((1, 2, 3), code_b)
    expected = delta_e_2000_of_greys(lightness_of_grey_code(code_a), lightness_of_grey_code(code_b))
    found = compare(a, b, encoding="srgb")
    assert found.delta_e_mean == pytest.approx(expected, abs=GREY_TOLERANCE)
    assert found.delta_e_max == pytest.approx(expected, abs=GREY_TOLERANCE)


def test_linear_light_is_encoded_before_it_is_judged():
    light = [((code + 0.055) / 1.055) ** 2.4 for code in (0.2, 0.3)]
    a, b = (np.full((11, 11, 3), value) for value in light)
    expected = delta_e_2000_of_greys(lightness_of_grey_code(0.2), lightness_of_grey_code(0.3))
    found = compare(a, b)
    assert found.delta_e_mean == pytest.approx(expected, abs=GREY_TOLERANCE)
    luminance = (2 * 0.2 * 0.3 + 1e-4) / (0.2**2 + 0.3**2 + 1e-4)
    assert found.ssim == pytest.approx(luminance, abs=SSIM_TOLERANCE)


@pytest.mark.parametrize("encoding", ["linear", "srgb"])
def test_a_difference_in_alpha_alone_is_seen_over_middle_grey(encoding):
    clear, black = np.zeros((11, 11, 4)), np.zeros((11, 11, 4))
    black[..., 3] = 1
    expected = delta_e_2000_of_greys(lightness_of_grey_code(0.5), 0.0)
    found = compare(clear, black, encoding=encoding)
    assert found.delta_e_mean == pytest.approx(expected, abs=GREY_TOLERANCE)
    assert found.ssim == pytest.approx(1e-4 / (0.5**2 + 1e-4), abs=SSIM_TOLERANCE)


def test_delta_e_leaves_out_the_pixels_that_are_clear_in_both_images():
    a, b = np.zeros((10, 10, 4)), np.zeros((10, 10, 4))
    a[0, 0], b[0, 1] = (1, 1, 1, 1), (1, 1, 1, 1)
    found = compare(a, b)
    expected = delta_e_2000_of_greys(100.0, lightness_of_grey_code(0.5))
    assert found.delta_e_mean == pytest.approx(expected, abs=GREY_TOLERANCE)
    assert found.delta_e_mean == found.delta_e_p95 == found.delta_e_max
    assert compare(np.zeros((2, 2, 4)), np.zeros((2, 2, 4))).delta_e_max == 0


def test_every_pixel_of_a_large_image_has_its_delta_e():
    a = premultiplied_noise(130, 130) * 0.5 + 0.25  # 16900 pixels: more than are taken at once
    b = a + noise(130, 130, 1, seed=2) / 8
    whole = compare(a, b, encoding="srgb")
    halves = [compare(a[rows], b[rows], encoding="srgb") for rows in (slice(65), slice(65, None))]
    # Sums of as many terms in another order: 16900 x 2^-53.
    assert whole.delta_e_mean == pytest.approx(sum(half.delta_e_mean for half in halves) / 2, rel=2e-12)
    assert whole.delta_e_max == max(half.delta_e_max for half in halves)


def test_what_a_display_cannot_show_differs_in_numbers_only():
    bright, brighter = np.full((11, 11, 3), 1.5), np.full((11, 11, 3), 2.0)
    found = compare(bright, brighter)
    assert (found.max, found.ssim, found.delta_e_max) == (0.5, 1.0, 0.0)


# --- where, and how many


def test_the_worst_pixel_is_named_by_column_row_and_channel():
    a = np.zeros((3, 5, 4))
    b = a.copy()
    b[1, 4, 2] = 0.25
    found = compare(a, b)
    assert (found.worst_pixel, found.worst_channel, found.worst_values) == ((4, 1), "blue", (0.0, 0.25))
    assert "pixel (4, 1) blue: 0 and 0.25" in str(found)


@given(st.integers(0, 254))
def test_neighbouring_8_bit_levels_are_not_above_one_level_and_two_levels_are(code):
    def share(step):
        return compare([[code / 255]], [[(code + step) / 255]], encoding="srgb").share_above_level

    assert share(1) == 0
    assert share(2) == 1


def test_differences_too_small_to_square_still_count():
    a, b = np.zeros((2, 2)), np.full((2, 2), 1e-200)
    found = compare(a, b)
    assert found.rms == 1e-200  # exact: the mean of ones, scaled
    assert found.psnr == pytest.approx(4000, rel=1e-15)


def test_the_difference_image_is_the_largest_channel_difference():
    a, b = noise(3, 4, 4, seed=9), noise(3, 4, 4, seed=10)
    expected = [
        [max(abs(p - q) for p, q in zip(*pq, strict=True)) for pq in zip(*rows, strict=True)]
        for rows in zip(a.tolist(), b.tolist(), strict=True)
    ]
    assert difference_image(a, b).tolist() == expected


# --- what people and programs read


@pytest.mark.parametrize("shape", [(2, 3), (12, 12, 4)])
def test_the_record_is_valid_json_also_for_equal_images(shape):
    for other in (noise(*shape), noise(*shape, seed=2)):
        found = compare(noise(*shape), other)
        read = json.loads(json.dumps(found.as_dict(), allow_nan=False))
        assert read["identical"] == found.identical
        assert read["psnr"] == (None if found.identical else found.psnr)
        assert read["worst_pixel"] == list(found.worst_pixel)


def test_the_table_has_one_line_per_measure_and_says_what_is_missing():
    small = str(compare(noise(2, 3), noise(2, 3, seed=2)))
    assert "needs 11 x 11 pixels" in small
    assert "Delta E" not in small
    large = str(compare(noise(12, 12, 4), noise(12, 12, 4, seed=2)))
    for name in ("largest difference", "RMS", "PSNR", "SSIM", "Delta E 2000", "pixels above 1/255"):
        assert len(re.findall(f"^{name} ", large, re.MULTILINE)) == 1
    assert "the images are identical" in str(compare(noise(2, 3), noise(2, 3)))


def test_a_comparison_cannot_be_changed():
    found = compare([[0.0]], [[1.0]])
    with pytest.raises(dataclasses.FrozenInstanceError):
        found.max = 0.0


# --- bad input


@pytest.mark.parametrize(
    ("a", "b", "words"),
    [
        (np.zeros((4, 4, 4)), np.zeros((5, 4, 4)), "one size .* 4 x 4 x 4 and 5 x 4 x 4; render both alike"),
        (np.zeros((4, 4, 4)), np.zeros((4, 4, 3)), "as many channels"),
        (np.zeros((4, 4, 2)), np.zeros((4, 4, 2)), "image a must have at least one pixel and 1, 3 or 4"),
        (np.zeros((0, 4, 4)), np.zeros((0, 4, 4)), "at least one pixel"),
        (np.zeros(4), np.zeros(4), "image a must have shape"),
        (np.zeros((1, 2, 3, 4)), np.zeros((1, 2, 3, 4)), "image a must have shape"),
        ([[0.0]], [[math.nan]], "image b must be finite, got nan at index"),
        ([[math.inf]], [[0.0]], "image a must be finite"),
        ([[1e305]], [[0.0]], "image a must lie within 1e\\+300 of 0"),
        ([[1.0], [1.0, 2.0]], [[0.0]], "image a must be an array, got rows of different lengths"),
        ([["x"]], [[0.0]], "image a must be numbers"),
        (None, [[0.0]], "image a must"),
    ],
)
def test_images_that_cannot_be_compared_are_refused_with_one_sentence(a, b, words):
    with pytest.raises(SceneError, match=words) as refusal:
        compare(a, b)
    assert "; " in str(refusal.value)
    assert "\n" not in str(refusal.value)


def test_an_unknown_encoding_is_refused():
    with pytest.raises(SceneError, match="encoding must be 'linear' or 'srgb', got 'gamma'"):
        compare([[0.0]], [[0.0]], encoding="gamma")


def test_importing_colour_makes_no_warning_without_matplotlib_either():
    # colour-science warns then, and a warning is an error here.
    program = (
        "import sys; sys.modules['matplotlib'] = None; from volref.oracle.metrics import import_colour; "
    )
    program += "print(import_colour().__name__)"
    words = [sys.executable, "-W", "error", "-c", program]
    assert subprocess.run(words, capture_output=True, text=True, check=True).stdout == "colour\n"


def test_importing_colour_leaves_numpys_print_options_alone():
    program = (
        "import numpy as np; before = np.get_printoptions(); "
        "from volref.oracle.metrics import import_colour; import_colour(); "
        "assert np.get_printoptions() == before"
    )
    subprocess.run([sys.executable, "-c", program], check=True)
