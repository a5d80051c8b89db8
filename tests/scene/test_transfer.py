import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.oracles.lookup import catmull_rom, natural_spline
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


def test_gradient_opacity_and_units_are_kept_by_every_way_to_build_one():
    more = {"gradient_opacity": ([0, 5, 5], [0, 0.5, 1]), "units": "HU"}
    table = np.zeros((4, 4))
    built = [
        TransferFunction([0, 1], WHITE, [0, 1], **more),
        TransferFunction.from_opacity([0, 1], WHITE, [0, 0.5], **more),
        TransferFunction.from_opacity([0, 1], WHITE, [0, 0.5], interpolation="extinction", **more),
        TransferFunction.from_lut(table, (0, 1), **more),
        TransferFunction.from_spline([0, 1], WHITE, [0, 0.5], **more),
    ]
    for tf in built:
        assert [column.tolist() for column in tf.gradient_opacity] == [[0, 5, 5], [0, 0.5, 1]]
        assert tf.units == "HU"
        with pytest.raises(ValueError, match="read-only"):
            tf.gradient_opacity[1][0] = 1.0


@pytest.mark.parametrize(
    ("change", "fragment"),
    [
        ({"gradient_opacity": ([1, 0], [0, 1])}, r"gradient_opacity\[0\] must not decrease, got 0 after 1"),
        ({"gradient_opacity": ([0, 0, 0], [0, 1, 1])}, r"gradient_opacity\[0\] must hold a value at most"),
        ({"gradient_opacity": ([0, 1], [0, 1.5])}, r"gradient_opacity\[1\] must lie in 0..1, got 1.5 at"),
        ({"gradient_opacity": ([0, 1], [0])}, r"gradient_opacity\[1\] must have shape \(2\), got \(1\)"),
        ({"gradient_opacity": ([], [])}, r"gradient_opacity\[0\] must have at least one knot"),
        ({"gradient_opacity": 5}, r"gradient_opacity must be a pair, got int; give \(magnitudes, factors\)"),
        ({"units": 5}, "units must be text of one line, at most 40 characters, got int"),
        ({"units": "H\nU"}, "units must be text of one line"),
        ({"units": "x" * 41}, "units must be text of one line"),
    ],
)
def test_gradient_opacity_and_units_that_break_a_rule_are_refused(change, fragment):
    with pytest.raises(SceneError, match=fragment):
        TransferFunction([0, 1], WHITE, [0, 1], **change)


control_points = st.lists(st.floats(0, 1), min_size=2, max_size=7, unique_by=lambda x: round(x, 3)).map(
    sorted
)


@given(control_points, st.data(), st.sampled_from(["natural", "catmull-rom"]))
def test_a_spline_is_the_textbook_one_at_texel_centres(at, data, kind):
    values = [10.0 * x - 3.0 for x in at]
    opacity = data.draw(st.lists(st.floats(0, 1), min_size=len(at), max_size=len(at)))
    tf = TransferFunction.from_spline(values, np.ones((len(at), 3)), opacity, samples=16, kind=kind)
    oracle = {"natural": natural_spline, "catmull-rom": catmull_rom}[kind]
    width = (values[-1] - values[0]) / 16
    for i in range(16):
        x = values[0] + (i + 0.5) * width
        assert tf.values[i] == pytest.approx(x, abs=1e-12)
        # Control points 1e-3 apart make slopes of 1e3 and bends of 1e6, of which 1e-16 is lost.
        assert tf.opacity[i] == pytest.approx(min(max(oracle(values, opacity, x), 0), 1), abs=1e-9)


@pytest.mark.parametrize("kind", ["natural", "clamped", "not-a-knot", "catmull-rom", "monotone"])
def test_a_spline_without_texel_centres_meets_its_control_points(kind):
    opacity = [0.0, 0.9, 0.1, 0.5, 0.0]
    tf = TransferFunction.from_spline(
        range(5), np.zeros((5, 3)), opacity, samples=17, kind=kind, texel_centers=False
    )
    np.testing.assert_allclose(tf.opacity[::4], opacity, rtol=0, atol=1e-15)


def test_only_the_monotone_spline_never_swings_beyond_its_control_points():
    step = [0.2, 0.2, 0.8, 0.8]

    def swing(kind):
        tf = TransferFunction.from_spline(range(4), np.zeros((4, 3)), step, kind=kind)
        return max(tf.opacity.max() - 0.8, 0.2 - tf.opacity.min())

    assert swing("monotone") <= 1e-15
    assert all(swing(kind) > 0.02 for kind in ("natural", "clamped", "not-a-knot", "catmull-rom"))


def test_a_spline_is_held_to_what_a_texture_holds():
    tf = TransferFunction.from_spline(range(4), np.zeros((4, 3)), [0, 0, 1, 1])
    assert (tf.opacity.min(), tf.opacity.max()) == (0, 1)


@pytest.mark.parametrize(
    ("change", "fragment"),
    [
        ({"values": [0, 0]}, "values must rise, at least 2 of them, for a spline"),
        ({"values": [0], "colors": WHITE[:1], "opacity": [0]}, r"must rise, .*got \[0.0\]"),
        ({"colors": [(0, 0, 0), (0, 2, 0)]}, r"colors must lie in 0..1, got 2 at index \(1, 1\)"),
        ({"kind": "bezier"}, "kind must be 'natural' or .* got 'bezier'"),
        ({"samples": 1}, "samples must be a whole number from 2 to 65536, got 1"),
    ],
)
def test_a_spline_that_breaks_a_rule_is_refused(change, fragment):
    with pytest.raises(SceneError, match=fragment):
        TransferFunction.from_spline(**{"values": [0, 1], "colors": WHITE, "opacity": [0, 1]} | change)
