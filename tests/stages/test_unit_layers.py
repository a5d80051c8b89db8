"""Layers one unit distance thick, against the scalar table; their bounds, against many values."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.oracles.scalar import table_value
from volref import TransferFunction
from volref.stages.unit_layers import straight_colors, unit_layers

BEHIND = np.array([0.3, 0.1, 0.9, 0.7])


def scalar_layer(transfer, value):
    strengths = transfer.opacity if transfer.extinction is None else transfer.extinction
    strength = table_value(list(transfer.values), list(strengths), value)
    opacity = strength if transfer.extinction is None else -math.expm1(-strength * transfer.unit_distance)
    color = [table_value(list(transfer.values), list(c), value) for c in transfer.colors.T]
    return np.array([(1 - opacity) * b + opacity * c for b, c in zip(BEHIND, [*color, 1.0], strict=True)])


@st.composite
def tables(draw):
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    count = draw(st.integers(1, 6))
    knots = np.sort(rng.choice([0.0, 0.25, 0.5, 0.5, 1.0, *rng.random(3)], count, replace=False))
    strength = rng.random(count) * rng.choice([0.0, 1.0], count)
    if draw(st.booleans()):
        return TransferFunction(knots, rng.random((count, 3)), 5 * strength, unit_distance=2.0)
    return TransferFunction(knots, rng.random((count, 3)), opacity=strength, unit_distance=2.0)


def layer(transfer, value, least, most):
    ends = (np.array([x]) for x in (value, least, most))
    rgba, bound = unit_layers(transfer, *ends, BEHIND[None])
    return rgba[0], bound[0]


@given(tables(), st.floats(-0.2, 1.2), st.floats(0, 0.5), st.floats(0, 0.5))
def test_every_value_of_the_range_is_within_the_bound(transfer, value, below, above):
    rgba, bound = layer(transfer, value, value - below, value + above)
    assert np.abs(rgba - scalar_layer(transfer, value)).max() <= 1e-15
    inside = transfer.values[(transfer.values >= value - below) & (transfer.values <= value + above)]
    just_below = np.nextafter(inside, -np.inf)
    near = [*inside, *just_below[just_below >= value - below], *np.linspace(value - below, value + above, 50)]
    assert max(np.abs(rgba - scalar_layer(transfer, x)).max() for x in near) <= bound


@given(tables(), st.floats(-0.2, 1.2))
def test_a_value_that_is_known_has_a_bound_of_rounding_even_on_a_jump(transfer, value):
    assert layer(transfer, value, value, value)[1] < 1e-14


def test_the_bound_is_the_change_where_only_opacity_or_colour_changes():
    opacity = TransferFunction([0, 1], [(1, 1, 1)] * 2, opacity=[0, 1])
    # White over a red of 0.3: 0.7 per unit of opacity.
    assert layer(opacity, 0.5, 0.4, 0.5)[1] == pytest.approx(0.1 * 0.9, rel=1e-12)
    color = TransferFunction([0, 1], [(0, 0, 0), (1, 1, 1)], opacity=[1, 1])
    assert layer(color, 0.5, 0.5, 0.75)[1] == pytest.approx(0.25, rel=1e-12)


def test_a_knot_between_the_ends_of_the_range_counts():
    peak = TransferFunction([0, 0.5, 1], [(1, 1, 1)] * 3, opacity=[0, 1, 0])
    assert layer(peak, 0.4, 0.2, 0.8)[1] == pytest.approx(0.4 * 0.9, rel=1e-12)  # to 0; to 1 it is 0.2
    assert layer(peak, 0.3, 0.2, 0.8)[1] == pytest.approx(0.4 * 0.9, rel=1e-12)  # up to the peak


def test_many_values_are_as_one_by_one():
    transfer = TransferFunction([0.0, 0.5, 0.5, 1.0], np.eye(4)[:, :3], [0.0, 1.0, 3.0, 0.5])
    values = np.linspace(-0.1, 1.1, 25)
    least, most = values - 0.1, values + 0.05
    rgba, bound = unit_layers(transfer, values, least, most, np.tile(BEHIND, (25, 1)))
    for k in range(25):
        one = layer(transfer, values[k], least[k], most[k])
        assert rgba[k].tolist() == one[0].tolist()
        assert bound[k] == one[1]


def test_straight_colours_are_the_tables():
    transfer = TransferFunction([0, 2], [(0, 0, 1), (1, 0.5, 0)], [1, 1])
    colors, rounding = straight_colors(transfer, np.array([-1.0, 0.5, 2.0]))
    assert colors.T.tolist() == [[0, 0, 1], [0.25, 0.125, 0.75], [1, 0.5, 0]]
    assert rounding.max() < 1e-15
