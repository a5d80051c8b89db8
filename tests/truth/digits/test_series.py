import dataclasses

import pytest
from mpmath import mp, mpf

from volref.scene import TransferFunction
from volref.truth.digits.pieces import evaluate
from volref.truth.digits.series import Medium, edge_step, taylor_step
from volref.truth.digits.table import exact_table

TOLERANCE = 1e-30
ZERO = mpf(0)


@pytest.fixture(autouse=True)
def _seventy_digits():
    with mp.workdps(70):
        yield


def medium(kind, strengths, unit_distance=1.0, colors=((0, 0.2, 1), (1, 0.5, 0))):
    table = exact_table(
        mp, TransferFunction([0, 1], colors, **{kind: strengths}, unit_distance=unit_distance)
    )
    return Medium(table.intervals[1], table.unit_distance, 1.0, TOLERANCE)


def rate(within, value, length):
    """Optical depth per z as a function of z."""

    def at(z):
        strength = within.interval.strength_at(evaluate(value, z))
        if within.unit_distance is None:
            return length * strength
        return -length / within.unit_distance * mp.log(1 - strength)

    return at


def integrals(within, value, length):
    """Depth and moment by nested Gauss-Legendre quadrature."""
    at = rate(within, value, length)

    def light(z):
        before = mp.quad(at, [-1, z], method="gauss-legendre")
        return (evaluate(value, z) - value[0]) * at(z) * mp.exp(-before)

    return [mp.quad(function, [-1, 1], method="gauss-legendre") for function in (at, light)]


@pytest.mark.parametrize("kind", ["extinction", "opacity"])
@pytest.mark.parametrize(
    ("bends", "length", "strengths"),
    [
        ((0.1, 0.0, 0.0), 1.0, (0.3, 0.7)),
        ((-0.04, 0.01, -0.002), 1.5, (0.7, 0.0)),
        ((0.0, 0.0, 0.015), 0.01, (0.0, 0.6)),
        ((0.02, -0.05, 0.0), 2.0, (0.5, 0.5)),
    ],
)
def test_a_step_is_the_integral_within_its_remainder(kind, bends, length, strengths):
    with mp.workdps(40):
        within = medium(kind, strengths)
        value = [mpf("0.5"), *map(mpf, bends)]
        step = taylor_step(mp, within, value, mpf(length), ZERO)
        depth, moment = integrals(within, value, mpf(length))
        assert abs(step.depth - depth) <= step.remainder
        assert abs(step.moment - moment) <= step.remainder
        assert step.remainder <= 3 * TOLERANCE * step.depth


def test_the_change_of_the_colour_counts_in_the_remainder():
    # With a brightest colour said to be faint, nothing but the change of the colour is left to ask for terms.
    within = dataclasses.replace(medium("extinction", (0, 1)), brightest=1e-20)
    value = [mpf("0.5"), mpf("0.3"), mpf("0.1"), mpf("-0.1")]
    step = taylor_step(mp, within, value, mpf(1), ZERO)
    more = taylor_step(mp, dataclasses.replace(within, tolerance=1e-45), value, mpf(1), ZERO)
    assert step.remainder <= 2e-50
    assert abs(step.moment - more.moment) <= step.remainder


def test_the_series_keep_the_digits_of_the_faintest_media():
    value = [mpf("0.5"), mpf("0.25"), mpf("0.125"), mpf("-0.1")]
    for kind in ("extinction", "opacity"):
        within = medium(kind, (0.0, 1e-300))
        step = taylor_step(mp, within, value, mpf(1), ZERO)
        # To first order in the strength w = slope s: depth = int w, moment = int (s - s(0)) w.
        strength = within.interval.strength_slope
        depth = 2 * strength * (value[0] + value[2] / 3)
        away = [0, *value[1:]]
        square = sum(
            strength * a * b * 2 / (i + j + 1)
            for i, a in enumerate(away)
            for j, b in enumerate(value)
            if (i + j) % 2 == 0
        )
        assert abs(step.depth / depth - 1) <= TOLERANCE
        assert abs(step.moment / square - 1) <= 3 * TOLERANCE  # of the depth, and the moment is half of it


def test_a_step_too_thick_or_too_close_to_an_opacity_of_1_is_refused():
    value = [mpf("0.5"), mpf("0.5"), ZERO, ZERO]
    assert taylor_step(mp, medium("extinction", (1, 5)), value, mpf(1), ZERO) is None
    assert taylor_step(mp, medium("opacity", (0, 1)), value, mpf("0.1"), ZERO) is None
    half = [mpf("0.5"), mpf("0.05"), ZERO, ZERO]
    assert taylor_step(mp, medium("opacity", (0, 1)), half, mpf("0.1"), ZERO) is not None


def test_more_depth_in_front_allows_a_larger_remainder():
    value, within = [mpf("0.5"), mpf("0.1"), ZERO, ZERO], medium("extinction", (0, 1))
    thin = taylor_step(mp, within, value, mpf("1e-9"), ZERO)
    behind = taylor_step(mp, within, value, mpf("1e-9"), mpf(1))
    assert thin.remainder < mpf("1e-37") < behind.remainder < TOLERANCE


def test_an_edge_step_has_the_depth_of_a_logarithm():
    within = medium("opacity", (0, 1), unit_distance=2.0)
    # The opacity rises to 1 over a length of 2 h: int -log(1 - a) = w (1 - log w) with w = 2 h, halved.
    h = mpf(10) ** -17
    for end, rising in ((1 - h, h), (1 - h, -h)):
        step = edge_step(mp, within, [end, rising, ZERO, ZERO], h)
        expected = 2 * h * (1 - mp.log(2 * h)) / 2
        assert abs(step.depth - expected) <= TOLERANCE * expected
        assert step.moment == 0
        assert 2 * h * step.depth / 4 <= step.remainder <= TOLERANCE


def test_an_edge_step_is_refused_where_the_colour_changes_too_much():
    within = medium("opacity", (0, 1))
    h = mpf(10) ** -12
    assert edge_step(mp, within, [1 - h, h, ZERO, ZERO], h) is None
    grey = medium("opacity", (0, 1), colors=((1, 1, 1), (1, 1, 1)))
    assert edge_step(mp, grey, [1 - h, h, ZERO, ZERO], h).remainder == 0
