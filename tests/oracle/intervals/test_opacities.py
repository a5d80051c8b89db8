"""Opacities of steps: of every place of a chord, of every share and factor that may be, near the chord."""

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import volref as vr
from volref.emulation.loop.opacity import OpacityRule
from volref.oracle.intervals.finding import Reach
from volref.oracle.intervals.opacities import share_of
from volref.oracle.intervals.slack import Slack, slack_of
from volref.oracle.intervals.walking import Pair

EXACT = Slack(0.0, 0.0, 0.0, 0.0)
PLAIN = vr.pipelines()["texture3d"]
ALONG = np.linspace(0, 1, 61)

# The rounding of the powers that this file itself makes.
FLOAT64 = 1e-12

opacity = st.floats(0, 1) | st.sampled_from([0.0, 1.0, 0.999, 1e-6])
scale = st.floats(0.01, 30) | st.sampled_from([0.25, 1.0, 0.5])


def course_of(rule, slack=EXACT, relative=0.0, pipeline=PLAIN):
    return SimpleNamespace(
        drawing=SimpleNamespace(pipeline=pipeline, rule=rule),
        finder=SimpleNamespace(slack=slack),
        walks=SimpleNamespace(relative=np.array([relative])),
    )


def reach_of(first, last, beside):
    ends = np.zeros((2, 4, 1))
    ends[0, 3, 0], ends[1, 3, 0] = first, last
    spread = np.zeros((4, 1))
    spread[3] = beside
    return Reach(ends, spread, np.array([0.5]), np.array([0.0]))


def shared(course, reach, part=None):
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        return share_of(course, reach, np.zeros(1, np.intp), part)


def made(rule, table, factor):
    """The opacity of a sample: the formulas of the switches, number by number."""
    return 1 - (1 - table) ** factor if rule.corrected else table * factor


@settings(max_examples=200)
@given(opacity, opacity, scale, st.booleans(), st.sampled_from([0.0, 1e-6, 1e-3, 0.05]))
def test_opacities_of_a_chord_and_beside_it_are_near_the_chord(first, last, factor, corrected, beside):
    rule = OpacityRule("table", corrected, np.array([factor]))
    share = shared(course_of(rule), reach_of(first, last, beside))
    for way in (-1, 0, 1):
        table = np.clip(first + ALONG * (last - first) + way * beside, 0, 1)
        chord = share.opacity[0, 0] + ALONG * (share.opacity[1, 0] - share.opacity[0, 0])
        apart = np.abs(made(rule, table, factor) - chord)
        assert (apart <= share.opacity_off[0] + FLOAT64 * max(1, factor)).all()


@settings(max_examples=100)
@given(
    opacity,
    scale,
    st.tuples(st.just(0.0) | st.floats(1e-6, 1), st.floats(1e-6, 1)).map(sorted),
    st.booleans(),
    st.sampled_from([0.0, 1e-6, 1e-3]),
)
def test_a_share_of_a_step_may_be_any_of_those_that_may_be_left(table, factor, part, corrected, relative):
    rule = OpacityRule("table", corrected, np.array([factor, factor]))
    course = course_of(rule, relative=relative)
    ends = Pair(*(np.array([one]) for one in part))
    share = shared(course, reach_of(table, table, 0.0), ends)
    # A sample is taken where more than nothing is left.
    low = max(factor * part[0] * (1 - relative), 1e-9)
    high = max(factor * part[1] * (1 + relative), low)
    for one in np.linspace(low, high, 31):
        apart = abs(made(rule, table, one) - share.opacity[:, 0].mean())
        assert apart <= share.opacity_off[0] + np.abs(np.diff(share.opacity[:, 0])[0]) / 2 + FLOAT64 * factor


@pytest.mark.parametrize("corrected", [False, True])
def test_a_plain_opacity_is_its_own_interval(corrected):
    rule = OpacityRule("table", corrected, np.array([0.5]))
    share = shared(course_of(rule), reach_of(0.3, 0.3, 0.0))
    assert share.opacity_off[0] == 0
    np.testing.assert_allclose(share.opacity[:, 0], made(rule, 0.3, 0.5), rtol=1e-15)


def test_the_bound_of_a_short_chord_is_its_width_times_the_slope():
    rule = OpacityRule("table", corrected=True, scale=np.array([0.5]))
    share = shared(course_of(rule), reach_of(0.6, 0.6, 1e-4))
    slope = 0.5 * 0.4**-0.5
    assert slope * 1e-4 <= share.opacity_off[0] < 1.3 * slope * 1e-4 + 0.5e-4 * slope


def test_the_power_of_a_gpu_is_inside():
    # x^y as exp2(y log2 x), log2 off by 2^-21 and exp2 by 3 + 2 |z| units: WebGPU's table, at its worst.
    slack = slack_of(vr.Device(freedom="khronos"))
    rng = np.random.default_rng(1)
    x, y = rng.random(4000), 10 ** rng.uniform(-2, 1, 4000)
    z = y * (np.log2(x) + rng.choice([-1, 1], 4000) * 2.0**-21)
    found = np.exp2(z) * (1 + rng.choice([-1, 1], 4000) * (3 + 2 * np.abs(z)) * 2.0**-23)
    said = np.array([slack.power(one) for one in y])
    assert (np.abs(found - x**y) <= said).all()
    assert (np.abs(found - x**y) / said).max() > 0.5


@pytest.mark.parametrize("freedom", ["rounded", "khronos"])
def test_opacities_in_float32_are_inside(freedom):
    slack = slack_of(vr.Device(freedom=freedom))
    table = np.random.default_rng(2).random(500)
    for factor in (0.1, 0.5, 1.0, 3.0):
        rule = OpacityRule("table", corrected=True, scale=np.array([factor]))
        one = np.float32(1)
        found = one - (one - table.astype(np.float32)) ** np.float32(factor)
        for k, alpha in enumerate(table):
            share = shared(course_of(rule, slack), reach_of(alpha, alpha, 2.0**-24))
            assert abs(found[k] - share.opacity[0, 0]) <= share.opacity_off[0]


def test_a_value_a_factor_a_gradient_and_own_alphas_count():
    rule = OpacityRule("value", corrected=False, scale=np.array([0.5]), by_gradient=3.0, times=1.5)
    pipeline = PLAIN.with_switches(accumulation={"alpha": "weighted"}, lighting={"factor": 1.2})
    reach = reach_of(0.1, 0.2, 0.0)._replace(
        value=np.array([0.4]),
        radius=np.array([0.01]),
        magnitude=np.array([0.2]),
        gradient_radius=np.array([0.02]),
    )
    reach.ends[:, :3] = 0.5
    share = shared(course_of(rule, pipeline=pipeline), reach)
    least, most = (value * 0.5 * 1.5 * 3.0 * steep for value, steep in ((0.39, 0.18), (0.41, 0.22)))
    assert share.opacity.min() - share.opacity_off[0] <= least
    assert share.opacity.max() + share.opacity_off[0] >= most
    np.testing.assert_allclose(share.color[:, :3, 0], 0.6)
    np.testing.assert_allclose(share.color[:, 3, 0], [0.39, 0.41])
