import json
from itertools import pairwise

import numpy as np
import pytest

from volref.report.verdicts.views import (
    ABOVE,
    BELOW,
    BOTH,
    SCALES,
    SIGNED,
    difference_of,
    difference_picture,
    interval_picture,
    palette,
    scale_of,
    shown,
)


def test_the_difference_of_a_pixel_is_that_of_its_worst_channel_with_its_sign():
    candidate = np.array([[[0.2, 0.4, 0.6, 0.8], [0.0, 0.0, 0.0, 1.0]]])
    nominal = candidate + np.array([[[1, -3, 2, 0], [0, 0, 0.5, -0.25]]]) / 255
    # differences of numbers below 1, times 255
    np.testing.assert_allclose(difference_of(candidate, nominal), [[3, -0.5]], rtol=1e-12)


def test_what_is_no_number_differs_by_everything():
    candidate = np.array([[[np.nan, 0, 0, 0], [0, -np.inf, 0, 0]]])
    assert difference_of(candidate, np.zeros((1, 2, 4))).tolist() == [[255, -255]]
    assert shown(candidate)[0, 0].tolist() == [0, 0, 0]


@pytest.mark.parametrize(("largest", "scale"), [(0, 1), (1, 1), (1.01, 4), (16, 16), (65, 255), (400, 255)])
def test_the_scale_is_the_shortest_that_holds_the_largest_difference(largest, scale):
    assert scale_of(np.array([-largest, 0.0])) == scale_of(np.array([largest])) == scale


def test_larger_differences_of_either_sign_are_brighter():
    for side in (-1, 1):
        ramp = difference_picture(side * np.linspace(0, 16, 33)[None], 16)[0].astype(int).sum(axis=-1)
        assert all(a < b for a, b in pairwise(ramp))
    blue, orange = difference_picture(np.array([[-16.0, 16.0]]), 16)[0].astype(int)
    assert blue[2] > blue[0]
    assert orange[0] > orange[2]


def test_pixels_outside_are_coloured_by_their_side_and_no_others():
    lo, hi = np.full((1, 5, 4), 0.4), np.full((1, 5, 4), 0.6)
    candidate = np.full((1, 5, 4), 0.5)
    candidate[0, 0, 0], candidate[0, 1, 3] = 0.0, 1.0
    candidate[0, 2, :2] = 0.0, 1.0
    candidate[0, 3, 0] = 0.61
    picture = interval_picture(candidate, lo, hi, np.array([[True, True, True, False, False]]))
    # more than 31/255 outside: the whole colour
    assert picture[0, :3].tolist() == [list(BELOW), list(ABOVE), list(BOTH)]
    assert len(set(picture[0, 3].tolist())) == len(set(picture[0, 4].tolist())) == 1


def test_a_pixel_further_out_is_brighter():
    far = 0.6 + np.array([0.1, 1, 5, 20, 31]) / 255
    candidate = np.repeat(far[None, :, None], 4, axis=-1)
    lo, hi = np.full(candidate.shape, 0.4), np.full(candidate.shape, 0.6)
    reds = interval_picture(candidate, lo, hi, np.ones((1, 5), bool))[0, :, 0].astype(int)
    assert all(a < b for a, b in pairwise(reds))
    assert reds[0] > ABOVE[0] // 2
    assert reds[-1] == ABOVE[0]


def test_the_script_is_told_the_colours_and_scales():
    told = json.loads(palette())
    assert told["signed"] == SIGNED.tolist()
    assert told["scales"] == list(SCALES)
    assert (told["below"], told["above"], told["both"]) == (list(BELOW), list(ABOVE), list(BOTH))
