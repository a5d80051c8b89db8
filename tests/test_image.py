import numpy as np
import pytest

from volref.image import bytes24_from_unit, decode_srgb, encode_srgb, unit_from_bytes24
from volref.oracle.metrics import import_colour

# Even steps, every size of number down to 1e-12, and both sides of the knee.
LIGHT = np.concatenate(
    [np.linspace(0, 1, 20001), np.logspace(-12, 1, 2001), 0.0031308 + np.array([-1, 0, 1]) * 2.0**-60]
)


@pytest.mark.parametrize(
    ("ours", "theirs"),
    [(encode_srgb, "eotf_inverse_sRGB"), (decode_srgb, "eotf_sRGB")],
    ids=["encode", "decode"],
)
def test_srgb_is_that_of_colour_science(ours, theirs):
    expected = getattr(import_colour().models, theirs)(LIGHT)
    # 1 ulp: both are the formula of IEC 61966-2-1, and only the order of its operations may differ.
    np.testing.assert_array_max_ulp(ours(LIGHT), expected, maxulp=1)


def test_every_kind_of_24_bit_code_comes_back_and_the_highest_byte_is_first():
    codes = np.unique(np.concatenate([np.arange(70000), 2**24 - 1 - np.arange(70000), 2 ** np.arange(24)]))
    split = bytes24_from_unit(codes / (2**24 - 1))
    assert (split.astype(np.int64) @ [65536, 256, 1] == codes).all()
    assert (unit_from_bytes24(split) == codes / (2**24 - 1)).all()


def test_24_bits_hold_numbers_to_half_a_level_and_clip_what_is_outside():
    unit = np.random.default_rng(5).random((100, 7))
    # Half a level of 1 / (2^24 - 1), and the rounding of a product and a quotient.
    assert np.abs(unit_from_bytes24(bytes24_from_unit(unit)) - unit).max() <= 0.5 / (2**24 - 1) + 2.0**-52
    assert bytes24_from_unit(np.array([-0.1, 1.1])).tolist() == [[0, 0, 0], [255, 255, 255]]
