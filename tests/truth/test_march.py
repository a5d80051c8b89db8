import dataclasses
import functools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import volref as vr
from tests.oracles import scalar
from tests.scenes import camera_towards, colorful_transfer, rough_scene, rough_volume, sparse_scene
from volref import planning
from volref.phantoms import scenes as phantoms
from volref.phantoms import transfer as phantom_tables
from volref.truth import integration, rendering
from volref.truth import march as marching

EPS = np.finfo(np.float64).eps

march = functools.partial(vr.render, method="march", tolerance=1e-12)
march_plan = functools.partial(vr.plan, method="march", tolerance=1e-12)


def rms(difference):
    return math.sqrt((difference**2).mean())


def colors5():
    return [(0.2, 0.0, 1.0), (0.2, 0.4, 1.0), (1.0, 0.6, 0.1), (0.9, 0.9, 0.3), (0.1, 0.9, 0.3)]


def smooth_ball_scene(width, height):
    """The ball scene with a table without jumps, so that the field is continuous."""
    return phantoms.ball_scene(width, height, transfer=phantom_tables.two_colors(0.0, 192.0))


def order_of(errors, steps):
    return np.polyfit(np.log(steps), np.log(errors), 1)[0]


@pytest.mark.parametrize("extinction", [1e-12, 1e-3, 1.0, 40.0])
def test_a_homogeneous_box_is_exact(extinction):
    color = np.array([0.9, 0.5, 0.25])
    transfer = vr.TransferFunction([0.0], [color], [extinction])
    volume = vr.Volume(np.zeros((5, 6, 7), np.uint8), spacing=(1.0, 0.7, 1.3), origin=(-1, 2, 0.5))
    scene = vr.Scene(volume, transfer, camera_towards(volume), 24, 16)
    out = march(scene)
    low, high = volume.corners.min(axis=0), volume.corners.max(axis=0)
    for y in range(16):
        for x in range(24):
            target = (low + high) / 2
            eye = scene.camera.world_from_view[:3, 3]
            origin, direction = scalar.look_at_ray(eye, target, (0, 0, 1), 35.0, 24, 16, x, y)
            span = scalar.box_span(origin, direction, low.tolist(), high.tolist()) or (0.0, 0.0)
            alpha = -math.expm1(-extinction * (span[1] - span[0]))
            # some 40 segments, each with an ulp of opacity and one of transmittance, and an ulp of the chord
            np.testing.assert_allclose(out.rgba[y, x], [*(color * alpha), alpha], rtol=0, atol=1e-13)


@pytest.mark.parametrize("scene_of", [phantoms.ramp_scene, phantoms.exponential_scene, smooth_ball_scene])
def test_the_error_falls_with_the_square_of_the_step(scene_of):
    scene, truth = scene_of(width=24, height=18)
    steps = np.array([0.2, 0.1, 0.05, 0.025])
    errors = [rms(march(scene, step=step).rgba - truth) for step in steps]
    assert order_of(errors, steps) == pytest.approx(2.0, abs=0.1)


def test_a_jump_in_the_table_costs_one_order():
    scene, truth = phantoms.ball_scene(width=24, height=18)
    steps = np.array([0.2, 0.1, 0.05, 0.025])
    errors = [rms(march(scene, step=step).rgba - truth) for step in steps]
    # A surface is missed by half a step on average: first order, and by chance from ray to ray.
    assert order_of(errors, steps) == pytest.approx(1.0, abs=0.15)


def test_the_opacity_of_a_linear_extinction_is_exact_and_of_a_bent_one_is_not():
    # The midpoint rule integrates polynomials of degree 1 exactly, and not those of degree 2.
    scene, truth = phantoms.ramp_scene(width=12, height=9)
    error = march(scene, step=0.5).rgba - truth
    assert np.abs(error[..., 3]).max() <= 40 * EPS  # some 20 segments at two roundings each
    assert np.abs(error[..., :3]).max() > 1e-4
    scene, truth = phantoms.exponential_scene(width=12, height=9)
    assert np.abs(march(scene, step=0.5).rgba - truth)[..., 3].max() > 1e-4


@pytest.mark.parametrize("centering", ["cell", "node"])
@pytest.mark.parametrize("dtype", [np.uint8, np.float32, np.float64])
@pytest.mark.parametrize("opacity", [False, True])
def test_images_equal_the_scalar_loop(dtype, centering, opacity):
    volume = rough_volume(3, dtype=dtype, centering=centering, spacing=(1.0, 0.8, 1.7), origin=(3, -2, 5))
    top = volume.value_bounds[1]
    transfer = colorful_transfer(top)
    if opacity:
        knots = np.array([0, 0.4, 0.4, 0.7, 0.9]) * top  # with a jump and a full opacity
        transfer = vr.TransferFunction(knots, colors5(), opacity=[0, 0, 0.3, 0.6, 1.0], unit_distance=0.7)
    camera = camera_towards(volume)
    scene = vr.Scene(volume, transfer, camera, 6, 5, background=(0.1, 0.2, 0.3, 0.5))
    out = march(scene, plan=march_plan(scene, step=0.3).everything())
    low, high = volume.corners.min(axis=0), volume.corners.max(axis=0)
    eye = camera.world_from_view[:3, 3]
    for y in range(5):
        for x in range(6):
            ray = scalar.look_at_ray(eye, (low + high) / 2, (0, 0, 1), 35.0, 6, 5, x, y)
            expected = scalar.march_ray(volume, transfer, *ray, 0.3, background=scene.background)
            # Positions agree to some ulp of the distance, 1e-14, times a slope of the table of about 10 a
            # voxel; a sample that this moves over the jump would show as an error of 0.1.
            np.testing.assert_allclose(out.rgba[y, x], expected, rtol=0, atol=1e-12)


def test_oblique_directions_and_flips_place_the_same_field():
    # The same samples, described once along the axes and once turned, flipped and reordered.
    volume = rough_volume(4, spacing=(1.0, 0.8, 1.7))
    turn = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    turned = vr.Volume(volume.values, volume.spacing, turn @ volume.origin, turn)
    flipped = vr.Volume(
        turned.values[:, :, ::-1],
        turned.spacing,
        turned.world_from_index @ [turned.size[0] - 1, 0, 0, 1] @ np.eye(4, 3),
        turn * [-1, 1, 1],
    )
    straight = camera_towards(volume)
    world_turn = np.eye(4)
    world_turn[:3, :3] = turn
    camera = vr.Camera(
        straight.view_from_world @ world_turn.T, "perspective", fov_y=35.0, near=0.1, far=100.0
    )
    transfer = colorful_transfer()
    expected = march(vr.Scene(volume, transfer, straight, 16, 12)).rgba
    for other in (turned, flipped):
        got = march(vr.Scene(other, transfer, camera, 16, 12)).rgba
        np.testing.assert_allclose(got, expected, rtol=0, atol=1e-12)  # positions to 1e-14, slopes of 10


@given(seed=st.integers(0, 99), top=st.floats(0.35, 3))
def test_skipping_empty_space_changes_nothing(seed, top):
    transfer = colorful_transfer(top)
    scene = rough_scene(12, 8, seed=seed, transfer=transfer, shape=(9, 13, 17))
    blank = scene.volume.values.copy()
    blank[:, :, 4:13] *= 0.2
    scene = dataclasses.replace(scene, volume=vr.Volume(blank))
    planned = dataclasses.replace(march_plan(scene), termination=0.0)
    everything = planned.everything()
    np.testing.assert_array_equal(march(scene, plan=planned).rgba, march(scene, plan=everything).rgba)


def test_empty_space_is_left_out_and_saves_samples():
    scene = sparse_scene(40, 32)
    plan = march_plan(scene)
    assert plan.includes("empty space")
    planned, everything = march(scene, plan=plan), march(scene, plan=plan.everything())
    np.testing.assert_array_equal(planned.rgba, everything.rgba)
    assert planned.samples < everything.samples / 3


@pytest.mark.parametrize("brightness", [0.5, 1.0, 6.0])
def test_what_an_early_end_leaves_out_is_within_the_bound(brightness, monkeypatch):
    monkeypatch.setattr(marching, "BATCH", 64)  # or all of so few rays is sampled before any ends
    # Homogeneous, so that fine and coarse agree and only the part of the early end is left of the bound.
    transfer = vr.TransferFunction([0.0], [(brightness, 0.0, 0.0)], [1.0])
    volume = vr.Volume(np.zeros((8, 8, 8), np.uint8))
    scene = vr.Scene(volume, transfer, camera_towards(volume), 24, 16, background=(0, 2 * brightness, 0, 1))
    plan = dataclasses.replace(march_plan(scene), termination=0.3)
    never = dataclasses.replace(plan, termination=0.0)
    early, full = march(scene, plan=plan), march(scene, plan=never)
    difference = np.abs(early.rgba - full.rgba).max(axis=-1)
    ended = early.rgba[..., 1] > full.rgba[..., 1] + 1e-3  # more of the background is left
    assert ended.sum() > 20
    assert early.samples < full.samples
    assert (difference <= early.bound + 1e-14).all()  # the images themselves are rounded
    # It is not merely large: T times the brightest thing behind, which is the background here.
    most = 0.3 * max(2 * brightness, 1.0)
    assert (early.bound[ended] <= most).all()
    assert (early.bound[ended] >= difference[ended]).all()


def test_light_brighter_than_one_counts_in_what_an_early_end_leaves_out():
    # Dark in front, ten times white behind: ending at T = 0.05 loses up to 0.5, in a colour and not in alpha.
    values = np.zeros((4, 4, 40))
    values[:, :, 20:] = 1.0
    volume = vr.Volume(values)
    transfer = vr.TransferFunction([0, 1], [(0, 0, 0), (10, 10, 10)], [0.2, 0.2])
    eye, target = (-30.0, 1.5, 1.5), (0.0, 1.5, 1.5)
    camera = vr.Camera.orthographic(eye, target, (0, 0, 1), 1.0, 0.0, 100.0)
    scene = vr.Scene(volume, transfer, camera, 1, 1)
    plan = dataclasses.replace(march_plan(scene), termination=0.05)
    early = march(scene, plan=plan)
    full = march(scene, plan=dataclasses.replace(plan, termination=0.0))
    lost = np.abs(early.rgba - full.rgba).max()
    assert lost > 0.05
    assert lost <= early.bound[0, 0]


def test_the_image_does_not_depend_on_threads_or_chunks(monkeypatch):
    scene = rough_scene(40, 30)
    expected = march(scene, threads=1)
    for threads, chunk in ((1, 7), (2, 64), (3, 1200)):
        monkeypatch.setattr(rendering, "RAYS_PER_CHUNK", chunk)
        out = march(scene, threads=threads)
        np.testing.assert_array_equal(out.rgba, expected.rgba)
        np.testing.assert_array_equal(out.bound, expected.bound)


@pytest.mark.parametrize(("seed", "step"), [(0, 0.5), (1, 0.25), (2, 0.1)])
def test_the_estimate_covers_the_error_of_most_pixels(seed, step):
    # An estimate is not a bound: on independent random voxels, rougher than any data, 93 % is asked here.
    scene = rough_scene(24, 16, seed=seed)
    out, truth = march(scene, step=step), march(scene, step=step / 64)
    error = np.abs(out.rgba - truth.rgba).max(axis=-1)
    hit = out.rgba[..., 3] > 0
    assert (error <= out.bound)[hit].mean() >= 0.93
    assert out.bound_kind == "estimate"


def test_the_estimate_tends_to_eight_times_the_error_of_a_smooth_scene():
    # C(3h) - C(h) = (9 - 1) k h^2
    scene, truth = phantoms.ramp_scene(width=12, height=9)
    out = march(scene, step=0.02)
    error = np.abs(out.rgba - truth).max(axis=-1)
    inside = error > 1e-8
    assert np.median(out.bound[inside] / error[inside]) == pytest.approx(8.0, rel=0.1)


def test_met_tolerance_compares_the_bound_with_the_tolerance():
    scene = rough_scene(12, 8)
    worst = march(scene).bound.max()
    assert march(scene, tolerance=worst * 1.01).met_tolerance
    assert not march(scene, tolerance=worst * 0.99).met_tolerance


def test_a_camera_inside_the_volume_sees_what_is_in_front_of_it():
    transfer = vr.TransferFunction([0.0], [(1, 1, 1)], [0.25])
    volume = vr.Volume(np.zeros((8, 8, 8)))
    camera = vr.Camera.look_at((3.5, 3.5, 3.5), (9, 3.5, 3.5), (0, 0, 1), 1e-3, 0.1, 10)
    out = march(vr.Scene(volume, transfer, camera, 1, 1))
    assert out.rgba[0, 0, 3] == pytest.approx(-math.expm1(-0.25 * 4.0), abs=1e-14)  # 16 segments


def test_a_camera_that_looks_along_a_face_sees_the_face():
    transfer = vr.TransferFunction([0.0], [(1, 1, 1)], [0.25])
    volume = vr.Volume(np.zeros((8, 8, 8)), centering="node")
    camera = vr.Camera.orthographic((-5, 0, 3.5), (0, 0, 3.5), (0, 0, 1), 1e-3, 0, 100)
    out = march(vr.Scene(volume, transfer, camera, 1, 1))
    assert out.rgba[0, 0, 3] == pytest.approx(-math.expm1(-0.25 * 7.0), abs=1e-14)


@pytest.mark.parametrize("extinction", [1e4, 1e300])
def test_stiff_extinctions_end_rays_without_a_warning(extinction):
    transfer = vr.TransferFunction([0, 1], [(1, 0.5, 0)] * 2, [0, extinction])
    out = march(rough_scene(12, 8, transfer=transfer))
    assert np.isfinite(out.rgba).all()
    assert out.rgba.max() <= 1.0


def test_a_transparent_volume_costs_no_samples_and_leaves_the_background():
    transfer = vr.TransferFunction([0, 1], [(1, 1, 1)] * 2, [0, 0])
    out = march(rough_scene(12, 8, transfer=transfer, background=(0.1, 0.2, 0.3, 0.4)))
    assert out.samples == 0
    assert (out.rgba == [0.1, 0.2, 0.3, 0.4]).all()
    assert (out.bound == 0).all()


def test_progress_reaches_the_end():
    seen = []
    march(rough_scene(12, 8), progress=lambda done, total: seen.append((done, total)))
    assert seen[-1][0] == seen[-1][1]


def test_an_exception_in_progress_stops_the_rendering():
    def stop(_done, _total):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        march(rough_scene(12, 8), progress=stop)


def test_a_step_that_would_run_for_hours_is_refused():
    volume = vr.Volume(np.zeros((128, 4, 4)), spacing=(1.0, 1.0, 1e6))
    transfer = vr.TransferFunction([0.0], [(1, 1, 1)], [1e-8])
    scene = vr.Scene(volume, transfer, camera_towards(volume), 2, 2)
    with pytest.raises(vr.SceneError, match="step must be stated"):
        march_plan(scene)
    assert march_plan(scene, step=1e5).step == 1e5


def test_early_termination_is_planned_only_where_it_can_happen():
    scene = rough_scene(12, 8, transfer=colorful_transfer(extinction=0.5))
    assert not march_plan(scene).includes("early termination")
    assert planning.TERMINATION == 1e-6


@pytest.mark.parametrize("threads", [1, 2])
def test_an_exception_in_a_thread_ends_the_rendering(monkeypatch, threads):
    def fail(*_):
        raise MemoryError

    monkeypatch.setattr(integration, "march_chunk", fail)
    monkeypatch.setattr(rendering, "RAYS_PER_CHUNK", 8)  # more chunks than threads
    with pytest.raises(MemoryError):
        march(rough_scene(12, 8), threads=threads)


def test_an_opacity_that_rounds_past_one_is_one():
    # 0.21 + (1 - 0.21) / (0.9 - 0.2) * (3 * 0.3 - 0.2) is 1 + 2^-52 in float64, and has no logarithm.
    transfer = vr.TransferFunction.from_opacity([0.2, 0.9], [(1, 1, 1)] * 2, [0.21, 1.0])
    values = np.full((6, 6, 6), 3 * 0.3)
    values[0], values[-1] = 0.0, 1.0
    volume = vr.Volume(values)
    for step in (None, 1.0, 0.3):
        out = march(vr.Scene(volume, transfer, camera_towards(volume), 8, 8), step=step)
        assert np.isfinite(out.rgba).all()
        assert out.rgba.max() <= 1.0 + 1e-15
    constant = vr.Volume(np.full((4, 4, 4), 107.99999999999999))
    transfer = vr.TransferFunction.from_opacity([-710, 108], [(1, 1, 1)] * 2, [0.18, 1.0])
    assert march_plan(vr.Scene(constant, transfer, camera_towards(constant), 8, 8)).includes("volume")


def test_the_plan_of_another_scene_is_refused():
    scene, other = rough_scene(12, 8), rough_scene(12, 8, seed=1)
    with pytest.raises(vr.SceneError, match="the plan of another volume"):
        march(other, plan=march_plan(scene))
    with pytest.raises(vr.SceneError, match="the plan of another volume"):
        vr.trace(other, (0, 0), plan=march_plan(scene))
    larger = dataclasses.replace(scene, width=20)
    assert march(larger, plan=march_plan(scene)).rgba.shape == (8, 20, 4)


@pytest.mark.parametrize("more", [{"step": 0.1}, {"method": "exact"}, {"tolerance": 0.5}])
def test_a_plan_stands_alone(more):
    scene = rough_scene(12, 8)
    with pytest.raises(vr.SceneError, match="plan must stand alone"):
        march(scene, plan=march_plan(scene), **more)


def test_a_word_is_no_plan():
    with pytest.raises(vr.SceneError, match=r"plan must be a volref.Plan, got str"):
        march(rough_scene(12, 8), plan="march")
    with pytest.raises(vr.SceneError, match=r"scene must be a volref.Scene, got NoneType"):
        march(None)
