"""Two-dimensional lookup and gradient opacity against a scalar loop."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.oracles.lookup import bilinear_2d, piecewise
from volref.scene import TransferFunction, TransferFunction2D
from volref.stages.lookup2d import gradient_factor, lookup_2d


@pytest.mark.parametrize("shape", [(5, 7), (1, 3), (4, 1), (1, 1)])
def test_a_lookup_is_that_of_the_scalar_loop(shape):
    random = np.random.default_rng(5)
    table = TransferFunction2D(random.random((*shape, 4)), (-10, 30), (1, 4))
    values, magnitudes = random.uniform(-20, 40, 200), random.uniform(0, 5, 200)
    colors, opacity = lookup_2d(table, values, magnitudes)
    found = np.concatenate([colors, opacity[None]]).T
    for one, value, magnitude in zip(found, values, magnitudes, strict=True):
        expected = bilinear_2d(table.rgba, (-10, 30), (1, 4), value, magnitude)
        np.testing.assert_allclose(one, expected, rtol=0, atol=4e-15)  # places up to 7 entries, ulp 1e-15


def test_the_centres_of_entries_give_the_entries_themselves():
    rgba = np.random.default_rng(6).random((4, 8, 4))
    table = TransferFunction2D(rgba, (0, 8), (0, 4))
    row, column = np.indices((4, 8)).reshape(2, -1)
    colors, opacity = lookup_2d(table, column + 0.5, row + 0.5)
    assert np.array_equal(colors.T, rgba.reshape(-1, 4)[:, :3])
    assert np.array_equal(opacity, rgba[..., 3].ravel())


@given(st.integers(0, 2**32 - 1))
def test_no_lookup_leaves_the_range_of_its_table(seed):
    random = np.random.default_rng(seed)
    # Opacities of 1 and just below it: rounded past 1, they would have no extinction.
    rgba = random.choice([0.0, 2.0**-60, 0.1, 1 - 2.0**-53, 1.0], (3, 3, 4))
    table = TransferFunction2D(rgba, (0, 1), (0, 1))
    colors, opacity = lookup_2d(table, random.random(50), random.random(50))
    assert colors.min() >= 0
    assert colors.max() <= 1
    assert opacity.min() >= 0
    assert opacity.max() <= 1


@given(
    st.lists(st.integers(0, 6), min_size=1, max_size=6).map(sorted),
    st.lists(st.floats(0, 1), min_size=6, max_size=6),
)
def test_the_factor_of_a_magnitude_is_that_of_the_scalar_loop(at, factors):
    at = [x for i, x in enumerate(at) if at[:i].count(x) < 2]
    factors = factors[: len(at)]
    tf = TransferFunction([0], [(1, 1, 1)], [1.0], gradient_opacity=(at, factors))
    magnitudes = np.array([0.0, 0.25, 1.0, 2.5, 3.0, 4.999, 5.0, 6.0, 7.0, 1e300])
    found = gradient_factor(tf, magnitudes)
    for one, magnitude in zip(found, magnitudes, strict=True):
        assert one == pytest.approx(piecewise(at, factors, magnitude), abs=1e-15)


def test_without_gradient_opacity_the_factor_is_one():
    assert gradient_factor(TransferFunction([0], [(1, 1, 1)], [1.0]), np.zeros(3)).tolist() == [1, 1, 1]
