"""The criteria of the public experiment, each against a case that is computed by hand."""

import math
import statistics
from importlib.util import find_spec

import numpy as np
import pytest

from data_gen.why_intervals import fuzzy, measures, mismatches
from data_gen.why_intervals.criteria import CRITERIA, RISES
from data_gen.why_intervals.measures import ALL, measured

COUNTERS = [mismatches.counted_by_port, *([mismatches.counted_by_node] if mismatches.node_is_there() else [])]


def grey(level, size=16):
    return np.full((size, size, 3), level, np.uint8)


@pytest.mark.parametrize("counted", COUNTERS)
def test_pixelmatch_finds_greys_different_from_27_on_at_a_threshold_of_a_tenth(counted):
    # Delta is 0.5053 d^2 for greys d apart, and may be 35215 0.1^2 = 352: d = 26.4.
    apart = [grey(level) for level in (100, 126, 127)]
    assert counted(grey(100), apart, (0.1, 0.2)) == [(0, 0), (0, 0), (256, 0)]


@pytest.mark.parametrize("counted", COUNTERS)
def test_pixelmatch_takes_one_odd_pixel_on_an_edge_for_antialiasing_as_its_authors_do(counted):
    edge = grey(0)
    edge[:, 8:] = 255
    smoothed = edge.copy()
    smoothed[4, 8] = 128
    assert counted(edge, [smoothed], (0.1,)) == [(0,)]


def test_ssim_of_flat_images_is_that_of_their_means():
    c1 = (0.01 * 255) ** 2
    expected = (2 * 100 * 150 + c1) / (100**2 + 150**2 + c1)
    assert measures.structural_similarity(grey(100), grey(150)) == pytest.approx(expected, rel=1e-12)


def test_psnr_of_images_10_apart_is_that_of_their_mean_square():
    expected = 10 * math.log10(255**2 / 10**2)
    assert measures.peak_signal_to_noise(grey(100), grey(110)) == pytest.approx(expected, rel=1e-12)
    assert measures.peak_signal_to_noise(grey(100), grey(100)) == 100.0


def test_flip_of_flat_greys_is_their_distance_in_lightness_as_its_paper_maps_it():
    # Andersson et al. 2020: flat images have no features, and no filter changes them; two greys differ in L*
    # alone.  The distance to the power of 0.7 is mapped to 0..0.95 up to 0.4 of the largest there is, which
    # lies between green and blue.
    def lightness(code):
        light = ((code / 255 + 0.055) / 1.055) ** 2.4
        return 116 * light ** (1 / 3) - 16

    apart = abs(lightness(140) - lightness(120)) ** 0.7
    assert measures.mean_flip(grey(120), grey(140)) == pytest.approx(0.95 * apart / (0.4 * LARGEST), rel=1e-3)
    assert measures.mean_flip(grey(120), grey(120)) == 0.0


def _hunt(color):
    """CIE L*a*b*, its a and b scaled by L / 100, of linear sRGB by D65."""
    to_xyz = np.array(
        [
            [10135552 / 24577794, 8788810 / 24577794, 4435075 / 24577794],
            [2613072 / 12288897, 8788810 / 12288897, 887015 / 12288897],
            [1425312 / 73733382, 8788810 / 73733382, 70074185 / 73733382],
        ]
    )
    x, y, z = (to_xyz @ color) / (to_xyz @ np.ones(3))

    def f(t):
        return t ** (1 / 3) if t > (6 / 29) ** 3 else t / (3 * (6 / 29) ** 2) + 4 / 29

    lightness = 116 * f(y) - 16
    return lightness, 0.01 * lightness * 500 * (f(x) - f(y)), 0.01 * lightness * 200 * (f(y) - f(z))


def _largest():
    (l1, a1, b1), (l2, a2, b2) = _hunt(np.array([0.0, 1.0, 0.0])), _hunt(np.array([0.0, 0.0, 1.0]))
    return (abs(l1 - l2) + math.hypot(a1 - a2, b1 - b2)) ** 0.7


LARGEST = _largest()


def test_fuzzy_comparison_adds_up_fourth_powers_of_what_is_above_4():
    # One channel 104 too bright on 12 x 9 pixels: 100 / 251 to the fourth power on the 10 x 7 that count.
    dark = np.zeros((9, 12, 3), np.uint8)
    bright = dark.copy()
    bright[..., 1] = 104
    assert fuzzy.fuzzy_difference(dark, bright) == pytest.approx(70 * (100 / 251) ** 4, rel=1e-12)


def test_fuzzy_comparison_overflows_as_the_original_does():
    # Black and white are 3 251^2 apart, whose square is kept modulo 2^32.
    squared = 3 * 251**2
    expected = 7 * 7 * (squared**2 % 2**32) / 251**4
    assert fuzzy.fuzzy_difference(grey(0, 9), grey(255, 9)) == pytest.approx(expected, rel=1e-12)


def test_fuzzy_comparison_does_not_see_a_picture_that_is_one_pixel_off():
    picture = np.random.default_rng(3).integers(0, 256, (20, 20, 3)).astype(np.uint8)
    assert fuzzy.fuzzy_difference(picture, np.roll(picture, 1, axis=1)) < 0.05


def test_fuzzy_comparison_rounds_between_blurring_along_x_and_along_y():
    # 255 becomes 25.5 -> 26, 204, 26 along x; along y 2.6 -> 3, 20.8 -> 21 and 20.4 -> 20, 163.2 -> 163.
    point = np.zeros((5, 5, 3), np.uint8)
    point[2, 2] = 255
    assert fuzzy._blurred(point)[1:4, 1:4, 0].tolist() == [[3, 20, 3], [21, 163, 21], [3, 20, 3]]


def test_fuzzy_comparison_takes_random_numbers_only_where_it_needs_them():
    stream = fuzzy._Stream()
    assert fuzzy._nearest(stream, grey(7)[0, 0], grey(7), 3, 3, 0) == 0
    assert stream.at == 0
    # Nothing equals it: all 32 places of two numbers each are tried.
    assert fuzzy._nearest(stream, grey(200)[0, 0], grey(7), 3, 3, 10**6) == 3 * 189**2
    assert stream.at == 64


def test_correlation_counts_alpha_as_vispy_does():
    ours, theirs = grey(0, 2), grey(0, 2)
    ours[0, 0] = (10, 20, 30)
    theirs[0, 1] = (60, 0, 0)
    expected = statistics.correlation(
        [10, 20, 30, 255, 0, 0, 0, 255, 0, 0, 0, 255, 0, 0, 0, 255],
        [0, 0, 0, 255, 60, 0, 0, 255, 0, 0, 0, 255, 0, 0, 0, 255],
    )
    assert measures.correlation(ours, theirs) == pytest.approx(expected, rel=1e-12)


def test_rms_does_not_overflow_bytes():
    assert measures.root_mean_square(grey(250), grey(3)) == 247.0


def test_idiff_lets_four_codes_pass_and_counts_five():
    image = grey(100)
    image[0, 0, 1], image[0, 1, 2] = 104, 105
    assert measures.share_above(grey(100), image) == 1 / 256


def test_the_largest_difference_is_of_a_channel():
    image = grey(100)
    image[3, 4] = (93, 107, 90)
    assert measures.largest(grey(100), image) == 10.0


def test_measures_are_had_by_name():
    names = ("max", "mismatch_strict", "rms")
    (row,) = measured(grey(100), [grey(127)], names)
    assert row == {"max": 27.0, "mismatch_strict": 1.0, "rms": 27.0}


EQUAL = dict.fromkeys(ALL, 0.0) | {"ssim": 1.0, "psnr": 100.0, "correlation": 1.0}


def test_an_image_that_equals_its_golden_passes_everywhere():
    assert all(criterion.passes(EQUAL) for criterion in CRITERIA)


@pytest.mark.parametrize(
    ("name", "changed", "passes"),
    [
        ("vispy", {"correlation": 0.899}, False),
        ("ANARI CTS", {"ssim": 0.71, "psnr": 20.1}, True),
        ("ANARI CTS", {"ssim": 0.7, "psnr": 50.0}, False),
        ("ANARI CTS", {"ssim": 0.9, "psnr": 20.0}, False),
        ("vtk.js", {"mismatch_strict": 0.049}, True),
        ("vtk.js", {"mismatch_strict": 0.05}, False),
        ("Babylon.js", {"mismatch_strict": 0.025}, True),
        ("three.js", {"mismatch_strict": 0.003}, False),
        ("Playwright", {"mismatch_playwright": 1 / 9216}, False),
        ("VTK", {"vtk": 0.051}, False),
        ("dEQP", {"fuzzy": 0.051}, False),
        ("wgpu", {"flip": 0.01}, True),
        ("pytest-mpl", {"rms": 2.0}, True),
        ("Blender", {"above_blender": 0.01}, True),
        ("WebGPU CTS", {"max": 8.0}, False),
        ("pygfx", {"max": 1.0}, True),
        ("pygfx", {"max": 2.0}, False),
        ("matplotlib", {"max": 1.0}, False),
    ],
)
def test_thresholds_are_on_the_side_that_the_project_has_them(name, changed, passes):
    criterion = next(one for one in CRITERIA if one.name == name)
    assert criterion.passes(EQUAL | changed) == passes


def test_every_measure_is_judged_by_a_criterion():
    assert set(RISES) == set(ALL)


# VTK is not among what the tests need.
ZERO_IF_EQUAL = ["flip", "mismatch_strict", "rms", *(["vtk"] if find_spec("vtkmodules") else [])]


@pytest.mark.parametrize("name", ZERO_IF_EQUAL)
def test_equal_images_measure_0_and_mirrored_ones_more_than_criteria_allow(name, capfd):
    picture = np.repeat(np.repeat(np.random.default_rng(1).integers(0, 256, (8, 8, 3)), 8, 0), 8, 1)
    picture = picture.astype(np.uint8)
    (same, mirrored) = measured(picture, [picture, picture[::-1]], (name,))
    assert same[name] == 0.0
    assert mirrored[name] > 0.05
    assert capfd.readouterr().out == ""
