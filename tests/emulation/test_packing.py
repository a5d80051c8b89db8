"""Numbers in four bytes: as printed in seed 000, put right, and as whole numbers in Python."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from volref.emulation.surfaces.packing import packed, unpacked
from volref.formats import stored

# Every number of 24 bits would be 16 million; each 97th, a prime, has all digits in all places.
NUMBERS = (np.arange(0, 2**24, 97) / 2**24).astype(np.float32)


def through_bytes(values, packing):
    return unpacked(stored(packed(values, packing), "unorm8"), packing)


def by_hand(value, packing):
    """Pack, store and unpack one number with Python's own arithmetic on whole numbers."""
    scaled = math.floor(value * 256**4)
    # Alpha, blue and green are whole digits; red keeps what is behind its own.
    digits = [(scaled >> 24) & 255, (scaled >> 16) & 255, (scaled >> 8) & 255]
    last = value * 256**3 % 1 * 256
    stretch = 255 / 256 if packing == "printed" else 1
    codes = [min(255, round(digit * stretch)) for digit in (*digits, last)]
    back = 1 / 255 if packing == "printed" else 1 / 256
    return sum(code * back / 256**k for k, code in enumerate(codes))


@given(st.integers(0, 2**24 - 1), st.sampled_from(["printed", "working"]))
def test_a_number_comes_back_as_whole_numbers_say(code, packing):
    value = code / 2**24
    found = through_bytes(np.array([value]), packing)[0]
    # float64 sums of four numbers below 1.
    assert found == pytest.approx(by_hand(value, packing), rel=0, abs=4e-16)


def test_as_printed_it_is_no_better_than_8_bits():
    error = np.abs(through_bytes(NUMBERS, "printed").astype(np.float64) - NUMBERS)
    # Half a byte, 0.00196, and half of the next digit's: 0.001953 (1 + 1/255 ...) is what is left of 24 bits.
    assert error.max() == pytest.approx(0.00197, abs=5e-6)
    assert np.sqrt((error**2).mean()) == pytest.approx(0.00113, abs=5e-6)
    eight_bits = np.abs(np.rint(NUMBERS * 255) / 255 - NUMBERS)
    assert error.max() >= eight_bits.max()


def test_put_right_it_holds_24_bits_to_float32s_rounding():
    error = np.abs(through_bytes(NUMBERS, "working").astype(np.float64) - NUMBERS)
    # One unit in the last place below 1.
    assert error.max() == 2.0**-24
    assert np.sqrt((error**2).mean()) == pytest.approx(3.2e-8, rel=0.02)


def test_put_right_in_float64_it_holds_32_bits():
    numbers = np.arange(100003) / 100003
    error = np.abs(through_bytes(numbers, "working") - numbers)
    # The fourth digit is rounded, and one above 255 is held at 255.
    assert 0.9 / 256**4 < error.max() <= 1 / 256**4 + 1e-15


def test_exact_numbers_are_not_packed():
    assert packed(NUMBERS, "exact").shape == (len(NUMBERS), 1)
    np.testing.assert_array_equal(unpacked(packed(NUMBERS, "exact"), "exact"), NUMBERS)


def test_white_is_beyond_1_and_black_is_0():
    assert unpacked(np.ones((1, 4)), "printed")[0] == pytest.approx(1.0039, abs=5e-5)
    assert unpacked(np.zeros((1, 4)), "printed")[0] == 0.0
