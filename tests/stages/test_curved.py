"""Pieces of interpolated opacity against 40 digits, and the lemmas behind them.

On a piece the opacity is a0 + slope g(v), v from -1/2 to 1/2, and the depth per v -scale log(1 - opacity).
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mpmath import mp, mpf

from volref.stages import curved
from volref.stages.curved import LOGARITHM_LOSS, OPAQUE, ORDERS, RHOS, curved_emission

U = 2.0**-53
few = settings(max_examples=12)  # each takes some quadratures at 40 digits


def emission(cubic, opacity, slope, *, clear=None, slack=0.0, scale=1.0, weight=1.0, share=1e-10):
    """The emission of one piece, as plain numbers."""
    numbers = opacity, 1.0 - opacity if clear is None else clear, slope, slack, scale, weight, share
    found = curved_emission(np.array(cubic, float)[:, None], *(np.array([float(x)]) for x in numbers))
    return {name: getattr(found, name)[0] for name in ("depth", "depth_error", "first", "error", "settled")}


def reach_of(cubic):
    return 0.5 * abs(cubic[1]) + 0.25 * abs(cubic[2]) + 0.125 * abs(cubic[3])


def roots_of(monic):
    """Return the roots of a monic polynomial, lowest coefficient first (Durand 1960, Kerner 1966)."""
    size = 1 + max(abs(c) for c in monic)
    roots = [size * mp.mpc("0.4", "0.9") ** k for k in range(len(monic) - 1)]
    for _ in range(400):
        moved = mpf(0)
        for i, root in enumerate(roots):
            others = mp.fprod(root - other for j, other in enumerate(roots) if j != i)
            if others:
                roots[i] -= sum(c * root**k for k, c in enumerate(monic)) / others
            moved = max(moved, abs(roots[i] - root))
        if moved < mpf(10) ** -35 * size:
            break
    return roots


class Truth:
    """Depth and J1 of a piece at 40 digits; the roots of 1 - opacity give the depth in closed form."""

    def __init__(self, cubic, clear, slope, scale):
        self.cubic, self.clear, self.slope, self.scale = map(mpf, cubic), mpf(clear), mpf(slope), mpf(scale)
        _, *self.f = self.cubic
        coefficients = [self.clear, *(-self.slope * f for f in self.f)]
        while len(coefficients) > 1 and coefficients[-1] == 0:
            coefficients.pop()
        self.lead = coefficients[-1]
        self.roots = roots_of([c / self.lead for c in coefficients])

    def g(self, v):
        f1, f2, f3 = self.f
        return ((f3 * v + f2) * v + f1) * v

    def _antiderivative(self, v):
        total = v * mp.log(abs(self.lead))
        for root in self.roots:
            away = v - root
            total += mp.re(away * mp.log(away) - away) if away else 0
        return -self.scale * total

    def depth(self, v=0.5):
        v = mpf(v)
        return self._antiderivative(v) - self._antiderivative(-mpf(1) / 2)

    def first(self):
        def light(v):
            g = self.g(v)
            clear = self.clear - self.slope * g
            return -g * self.scale * mp.log(clear) * mp.exp(-self.depth(v)) if clear > 0 else mpf(0)

        inside = [mp.re(r) for r in self.roots if abs(mp.re(r)) < 0.5]
        steps = max(1, int(mp.log(self.depth() + 1, 2)) + 2)
        graded = [mpf(2) ** -k - mpf(1) / 2 for k in range(steps + 1)]
        return mp.quad(light, sorted({-mpf(1) / 2, *graded, *inside, mpf(1) / 2}))


@st.composite
def pieces(draw):
    """Cubic, opacity and clear in the middle, slope, scale: the opacity stays within 0..1."""
    cubic = [
        0.0,
        *(draw(st.integers(-128, 128)) / 64 for _ in "123"),
    ]
    exponent = draw(st.floats(-17.0, -0.5, width=32))
    small = 10.0**exponent
    opacity, clear = (small, 1.0 - small) if draw(st.booleans()) else (1.0 - small, small)
    share = draw(st.sampled_from([0.0, 0.1, 0.5, 0.9, 0.999, 1.0]))
    reach = reach_of(cubic)
    slope = share * small / reach if reach > 1e-30 else 0.0
    slope *= draw(st.sampled_from([-1.0, 1.0])) * (1 - 4 * U)
    return cubic, opacity, clear, slope, 10.0 ** draw(st.floats(-3.0, 1.5, width=32))


def truth_of(piece):
    cubic, opacity, clear, slope, scale = piece
    # Of opacity and what is clear the smaller has all digits.
    return Truth(cubic, clear if clear < 0.5 else 1 - mpf(opacity), slope, scale)


def assert_depth(found, truth):
    # Beyond 1600 nothing comes through: a depth may be cut there.
    off = abs(min(truth.depth(), 1600) - min(mpf(float(found["depth"])), 1600))
    assert 0 <= off <= found["depth_error"]


def assert_first(found, truth, cubic):
    # In float64 the terms of J1 lose some ulp each, those of t e^-t some more; J1 is at most the reach.
    assert abs(truth - mpf(float(found["first"]))) <= found["error"] + 256 * U * reach_of(cubic)


@few
@given(pieces(), st.sampled_from([1e-3, 1e-6, 1e-10, 1e-13]))
def test_depth_and_moment_are_within_their_errors(piece, share):
    cubic, opacity, clear, slope, scale = piece
    found = emission(cubic, opacity, slope, clear=clear, scale=scale, share=share)
    with mp.workdps(40):
        truth = truth_of(piece)
        assert_depth(found, truth)
        assert_first(found, truth.first(), cubic)


@few
@given(pieces(), st.sampled_from([1e-15, 1e-6, 1e-2]), st.sampled_from([-1, 1]))
def test_the_error_of_the_depth_holds_for_values_off_by_the_slack(piece, slack, side):
    cubic, opacity, clear, slope, scale = piece
    slack *= reach_of(cubic)
    found = emission(cubic, opacity, slope, clear=clear, slack=slack, scale=scale, share=1e-6)
    with mp.workdps(40):
        truth = truth_of(piece)
        moved = truth.clear - side * mpf(slack) * abs(truth.slope)
        if moved <= abs(truth.slope) * reach_of(cubic):
            return  # no true opacity goes beyond 1
        assert_depth(found, Truth(cubic, moved, slope, scale))


@given(pieces(), st.sampled_from([1e-3, 1e-6, 1e-10]), st.sampled_from([1e-6, 1.0, 1e6]))
def test_settled_pieces_meet_their_share_but_for_rounding(piece, share, weight):
    cubic, opacity, clear, slope, scale = piece
    found = emission(cubic, opacity, slope, clear=clear, scale=scale, share=share, weight=weight)
    if found["settled"] and clear > 1e-12:
        least = clear - abs(slope) * reach_of(cubic)
        lost = 64 * U * found["depth"] + 32 * U * scale / max(least, 1e-300)
        # Where the opacity nears 1 the doubt about it is all there is: such pieces are not asked for more.
        assert found["error"] * weight <= share * (1 + 1e-12) or least <= 200 * 8 * U
        assert found["depth_error"] <= share + lost or least <= 200 * 8 * U


@pytest.mark.parametrize("scale", [1e-6, 5.0, 300.0, 1e5, 1e9])
@pytest.mark.parametrize(
    ("cubic", "clear", "slope"),
    [
        ([0, 1, 0, 0], 0.25, 0.5),  # at the far end
        ([0, 1, 0, 0], 0.25, -0.5),  # at the near end
        ([0, 0.25, -1, 0], 0.5 * 0.125**2, 0.5),  # at v = 1/8: (v - 1/8)^2 / 2
        ([0, 0, 0, 8], 0.5, 0.5),  # to the third power? no: 1/2 - 4 v^3, at the far end
        ([0, -0.75, -1.5, -1], 0.125, 1.0),  # (v + 1/2)^3: to the third power at the near end
    ],
)
def test_opacities_that_touch_1_have_a_finite_depth(cubic, clear, slope, scale):
    found = emission(cubic, 1 - clear, slope, clear=clear, scale=scale, share=1e-9)
    with mp.workdps(40):
        truth = Truth(cubic, clear, slope, scale)
        assert_depth(found, truth)
        if scale == 5.0:
            assert_first(found, truth.first(), cubic)
        assert not found["settled"]


@pytest.mark.parametrize("least", [1e-3, 1e-9, 1e-15])
@pytest.mark.parametrize("scale", [1.0, 1e4, 1e8])
def test_depths_near_opaque_are_within_their_errors(least, scale):
    found = emission([0, 1, 0, 0], 0.75, 0.5 - 2 * least, clear=0.25, scale=scale, share=1e-9)
    with mp.workdps(40):
        assert_depth(found, Truth([0, 1, 0, 0], 0.25, 0.5 - 2 * least, scale))


def test_an_opaque_piece_shows_the_colour_at_its_near_end():
    found = emission([0.3, 1.0, 0.5, 0.25], 1.0, 0.0, clear=0.0)
    g_near = -0.5 + 0.125 - 0.25 / 8
    assert found == {"depth": OPAQUE, "depth_error": 0.0, "first": g_near, "error": 0.0, "settled": True}


def test_opacities_of_1e_minus_17_keep_their_digits():
    found = emission([0, 1, 0, 0], 1e-17, 1e-17, clear=1.0, scale=2.0)
    # -log1p(-a) is a; the mean of a line is its middle; J1 is the slope times scale times the mean of v^2.
    assert found["depth"] == pytest.approx(2e-17, rel=1e-14)
    assert found["first"] == pytest.approx(2e-17 / 12, rel=1e-13)


def test_constant_opacities_are_exact():
    for opacity in (0.0, 1e-17, 0.25, 0.75, 1 - 2.0**-53):
        found = emission([0.7, 0, 0, 0], opacity, 0.0, scale=0.5)
        truth = -0.5 * np.log1p(-opacity)
        assert found["depth"] == pytest.approx(truth, rel=1e-14)  # a sum of some weights
        assert found["depth_error"] <= 64 * U * truth * (1 + 1e-12)
        assert found["first"] == 0.0


# --- the lemmas


@pytest.mark.parametrize("order", ORDERS)
def test_the_lebesgue_constant_is_below_its_bound(order):
    nodes = 2 * curved._rule(order)[0]
    x = np.linspace(-1, 1, 4001)
    total = np.zeros_like(x)
    for j in range(order):
        others = np.delete(nodes, j)
        total += np.abs(np.prod((x[:, None] - others) / (nodes[j] - others), axis=1))
    bound = curved._rule(order)[3] - 1
    assert total.max() <= bound
    assert bound <= 4 * total.max()  # and of use


@pytest.mark.parametrize("order", ORDERS)
def test_partial_integrals_are_exact_to_degree_k_minus_1_and_not_to_k(order):
    nodes, weights, partial, _ = curved._rule(order)
    for degree in range(order + 1):
        found = partial @ nodes**degree
        exact = (nodes ** (degree + 1) - (-0.5) ** (degree + 1)) / (degree + 1)
        assert (np.abs(found - exact).max() <= 1e-15 * 0.5**degree * order) == (degree < order)
    assert weights.sum() == pytest.approx(1.0, rel=1e-15)
    assert nodes == pytest.approx(np.polynomial.legendre.leggauss(order)[0] / 2, rel=1e-15)


def mean_logarithm(root):
    """The mean of log|v - root| over -1/2..1/2, in closed form."""

    def part(z):
        return (z * np.log(z) - z).real if z else 0.0

    return part(0.5 - root) - part(-0.5 - root)


def loss(roots):
    """Log of the greatest magnitude of the product of (v - root), less the mean of its logarithm."""
    v = np.concatenate([np.linspace(-0.5, 0.5, 2001), [r.real for r in roots if abs(r.real) <= 0.5]])
    most = sum(np.log(np.maximum(np.abs(v - root), 1e-300)) for root in roots).max()
    return most - sum(mean_logarithm(complex(root)) for root in roots)


parts = st.floats(-0.75, 0.75)


@given(
    st.one_of(
        st.tuples(parts, parts, parts),
        st.tuples(parts, parts, parts).map(lambda x: (x[0], complex(*x[1:]), complex(x[1], -x[2]))),
    )
)
def test_the_mean_logarithm_of_a_cubic_is_at_most_3_84_below_its_greatest(roots):
    # 2001 places miss the greatest by a factor of 1 + 1e-6 at most, for three factors.
    assert loss([complex(r) for r in roots]) <= LOGARITHM_LOSS


def test_the_worst_cubic_has_a_triple_root_near_0_218_of_the_interval():
    losses = [loss([complex(r)] * 3) for r in np.linspace(-0.5, 0.5, 1001)]
    assert 3.83 < max(losses) <= LOGARITHM_LOSS
    assert abs(abs(np.linspace(-0.5, 0.5, 1001)[np.argmax(losses)]) - (0.5 - 0.218)) < 2e-3


@pytest.mark.parametrize("rho", RHOS)
def test_errors_are_no_less_than_the_remainder_by_its_definition(rho):
    # A straight, thin piece with its singularity just outside this ellipse, so that no wider one serves.
    r = (rho + 1 / rho) / 4
    slope, clear, scale = 0.5, 0.5 * r / 0.98, 1e-3
    clear = min(clear, 1.0)
    slope = clear * 0.98 / r
    opacity = 1 - clear
    found = emission([0, 1, 0, 0], opacity, slope, clear=clear, scale=scale, share=1e-300)
    order, narrow = ORDERS[-1], [x for x in RHOS if x <= rho]
    least = min(
        (32 / 15) * -scale * np.log1p(-slope * ((x + 1 / x) / 4) / clear) * x ** (-2 * order) / (1 - x**-2)
        for x in narrow
    )
    # Not even the highest order meets such a share; the error of the depth is then this, and its rounding.
    assert not found["settled"]
    assert found["depth_error"] >= least * (1 - 1e-12)
