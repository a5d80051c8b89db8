import dataclasses
import functools
import json

import numpy as np
import pytest

import volref as vr
from tests.scenes import camera_towards, colorful_transfer, rough_scene, sparse_scene
from volref.phantoms.meshes import box_mesh
from volref.scene.palette import FULL_PALETTE

march_plan = functools.partial(vr.plan, method="march")
exact_plan = functools.partial(vr.plan, method="exact")

NEVER_NEEDED = ["gradients", "lighting", "jitter", "tone mapping"]


def stage(plan, name):
    return next(stage for stage in plan.stages if stage.name == name)


def test_every_stage_says_in_or_out_and_why():
    plan = march_plan(rough_scene())
    assert [s.name for s in plan.stages] == [
        "meshes",
        "volume",
        "rays that miss",
        "empty space",
        "early termination",
        "colour",
        "float64",
        *NEVER_NEEDED,
        "background",
    ]
    assert all(s.reason for s in plan.stages)
    assert "out  meshes" in str(plan)
    assert json.loads(json.dumps(plan.as_dict()))["stages"][0]["included"] is False


def test_every_stage_of_the_exact_method_says_in_or_out_and_why():
    plan = exact_plan(rough_scene())
    assert [s.name for s in plan.stages] == [
        "meshes",
        "volume",
        "rays that miss",
        "empty space",
        *NEVER_NEEDED,
        "background",
    ]
    assert all(s.reason for s in plan.stages)
    assert str(plan).startswith("method exact\n")
    assert json.loads(json.dumps(plan.as_dict()))["method"] == "exact"


def test_the_exact_method_has_no_step_and_ends_no_ray_early():
    plan = exact_plan(rough_scene())
    assert (plan.step, plan.most_segments, plan.termination) == (0.0, 0, 0.0)
    for more in ({"method": "exact"}, {"method": "auto"}):
        with pytest.raises(vr.SceneError, match=r"step must be left out unless method is 'march', got 0.3"):
            vr.plan(rough_scene(), step=0.3, **more)


def test_auto_is_exact_unless_an_estimate_may_do():
    scene = rough_scene()
    assert vr.plan(scene, method="auto").method == "exact"
    assert vr.plan(scene, method="auto").stages == exact_plan(scene).stages
    assert vr.plan(scene, method="auto", certified=False).method == "auto"
    # Who names a method has chosen.
    assert march_plan(scene, certified=True).method == "march"
    assert exact_plan(scene, certified=False).method == "exact"


def test_the_exact_method_leaves_out_what_the_scene_does_not_need():
    scene = rough_scene()
    clear = dataclasses.replace(scene, transfer=vr.TransferFunction([0], [(1, 1, 1)], [0]))
    plan = exact_plan(clear)
    assert [s.name for s in plan.stages if s.included] == []
    assert plan.everything().includes("volume")
    bare = dataclasses.replace(scene, volume=None, transfer=None, meshes=[box_mesh((1, 1, 1))])
    assert stage(exact_plan(bare), "volume").reason == "the scene has none"
    assert not exact_plan(bare).everything().includes("volume")


def test_everything_of_the_exact_method_is_the_same_image():
    scenes = [rough_scene(), sparse_scene(), rough_scene(spacing=(1.0, 0.7, 1.3), centering="node")]
    for scene in scenes:
        planned, forced = exact_plan(scene, tolerance=1e-6), exact_plan(scene, tolerance=1e-6).everything()
        assert planned.includes("empty space")
        assert not forced.includes("empty space")
        first, second = vr.render(scene, plan=planned), vr.render(scene, plan=forced)
        assert (np.abs(first.rgba - second.rgba).max(axis=-1) <= first.bound + second.bound).all()
        assert second.plan.stages == forced.stages
        assert (first.bound_kind, second.bound_kind) == ("certified", "certified")
        assert first.met_tolerance
        assert second.met_tolerance


def test_the_default_step_is_half_the_least_spacing():
    assert march_plan(rough_scene(spacing=(1.0, 0.5, 3.0))).step == 0.25


def test_a_volume_that_nothing_shows_is_left_out():
    plan = march_plan(rough_scene(transfer=vr.TransferFunction([2, 3], [(1, 1, 1)] * 2, [0, 1])))
    assert not plan.includes("volume")
    assert stage(plan, "volume").reason.startswith("opacity 0 for every value from 0.0")


def test_an_optical_depth_that_cannot_end_a_ray_leaves_early_termination_out():
    faint = rough_scene(transfer=colorful_transfer(extinction=0.1))
    assert stage(march_plan(faint), "early termination").reason.startswith(
        "the optical depth of a ray cannot exceed"
    )
    assert march_plan(rough_scene(transfer=colorful_transfer(extinction=9.0))).includes("early termination")


def test_only_knots_that_the_volume_reaches_count_for_early_termination():
    # 50 is far above the values, which end at 1; between 1 and 50 the extinction has risen by 1/49 of 1e3.
    transfer = vr.TransferFunction([0, 1, 50], [(1, 1, 1)] * 3, [0, 0.01, 1e3])
    assert not march_plan(rough_scene(transfer=transfer)).includes("early termination")


def test_a_sparse_volume_has_empty_space_and_a_full_one_has_none():
    assert march_plan(sparse_scene()).includes("empty space")
    assert not march_plan(rough_scene(transfer=colorful_transfer(0.01))).includes("empty space")


def test_everything_forces_all_that_was_left_out():
    scene = rough_scene()
    everything = march_plan(scene).everything()
    assert everything.occupancy is None
    assert everything.termination == 0.0
    assert [s.name for s in everything.stages if s.included] == [
        "volume",
        "rays that miss",
        "colour",
        "float64",
    ]
    assert (everything.precision, everything.palette) == ("float64", FULL_PALETTE)
    expected = vr.render(scene, plan=march_plan(scene, precision="float64"))
    np.testing.assert_array_equal(vr.render(scene, plan=everything).rgba, expected.rgba)


def test_a_plan_with_another_step_is_followed_and_skips_only_what_it_may():
    scene = sparse_scene()
    plan = march_plan(scene, precision="float64")
    for factor in (0.5, 2.0, 8.0):
        changed = dataclasses.replace(plan, step=plan.step * factor, termination=0.0)
        out = vr.render(scene, plan=changed)
        np.testing.assert_array_equal(out.rgba, vr.render(scene, plan=changed.everything()).rgba)


@pytest.mark.parametrize("step", [0, -1, np.nan, np.inf, "a"])
def test_a_step_that_is_no_length_is_refused(step):
    with pytest.raises(vr.SceneError, match="step must be"):
        march_plan(rough_scene(), step=step)


def test_an_unknown_method_is_refused():
    with pytest.raises(vr.SceneError, match="method must be 'auto' or 'march' or 'exact', got 'euler'"):
        vr.plan(rough_scene(), method="euler")


@pytest.mark.parametrize("step", [1e-310, 1e-300, 1e-9])
def test_a_step_that_would_never_end_is_refused(step):
    with pytest.raises(vr.SceneError, match="step must take at most 2147483648 samples"):
        march_plan(rough_scene(), step=step)


def test_what_the_scene_does_not_have_cannot_be_forced_in():
    scene = rough_scene()
    assert not march_plan(scene).everything().includes("meshes")
    clear = dataclasses.replace(scene, transfer=vr.TransferFunction([0], [(1, 1, 1)], [0]))
    assert not march_plan(clear).includes("volume")
    assert march_plan(clear).everything().includes("volume")
    assert vr.render(clear, plan=march_plan(clear).everything()).samples > 0


def test_a_range_that_ends_at_the_foot_of_a_ramp_counts_as_seen_since_rounding_may_pass_it():
    transfer = vr.TransferFunction([0.3, 1.0], [(1, 1, 1)] * 2, [0.0, 1.0])
    values = np.full((8, 8, 32), 0.1)
    values[:, :, :4] = 0.3
    volume = vr.Volume(values)
    scene = vr.Scene(volume, transfer, camera_towards(volume), 4, 4)
    plan = march_plan(scene)
    assert plan.includes("volume")
    assert plan.occupancy.blocks.any()
    flat = vr.Volume(np.full((8, 8, 32), 0.3))  # one value is interpolated without rounding
    assert not march_plan(vr.Scene(flat, transfer, camera_towards(flat), 4, 4)).includes("volume")


def smooth_scene(**table):
    values = np.add.outer(np.add.outer(np.arange(12.0), np.arange(12.0)), np.arange(12.0)) / 33
    volume = vr.Volume(values)
    colors = table.pop("colors", [(0.1, 0.2, 0.3), (0.9, 0.8, 0.1)])
    transfer = vr.TransferFunction([0, 1], colors, **(table or {"extinction": [0.1, 0.4]}))
    return vr.Scene(volume, transfer, camera_towards(volume), 16, 12)


def test_float32_is_chosen_where_its_bound_is_a_small_part_of_the_tolerance():
    scene = smooth_scene()
    plan = march_plan(scene)
    assert (plan.precision, plan.includes("float64")) == ("float32", False)
    assert 0 < plan.rounding < 1 / 510 / 8
    assert march_plan(scene, tolerance=plan.rounding).precision == "float64"
    difference = np.abs(vr.render(scene, plan=plan).rgba - vr.render(scene, plan=plan.everything()).rgba)
    assert 0 < difference.max() <= plan.rounding + plan.most_segments * 2.0**-23


def test_float32_is_never_chosen_where_the_table_jumps_or_is_opaque():
    jump = dataclasses.replace(
        smooth_scene(), transfer=vr.TransferFunction([0.5, 0.5], [(1, 1, 1)] * 2, [0, 0.1])
    )
    for scene in (jump, smooth_scene(opacity=[0.1, 1.0])):
        plan = march_plan(scene, tolerance=10.0)
        assert plan.precision == "float64"
        assert stage(plan, "float64").reason == "float32 has no bound here"


def test_a_precision_that_is_asked_for_is_kept():
    assert march_plan(smooth_scene(), precision="float64").precision == "float64"
    scene = smooth_scene(opacity=[0.1, 1.0])
    asked = march_plan(scene, precision="float32", tolerance=1e-12)
    assert (asked.precision, asked.rounding) == ("float32", np.inf)
    assert np.isinf(vr.render(scene, plan=asked).bound).any()
    with pytest.raises(vr.SceneError, match="precision must be 'float64' or 'float32', got 'half'"):
        march_plan(smooth_scene(), precision="half")


def test_equal_channels_are_looked_up_once_and_constant_ones_not_at_all():
    grey = march_plan(smooth_scene(colors=[(0.1,) * 3, (0.9,) * 3]))
    assert (grey.palette.looked_up, stage(grey, "colour").reason) == ((0,), "grey: one channel")
    white = march_plan(smooth_scene(colors=[(1, 0.5, 0.25)] * 2))
    assert (white.palette.looked_up, white.includes("colour")) == ((), False)
    assert stage(white, "colour").reason.startswith("(1, 0.5, 0.25) wherever anything is seen")
    assert stage(march_plan(smooth_scene()), "colour").included


def test_a_colour_that_only_clear_values_have_does_not_count():
    colors, strength = [(1, 0, 0), (0, 1, 0), (0, 1, 0)], [0.0, 0.0, 1.0]
    scene = dataclasses.replace(smooth_scene(), transfer=vr.TransferFunction([0, 0.3, 1], colors, strength))
    assert march_plan(scene).palette.constant == (0.0, 1.0, 0.0)


LOOKS = {
    "lights": [vr.Light.headlight()],
    "material": vr.Material("lambert"),
    "mode": "mip",
    "clip": [vr.Plane((0, 0, 0), (1, 0, 0))],
    "gradient": "sobel",
    "classification": "pre",
}


@pytest.mark.parametrize("name", LOOKS)
def test_a_plan_of_another_look_is_refused(name):
    scene = sparse_scene()
    other = dataclasses.replace(scene, **{name: LOOKS[name]})
    with pytest.raises(vr.SceneError, match=r"plan must be one for this scene.*make one with volref.plan"):
        vr.render(other, plan=vr.plan(scene))
    smaller = dataclasses.replace(scene, width=4, height=4, background=(1, 1, 1, 1))
    assert vr.render(smaller, plan=vr.plan(scene)).met_tolerance
