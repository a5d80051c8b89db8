"""Conventions of docs/conventions.md that no stage has to itself."""

import math

import numpy as np
import pytest

import volref as vr
from tests.scenes import camera_towards, rough_scene
from volref.image import bytes_from_unit, decode_rgba8, encode_rgba8
from volref.scene.transform import affine, transform_directions, transform_points

EPS = np.finfo(np.float64).eps
EYE, TARGET, UP = (3, 1, 2), (0, 0.5, 0), (0.1, 1, 0)


def box(transfer, depth=4.0, **camera):
    """One voxel of value 0.5, `depth` world units deep, seen along -z by a parallel camera in its middle."""
    volume = vr.Volume(np.full((1, 1, 1), 0.5), spacing=(1, 1, depth))
    place = {"near": 1.0, "far": 100.0} | camera
    view = vr.Camera.orthographic((0, 0, 50), (0, 0, 0), (0, 1, 0), 0.5, **place)
    return vr.Scene(volume, transfer, view, 1, 1)


def grey(extinction=0.25):
    return vr.TransferFunction([0.5], [(0.5, 0.5, 0.5)], [extinction])


def test_world_from_view_takes_a_view_point_to_the_world():
    camera = vr.Camera.look_at(EYE, TARGET, UP, 40.0, 0.5, 20.0)
    ahead = np.subtract(TARGET, EYE) / np.linalg.norm(np.subtract(TARGET, EYE))
    p_world = camera.world_from_view @ [0, 0, -2.0, 1]
    # an inverse of a rotation and one product, numbers up to 4
    np.testing.assert_allclose(p_world[:3], EYE + 2 * ahead, rtol=0, atol=32 * EPS)


def test_points_are_rows():
    turn = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    matrix = affine(turn, np.array([10.0, 20, 30]))
    points = np.array([[1.0, 0, 0], [0, 2, 0]])
    for point, got in zip(points, transform_points(matrix, points), strict=True):
        assert got.tolist() == (matrix @ [*point, 1])[:3].tolist()
    assert transform_directions(matrix, points).tolist() == [[0, 1, 0], [-2, 0, 0]]


def test_near_and_far_do_not_cut_the_volume():
    scene = rough_scene(12, 8)
    low, high = scene.volume.corners.min(axis=0), scene.volume.corners.max(axis=0)
    away = np.linalg.norm(scene.camera.world_from_view[:3, 3] - (low + high) / 2)
    view = scene.camera.view_from_world
    cut = vr.Camera(view, "perspective", fov_y=35.0, near=away * 0.99, far=away * 1.01)
    around = vr.Camera(view, "perspective", fov_y=35.0, near=away / 100, far=away * 100)
    images = [
        vr.render(vr.Scene(scene.volume, scene.transfer, camera, 12, 8)).rgba for camera in (cut, around)
    ]
    np.testing.assert_array_equal(*images)
    assert images[0].any()


def test_the_far_plane_of_a_parallel_camera_does_not_cut_the_volume_but_its_near_plane_begins_the_rays():
    alpha = [
        vr.render(box(grey(), near=near, far=far)).rgba[0, 0, 3]
        for near, far in ((1, 100), (1, 50), (50, 51))
    ]
    # 16 segments or 8; the eye is 50 in front of the middle of a box 4 deep
    np.testing.assert_allclose(alpha, -np.expm1([-1.0, -1.0, -0.5]), rtol=0, atol=32 * EPS)


def test_colours_of_a_table_are_weighted_with_their_opacity_and_not_decoded():
    rgba = vr.render(box(grey())).rgba[0, 0]
    # 16 segments with a rounding or two each
    np.testing.assert_allclose(rgba, -math.expm1(-1.0) * np.array([0.5, 0.5, 0.5, 1]), rtol=0, atol=32 * EPS)


@pytest.mark.parametrize("interpolation", ["opacity", "extinction"])
def test_a_layer_of_one_unit_distance_has_the_opacity_of_the_table(interpolation):
    table = np.array([[0.2, 0.4, 0.6, 0.3]] * 2)
    for length, layers in ((4.0, 1.0), (2.0, 2.0), (8.0, 0.5)):
        transfer = vr.TransferFunction.from_lut(
            table, (0, 1), unit_distance=length, interpolation=interpolation
        )
        alpha = vr.render(box(transfer, depth=4.0)).rgba[0, 0, 3]
        # up to 16 segments with a rounding or two each
        assert alpha == pytest.approx(1 - 0.7**layers, abs=32 * EPS)


def test_segments_are_equal_and_no_longer_than_the_step():
    table = vr.trace(box(grey(), depth=4.0), (0, 0), step=0.75).table
    lengths = table["t_end"] - table["t_start"]
    # distances near 50, each rounded by an ulp of 64
    np.testing.assert_allclose(lengths, [4 / 6] * 6, rtol=0, atol=64 * EPS)
    np.testing.assert_allclose(table["opacity"], -np.expm1(-0.25 * lengths), rtol=0, atol=64 * EPS)


def test_a_span_of_up_to_three_steps_has_three_equal_segments():
    for step in (1.5, 10.0):
        table = vr.trace(box(grey(), depth=3.0), (0, 0), step=step).table
        np.testing.assert_allclose(table["t_end"] - table["t_start"], [1.0] * 3, rtol=0, atol=64 * EPS)


def test_every_array_of_a_rendering_is_float64_with_row_0_at_the_top():
    scene = rough_scene(6, 4)
    mesh = vr.Mesh([(-90, -90, 90), (90, -90, 90), (0, 90, 90)], [(0, 1, 2)])  # above everything
    camera = camera_towards(scene.volume, direction=(1, 0, 0), fov_y=170.0)
    out = vr.render(vr.Scene(scene.volume, scene.transfer, camera, 6, 4, meshes=[mesh]))
    for array, shape in ((out.rgba, (4, 6, 4)), (out.distance, (4, 6)), (out.bound, (4, 6))):
        assert array.dtype == np.float64
        assert array.shape == shape
    assert np.isfinite(out.distance[0]).any()
    assert np.isinf(out.distance[3]).all()


def test_alpha_is_never_encoded():
    half = np.array([[[0.25, 0.25, 0.25, 0.5]]])  # straight colour 0.5, which sRGB codes as 188
    assert encode_rgba8(half).tolist() == [[[188, 188, 188, 128]]]
    assert encode_rgba8(half, "none").tolist() == [[[128, 128, 128, 128]]]
    assert decode_rgba8(np.array([[[0, 0, 0, 51]]], np.uint8))[0, 0, 3] == 0.2


def test_numbers_are_clipped_and_rounded_to_the_nearest_code():
    codes = np.array([-1.0, 0.4, 0.6, 0.5, 1.5, 2.5, 127.5, 254.9, 256.0, 1e9])
    # k / 255 * 255 is k again for these, but for an ulp that could decide a tie: the ties are exact
    assert bytes_from_unit(codes / 255).tolist() == [0, 0, 1, 0, 2, 2, 128, 255, 255, 255]


def test_both_errors_are_value_errors():
    assert issubclass(vr.SceneError, ValueError)
    assert issubclass(vr.FormatError, ValueError)
