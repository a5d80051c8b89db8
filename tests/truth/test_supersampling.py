"""Supersampling: the mean of the rays of a finer image, with the bound of that mean."""

import dataclasses

import numpy as np
import pytest

import volref as vr
from tests.scenes import colorful_transfer, rough_scene
from volref import Camera, Mesh, Scene, SceneError, Volume, render, supersample
from volref.stages.rays import pixel_rays
from volref.truth.supersampling import fine_band

TRIANGLE = Mesh([(-40.0, -40.0, 2.0), (40.0, -40.0, 2.0), (0.0, 60.0, 2.0)], [(0, 1, 2)], (0.2, 0.9, 0.4))


def mean(image, factor):
    height, width = image.shape[0] // factor, image.shape[1] // factor
    return image.reshape(height, factor, width, factor, *image.shape[2:]).mean(axis=(1, 3))


def finer(scene, factor):
    return dataclasses.replace(scene, width=factor * scene.width, height=factor * scene.height)


@pytest.mark.parametrize("factor", [1, 2, 3])
def test_a_pixel_is_the_mean_of_the_rays_of_a_finer_image(factor):
    scene = rough_scene(12, 8, background=(0.1, 0.2, 0.3, 0.5))
    fine, out = render(finer(scene, factor)), supersample(scene, factor)
    assert out.rgba.shape == (8, 12, 4)
    # Means of numbers up to 1, added in another order.
    np.testing.assert_allclose(out.rgba, mean(fine.rgba, factor), rtol=0, atol=factor**2 * 2.0**-52)
    assert out.bound_kind == fine.bound_kind == "certified"
    assert (out.bound >= mean(fine.bound, factor)).all()
    np.testing.assert_allclose(out.bound, mean(fine.bound, factor), rtol=0, atol=1e-13)
    assert out.samples == fine.samples


def test_the_bound_certifies_the_mean_of_the_true_rays():
    scene = rough_scene(8, 6)
    truth = mean(render(finer(scene, 2), tolerance=1e-12).rgba, 2)
    out = supersample(scene, 2, tolerance=1e-3)
    # 2e-12: the bound of the truth, and the rounding of its mean.
    assert (np.abs(out.rgba - truth).max(axis=-1) <= out.bound + 2e-12).all()
    assert out.met_tolerance


def test_a_march_gives_an_estimate_and_certified_only_where_all_is():
    scene = rough_scene(8, 6)
    assert supersample(scene, 2, method="march").bound_kind == "estimate"


@pytest.mark.parametrize("build", [Camera.look_at, Camera.orthographic])
@pytest.mark.parametrize("clip_z", ["-1..1", "0..1"])
def test_the_rays_of_bands_are_those_of_the_whole(build, clip_z):
    camera = build((9.0, 8.0, 11.0), (2.0, 2.5, 3.0), (0, 0, 1), 9.0, 0.5, 40.0, clip_z=clip_z)
    scene = dataclasses.replace(rough_scene(10, 7), camera=camera)
    whole = pixel_rays(camera, 30, 21, np.arange(630))
    for top, bottom in [(0, 3), (3, 4), (4, 7)]:
        band = fine_band(scene, 3, top, bottom)
        rays = pixel_rays(band.camera, band.width, band.height, np.arange(band.width * band.height))
        rows = slice(90 * top, 90 * bottom)
        # A few products of numbers up to the stretch of 7, and coordinates up to 20.
        np.testing.assert_allclose(rays.directions, whole.directions[rows], rtol=0, atol=4e-15)
        np.testing.assert_allclose(rays.origins, whole.origins[rows], rtol=0, atol=4e-14)


def test_bands_change_nothing_but_the_last_digits():
    scene = dataclasses.replace(rough_scene(12, 9), meshes=[TRIANGLE])
    whole, banded = supersample(scene, 2), supersample(scene, 2, band_pixels=100)
    assert banded.rgba.shape == whole.rgba.shape
    # Rays that differ by an ulp: both are within their bounds of almost the same truth.
    assert (np.abs(whole.rgba - banded.rgba).max(axis=-1) <= whole.bound + banded.bound + 1e-12).all()
    assert banded.samples == pytest.approx(whole.samples, rel=0.05)


def test_an_edge_is_smoothed_and_its_distance_is_the_nearest():
    camera = Camera.orthographic((0, 0, 5), (0, 0, 0), (0, 1, 0), 2.0, 0.0, 10.0)
    half = Mesh(
        [(-0.125, -9, 1), (9, -9, 1), (9, 9, 1), (-0.125, 9, 1)], [(0, 1, 2), (0, 2, 3)], (1.0, 1.0, 1.0)
    )
    scene = Scene(None, None, camera, 4, 4, [half])
    out = supersample(scene, 4)
    # Pixels are 0.5 wide; of the second one, from -0.5 to 0, the last quarter is covered.
    assert out.rgba[0, :, 3].tolist() == [0.0, 0.25, 1.0, 1.0]
    assert out.distance[0].tolist() == [np.inf, 4.0, 4.0, 4.0]
    assert out.bound_kind == "certified"
    assert out.bound.max() < 1e-14


def test_a_camera_given_as_a_matrix_keeps_its_aspect():
    scene = rough_scene(12, 8)
    clip = scene.camera.clip_from_view(12, 8)
    given = dataclasses.replace(scene, camera=Camera.from_matrices(scene.camera.view_from_world, clip))
    a, b = supersample(scene, 2), supersample(given, 2)
    assert (np.abs(a.rgba - b.rgba).max(axis=-1) <= a.bound + b.bound + 1e-12).all()


def test_progress_goes_from_the_first_band_to_the_last():
    seen = []
    supersample(rough_scene(8, 6), 2, band_pixels=64, progress=lambda done, total: seen.append((done, total)))
    assert seen == sorted(seen)
    assert seen[-1] == (3000, 3000)


def test_what_is_not_reached_in_time_has_a_bound_that_says_so():
    out = supersample(rough_scene(8, 6), 2, max_seconds=1e-6, band_pixels=64)
    assert not out.met_tolerance
    truth = supersample(rough_scene(8, 6), 2)
    assert (np.abs(out.rgba - truth.rgba).max(axis=-1) <= out.bound + truth.bound).all()


def test_a_plan_may_be_given_and_the_result_says_what_was_done():
    scene = rough_scene(6, 4)
    out = supersample(scene, 2, plan=vr.plan(scene, method="march", step=0.25))
    assert (out.plan.method, out.plan.step) == ("march", 0.25)
    assert out.plan.includes("supersampling")
    assert not supersample(scene, 1).plan.includes("supersampling")


@pytest.mark.parametrize("factor", [0, 65, 1.5, True])
def test_no_other_factor_is_taken(factor):
    with pytest.raises(SceneError, match="factor must be a whole number from 1 to 64"):
        supersample(rough_scene(6, 4), factor)


def test_an_image_too_large_is_refused_before_the_work():
    volume = Volume(np.zeros((2, 2, 2)))
    scene = Scene(
        volume, colorful_transfer(), Camera.look_at((9, 9, 9), (0, 0, 0), (0, 0, 1), 30, 1, 20), 40000, 1
    )
    with pytest.raises(SceneError, match="from 1 to 1, got 2"):
        supersample(scene, 2)
