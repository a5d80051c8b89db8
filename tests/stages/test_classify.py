import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.oracles import scalar
from volref import TransferFunction
from volref.stages.classify import MOST_BUCKETS, classify, lookup_table, segment_opacity
from volref.workspace import Workspace

EPS = np.finfo(np.float64).eps

UNIT = st.floats(0, 1)


def classified(transfer, values, bounds=None):
    values = np.asarray(values, dtype=float)
    table = lookup_table(transfer, bounds or (float(values.min()), float(values.max())))
    colors, strength = classify(table, values, Workspace())
    return colors.copy(), strength.copy()


@st.composite
def transfer_functions(draw):
    """Transfer functions with knots anywhere, close together, and doubled to jumps."""
    positions = draw(
        st.lists(st.floats(-100, 100, allow_subnormal=False), min_size=1, max_size=12, unique=True)
    )
    jumps = draw(st.lists(st.sampled_from(positions), max_size=3, unique=True))
    close = [p + 1e-6 for p in draw(st.lists(st.sampled_from(positions), max_size=2, unique=True))]
    knots = sorted({*positions, *close})
    knots = sorted([*knots, *jumps])
    n = len(knots)
    colors = draw(st.lists(st.tuples(UNIT, UNIT, UNIT), min_size=n, max_size=n))
    strength = draw(st.lists(UNIT, min_size=n, max_size=n))
    if draw(st.booleans()):
        return TransferFunction(knots, colors, strength)
    return TransferFunction(knots, colors, opacity=strength)


@given(
    transfer=transfer_functions(),
    more=st.lists(st.floats(-120, 120), min_size=1, max_size=20),
)
def test_tables_equal_the_scalar_walk_over_the_knots(transfer, more):
    # The knots themselves and their neighbours in float64 are where a bucket could go wrong.
    knots = transfer.values
    values = np.concatenate([more, knots, np.nextafter(knots, -np.inf), np.nextafter(knots, np.inf)])
    colors, strength = classified(transfer, values)
    positions = knots.tolist()
    columns = [*transfer.colors.T, transfer.extinction if transfer.opacity is None else transfer.opacity]
    for column, got in zip(columns, [*colors, strength], strict=True):
        expected = [scalar.table_value(positions, column.tolist(), v) for v in values]
        # value - start is exact to an ulp of 120, over the narrowest gap of 1e-6 at a slope of at most 1e6.
        np.testing.assert_allclose(got, expected, rtol=0, atol=4 * EPS * 120 * 1e6)


def test_a_knot_gives_its_own_numbers_exactly():
    rng = np.random.default_rng(0)
    knots = np.sort(rng.uniform(-5, 5, 40))
    colors, opacity = rng.random((40, 3)), rng.random(40)
    got_colors, got = classified(TransferFunction(knots, colors, opacity=opacity), knots)
    np.testing.assert_array_equal(got_colors, colors.T)
    np.testing.assert_array_equal(got, opacity)


def test_at_a_jump_the_value_itself_takes_the_later_knot():
    transfer = TransferFunction([0, 1, 1, 2], np.ones((4, 3)), [0, 0, 5, 5])
    _, strength = classified(transfer, [0.0, np.nextafter(1.0, 0), 1.0, 2.0])
    assert strength.tolist() == [0, 0, 5, 5]


def test_jumps_at_both_ends_hold():
    transfer = TransferFunction([0, 0, 1, 1], np.ones((4, 3)), [1, 2, 3, 4])
    _, strength = classified(transfer, [-1.0, 0.0, 1.0, 2.0])
    assert strength.tolist() == [1, 2, 4, 4]


def test_half_texel_a_lut_entry_is_met_at_its_centre():
    table = np.zeros((4, 4))
    table[:, 3] = [0.1, 0.2, 0.4, 0.8]
    transfer = TransferFunction.from_lut(table, (0.0, 8.0))
    _, opacity = classified(transfer, [0.0, 1.0, 2.0, 3.0, 7.0, 8.0])
    np.testing.assert_allclose(opacity, [0.1, 0.1, 0.15, 0.2, 0.8, 0.8], rtol=4 * EPS)


def test_without_texel_centres_the_outer_entries_lie_at_the_ends_of_the_domain():
    table = np.zeros((3, 4))
    table[:, 3] = [0.1, 0.2, 0.4]
    transfer = TransferFunction.from_lut(table, (0.0, 8.0), texel_centers=False)
    _, opacity = classified(transfer, [0.0, 2.0, 4.0, 8.0])
    np.testing.assert_allclose(opacity, [0.1, 0.15, 0.2, 0.4], rtol=4 * EPS)


def test_gaps_too_narrow_for_buckets_are_searched_with_the_same_result():
    knots = np.array([0.0, 0.5, 0.5 + 1e-9, 1.0])
    transfer = TransferFunction(knots, np.ones((4, 3)), [0.0, 1.0, 3.0, 0.0])
    table = lookup_table(transfer, (0.0, 1.0))
    assert table.scale is None
    assert MOST_BUCKETS < 2 / 1e-9
    _, strength = classified(transfer, [0.25, 0.5, 0.5 + 1e-9, 0.75, 1.0])
    np.testing.assert_allclose(strength, [0.5, 1.0, 3.0, 1.5, 0.0], rtol=1e-8)  # the gap itself is rounded


def test_a_constant_volume_needs_no_range():
    transfer = TransferFunction([0, 0.5, 0.6, 2], np.ones((4, 3)), [0, 1, 2, 3])
    assert classified(transfer, [0.55, 0.55])[1].tolist() == pytest.approx([1.5, 1.5], rel=4 * EPS)


@pytest.mark.parametrize("length", [1e-6, 0.25, 0.5, 1.0, 3.0])
@pytest.mark.parametrize("strength", [0.0, 1e-17, 1e-9, 0.3, 0.999999, 1.0])
def test_segment_opacities_keep_their_digits(strength, length):
    unit_distance = 1.0
    transfer = TransferFunction(
        [0, 1], np.ones((2, 3)), opacity=[strength, strength], unit_distance=unit_distance
    )
    got = segment_opacity(lookup_table(transfer, (0, 1)), np.array([strength]), length)[0]
    with mpmath.workdps(40):
        expected = float(1 - (1 - mpmath.mpf(strength)) ** mpmath.mpf(length))
    # log1p, one product and expm1 at an ulp each; the product's rounding grows with |log(1 - a)| <= 14.
    assert got == pytest.approx(expected, rel=32 * EPS, abs=0)


@given(extinction=st.floats(0, 1e6), length=st.floats(1e-9, 10))
def test_segment_opacity_of_an_extinction_is_that_of_a_homogeneous_segment(extinction, length):
    transfer = TransferFunction([0], [(1, 1, 1)], [extinction])
    got = segment_opacity(lookup_table(transfer, (0, 1)), np.array([extinction]), length)[0]
    with mpmath.workdps(40):
        expected = float(-mpmath.expm1(-mpmath.mpf(extinction) * mpmath.mpf(length)))
    assert got == pytest.approx(expected, rel=4 * EPS, abs=0)


@given(opacity=UNIT, ratio=st.sampled_from([0.5, 1.0]))
def test_the_short_cuts_for_the_usual_steps_equal_the_general_formula(opacity, ratio):
    transfer = TransferFunction([0], [(1, 1, 1)], opacity=[opacity], unit_distance=2.0)
    table = lookup_table(transfer, (0, 1))
    short = segment_opacity(table, np.array([opacity]), ratio * 2.0)
    general = segment_opacity(table, np.array([opacity]), np.array([ratio * 2.0]))
    np.testing.assert_allclose(short, general, rtol=64 * EPS, atol=0)  # |log(1 - a)| <= 37 times an ulp


@given(transfer=transfer_functions(), low=st.floats(-120, 120), length=st.floats(0, 30))
def test_what_is_not_visible_has_no_opacity_anywhere(transfer, low, length):
    high = low + length
    values = np.concatenate([np.linspace(low, high, 50), transfer.values])
    values = values[(values >= low) & (values <= high)]
    _, strength = classified(transfer, values)
    if not transfer.is_visible(low, high):
        assert not strength.any()


def test_a_background_exactly_at_the_foot_of_a_ramp_is_not_visible():
    transfer = TransferFunction([0, 1], np.ones((2, 3)), [0, 1])
    assert not transfer.is_visible(0.0, 0.0)
    assert transfer.is_visible(0.0, 1e-12)


def test_knots_so_close_that_their_slope_overflows_are_a_jump():
    transfer = TransferFunction([0.0, 5e-324, 1.0], np.ones((3, 3)), [0.0, 1.0, 2.0])
    _, strength = classified(transfer, [0.0, 5e-324, 0.5])
    assert strength.tolist() == [0.0, 1.0, 1.5]


@given(count=st.integers(2, 40), offset=st.sampled_from([0.0, 0.1, -7.3]), parts=st.sampled_from([1, 3, 7]))
def test_tables_with_even_knots_are_exact_at_them(count, offset, parts):
    values = offset + np.arange(count) / 8 * parts  # even to the bit, which offsets may spoil
    strength = np.where(np.arange(count) % 3, np.arange(count) * 0.1, 0.0)
    transfer = TransferFunction(values, np.ones((count, 3)), strength)
    if offset == 0.0:
        assert lookup_table(transfer, (values[0], values[-1])).knots is None
    _, found = classified(transfer, values)
    np.testing.assert_array_equal(found, strength)
    between = (values[1:] + values[:-1]) / 2
    # The slope is rounded, the offset off by an ulp of the values.
    np.testing.assert_allclose(
        classified(transfer, between)[1], np.interp(between, values, strength), atol=1e-13
    )


def test_a_knot_just_outside_the_values_does_not_hide_one_just_inside():
    transfer = TransferFunction([-1e-3, 1e-3, 1.0], np.ones((3, 3)), [0.0, 5.0, 5.0])
    _, strength = classified(transfer, [0.0, 1e-3, 2e-3, 0.1, 1.0])
    assert strength.tolist() == [2.5, 5.0, 5.0, 5.0, 5.0]


def test_values_a_few_ulp_apart_are_told_apart():
    ulp = np.spacing(1.0)
    knots = 1.0 + ulp * np.array([0, 1, 2, 3])
    transfer = TransferFunction(knots, np.ones((4, 3)), [1.0, 2.0, 4.0, 8.0])
    _, strength = classified(transfer, knots)
    assert strength.tolist() == [1.0, 2.0, 4.0, 8.0]


@pytest.mark.parametrize("values", [[-0.1, -0.05, -0.05], [-0.1, -0.0998, 199.1]])
def test_knots_close_to_each_other_beyond_the_range_are_told_apart(values):
    table = TransferFunction(values, [(0.1, 0.2, 0.3), (0.5, 0.5, 0.5), (1.0, 0.0, 0.4)], [5.0, 0.0, 0.25])
    for bounds in ((0.0, 0.0), (0.0, 199.0)):
        looked_up = lookup_table(table, bounds)
        _, strength = classify(looked_up, np.zeros(1), Workspace())
        assert strength[0] == pytest.approx(np.interp(0.0, values, [5.0, 0.0, 0.25]), abs=1e-15)
