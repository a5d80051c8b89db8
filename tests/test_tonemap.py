"""Tone mapping held to the formulas as printed, and to what any such curve must do."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from volref import SceneError, tone_map
from volref.image import decode_light, encode_light
from volref.tonemap import OPERATORS, hable_curve

LIGHT = np.concatenate([np.linspace(0, 2, 401), np.logspace(-12, 4, 161)])
SHAPES = {"reinhard-extended": {"white": 4.0}, "artistic": {"low": 0.1, "mid": 0.4, "high": 1.3}}


def opaque(light):
    """Grey pixels of that light."""
    return np.stack([*[np.asarray(light, float)] * 3, np.ones_like(light, float)], axis=-1)


def mapped(light, operator, **options):
    return tone_map(opaque(light), operator, **options)[..., 0]


def hable_as_printed(x):
    a, b, c, d, e, f = 0.15, 0.50, 0.10, 0.20, 0.02, 0.30
    return ((x * (a * x + c * b) + d * e) / (x * (a * x + b) + d * f)) - e / f


def test_the_stable_form_of_hables_curve_is_the_printed_one():
    # The printed difference loses what lies below 2^-53 of 0.067 each time it rounds, four times.
    np.testing.assert_allclose(hable_curve(LIGHT), hable_as_printed(LIGHT), rtol=4e-16, atol=1e-16)
    assert hable_curve(np.array(0.0)) == 0


def vpt_artistic(color, low, mid, high, saturation, gamma):
    """VPT's ArtisticToneMapper of one pixel, in its own order."""
    color = [(c - low) / (high - low) for c in color]
    gray = [1 / math.sqrt(3)] * 3
    along = sum(c * g for c, g in zip(color, gray, strict=True))
    color = [along * g * (1 - saturation) + c * saturation for c, g in zip(color, gray, strict=True)]
    exponent = -math.log((mid - low) / (high - low)) / math.log(2.0)
    return [max(c, 0.0) ** (exponent / gamma) for c in color]


@given(
    st.lists(st.floats(0, 3), min_size=3, max_size=3),
    st.floats(0, 0.4),
    st.floats(0.05, 0.95),
    st.floats(0, 2),
    st.floats(1, 3),
)
def test_artistic_is_vpts_shader(color, low, middle, saturation, gamma):
    high = 1.2
    mid = low + middle * (high - low)
    got = tone_map([*color, 1.0], "artistic", low=low, mid=mid, high=high, saturation=saturation, gamma=gamma)
    expected = vpt_artistic(color, low, mid, high, saturation, gamma)
    # Near 0 the power is steep: an ulp of 1 in its argument moves x^(1/40) by up to 1e-16^(1/40).
    if min(abs(c - low) for c in color) > 1e-3 and saturation in (0, 1):
        np.testing.assert_allclose(got[:3], expected, rtol=1e-10, atol=0)
    bases = [value ** (gamma / -math.log2(middle)) for value in (*got[:3], *expected)]
    np.testing.assert_allclose(bases[:3], bases[3:], rtol=0, atol=1e-12)


@pytest.mark.parametrize(
    ("operator", "formula"),
    [
        ("linear", lambda c: c),
        ("exponential", lambda c: 1 - math.exp(-c)),
        ("reinhard", lambda c: c / (1 + c)),
        ("reinhard-extended", lambda c: c * (1 + c / 4.0**2) / (1 + c)),
        ("hable", lambda c: hable_as_printed(c) / hable_as_printed(11.2)),
    ],
)
def test_each_operator_is_its_formula(operator, formula):
    expected = [formula(c) for c in LIGHT.tolist()]
    got = mapped(LIGHT, operator, **SHAPES.get(operator, {}))
    # The formulas as they stand lose what is below an ulp of 1.
    np.testing.assert_allclose(got, expected, rtol=4e-16, atol=4e-16)


@pytest.mark.parametrize("operator", OPERATORS)
def test_more_light_is_never_darker_and_black_stays_black(operator):
    values = mapped(np.sort(LIGHT), operator, **SHAPES.get(operator, {}))
    # An ulp back is what rounding may take where the curve is flat.
    assert (np.diff(values) >= -(2.0**-53) * values[1:]).all()
    assert values[0] == 0


@pytest.mark.parametrize(
    ("operator", "white", "shape"),
    [
        ("reinhard-extended", 4.0, {"white": 4.0}),
        ("reinhard-extended", 0.5, {"white": 0.5}),
        ("hable", 11.2, {}),
        ("hable", 3.0, {"white": 3.0}),
        ("artistic", 1.3, {"low": 0.1, "mid": 0.6, "high": 1.3}),
    ],
)
def test_white_becomes_1(operator, white, shape):
    # A quotient and a product: 2 ulp.
    assert mapped(white, operator, **shape) == pytest.approx(1, abs=4.5e-16)


def test_middle_grey_of_the_artistic_operator_by_its_default_changes_nothing():
    assert np.array_equal(mapped(LIGHT, "artistic"), LIGHT)


@given(st.floats(1e-3, 1), st.floats(0, 10), st.floats(1e-3, 1e3), st.sampled_from(list(OPERATORS)))
def test_alpha_stays_and_exposure_is_light(alpha, light, exposure, operator):
    shape = SHAPES.get(operator, {})
    thin = tone_map([*[light * alpha] * 3, alpha], operator, exposure=exposure, **shape)
    dense = tone_map([*[light * exposure] * 3, 1.0], operator, **shape)
    assert thin[3] == alpha
    if operator != "artistic":  # whose power may be steep at 0
        # The colour is divided by alpha and multiplied by exposure in another order: 3 ulp of the argument.
        assert thin[0] / alpha == pytest.approx(dense[0], rel=2e-15)


def test_a_gamma_is_the_encoding_of_that_gamma():
    codes = encode_light(LIGHT[LIGHT <= 1], "gamma2.2")
    np.testing.assert_array_max_ulp(mapped(LIGHT[LIGHT <= 1], "linear", gamma=2.2), codes, maxulp=1)
    # The exponent 1 / 2.2 is off by half an ulp, which is worth ln(1e-12) = 28 times that and 2.2 more.
    np.testing.assert_allclose(decode_light(codes, "gamma2.2"), LIGHT[LIGHT <= 1], rtol=8e-15, atol=0)


@pytest.mark.parametrize(
    ("call", "fragment"),
    [
        (lambda: tone_map(opaque(1.0), "aces"), "operator must be 'linear' or 'exponential'"),
        (
            lambda: tone_map(opaque(1.0), "reinhard", white=2.0),
            "must be given what 'reinhard' has, got white",
        ),
        (lambda: tone_map(opaque(1.0), "reinhard-extended"), "white must be given to 'reinhard-extended'"),
        (lambda: tone_map(opaque(1.0), "hable", white=0.0), "white must be above 0"),
        (lambda: tone_map(opaque(1.0), "artistic", mid=1.0), "low, mid and high must rise"),
        (lambda: tone_map(opaque(1.0), exposure=-1.0), "exposure must be at least 0"),
        (lambda: tone_map(opaque(1.0), gamma=0.0), "gamma must be above 0"),
        (lambda: tone_map(opaque(np.nan)), "image must be finite"),
        (lambda: tone_map([1.0, 2.0, 3.0]), "image must have shape (pixels, 4)"),
        (lambda: tone_map(1.0), "image must have shape (pixels, 4)"),
        (lambda: tone_map([[1.0], [1.0, 2.0]]), "image must be an array"),
    ],
)
def test_what_cannot_be_mapped_is_refused_in_one_sentence(call, fragment):
    with pytest.raises(SceneError) as refusal:
        call()
    assert fragment in str(refusal.value)
