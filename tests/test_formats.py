import math
import struct
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from volref.formats import KINDS, codes_of, decoded, stored

single = st.floats(width=32)


def packed(value, letter):
    """The number that struct packs `value` as, infinity beyond the format's end."""
    try:
        return struct.unpack(letter, struct.pack(letter, value))[0]
    except OverflowError:
        return math.copysign(math.inf, value)


@given(single)
def test_a_half_is_the_one_that_struct_packs(value):
    assert stored(np.array([value]), "half").tobytes() == np.array([packed(value, "<e")]).tobytes()


@given(st.floats())
def test_a_float_is_the_one_that_struct_packs(value):
    assert stored(np.array([value]), "float").tobytes() == np.array([packed(value, "<f")]).tobytes()


def test_a_half_of_a_float64_is_that_of_its_float32():
    value = 1 + 2.0**-11 + 2.0**-30  # just above a tie of half; as a float32 it is the tie
    assert np.float16(value) == 1 + 2.0**-10
    assert stored(np.array([value]), "half").tolist() == [1.0]


@given(st.floats(allow_nan=False))
def test_exact_loses_nothing(value):
    assert stored(np.array([value]), "exact").tolist() == [value]


@pytest.mark.parametrize("bits", [8, 16])
@given(value=st.floats(0, 1, width=32))
def test_a_unorm_is_the_nearest_code_of_the_product_in_float32(bits, value):
    most = 2**bits - 1
    product = Fraction(float(np.float32(value) * np.float32(most)))
    assert codes_of(np.array([value]), bits).tolist() == [round(product)]  # Fraction rounds ties to even


def test_ties_of_a_unorm_go_to_the_even_code():
    # k + 1/2 for small k is a float32, and some float32 has it as its product with 255.
    for k in range(255):
        near = np.float32((k + 0.5) / 255)
        around = np.array([np.nextafter(near, np.float32(end)) for end in (0, 1)] + [near], np.float32)
        ties = around[around * np.float32(255) == np.float32(k + 0.5)]
        assert (codes_of(ties) == (k if k % 2 == 0 else k + 1)).all()
    assert codes_of(np.array([0.5])).tolist() == [128]  # 127.5


@pytest.mark.parametrize("bits", [8, 16])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_every_code_comes_back(bits, dtype):
    codes = np.arange(2**bits).astype(f"u{bits // 8}")
    values = decoded(codes, dtype)
    assert values.dtype == dtype
    assert (codes_of(values, bits) == codes).all()
    assert (stored(values, f"unorm{bits}") == values).all()


def test_float32_codes_are_multiples_of_the_float32_nearest_to_1_over_255():
    step = struct.unpack("<f", struct.pack("<f", 1 / 255))[0]
    expected = [packed(k * step, "<f") for k in range(256)]
    assert decoded(np.arange(256).astype(np.uint8), np.float32).tolist() == expected


def test_float64_codes_are_nearest_to_the_fraction():
    assert decoded(np.arange(256).astype(np.uint8)).tolist() == [float(Fraction(k, 255)) for k in range(256)]


@pytest.mark.parametrize("bits", [8, 16])
def test_what_is_no_number_from_0_to_1_is_held_to_them(bits):
    values = np.array([-np.inf, -1e300, -1e-9, 1.01, 1e300, np.inf])
    most = 2**bits - 1
    assert codes_of(values, bits).tolist() == [0, 0, 0, most, most, most]


@pytest.mark.parametrize("nan", [0.0, 1.0])
@pytest.mark.parametrize("bits", [8, 16])
def test_a_nan_becomes_what_the_device_says(bits, nan):
    values = np.array([np.nan, 0.0, 1.0], np.float32)
    assert stored(values, f"unorm{bits}", nan=nan).tolist() == [nan, 0.0, 1.0]


@pytest.mark.parametrize("kind", ["half", "float", "exact"])
def test_a_float_keeps_its_nan(kind):
    assert np.isnan(stored(np.array([np.nan]), kind)).all()


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("dtype", [np.float16, np.float32, np.float64])
def test_storing_keeps_the_type_and_shape_and_the_array_itself(kind, dtype):
    values = np.linspace(0, 1, 12).astype(dtype).reshape(3, 4)
    before = values.copy()
    result = stored(values, kind)
    assert (result.dtype, result.shape) == (dtype, (3, 4))
    assert (values == before).all()
