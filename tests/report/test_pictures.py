import io

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given
from PIL import Image

from volref.image import decode_srgb
from volref.report.pictures import (
    NEUTRAL,
    VIRIDIS,
    color_map,
    distance_map,
    error_map,
    png_bytes,
    with_legend,
)


def lightness(codes):
    """CIE 1976 L* of 8-bit sRGB colours."""
    luminance = decode_srgb(codes / 255) @ (0.2126, 0.7152, 0.0722)
    return np.where(luminance > (6 / 29) ** 3, 116 * np.cbrt(luminance) - 16, luminance * (29 / 3) ** 3)


def test_the_colour_map_gets_lighter_evenly_so_that_it_can_be_read_in_grey():
    steps = np.diff(lightness(color_map(np.linspace(0, 1, 9))))
    # Even to a quarter: the map is a table of nine rounded colours.
    np.testing.assert_allclose(steps, steps.mean(), rtol=0.25)
    assert steps.sum() > 70


def test_the_colour_map_is_never_the_neutral_tone():
    colors = color_map(np.linspace(0, 1, 4096)).astype(int)
    # 25 of 255 in some channel: far more than the few codes that people can just tell apart.
    assert np.abs(colors - NEUTRAL).max(axis=1).min() > 25


def test_a_colour_lies_between_its_two_neighbours_in_the_table():
    between = color_map(np.array(1.5 / 8))
    np.testing.assert_array_equal(between, np.rint((VIRIDIS[1] + VIRIDIS[2]) / 2))


def test_the_nearest_surface_is_yellow_and_no_surface_is_neutral():
    picture = distance_map(np.array([[10.0, np.inf], [30.0, 20.0]]), "mm")
    assert picture.colors[0, 0].tolist() == VIRIDIS[-1].tolist()
    assert picture.colors[1, 0].tolist() == VIRIDIS[0].tolist()
    assert picture.colors[0, 1].tolist() == list(NEUTRAL)
    assert picture.ticks == ((0.0, "30"), (0.5, "20"), (1.0, "10"))
    assert (picture.unit, picture.neutral) == ("mm", "no surface")


def test_a_map_without_a_surface_has_no_scale():
    picture = distance_map(np.full((2, 3), np.inf))
    assert (picture.colors == NEUTRAL).all()
    assert picture.ticks == ()


def test_surfaces_at_one_distance_have_one_tick():
    picture = distance_map(np.full((2, 2), 5.0))
    assert (picture.colors == VIRIDIS[-1]).all()
    assert picture.ticks == ((1.0, "5"),)
    assert picture.neutral == ""


def test_the_error_scale_has_a_colour_for_each_decade():
    levels = np.array([[1e-4, 1e-3, 1e-2, 1e-1, 1.0]])
    picture = error_map(levels / 255)
    np.testing.assert_array_equal(picture.colors[0], VIRIDIS[::2])
    assert [word for _, word in picture.ticks] == ["0.0001", "0.001", "0.01", "0.1", "1"]


def test_the_error_scale_ends_at_the_power_of_ten_above():
    assert error_map(np.array([[0.3, 0.04]]) / 255).ticks[-1] == (1.0, "1")
    assert error_map(np.array([[3.0, 0.04]]) / 255).ticks[-1] == (1.0, "10")


@pytest.mark.parametrize("exponent", range(-12, 3))
def test_a_whole_power_of_ten_ends_its_own_scale(exponent):
    assert float(error_map(np.array([[10.0**exponent / 255]])).ticks[-1][1]) == 10.0**exponent


def test_an_image_without_error_is_neutral():
    picture = error_map(np.zeros((3, 2)))
    assert (picture.colors == NEUTRAL).all()
    assert (picture.ticks, picture.neutral) == ((), "error 0")


@given(st.lists(st.floats(1e-6, 1e-2), min_size=1, max_size=8))
def test_ten_times_the_error_is_the_same_picture_with_other_ticks(errors):
    bound = np.array([errors])
    one, ten = error_map(bound), error_map(bound * 10)
    # One code: log10 of ten times a number is off by an ulp, which may turn a rounding.
    assert np.abs(one.colors.astype(int) - ten.colors).max() <= 1
    assert float(ten.ticks[-1][1]) == pytest.approx(10 * float(one.ticks[-1][1]))


def test_the_legend_stands_below_the_map_and_shows_the_whole_scale():
    picture = error_map(np.geomspace(1e-5, 1e-2, 200 * 100).reshape(100, 200))
    drawn = with_legend(picture)
    np.testing.assert_array_equal(drawn[:100], picture.colors)
    strip = drawn[100:].reshape(-1, 3)
    assert drawn.shape[1] == 200
    for color in (VIRIDIS[0], VIRIDIS[-1]):
        assert (strip == color).all(axis=1).any()


@pytest.mark.parametrize("width", [1, 7, 40])
def test_the_legend_of_a_tiny_image_is_as_wide_as_the_image(width):
    assert with_legend(distance_map(np.arange(1.0, width + 1)[None])).shape[1] == width


def test_a_png_gives_its_codes_back():
    codes = np.random.default_rng(1).integers(0, 256, (5, 7, 4), np.uint8)
    with Image.open(io.BytesIO(png_bytes(codes))) as image:
        np.testing.assert_array_equal(np.asarray(image), codes)
