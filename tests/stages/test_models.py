"""Models of tables over ranges of values, against the table in exact and 50-digit arithmetic."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mpmath import mp, mpf

from tests.scene.test_table import channels_at, tables
from volref import TransferFunction
from volref.scene.table import STRENGTH
from volref.stages.models import columns as column
from volref.stages.models import look_up, models_of, piece_of, rows_of

U = 2.0**-53
COLORS = [(0.2, 0.0, 1.0), (0.2, 0.4, 1.0), (1.0, 0.6, 0.1), (0.9, 0.9, 0.3), (0.1, 0.9, 0.3)]
some = settings(max_examples=20)


@pytest.fixture(autouse=True)
def _fifty_digits():
    with mp.workdps(50):
        yield


def extinction_at(transfer, value):
    """Extinction at an exact value, as mpmath number."""
    strength = channels_at(transfer, value)[STRENGTH]
    number = mpf(strength.numerator) / strength.denominator
    if transfer.extinction is not None:
        return number
    return -mp.log1p(-number) / mpf(transfer.unit_distance) if number < 1 else mp.inf


def values_between(transfer, low, high, count=7):
    """Values from low to high: evenly spaced ones, and knots with those just below them."""
    knots = [v for v in transfer.values if low <= v <= high]
    inside = np.concatenate([np.linspace(low, high, count), knots, np.nextafter(knots, -np.inf)])
    found = np.unique(inside[(inside >= low) & (inside <= high)])
    return found[:: max(1, len(found) // 40)]


def assert_model(transfer, models, row, low, high):
    """The row's line and parabolas are the table from low to high but for what it says, and rounding."""
    rows = models.rows[:, row]
    offset = Fraction(float(rows[column.CENTER]))
    sigma0, sigma1, sigma_off = (rows[k] for k in (column.SIGMA0, column.SIGMA1, column.SIGMA_OFF))
    at_ends = [sigma0 + sigma1 * (end - rows[column.CENTER]) for end in (low, high)]
    greatest = max(float(sigma0), *map(float, at_ends))
    # The centre is rounded, and so is half the width.
    at_center = 2 * U * abs(sigma1 * rows[column.CENTER])
    assert min(at_ends) >= -64 * U * max(greatest, sigma_off) - at_center
    brightest = max(1.0, transfer.colors.max())
    for value in map(float, values_between(transfer, low, high)):
        exact = Fraction(value)
        s = mpf((exact - offset).numerator) / (exact - offset).denominator
        sigma = extinction_at(transfer, exact)
        line = mpf(float(sigma0)) + mpf(float(sigma1)) * s
        # Fits are made in float64: some tens of ulp of what the line is in the middle, or further on.
        assert abs(sigma - line) <= sigma_off + 256 * U * max(greatest, float(min(sigma, 1e300)))
        if sigma == 0:
            continue  # nothing to see: its colour does not matter
        for channel, true in enumerate(channels_at(transfer, exact)[:3]):
            c0, c1, c2 = (mpf(float(rows[c][channel])) for c in (column.C0, column.C1, column.C2))
            found = c0 + c1 * s + c2 * s * s
            off = abs(found - mpf(true.numerator) / true.denominator)
            assert off <= rows[column.COLOR_OFF] + 256 * U * brightest


@st.composite
def long_tables(draw):
    """Tables of some hundred knots, smooth or of independent numbers."""
    count, seed = draw(st.integers(70, 600)), draw(st.integers(0, 999))
    rng = np.random.default_rng(seed)
    values = np.linspace(0.0, 1.0, count) if draw(st.booleans()) else np.sort(rng.random(count))
    if draw(st.booleans()):
        wave = 0.5 + 0.5 * np.sin(np.arange(count) * draw(st.sampled_from([0.01, 0.1])))
        strength, colors = wave, np.stack([wave, 1 - wave, wave**2], axis=1)
    else:
        strength, colors = rng.random(count) * (rng.random(count) < 0.7), rng.random((count, 3))
    if draw(st.booleans()):
        return TransferFunction(values, colors, strength * 10.0 ** draw(st.integers(-3, 3)))
    return TransferFunction(values, colors, opacity=strength * draw(st.sampled_from([1.0, 0.9, 1e-3])))


# --- runs


@some
@given(
    st.one_of(tables(), long_tables()),
    st.lists(st.tuples(*[st.floats(0.0, 1.0)] * 2), min_size=1, max_size=6),
)
def test_the_row_of_a_range_models_the_table_there(transfer, ranges):
    bounds = min(transfer.values[0], 0.0) - 0.125, max(transfer.values[-1], 1.0) + 0.25
    models = models_of(transfer, *bounds)
    width = bounds[1] - bounds[0]
    # Wide ranges and, where the second share scales them down, narrow ones.
    low = bounds[0] + width * np.array([a for a, _ in ranges])
    high = np.minimum(low + width * np.array([b**6 for _, b in ranges]), bounds[1])
    for row, a, b in zip(rows_of(models, low, high), low, high, strict=True):
        assert row < models.exact
        assert_model(transfer, models, row, float(a), float(b))


@some
@given(st.one_of(tables(), long_tables()), st.data())
def test_ranges_that_begin_and_end_at_knots_are_modelled_too(transfer, data):
    knots = np.unique(transfer.values)
    models = models_of(transfer, knots[0] - 1.0, knots[-1] + 1.0)
    i = data.draw(st.integers(0, len(knots) - 1))
    k = data.draw(st.integers(i, min(i + 70, len(knots) - 1)))
    row = rows_of(models, knots[i : i + 1], knots[k : k + 1])[0]
    assert_model(transfer, models, row, float(knots[i]), float(knots[k]))


def test_long_tables_have_coarser_levels():
    rng = np.random.default_rng(1)
    transfer = TransferFunction(np.linspace(0, 1, 600), rng.random((600, 3)), rng.random(600))
    models = models_of(transfer, 0.0, 1.0)
    assert len(models.levels) > 3
    everything = rows_of(models, np.array([0.0]), np.array([1.0]))[0]
    assert_model(transfer, models, everything, 0.0, 1.0)
    # Runs of the longest length of each level and those one longer take another level.
    for length in range(1, 600, 13):
        low, high = 0.1 / 599, (length + 0.1) / 599
        row = rows_of(models, np.array([low]), np.array([min(high, 1.0)]))[0]
        assert_model(transfer, models, row, low, min(high, 1.0))


def test_the_model_of_one_straight_piece_is_that_piece():
    transfer = TransferFunction([0.0, 1.0], COLORS[:2], [1.0, 3.0])
    models = models_of(transfer, 0.25, 0.75)
    row = models.rows[:, rows_of(models, np.array([0.3]), np.array([0.6]))[0]]
    assert row[column.SIGMA_OFF] <= 8 * U
    assert row[column.COLOR_OFF] <= 8 * U
    assert row[column.SIGMA1] == pytest.approx(2.0, rel=1e-14)
    assert row[column.C1] == pytest.approx(np.subtract(COLORS[1], COLORS[0]), abs=1e-14)


def test_a_ramp_from_0_is_off_by_a_quarter_of_its_end_at_most():
    # 0 up to the middle, then rising to 1: the best line above 0 is off by 1/4, one through the ends by 1/2.
    table = TransferFunction(np.linspace(-1, 1, 99), np.ones((99, 3)), np.maximum(np.linspace(-1, 1, 99), 0))
    models = models_of(table, -1.0, 1.0)
    row = models.rows[:, rows_of(models, np.array([-0.9]), np.array([0.9]))[0]]
    assert row[column.SIGMA_OFF] <= 0.5 * 1.05


def test_models_of_smooth_tables_improve_with_the_square_of_the_range():
    values = np.linspace(0, 1, 512)
    wave = 0.5 + 0.5 * np.sin(7 * values)
    models = models_of(TransferFunction(values, np.ones((512, 3)), wave), 0.0, 1.0)
    widths = np.array([0.4, 0.1, 0.025])
    off = models.rows[column.SIGMA_OFF, rows_of(models, 0.3 - widths / 2, 0.3 + widths / 2)]
    # A parabola of second derivative 49/2 is off by 49/2 w^2 / 16 from its best line.
    assert (off <= 49 / 2 * (1.3 * widths + 0.01) ** 2 / 16).all()


def test_colours_are_fitted_by_parabolas():
    values = np.linspace(0, 1, 512)
    models = models_of(
        TransferFunction(values, np.stack([values**2] * 3, axis=1), np.sin(9 * values) ** 2), 0.0, 1.0
    )
    assert models.bent
    row = models.rows[:, rows_of(models, np.array([0.3]), np.array([0.33]))[0]]
    assert row[column.C2] == pytest.approx(1.0, rel=0.05)
    # 512 knots on a parabola: a chord leaves it by 1 / (4 * 512^2).
    assert row[column.COLOR_OFF] <= 2 / (4 * 511**2)


# --- exact rows


@some
@given(st.one_of(tables(), long_tables()))
def test_exact_rows_are_the_table_between_bends(transfer):
    low, high = float(transfer.values[0]) - 0.5, float(transfer.values[-1]) + 0.5
    models = models_of(transfer, low, high)
    count = models.rows.shape[1] - models.exact
    assert len(models.bends) == count + 1
    for j in list(range(count))[:: max(1, count // 12)]:
        a, b = models.bends[j], np.nextafter(models.bends[j + 1], -np.inf)
        row = models.rows[:, models.exact + j]
        if transfer.extinction is not None:
            assert_model(transfer, models, models.exact + j, float(a), float(b))
            continue
        middle, slope = (mpf(float(row[k])) for k in (column.ALPHA0, column.ALPHA1))
        end, least = (mpf(float(row[k])) for k in (column.DENSE_END, column.LEAST_CLEAR))
        for value in map(float, values_between(transfer, a, b, 3)):
            true = channels_at(transfer, Fraction(value))[STRENGTH]
            opacity = mpf(true.numerator) / true.denominator
            assert abs(middle + slope * (value - mpf(float(row[column.CENTER]))) - opacity) <= 16 * U
            clear = least + abs(slope) * abs(value - end)
            if clear < 0.5:
                # Bends of up to 2^-50 may have been removed.
                assert abs(clear - (1 - opacity)) <= 16 * U * (1 - opacity) + _removed(row, transfer)


def _removed(row, transfer):
    off = row[column.SIGMA_OFF] * transfer.unit_distance
    return off if np.isfinite(off) else 2.0**-46


def test_the_centre_of_an_exact_row_is_where_its_level_holds():
    # Knots 33 ulp apart: their middle is no float64, and half an ulp beside it the level is another.
    ulp = 2.0**-52
    transfer = TransferFunction([1.0, 1 + 33 * ulp], COLORS[:2], [0.0, 1.0])
    models = models_of(transfer, 1.0, 1 + 33 * ulp)
    for k in range(34):
        value = 1 + k * ulp
        row = models.rows[:, models.exact + piece_of(models.bend_locator, np.array([value]))[0]]
        found = row[column.SIGMA0] + row[column.SIGMA1] * (value - row[column.CENTER])
        assert found == pytest.approx(k / 33, abs=1e-14)


@pytest.mark.parametrize(
    ("clear", "knots"), [((1e-9, 1e-12), (0.0, 1000.0)), ((1e-12, 1e-9), (-1000.0, 1.0))]
)
def test_opacities_near_1_between_far_knots_keep_the_digits_of_what_is_clear(clear, knots):
    transfer = TransferFunction(knots, COLORS[:2], opacity=1 - np.array(clear))
    models = models_of(transfer, 0.25, 0.75)
    for value in (0.25, 0.5, 0.75):
        row = models.rows[:, models.exact + piece_of(models.bend_locator, np.array([value]))[0]]
        found = row[column.LEAST_CLEAR] + abs(row[column.ALPHA1]) * abs(value - row[column.DENSE_END])
        true = 1 - channels_at(transfer, Fraction(value))[STRENGTH]
        assert abs(Fraction(found) - true) <= 16 * Fraction(U) * true


def exact_rows(transfer, low=0.0, high=4.0):
    models = models_of(transfer, low, high)
    return models, models.rows[:, models.exact :]


def test_jumps_cost_their_height_on_both_sides():
    transfer = TransferFunction(
        [1.0, 1.0, 2.0, 2.0], [(0, 0, 0), (1, 0, 0), (1, 0, 0), (1, 0.5, 0)], [1, 4, 4, 2]
    )
    models, rows = exact_rows(transfer)
    assert models.bends[1:-1].tolist() == [1.0, 2.0]
    assert rows[column.JUMP].tolist() == [3.0, 3.0, 2.0]
    # The change of colour times the greater extinction on either side.
    assert rows[column.JUMP_LIGHT].tolist() == [4.0, 4.0, 2.0]
    assert models.most_jump == 3.0
    assert models.most_sigma == 4.0


def test_slopes_beside_a_piece_are_the_steepest_of_it_and_its_neighbours():
    transfer = TransferFunction(
        [0.0, 1.0, 2.0, 3.0], np.array([[0, 0, 0, 3.0]] * 3).T / 3, [0.0, 5.0, 5.0, 3.0]
    )
    models, rows = exact_rows(transfer)
    slopes = dict(zip(models.bends[:-1].tolist(), rows[column.BESIDE].tolist(), strict=True))
    assert slopes[0.0] == 5.0
    assert slopes[1.0] == 5.0
    assert slopes[2.0] == 2.0
    assert rows[column.COLOR_BESIDE, models.bends[:-1].tolist().index(1.0)] == 1.0
    assert models.most_slope == 5.0


def test_slopes_of_opacity_count_where_it_is_greatest():
    transfer = TransferFunction([0.0, 1.0], np.ones((2, 3)), opacity=[0.0, 0.75], unit_distance=0.5)
    _, rows = exact_rows(transfer, 0.25, 0.75)
    assert rows[column.BESIDE].max() == pytest.approx(0.75 / 0.25 / 0.5, rel=1e-14)


def test_opacity_1_at_a_knot_is_touched_from_both_sides():
    transfer = TransferFunction([0.0, 1.0, 3.0], np.ones((3, 3)), opacity=[0.5, 1.0, 0.5])
    models, rows = exact_rows(transfer, 0.0, 3.0)
    at = models.bends[:-1].tolist().index(0.0), models.bends[:-1].tolist().index(1.0)
    assert rows[column.TOUCHING, list(at)].tolist() == [0.25, 0.25]  # the lesser slope of both
    assert not rows[column.IS_OPAQUE].any()
    assert models.most_slope == np.inf
    assert not models.opaque


def test_opaque_pieces_know_of_each_other():
    transfer = TransferFunction([1.0, 1.0, 2.0, 2.0], np.ones((4, 3)), opacity=[0.1, 1.0, 1.0, 0.2])
    models, rows = exact_rows(transfer)
    assert models.opaque
    assert rows[column.IS_OPAQUE].tolist() == [0, 1, 0]
    assert rows[column.OPAQUE_ABOVE].tolist() == [1, 0, 0]
    assert rows[column.OPAQUE_BELOW].tolist() == [0, 0, 1]
    # Beside it only the light of the clearer side can be missing.
    assert rows[column.JUMP].tolist() == [0, 0, 0]
    light = -np.log1p(-np.array([0.1, 0.2]))
    assert rows[column.JUMP_LIGHT] == pytest.approx([light[0], light[1], light[1]], rel=1e-14)


def test_clear_pieces_beside_opaque_ones_are_seen():
    _, rows = exact_rows(TransferFunction([1.0, 1.0], np.ones((2, 3)), opacity=[1.0, 0.0]))
    assert rows[column.SEEN].tolist() == [1, 1]


@some
@given(tables())
def test_rows_that_are_not_seen_are_clear(transfer):
    low, high = float(transfer.values[0]) - 0.5, float(transfer.values[-1]) + 0.5
    models = models_of(transfer, low, high)
    edges = np.linspace(low, high, 23)
    rows = rows_of(models, edges[:-1], edges[1:])
    for row, a, b in zip(rows, edges[:-1], edges[1:], strict=True):
        if not models.rows[column.SEEN, row]:
            assert all(
                extinction_at(transfer, Fraction(float(v))) == 0 for v in values_between(transfer, a, b)
            )


# --- finding rows


@some
@given(st.one_of(tables(), long_tables()), st.lists(st.floats(-0.1, 1.1), max_size=8))
def test_the_piece_of_a_value_is_found_as_by_searching(transfer, shares):
    low, high = float(transfer.values[0]) - 0.25, float(transfer.values[-1]) + 0.25
    models = models_of(transfer, low, high)
    for locator, breaks in ((models.bend_locator, models.bends), (models.locator, None)):
        inner = locator.inner if breaks is None else breaks[1:-1]
        values = [
            low,
            high,
            *inner[:50],
            *np.nextafter(inner[:50], -np.inf),
            *np.nextafter(inner[:50], np.inf),
        ]
        values = np.array([*values, *(low + (high - low) * np.array(shares))])
        values = values[(values >= low) & (values <= high)]
        assert piece_of(locator, values).tolist() == np.searchsorted(inner, values, side="right").tolist()


@pytest.mark.parametrize(
    "transfer",
    [
        TransferFunction([1.0, 1 + 33 * 2.0**-52], COLORS[:2], opacity=[0.0, 0.9]),
        TransferFunction([0.0, 1e-300, 1.0], COLORS[:3], [0.0, 1.0, 0.5]),
        TransferFunction([-1e300, 0.0, 1e300], COLORS[:3], [0.0, 1.0, 0.5]),
        TransferFunction([0.0, 1e-6, 1.0], COLORS[:3], opacity=[0.0, 1.0, 0.5]),
        TransferFunction([3.0], COLORS[:1], [1.0]),
    ],
)
def test_knots_of_any_distance_are_found(transfer):
    low, high = float(transfer.values[0]), float(transfer.values[-1])
    for bounds in ((low, high), (low, low), (high, high)):
        models = models_of(transfer, *bounds)
        for locator in (models.locator, models.bend_locator):
            values = np.array([bounds[0], bounds[1], *locator.inner])
            assert (
                piece_of(locator, values).tolist()
                == np.searchsorted(locator.inner, values, side="right").tolist()
            )


# --- where rays enter and leave


@some
@given(st.one_of(tables(), long_tables()), st.lists(st.floats(0.0, 1.0), min_size=1, max_size=6))
def test_what_is_looked_up_bounds_the_extinction_and_the_colour(transfer, shares):
    low, high = float(transfer.values[0]) - 0.25, float(transfer.values[-1]) + 0.25
    models = models_of(transfer, low, high)
    values = np.array([*(low + (high - low) * np.array(shares)), *transfer.values[:20]])
    extinction, color, off = look_up(models, values)
    assert np.isfinite(extinction).all()
    for k, value in enumerate(values):
        sigma = extinction_at(transfer, Fraction(float(value)))
        if mp.isinf(sigma):
            continue
        # A bound of a bound on rounding: 1e-9 of it is nothing.
        assert sigma <= extinction[k] * (1 + 1e-9) + 1e-300
        for channel, true in enumerate(channels_at(transfer, Fraction(float(value)))[:3]):
            assert sigma == 0 or abs(float(true) - color[channel, k]) <= off[k] + 256 * U
