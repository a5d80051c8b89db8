"""Marches with start offsets held to a scalar loop, to the midpoint rule, and to the true integral."""

import dataclasses
import math
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import numpy as np
import pytest

from tests.oracles import scalar
from tests.scenes import rough_scene
from volref import (
    Camera,
    Mesh,
    Scene,
    SceneError,
    TransferFunction,
    Volume,
    jitter_images,
    plan,
    render,
    render_jittered,
)

SCENE = rough_scene(12, 8, background=(0.1, 0.2, 0.3, 0.5))
STEP = 0.3
TRIANGLE = Mesh([(-40.0, -40.0, 2.0), (40.0, -40.0, 2.0), (0.0, 60.0, 2.0)], [(0, 1, 2)], (0.2, 0.9, 0.4))


def with_offsets(scene, offsets, **options):
    decided = plan(scene, method="march", step=STEP, **options)
    return render(scene, plan=dataclasses.replace(decided, offsets=offsets))


def test_each_ray_samples_where_its_offset_says():
    offsets = jitter_images(12, 8, seed=5)[0]
    image = with_offsets(SCENE, offsets.reshape(-1)).rgba
    eye = SCENE.camera.world_from_view[:3, 3]
    target = eye - SCENE.camera.world_from_view[:3, 2]
    for y, x in np.ndindex(8, 12):
        ray = scalar.look_at_ray(eye, target, (0, 0, 1), SCENE.camera.fov_y, 12, 8, x, y)
        expected = scalar.march_ray(
            SCENE.volume, SCENE.transfer, *ray, STEP, background=SCENE.background, place=offsets[y, x]
        )
        # float32 holds 24 bits, and a ray has up to 30 segments.
        np.testing.assert_allclose(image[y, x], expected, rtol=0, atol=30 * 2.0**-23)


@pytest.mark.parametrize("precision", ["float32", "float64"])
def test_an_offset_of_a_half_is_the_midpoint_rule_to_the_bit(precision):
    half, middle = (with_offsets(SCENE, offsets, precision=precision) for offsets in (np.full(96, 0.5), None))
    assert np.array_equal(half.rgba, middle.rgba)
    assert np.array_equal(half.bound, middle.bound)


def test_skipping_empty_blocks_changes_nothing_at_any_offset():
    decided = plan(SCENE, method="march", step=STEP)
    for offsets in (np.zeros(96), np.ones(96), jitter_images(12, 8)[0].reshape(-1)):
        skipping = dataclasses.replace(decided, offsets=offsets, precision="float64", rounding=0.0)
        everywhere = skipping.everything()
        # A segment left out has no opacity: only the number of roundings may differ.
        np.testing.assert_allclose(
            render(SCENE, plan=skipping).rgba, render(SCENE, plan=everywhere).rgba, rtol=0, atol=1e-14
        )


def test_the_image_is_the_mean_of_its_frames():
    offsets = jitter_images(12, 8, frames=3, seed=2)
    frames = [with_offsets(SCENE, frame.reshape(-1)).rgba for frame in offsets]
    for out in (
        render_jittered(SCENE, 3, seed=2, step=STEP),
        render_jittered(SCENE, jitter=offsets, step=STEP),
        render_jittered(SCENE, plan=plan(SCENE, method="march", step=STEP), seed=2, frames=3),
    ):
        np.testing.assert_allclose(out.rgba, np.mean(frames, axis=0), rtol=0, atol=1e-15)
        assert out.bound_kind == "estimate"
        assert out.plan.includes("jitter")


def test_a_small_texture_is_repeated_and_frames_may_be_fewer_than_given():
    texture = np.array([[[0.1, 0.9]], [[0.4, 0.4]]])
    once = render_jittered(SCENE, 1, jitter=texture, step=STEP)
    assert np.array_equal(once.rgba, with_offsets(SCENE, np.tile([0.1, 0.9], 48)).rgba)


def test_the_mean_of_many_frames_comes_close_where_the_midpoint_rule_does_not():
    scene = dataclasses.replace(SCENE, width=24, height=16)
    truth = render(scene, tolerance=1e-9).rgba
    errors = [
        np.sqrt(((render_jittered(scene, n, step=1.0, seed=1).rgba - truth) ** 2).mean()) for n in (4, 64)
    ]
    midpoint = np.sqrt(((render(scene, method="march", step=1.0).rgba - truth) ** 2).mean())
    # Sixteen times the frames: a quarter of the noise, and what the bend leaves.
    assert errors[1] < 0.45 * errors[0]
    assert errors[1] < 0.5 * midpoint


def dense_ball():
    """A smooth volume in which rays end: what is left of the error is the order of the rule."""
    z, y, x = np.mgrid[-1:1:32j, -1:1:32j, -1:1:32j]
    volume = Volume(np.exp(-4 * (x**2 + y**2 + z**2)), origin=(-15.5, -15.5, -15.5))
    transfer = TransferFunction([0.1, 1.0], [(0.1, 0.3, 1.0), (1.0, 0.8, 0.3)], [0.0, 0.4])
    camera = Camera.look_at((0, -60, 35), (0, 0, 0), (0, 0, 1), 25.0, 1.0, 200.0)
    return Scene(volume, transfer, camera, 60, 40)


@pytest.mark.parametrize("frames", [1, 4, 16, 64])
@pytest.mark.parametrize(
    ("scene", "step"),
    [(dataclasses.replace(SCENE, width=60, height=40), 0.5), (dense_ball(), 1.0), (dense_ball(), 4.0)],
    ids=["rough", "smooth", "coarse"],
)
def test_the_estimate_covers_99_9_percent_of_the_pixels(scene, step, frames):
    """Of independent voxels, than which nothing is rougher, and of a smooth ball that ends rays."""
    truth = render(scene, tolerance=1e-9).rgba
    out = render_jittered(scene, frames, step=step, seed=1)
    assert np.mean(np.abs(out.rgba - truth).max(axis=-1) <= out.bound + 1e-9) >= 0.999


def test_meshes_and_clear_pixels_are_as_without_jitter():
    scene = dataclasses.replace(SCENE, meshes=[TRIANGLE])
    out, plain = render_jittered(scene, 2, step=STEP), render(scene, method="march", step=STEP)
    assert np.array_equal(out.distance, plain.distance)
    only = Scene(None, None, SCENE.camera, 12, 8, [TRIANGLE])
    alone = render_jittered(only, 2)
    np.testing.assert_allclose(alone.rgba, render(only).rgba, rtol=0, atol=2.0**-52)


def test_other_processes_take_their_samples_at_the_same_places():
    here = render_jittered(SCENE, 2, seed=4, step=STEP)
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        there = render_jittered(SCENE, 2, seed=4, step=STEP, executor=pool)
    assert np.array_equal(here.rgba, there.rgba)


def test_progress_goes_through_all_frames():
    seen = []
    render_jittered(SCENE, 2, step=STEP, progress=lambda done, total: seen.append((done, total)))
    assert seen == sorted(seen)
    assert seen[-1] == (3000, 3000)  # two frames, and the midpoint rule that they are compared with


@pytest.mark.parametrize(
    ("options", "fragment"),
    [
        ({"frames": 0}, "frames must be a whole number from 1"),
        ({"frames": 3, "jitter": np.zeros((2, 4, 4))}, "frames must be a whole number from 1 to 2, got 3"),
        ({"jitter": np.full((4, 4), 1.5)}, "jitter must be offsets from 0 to 1, got 1.5 to 1.5"),
        ({"jitter": np.zeros((0, 4, 4))}, "jitter must be offsets from 0 to 1, got none"),
        ({"jitter": np.zeros(4)}, "jitter must have shape (frames, height, width)"),
        ({"seed": -1}, "seed must be a whole number"),
        ({"plan": plan(SCENE)}, "plan must be one of method 'march'"),
        ({"step": math.inf}, "step must be finite"),
    ],
)
def test_what_cannot_be_jittered_is_refused_in_one_sentence(options, fragment):
    with pytest.raises(SceneError) as refusal:
        render_jittered(SCENE, **options)
    assert fragment in str(refusal.value)


def test_offsets_of_another_size_are_refused():
    with pytest.raises(SceneError, match=r"plan\.offsets must be one per pixel of 12 x 8, got shape"):
        with_offsets(SCENE, np.zeros(95))
