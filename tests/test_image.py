import numpy as np
import pytest

from volref.image import decode_srgb, encode_srgb
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
