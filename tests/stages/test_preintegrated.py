"""Tables of whole segments against a scalar loop over thin slices, and closed forms."""

import math

import numpy as np
import pytest

from tests.oracles.lookup import piecewise
from volref.stages.preintegrated import entries_along, look_up, preintegrated_table

KNOTS = np.array([0.0, 0.3, 0.3, 0.7, 1.0])
SIGMA = [0.2, 0.5, 3.0, 0.0, 4.0]
RED = [1.0, 0.4, 0.4, 0.8, 0.6]


def paint(values):
    flat = values.ravel()
    sigma = np.array([piecewise(KNOTS, SIGMA, value) for value in flat]).reshape(values.shape)
    red = np.array([piecewise(KNOTS, RED, value) for value in flat]).reshape(values.shape)
    return np.stack([red, np.zeros_like(red), np.ones_like(red)]), sigma


def light_of_slices(front, back, length, count=20000):
    """Red and opacity of a segment, from thin homogeneous slices, front to back."""
    through, red = 1.0, 0.0
    for k in range(count):
        value = front + (back - front) * (k + 0.5) / count
        stopped = -math.expm1(-piecewise(KNOTS, SIGMA, value) * length / count)
        red += through * stopped * piecewise(KNOTS, RED, value)
        through *= 1 - stopped
    return red, 1 - through


@pytest.mark.parametrize(("front", "back"), [(0.0, 1.0), (1.0, 0.0), (0.25, 0.5), (0.5, 0.5), (0.75, 0.125)])
def test_an_entry_is_the_light_of_its_segment(front, back):
    table = preintegrated_table(paint, KNOTS, (0.0, 1.0), 2.0, 33)
    red, _, blue, opacity = look_up(table, np.array([front]), np.array([back]))[:, 0]
    true_red, true_opacity = light_of_slices(front, back, 2.0)
    # The slices miss the jump by up to one of 20000: 2 length times (3 - 0.5) / 20000.
    assert opacity == pytest.approx(true_opacity, abs=3e-4)
    assert blue == pytest.approx(opacity, abs=1e-12)  # a colour of 1 everywhere is the opacity itself
    # In a part of 1/32 of the values the colour changes by 1/16; a jump within it is not told apart.
    assert red == pytest.approx(true_red, abs=0.02)


def test_a_band_of_the_table_is_the_same_table():
    values = np.linspace(0, 1, 40)
    change = 0.2
    whole = preintegrated_table(paint, KNOTS, (0.0, 1.0), 0.5, 65)
    band = preintegrated_table(paint, KNOTS, (0.0, 1.0), 0.5, 65, most_change=change)
    assert band.entries.shape[-1] < whole.entries.shape[-1] / 2
    for back in (values - change / 2, values + change):
        held = np.clip(back, 0, 1)
        np.testing.assert_array_equal(look_up(band, values, held), look_up(whole, values, held))


def test_no_entry_gives_out_more_than_its_colours_however_thick_it_is():
    table = preintegrated_table(paint, KNOTS, (0.0, 1.0), 1e6, 17)
    assert np.isfinite(table.entries).all()
    assert table.entries.min() >= 0
    assert (table.entries[:3] <= 1 + 1e-12).all()  # sums of up to 32 parts of 1


def test_the_integral_of_the_extinction_knows_its_jump():
    lattice = entries_along(paint, KNOTS, (0.0, 1.0), 11)
    assert lattice.integral[-1] == pytest.approx(0.3 * 0.35 + 0.4 * 1.5 + 0.3 * 2, abs=1e-14)


def test_a_field_of_one_value_has_a_table():
    table = preintegrated_table(paint, KNOTS, (0.5, 0.5), 2.0, 4)
    opacity = look_up(table, np.array([0.5]), np.array([0.5]))[3, 0]
    assert opacity == pytest.approx(-math.expm1(-2.0 * 1.5), abs=1e-14)
