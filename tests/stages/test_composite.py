import mpmath
import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from volref.stages.composite import composite_block, composite_block_coarse, over
from volref.workspace import Workspace

EPS = np.finfo(np.float64).eps
UNIT = st.floats(0, 1)
RGBA = st.tuples(UNIT, UNIT, UNIT, UNIT)


def composite(opacity, colors):
    """Transmittance (R,) and colour (3, R) of opacities (S, R) and colours (3, S, R)."""
    opacity, colors = np.asarray(opacity, float), np.array(colors, float)
    transmittance, color = np.ones(opacity.shape[1]), np.zeros((3, opacity.shape[1]))
    composite_block(transmittance, color, opacity, colors, Workspace())
    return transmittance, color


@given(opacities=st.lists(UNIT, min_size=1, max_size=30))
def test_weights_and_the_last_transmittance_add_up_to_one(opacities):
    # With white segments the colour is the sum of the weights.
    transmittance, color = composite(np.array(opacities)[:, None], np.ones((3, len(opacities), 1)))
    # one rounding per addition and one per subtraction
    assert abs(color[0, 0] + transmittance[0] - 1) <= 2 * len(opacities) * EPS


@given(optical_depths=st.lists(st.floats(0, 30), min_size=1, max_size=20))
def test_transmittances_equal_the_exponential_of_the_optical_depth(optical_depths):
    transmittance, _ = composite(
        -np.expm1(-np.array(optical_depths))[:, None], np.zeros((3, len(optical_depths), 1))
    )
    with mpmath.workdps(30):
        expected = float(mpmath.exp(-mpmath.fsum(optical_depths)))
    assert abs(transmittance[0] - expected) <= 2 * len(optical_depths) * EPS


@given(optical_depth=st.floats(0, 50), part=UNIT, color=st.tuples(UNIT, UNIT, UNIT))
def test_splitting_a_homogeneous_segment_changes_nothing(optical_depth, part, color):
    whole = composite(-np.expm1([[-optical_depth]]), np.array(color)[:, None, None])
    halves = -np.expm1([[-optical_depth * part], [-optical_depth * (1 - part)]])
    split = composite(halves, np.tile(np.array(color)[:, None, None], (1, 2, 1)))
    # the split optical depths are each rounded: 2 eps of tau, times e^-tau tau <= 1/e, and a few roundings
    np.testing.assert_allclose(split[0], whole[0], rtol=0, atol=8 * EPS)
    np.testing.assert_allclose(split[1], whole[1], rtol=0, atol=8 * EPS)


def over_rgba(front, back):
    front, back = np.asarray(front), np.asarray(back)
    return over(front[:3, None], 1 - front[3:], back[None])[0]


def premultiplied(straight):
    return np.array([*(c * straight[3] for c in straight[:3]), straight[3]])


@given(a=RGBA, b=RGBA, c=RGBA)
def test_over_is_associative(a, b, c):
    a, b, c = premultiplied(a), premultiplied(b), premultiplied(c)
    np.testing.assert_allclose(
        over_rgba(over_rgba(a, b), c), over_rgba(a, over_rgba(b, c)), rtol=0, atol=8 * EPS
    )


@given(a=RGBA)
def test_over_a_clear_background_changes_nothing(a):
    a = premultiplied(a)
    np.testing.assert_allclose(over_rgba(a, np.zeros(4)), a, rtol=0, atol=EPS)  # alpha is 1 - (1 - a)


def test_an_opaque_segment_hides_all_behind_it_exactly():
    transmittance, color = composite([[0.25], [1.0], [0.5]], np.array([[[1.0], [0.5], [9.0]]] * 3))
    assert transmittance.tolist() == [0.0]
    assert color[:, 0].tolist() == [0.25 + 0.75 * 0.5] * 3


def test_clear_segments_change_nothing_at_all():
    opacity = np.array([[0.5, 0.5], [0.5, 0.0]])
    transmittance, color = composite(opacity, np.full((3, 2, 2), 0.7))
    assert transmittance.tolist() == [0.25, 0.5]
    assert color[0, 1] == 0.35


def test_without_colours_the_transmittance_is_the_same():
    transmittance, weights = np.ones(1), np.zeros((1, 1))
    composite_block(transmittance, weights, np.array([[0.25], [0.5]]), np.zeros((0, 2, 1)), Workspace())
    assert transmittance.tolist() == [0.375]
    assert weights.tolist() == [[0.625]]


@given(a=UNIT)
def test_equal_segments_are_the_same_taken_three_at_a_time(a):
    opacity, colors = np.full((6, 1), a), np.full((3, 6, 1), 0.5)
    fine, fine_color = composite(opacity, colors)
    coarse, coarse_color = np.ones(1), np.zeros((3, 1))
    composite_block_coarse(coarse, coarse_color, opacity, colors, Workspace())
    np.testing.assert_allclose(coarse, fine, rtol=0, atol=16 * EPS)  # some roundings of numbers up to 3
    np.testing.assert_allclose(coarse_color, fine_color, rtol=0, atol=16 * EPS)


def test_the_coarse_rule_takes_the_middle_sample_of_three():
    opacity = np.array([[0.9], [0.5], [0.1]])
    colors = np.array([[[1.0], [0.25], [1.0]]] * 3)
    transmittance, color = np.ones(1), np.zeros((3, 1))
    composite_block_coarse(transmittance, color, opacity, colors, Workspace())
    assert transmittance.tolist() == [0.125]
    assert color[0].tolist() == [0.875 * 0.25]
