"""Tables of value and gradient magnitude: what they hold, refuse, and let be skipped."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.oracles.lookup import bilinear_2d
from volref import SceneError, TransferFunction2D

TABLE = np.zeros((3, 4, 4))


def test_a_table_of_bytes_is_divided_by_255_and_read_only():
    tf = TransferFunction2D(np.full((2, 2, 4), 51, np.uint8), (0, 1), (0, 1), 2.0, units="HU")
    assert (tf.rgba == 0.2).all()
    assert (tf.unit_distance, tf.units, tf.interpolation) == (2.0, "HU", "opacity")
    with pytest.raises(ValueError, match="read-only"):
        tf.rgba[0, 0, 0] = 1.0


@pytest.mark.parametrize(
    ("change", "fragment"),
    [
        ({"rgba": TABLE[0]}, r"rgba must have shape \(m, n, 4\), got \(4, 4\)"),
        ({"rgba": TABLE[:0]}, r"rgba must have at least one entry, got shape \(0, 4, 4\)"),
        ({"rgba": TABLE - 1}, r"rgba must be at least 0, got -1 at index \(0, 0, 0\)"),
        ({"rgba": TABLE + 2}, r"rgba must hold opacities in 0..1, got 2 at index \(0, 0, 3\)"),
        ({"value_domain": (1, 1)}, "value_domain must rise"),
        ({"magnitude_domain": (1, 0)}, "magnitude_domain must rise"),
        ({"unit_distance": 0}, "unit_distance must be above 0"),
        ({"units": None}, "units must be text"),
    ],
)
def test_a_table_that_breaks_a_rule_is_refused(change, fragment):
    with pytest.raises(SceneError, match=fragment):
        TransferFunction2D(**{"rgba": TABLE, "value_domain": (0, 1), "magnitude_domain": (0, 1)} | change)


def test_the_greatest_colours_are_those_of_any_entry():
    table = TABLE.copy()
    table[1, 2, :3], table[2, 0, 1] = (0.3, 0.1, 2.0), 0.9
    assert TransferFunction2D(table, (0, 1), (0, 1)).colors_max.tolist() == [0.3, 0.9, 2.0]


opacities = st.lists(st.sampled_from([0.0, 0.0, 0.4, 1.0]), min_size=12, max_size=12)


@given(opacities, st.floats(-1, 9), st.floats(0, 4))
def test_a_range_of_values_is_visible_if_and_only_if_some_gradient_makes_it_so(opacity, low, width):
    table = TABLE.copy()
    table[..., 3] = np.reshape(opacity, (3, 4))
    tf = TransferFunction2D(table, (0, 8), (0, 3))
    high = low + width
    # Opacity is linear between entries, so it is seen inside or at the ends of a range, or nowhere.
    values = [low, high, (low + high) / 2, *(x for x in (1, 3, 5, 7) if low <= x <= high)]
    values += [value + (high - value) * 1e-9 for value in values]
    seen = max(bilinear_2d(table, (0, 8), (0, 3), v, m)[3] for v in values for m in (0.5, 1.5, 2.5))
    assert bool(tf.is_visible(low, high)) >= (seen > 0)
    assert tf.most_opacity(low, high) >= seen - 1e-15
    if seen == 0:
        assert not tf.is_visible(low, high) or low in (1, 3, 5, 7) or high in (1, 3, 5, 7) or width < 1e-6


def test_the_greatest_opacity_is_reached_at_columns():
    table = TABLE.copy()
    table[1, 2, 3] = 0.8
    tf = TransferFunction2D(table, (0, 8), (0, 3))
    assert tf.most_opacity(5, 5) == 0.8
    assert tf.most_opacity(4, 4) == 0.4
    assert tf.most_opacity(-5, 3) == 0.0
