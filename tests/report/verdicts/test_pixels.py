import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.report import cases
from tests.report.verdicts.unpacking import unpacked
from volref.report.verdicts.pixels import (
    AMBIGUOUS,
    DRAWN,
    LEFT_OUT,
    NAN_CODE,
    OUTSIDE,
    PARTS,
    WIDTH_DECADES,
    WIDTH_STEPS,
    packed,
    sample_of,
)


def whole(case):
    return sample_of(case.verdict.excess, case.verdict.excess.size)


@pytest.mark.parametrize("make", [cases.failing, cases.opaque_colors, cases.passing])
def test_bytes_come_back_as_they_are(make):
    case = make()
    fields, *_ = unpacked(*packed(case, whole(case)))
    images = {
        "nominal": case.acceptance.nominal,
        "candidate": case.candidate,
        "lo": case.acceptance.lo,
        "hi": case.acceptance.hi,
    }
    if case.counterfactual is not None:
        images["counterfactual"] = case.counterfactual
    assert list(fields) == list(images)
    for name, image in images.items():
        np.testing.assert_array_equal(fields[name], np.rint(255 * image))


def test_numbers_between_bytes_come_back_to_half_a_part_with_nan_and_infinity():
    case = cases.floating()
    about, text = packed(case, whole(case))
    assert about["parts"] == str(PARTS)
    fields, *_ = unpacked(about, text)
    known = np.isfinite(case.candidate)
    # rounding to a part, and the product's own rounding
    apart = fields["candidate"][known] / (255 * PARTS) - case.candidate[known]
    assert np.abs(apart).max() <= 0.5 / (255 * PARTS) + 1e-15
    assert fields["candidate"][8, 9, 1] == NAN_CODE
    assert fields["candidate"][9, 9, 2] == 2**30
    assert (~known).sum() == 2


def test_marks_are_those_of_verdict_and_intervals():
    case = cases.opaque_colors()
    _, marks, *_ = unpacked(*packed(case, whole(case)))
    np.testing.assert_array_equal(marks & OUTSIDE > 0, case.verdict.outside)
    np.testing.assert_array_equal(marks & AMBIGUOUS > 0, case.acceptance.ambiguous)
    np.testing.assert_array_equal(marks & DRAWN > 0, case.acceptance.drawn)
    np.testing.assert_array_equal(marks & LEFT_OUT > 0, case.verdict.left_out)
    assert all((marks & bit).any() for bit in (OUTSIDE, AMBIGUOUS, DRAWN, LEFT_OUT))


def test_widths_come_back_to_a_step_of_their_scale():
    case = cases.failing()
    _, _, codes, _ = unpacked(*packed(case, whole(case)))
    width = case.acceptance.width
    np.testing.assert_array_equal(codes == 0, width == 0)
    there = codes > 0
    got = 10.0 ** (codes[there] / WIDTH_STEPS - WIDTH_DECADES)
    # half a step of 1/WIDTH_STEPS decades
    np.testing.assert_allclose(got, 255 * width[there], rtol=10 ** (0.5 / WIDTH_STEPS) - 1)


def test_a_reduced_image_holds_true_numbers_and_their_true_places():
    case = cases.failing(size=(50, 37))
    sample = sample_of(case.verdict.excess, 200)
    about, text = packed(case, sample)
    fields, marks, _, places = unpacked(about, text)
    assert int(about["width"]) * int(about["height"]) <= 200
    x, y = places[..., 0], places[..., 1]
    np.testing.assert_array_equal(fields["candidate"], np.rint(255 * case.candidate[y, x]))
    np.testing.assert_array_equal(marks & OUTSIDE > 0, case.verdict.outside[y, x])


@given(
    st.integers(1, 40), st.integers(1, 40), st.integers(1, 300), st.integers(0, 2**32 - 1), st.floats(0, 0.3)
)
def test_of_every_block_the_pixel_that_is_most_outside_is_shown(height, width, most, seed, share):
    random = np.random.default_rng(seed)
    excess = np.where(random.random((height, width)) < share, random.random((height, width)), 0)
    sample = sample_of(excess, most)
    high, wide = sample.rows.shape
    assert high * wide <= most
    for i in range(high):
        for j in range(wide):
            rows = slice(i * sample.factor, (i + 1) * sample.factor)
            columns = slice(j * sample.factor, (j + 1) * sample.factor)
            assert excess[sample.rows[i, j], sample.columns[i, j]] == excess[rows, columns].max()
            assert sample.rows[i, j] in range(height)[rows]
            assert sample.columns[i, j] in range(width)[columns]


def test_an_image_that_is_small_enough_is_shown_whole():
    sample = sample_of(np.zeros((5, 7)), 35)
    image = np.arange(35).reshape(5, 7)
    assert sample.factor == 1
    np.testing.assert_array_equal(sample(image), image)
