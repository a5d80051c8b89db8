import numpy as np

import volref as vr
from tests.oracle.made_up import acceptance_of
from volref.report.pictures import NEUTRAL
from volref.report.verdict_images import LEAST_WIDTH, verdict_images
from volref.report.verdicts.views import AMBIGUOUS


def verdict_of(width=6, mask=None):
    """Return intervals and a verdict: one pixel outside, one ambiguous, all else inside."""
    end = np.full((4, width, 4), 0.4)
    marked = np.zeros((4, width), np.bool_)
    marked[1, 2] = True
    acceptance = acceptance_of(end, end, ambiguous=marked)
    image = np.full((4, width, 4), 102, np.uint8)
    image[3, 1, 0] = 140
    return acceptance, vr.check(image, acceptance, mask=mask)


def corner(picture, y, x, width=6):
    """Return the colour of pixel (x, y) of a picture enlarged from so many columns."""
    factor = picture.shape[1] // width
    return picture[y * factor, x * factor].astype(int)


def test_the_overlay_marks_what_is_outside_what_is_ambiguous_and_what_is_left_out():
    mask = np.zeros((4, 6))
    mask[0, 5] = 1
    overlay = verdict_images(*verdict_of(mask=mask))["overlay"]
    plain = corner(overlay, 0, 0)
    assert plain[0] == plain[1] == plain[2]
    red, _, blue = corner(overlay, 3, 1)
    assert red > blue + 50  # too high is orange
    np.testing.assert_array_equal(corner(overlay, 1, 2), plain // 2 + np.array(AMBIGUOUS) // 2)
    np.testing.assert_array_equal(corner(overlay, 0, 5), NEUTRAL)


def test_the_difference_is_signed_and_dark_where_there_is_none():
    acceptance, verdict = verdict_of()
    difference = verdict_images(acceptance, verdict)["difference"]
    red, _, blue = corner(difference, 3, 1)
    assert red > blue
    assert corner(difference, 0, 0).max() < 30


def test_small_images_are_enlarged_by_a_whole_factor_and_large_ones_are_not():
    small = verdict_images(*verdict_of())["candidate"]
    assert small.shape == (4 * (LEAST_WIDTH // 6), 6 * (LEAST_WIDTH // 6), 3)
    large = verdict_images(*verdict_of(width=LEAST_WIDTH + 1))
    assert large["candidate"].shape == (4, LEAST_WIDTH + 1, 3)
    # Legends lie below and change no pixel of the picture.
    assert large["overlay"].shape[0] > 4
    assert large["overlay"].shape[1] == LEAST_WIDTH + 1
