"""Blend states in whole numbers are those in floating point, but for the rounding of each product."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from volref.emulation.targets.blending import blended, blended_codes

STATES = ["none", "premultiplied", "straight", "additive-alpha"]
codes = st.lists(st.integers(0, 255), min_size=4, max_size=4).map(lambda c: np.array([c], np.uint8))


@pytest.mark.parametrize("blend", STATES)
@given(source=codes, behind=codes)
def test_two_products_are_off_by_at_most_two_thirds_of_a_step_each(blend, source, behind):
    found = blended_codes(source, behind, blend)
    expected = np.minimum(blended(source / 255, behind / 255, blend), 1.0)
    # Each product is at most 2/3 of a step beside the exact one, as all 65536 show below.
    assert np.abs(found - 255 * expected).max() <= 4 / 3 + 1e-9


def test_a_product_is_never_further_off():
    one, other = np.meshgrid(np.arange(256), np.arange(256))
    alone = np.zeros((one.size, 4), np.uint8)
    source, behind = alone.copy(), alone.copy()
    # SRC_ALPHA alone: alpha is what red is multiplied by.
    source[:, 0], source[:, 3] = one.reshape(-1), other.reshape(-1)
    off = blended_codes(source, behind, "straight")[:, 0] - one.reshape(-1) * other.reshape(-1) / 255
    assert 0.5 < np.abs(off).max() <= 2 / 3


def test_one_times_a_half_is_one_and_255_leaves_what_it_multiplies():
    nothing = np.zeros((1, 4), np.uint8)
    half = blended_codes(np.array([[1, 2, 3, 128]], np.uint8), nothing, "straight")
    assert half.tolist() == [[1, 1, 2, 64]]
    whole = np.array([[k, k, k, 255] for k in range(256)], np.uint8)
    np.testing.assert_array_equal(blended_codes(whole, np.repeat(nothing, 256, axis=0), "straight"), whole)


@given(source=codes, behind=codes)
def test_an_opaque_fragment_replaces_and_a_transparent_one_leaves(source, behind):
    source[:, 3] = 255
    np.testing.assert_array_equal(blended_codes(source, behind, "straight"), source)
    np.testing.assert_array_equal(blended_codes(source * np.uint8(0), behind, "straight"), behind)
    np.testing.assert_array_equal(blended_codes(source * np.uint8(0), behind, "premultiplied"), behind)
