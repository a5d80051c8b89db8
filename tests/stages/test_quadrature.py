"""The moments of pieces against adaptive quadrature at 30 digits, and their remainder against its derivation.

On a piece of value f0 + g(v) the density is A(v) = a0 + slope g(v), at least 0 for v from -1/2 to 1/2.
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mpmath import mp, mpf
from numpy.polynomial import chebyshev

from volref.stages.quadrature import ORDERS, REACH, RHO, RHOS, gauss_pairs, moments

ELLIPSES = (RHO, *RHOS)
few = settings(max_examples=25)  # each takes three quadratures at 30 digits


# --- the rules


@pytest.mark.parametrize("order", ORDERS)
def test_a_rule_is_exact_to_degree_2k_minus_1_and_not_to_2k(order):
    middle, pairs = gauss_pairs(order)
    for degree in range(2 * order + 1):
        rule = (middle if degree == 0 else 0.0) + sum(w * (x**degree + (-x) ** degree) for x, w in pairs)
        exact = 0.5**degree / (degree + 1) if degree % 2 == 0 else 0.0
        # Nodes and weights are good to some ulp each, of terms no larger than 2^-degree.
        assert (abs(rule - exact) <= 0.5**degree * order * 1e-15) == (degree < 2 * order)


@pytest.mark.parametrize("order", ORDERS)
def test_orders_are_odd_so_that_the_middle_node_costs_nothing(order):
    middle, pairs = gauss_pairs(order)
    assert middle > 0
    assert len(pairs) == order // 2
    assert middle + 2 * sum(weight for _, weight in pairs) == pytest.approx(1.0, rel=1e-15)


@pytest.mark.parametrize("order", ORDERS)
def test_a_rule_is_off_by_at_most_2_and_2_fifteenths_for_even_chebyshev_polynomials(order):
    # The lemma behind the remainder, for the interval of length 2; j >= 2 k >= 4.
    middle, pairs = gauss_pairs(order)
    for degree in range(2 * order, 120, 2):
        polynomial = np.eye(degree + 1)[degree]
        rule = 2 * middle * chebyshev.chebval(0.0, polynomial)
        rule += sum(2 * 2 * w * chebyshev.chebval(2 * x, polynomial) for x, w in pairs)
        assert abs(rule + 2 / (degree**2 - 1)) <= 2 + 2 / 15


def test_how_much_further_a_cubic_reaches_in_the_widest_ellipse():
    rho = max(ELLIPSES)
    # |v| <= (rho + 1 / rho) / 4 there, against 1/2 on the piece.
    assert ((rho + 1 / rho) / 2) ** 3 == pytest.approx(REACH)


# --- the moments


def true_moments(cubic, density):
    """J1 and J2 of one piece at 30 digits, in parts that grow from the near end."""
    with mp.workdps(40):
        f1, f2, f3 = map(mpf, cubic[1:])
        a0, a1, a2, a3 = map(mpf, density)

        def depth(v):
            return ((a3 / 4 * v + a2 / 3) * v + a1 / 2) * v * v + a0 * v

        def integrand(power):
            def value(v):
                g = ((f3 * v + f2) * v + f1) * v
                return g**power * (((a3 * v + a2) * v + a1) * v + a0) * mp.exp(depth(-mpf(1) / 2) - depth(v))

            return value

        most = max(float(a0) + abs(float(a1)) + abs(float(a2)) + abs(float(a3)), 1.0)
        steps = max(0, int(np.log2(most)))
        breaks = [mpf(-1) / 2, *[mpf(2) ** -k - mpf(1) / 2 for k in range(steps + 1, -1, -1)]]
        return [mp.quad(integrand(power), breaks) for power in (1, 2)]


@st.composite
def pieces(draw):
    """Cubic and density (4,) of one piece, of optical depth up to some hundreds."""
    f = [draw(st.floats(-2.0, 2.0, width=32)) * draw(st.sampled_from([1.0, 1e-3, 0.0])) for _ in range(3)]
    low = -sum(abs(x) * 0.5**k for k, x in enumerate(f, start=1))  # no value is less
    slope = draw(st.sampled_from([0.0, 1.0, -1.0])) * 10.0 ** draw(st.floats(-4.0, 2.0, width=32))
    least = draw(st.sampled_from([0.0, 1e-12, 1.0])) * 10.0 ** draw(st.floats(-4.0, 2.0, width=32))
    return np.array([0.0, *f]), np.array([least - abs(slope) * low, *(slope * x for x in f)])


def rounding(cubic):
    """What float64 may lose: J1 is at most the reach, its terms have some ulp each, and t e^-t ulp more."""
    reach = 0.5 * abs(cubic[1]) + 0.25 * abs(cubic[2]) + 0.125 * abs(cubic[3])
    return reach, 64 * 2.0**-53 * reach


@few
@given(pieces(), st.sampled_from([1e-2, 1e-6, 1e-10, 1e-14]))
def test_moments_are_within_their_error(piece, limit):
    cubic, density = piece
    found = moments(cubic[:, None], density[:, None], np.array([limit]), second=True)
    first, second = true_moments(cubic.tolist(), density.tolist())
    reach, lost = rounding(cubic)
    assert abs(first - mpf(float(found.first[0]))) <= found.error[0] + lost
    assert abs(second - mpf(float(found.second[0]))) <= found.error[0] * REACH * reach + reach * lost


@given(st.lists(pieces(), min_size=1, max_size=8), st.sampled_from([1e-2, 1e-6, 1e-10, 1e-14, 0.0]))
def test_errors_stay_below_the_limit_or_below_what_a_moment_can_be(some, limit):
    cubic, density = (np.array(x).T for x in zip(*some, strict=True))
    found = moments(cubic, density, np.full(len(some), limit), second=True)
    depth = density[0] + density[2] / 12
    most = np.array([rounding(column)[0] for column in cubic.T]) * -np.expm1(-np.maximum(depth, 0.0))
    assert (found.error <= np.maximum(limit, most) * (1 + 1e-15)).all()
    given_up = (found.error > limit) & (found.error == most)
    assert (found.first[given_up] == 0).all()


@given(st.lists(pieces(), min_size=2, max_size=8), st.sampled_from([1e-3, 1e-9, 1e-13]))
def test_a_piece_is_the_same_whatever_pieces_it_stands_among(some, limit):
    cubic, density = (np.array(x).T for x in zip(*some, strict=True))
    together = moments(cubic, density, np.full(len(some), limit), second=True)
    for j in range(len(some)):
        alone = moments(cubic[:, [j]], density[:, [j]], np.array([limit]), second=True)
        for one, all_ in (
            (alone.first, together.first),
            (alone.second, together.second),
            (alone.error, together.error),
        ):
            # NumPy's exp may take another path for the last pieces of an array: an ulp of each of the terms.
            assert one[0] == pytest.approx(all_[j], rel=1e-14, abs=1e-300)


def test_the_second_moment_is_0_where_it_was_not_asked_for():
    cubic, density = np.array([[0.0], [1.0], [0.2], [0.1]]), np.array([[1.0], [0.5], [0.1], [0.0]])
    once = moments(cubic, density, np.array([1e-9]), second=False)
    assert once.second.tolist() == [0.0]
    assert once.first == moments(cubic, density, np.array([1e-9]), second=True).first


def remainder(cubic, density, order, rho):
    """The remainder of J1 in one ellipse, by its definition: the integrand is sampled on the ellipse."""
    angle = np.linspace(0.0, 2 * np.pi, 721)
    v = (rho * np.exp(1j * angle) + np.exp(-1j * angle) / rho) / 4
    g = ((cubic[3] * v + cubic[2]) * v + cubic[1]) * v
    dense = ((density[3] * v + density[2]) * v + density[1]) * v + density[0]

    def depth(u):
        return (((density[3] / 4 * u + density[2] / 3) * u + density[1] / 2) * u + density[0]) * u

    light = g * dense * np.exp(depth(-0.5) - depth(v))
    return 0.5 * (64 / 15) * np.abs(light).max() * rho ** (-2 * order) / (1 - rho**-2)


@given(pieces(), st.sampled_from([1e-2, 1e-6, 1e-10, 1e-14]))
def test_an_error_below_its_limit_is_no_less_than_the_remainder_by_its_definition(piece, limit):
    cubic, density = piece
    found = moments(cubic[:, None], density[:, None], np.array([limit]), second=False)
    reach = rounding(cubic)[0]
    if found.error[0] > limit:
        return
    order = _order_of(found.first[0], cubic, density, reach)
    with np.errstate(over="ignore", invalid="ignore"):
        least = min(np.nan_to_num(remainder(cubic, density, order, rho), nan=np.inf) for rho in ELLIPSES)
    assert found.error[0] >= least * (1 - 1e-9)


def _order_of(first, cubic, density, reach):
    """Return the highest order that can have led to this moment, but for rounding."""
    return max(k for k in ORDERS if abs(_by_rule(cubic, density, k) - first) <= 1e-13 * reach)


def _by_rule(cubic, density, order):
    nodes, weights = np.polynomial.legendre.leggauss(order)
    total = 0.0
    for x, w in zip(nodes / 2, weights / 2, strict=True):
        g = ((cubic[3] * x + cubic[2]) * x + cubic[1]) * x
        depth = sum(density[k] * (x ** (k + 1) - (-0.5) ** (k + 1)) / (k + 1) for k in range(4))
        total += w * g * (((density[3] * x + density[2]) * x + density[1]) * x + density[0]) * np.exp(-depth)
    return total


@pytest.mark.parametrize("order", ORDERS[:3])
def test_the_remainder_of_a_straight_piece_of_constant_density_is_the_formula(order):
    # g = f1 v and A = a0: the greatest integrand on the ellipse is at v = -R, and the bound is sharp there.
    f1, a0 = 0.7, 0.4
    r = (RHO + 1 / RHO) / 4
    scale = f1 * r * a0 * np.exp(a0 * (r - 0.5)) * (32 / 15) / (1 - RHO**-2)
    limit = scale * RHO ** (-2 * order) * (1 + 1e-9)
    found = moments(
        np.array([[0.0], [f1], [0.0], [0.0]]),
        np.array([[a0], [0.0], [0.0], [0.0]]),
        np.array([limit]),
        second=False,
    )
    assert found.error[0] <= limit
    assert found.first[0] == pytest.approx(_by_rule([0, f1, 0, 0], [a0, 0, 0, 0], order), rel=1e-13)
    if order < 7:  # above, the other ellipses do better
        assert found.error[0] == pytest.approx(limit, rel=1e-8)


def test_more_is_spent_only_where_it_is_asked_for():
    # The same piece at ever lower limits: errors fall, and never far below what was asked for.
    cubic, density = np.array([0.0, 1.0, 0.3, 0.1]), np.array([1.0, 0.5, 0.15, 0.05])
    limits = 10.0 ** -np.arange(1.0, 15.0)
    found = moments(
        np.repeat(cubic[:, None], 14, axis=1), np.repeat(density[:, None], 14, axis=1), limits, second=False
    )
    assert (found.error <= limits).all()
    assert (np.diff(found.error) <= 0).all()
    # Two orders more are rho^4 = 1300 in the first ellipse, and at least 10^2 times better in any.
    assert len(set(found.error.tolist())) >= 4


def test_a_piece_too_thick_for_any_order_is_given_up():
    cubic, density = np.array([[0.0], [2.0], [0.0], [0.0]]), np.array([[1e6], [0.0], [0.0], [0.0]])
    found = moments(cubic, density, np.array([1e-9]), second=True)
    assert (found.first[0], found.second[0], found.error[0]) == (0.0, 0.0, 1.0)  # the reach


@pytest.mark.parametrize("size", [1e-300, 1e-100, 1e100, 1e300])
def test_extreme_numbers_do_not_overflow(size):
    cubic = np.array([[0.0], [size], [size], [size]])
    for density in (size, 1e-300, 1e300):
        found = moments(cubic, np.array([[density], [0.0], [0.0], [0.0]]), np.array([1e-9]), second=False)
        assert np.isfinite(found.first).all()
        assert not np.isnan(found.error).any()
