import numpy as np
import pytest

from volref import SceneError, TransferFunction

WHITE = [(1, 1, 1)] * 2


def test_opacities_become_extinctions_at_the_knots_when_asked():
    tf = TransferFunction.from_opacity([0, 1], WHITE, [0.0, 0.5], 2.0, interpolation="extinction")
    assert tf.interpolation == "extinction"
    assert tf.extinction.tolist() == [0.0, -np.log1p(-0.5) / 2]


def test_opacities_stay_opacities_by_default():
    tf = TransferFunction.from_opacity([0, 1], WHITE, [0.0, 1.0], 2.0)
    assert tf.interpolation == "opacity"
    assert tf.opacity.tolist() == [0.0, 1.0]
    assert tf.most_extinction(0.0, 1.0) == np.inf
    assert tf.most_extinction(0.0, 0.5) == -np.log1p(-0.5) / 2


def test_opacity_one_is_refused_where_extinction_is_interpolated():
    with pytest.raises(SceneError, match=r"must stay below 1 .* got 1 at index 1"):
        TransferFunction.from_opacity([0, 1], WHITE, [0.0, 1.0], interpolation="extinction")


def test_a_table_of_bytes_is_divided_by_255():
    tf = TransferFunction.from_lut(np.array([[0, 51, 255, 0], [255, 0, 0, 102]], np.uint8), (0, 1))
    assert tf.colors.tolist() == [[0, 0.2, 1], [1, 0, 0]]
    assert tf.opacity.tolist() == [0, 0.4]


def test_half_texel_lut_entries_lie_at_texel_centres_or_at_the_ends():
    table = np.zeros((4, 4))
    assert TransferFunction.from_lut(table, (0, 8)).values.tolist() == [1, 3, 5, 7]
    assert TransferFunction.from_lut(table, (-1, 2), texel_centers=False).values.tolist() == [-1, 0, 1, 2]


def test_arrays_are_copied_and_read_only():
    values = np.array([0.0, 1.0])
    tf = TransferFunction(values, WHITE, [0, 1])
    values[0] = 5.0
    assert tf.values[0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        tf.values[0] = 1.0


def test_the_greatest_extinction_counts_knots_inside_and_both_ends():
    tf = TransferFunction([0, 1, 1, 3], [(1, 1, 1)] * 4, [4, 0, 6, 2])
    assert tf.most_extinction(0.25, 0.5) == 3.0
    assert tf.most_extinction(0.25, 1.0) == 6.0
    assert tf.most_extinction(2.0, 3.0) == 4.0
    assert tf.most_extinction(5.0, 9.0) == 2.0
