"""Rules of opacity by hand, and factors that give faint samples the transfer function's own opacity."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from volref import Camera, Pipeline, Scene, TransferFunction, Volume, emulate
from volref.emulation.device import Device
from volref.emulation.drawing import prepare
from volref.emulation.loop.opacity import OpacityRule, factor_of
from volref.emulation.rays.box import box_of
from volref.emulation.textures.lookup import Found

EXACT = Device.named("exact")
SIDES = (4.0, 6.0, 8.0)
FLOATS = Pipeline("p").with_switches(
    volume={"format": "exact"}, table={"format": "exact"}, output={"format": "exact"}
)


def scene(opacity=0.4, unit_distance=2.0, spacing=(1.0, 1.5, 2.0), turn=(0, 0, 1)):
    """A box of sides 4, 6 and 8 with one opacity everywhere, one pixel that looks through its middle."""
    volume = Volume(np.full((4, 4, 4), 128, np.uint8), spacing=spacing)
    middle = volume.corners.mean(axis=0)
    camera = Camera.orthographic(middle + 20 * np.array(turn), middle, (0.1, 1, 0.2), 0.5, 1, 60)
    transfer = TransferFunction.from_opacity([0, 255], [(1, 1, 1)] * 2, [opacity] * 2, unit_distance)
    return Scene(volume, transfer, camera, 1, 1)


def found(alpha, value=0.25, magnitude=None):
    color = np.concatenate([np.zeros((3, len(alpha))), [alpha]])
    return Found(np.full(len(alpha), value), color, None, magnitude)


def rule_of(shown, **groups):
    """The rule of the one ray, and its paths."""
    drawing = prepare(shown, FLOATS.with_switches(**groups), EXACT)
    return drawing.rule, drawing.paths


HALVES = np.array([0.0, 0.5, 1.0])
# A factor of 3 and 8 steps through the depth of 8: each is 1/8 of texture space and 1 of the world, half of
# the unit distance.
BY_HAND = {
    "as-is": 3 * HALVES,
    "per-step": 3 * HALVES / 8,
    "per-length": 3 * HALVES / 8,
    "corrected": 1 - (1 - HALVES) ** 1.5,
}


@pytest.mark.parametrize("rule", BY_HAND)
def test_each_rule_is_its_formula(rule):
    ready, paths = rule_of(
        scene(), stepping={"rule": "count", "steps": 8, "end": "count"}, opacity={"rule": rule, "factor": 3.0}
    )
    np.testing.assert_allclose([paths.texture_step[0], paths.world_step[0]], [1 / 8, 1], rtol=1e-12)
    opacity = ready.opacity(found(HALVES), np.zeros(3, int), None)
    np.testing.assert_allclose(opacity, BY_HAND[rule], rtol=1e-12)


@pytest.mark.parametrize("rule", BY_HAND)
def test_a_part_of_a_step_is_a_part_of_the_factor_or_of_the_exponent(rule):
    ready, _ = rule_of(
        scene(), stepping={"rule": "count", "steps": 8, "end": "count"}, opacity={"rule": rule, "factor": 3.0}
    )
    third = ready.opacity(found(HALVES), np.zeros(3, int), np.full(3, 1 / 3))
    whole = BY_HAND[rule] / 3 if rule != "corrected" else 1 - np.sqrt(1 - HALVES)
    np.testing.assert_allclose(third, whole, rtol=1e-12)


def test_the_value_itself_may_be_the_opacity():
    rule = OpacityRule("value", corrected=False, scale=np.array([2.0]))
    np.testing.assert_array_equal(rule.opacity(found(HALVES), np.zeros(3, int), None), [0.5] * 3)


def test_the_gradients_length_multiplies_what_the_step_has_made():
    rule = OpacityRule("table", corrected=True, scale=np.array([2.0]), by_gradient=8.0)
    magnitude = np.array([0.0, 0.125, 0.5])
    opacity = rule.opacity(found(np.full(3, 0.5), magnitude=magnitude), np.zeros(3, int), None)
    np.testing.assert_allclose(opacity, 0.75 * 8 * magnitude, rtol=1e-15)


def test_each_ray_has_its_own_factor():
    rule = OpacityRule("table", corrected=False, scale=np.array([1.0, 10.0, 100.0]))
    opacity = rule.opacity(found(np.full(2, 0.5)), np.array([2, 0]), None)
    np.testing.assert_array_equal(opacity, [50.0, 0.5])


@pytest.mark.parametrize("values", ["float16", "float32", "float64"])
def test_opacity_is_in_the_type_of_the_table(values):
    for name in BY_HAND:
        drawing = prepare(scene(), FLOATS.with_switches(opacity={"rule": name}), Device("d", values=values))
        alpha = HALVES.astype(values)
        for share in (None, np.float32([0.5] * 3)):
            opacity = drawing.rule.opacity(Found(alpha, np.stack([alpha] * 4)), np.zeros(3, int), share)
            assert opacity.dtype == values


@given(opacity=st.floats(0, 1), cuts=st.integers(1, 40), exponent=st.floats(0.01, 5))
def test_corrected_steps_are_worth_as_much_as_the_whole_they_are_parts_of(opacity, cuts, exponent):
    whole, part = (
        OpacityRule("table", corrected=True, scale=np.array([e])) for e in (exponent, exponent / cuts)
    )
    alpha = np.array([opacity])
    left = (1 - part.opacity(found(alpha), np.zeros(1, int), None)) ** cuts
    # 1 - a is rounded once for each step, 40 at most.
    np.testing.assert_allclose(
        left, 1 - whole.opacity(found(alpha), np.zeros(1, int), None), rtol=0, atol=1e-14
    )


# Programs whose rule is linear in the step, by the rule of their steps.
LINEAR = [
    ("per-step", {"rule": "count", "steps": 300, "end": "count"}),
    ("per-step", {"rule": "texture-length", "steps": 90, "end": "length-before"}),
    ("per-step", {"rule": "texture-length", "steps": 70, "length": 1 / 300, "end": "length-before"}),
    ("per-length", {"rule": "count", "steps": 300, "end": "count"}),
    ("per-length", {"rule": "texture-length", "steps": 300, "end": "length-before"}),
    ("per-length", {"rule": "world-length", "length": 0.02, "end": "length-before"}),
]


@pytest.mark.parametrize(("rule", "stepping"), LINEAR)
@pytest.mark.parametrize("turn", [(0, 0, 1), (0.3, -0.5, 0.9)])
def test_in_a_box_of_equal_sides_faint_light_is_that_of_the_transfer_function(rule, stepping, turn):
    if rule == "per-step" and stepping["rule"] == "count" and turn != (0, 0, 1):
        turn = (1, 0, 0)  # a count does not know how long the ray is: along a side it is right
    shown = scene(1e-4, 2.0, (1.5, 1.5, 1.5), np.array(turn) / np.linalg.norm(turn))
    pipeline = FLOATS.with_switches(stepping=stepping | {"last_step": "whole"}, opacity={"rule": rule})
    drawing = prepare(shown, pipeline, EXACT)
    length = np.linalg.norm(6.0 * (drawing.ends.exit - drawing.ends.entry)[:, 0])
    expected = 1 - (1 - 1e-4) ** (length / 2.0)
    # One step more or less, of 90 at least; squares of opacities of 1e-4 are left out.
    np.testing.assert_allclose(emulate(shown, pipeline, EXACT).rgba[0, 0, 3], expected, rtol=0.012)


def test_a_factor_is_the_mean_side_in_unit_distances_or_none():
    box, shown = box_of(scene()), scene()
    assert tuple(box.sides) == SIDES

    def factor(**groups):
        return factor_of(shown, FLOATS.with_switches(**groups), box)

    assert factor(opacity={"rule": "as-is"}) == factor(opacity={"rule": "corrected"}) == 1.0
    assert factor(opacity={"rule": "per-length"}) == 3.0
    assert factor(opacity={"rule": "per-step"}) == 3.0
    assert factor(opacity={"rule": "per-step", "factor": 25.6}) == 25.6
    assert factor(opacity={"rule": "as-is", "factor": 0.0}) == 0.0
    # 70 steps of 1/140 are half of a side.
    steps = {"rule": "texture-length", "steps": 70}
    assert factor(opacity={"rule": "per-step"}, stepping=steps) == pytest.approx(3.0, rel=1e-15)
    assert factor(opacity={"rule": "per-step"}, stepping=steps | {"length": 1 / 140}) == pytest.approx(1.5)
