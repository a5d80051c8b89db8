"""Laws that hold for any scene, drawn by hypothesis.

Others live beside the stage they belong to: weights and the last transmittance add up to one, splitting a
segment changes nothing, over is associative (tests/stages/test_composite.py); triangle order is irrelevant
(tests/truth/meshes/test_surfaces.py); skipping changes nothing (tests/truth/test_march.py).
"""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import volref as vr
from tests.scenes import camera_towards, colorful_transfer, rough_volume
from volref.phantoms.meshes import sphere_mesh

# Both ways to the image; the exact one so close that what it may still be off does not show.
EXACT = {"method": "exact", "tolerance": 1e-12}
MARCH = {"method": "march", "tolerance": 1e-12}
WAYS = pytest.mark.parametrize(
    "way", [MARCH, pytest.param(EXACT, marks=pytest.mark.slow)], ids=lambda way: way["method"]
)

ANGLE = st.floats(0, 2 * np.pi)
SHIFT = st.tuples(*[st.floats(-50, 50)] * 3)


def scene_with_a_ball(seed, width=10, height=8):
    volume = rough_volume(seed, spacing=(1.0, 0.8, 1.7))
    ball = sphere_mesh(2.0, volume.corners.mean(axis=0), colors=(0.2, 0.9, 0.4), subdivisions=2)
    background = (0.1, 0.0, 0.2, 0.3)
    camera = camera_towards(volume)
    return vr.Scene(volume, colorful_transfer(), camera, width, height, meshes=[ball], background=background)


def turned(angle, axis):
    c, s = np.cos(angle), np.sin(angle)
    matrix = np.eye(3)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    matrix[i, i] = matrix[j, j] = c
    matrix[i, j], matrix[j, i] = -s, s
    return matrix


def moved(scene, rotation, shift):
    """The same scene, camera, volume and meshes, elsewhere in the world."""
    shift = np.array(shift)
    world_from_old = np.eye(4)
    world_from_old[:3, :3], world_from_old[:3, 3] = rotation, shift
    volume = scene.volume
    camera = scene.camera
    view = camera.view_from_world @ np.linalg.inv(world_from_old)
    return dataclasses.replace(
        scene,
        volume=vr.Volume(
            volume.values,
            volume.spacing,
            rotation @ volume.origin + shift,
            rotation @ volume.direction,
            volume.centering,
        ),
        camera=vr.Camera(view, camera.kind, fov_y=camera.fov_y, near=camera.near, far=camera.far),
        meshes=[
            vr.Mesh(mesh.vertices @ rotation.T + shift, mesh.faces, mesh.colors) for mesh in scene.meshes
        ],
    )


def same_images(first, second):
    """Equal to rounding but at outlines, where one ray may pass on either side of an edge."""
    # Positions near 50 round to 1e-14; the table turns a thousandth of a voxel into at most a hundredth.
    return np.abs(first.rgba - second.rgba).max(axis=-1) <= 1e-11


@WAYS
@given(seed=st.integers(0, 20), angle=ANGLE, axis=st.integers(0, 2), shift=SHIFT)
@settings(max_examples=25)
def test_moving_camera_and_scene_together_changes_nothing(way, seed, angle, axis, shift):
    scene = scene_with_a_ball(seed)
    there = moved(scene, turned(angle, axis), shift)
    first, second = vr.render(scene, **way), vr.render(there, **way)
    same = same_images(first, second)
    # An outline may fall on the other side of a pixel centre only where it passes within 1e-10 pixels of it.
    assert (~same).sum() <= 1
    hit = np.isfinite(first.distance) & same
    np.testing.assert_allclose(first.distance[hit], second.distance[hit], rtol=0, atol=1e-11)


@WAYS
@given(seed=st.integers(0, 20), scale=st.sampled_from([2.0**-20, 0.5, 4.0, 2.0**30]))
@settings(max_examples=15)
def test_scaling_the_world_and_the_extinction_changes_nothing(way, seed, scale):
    # Powers of two scale without rounding, so the images are equal to the bit.
    volume = rough_volume(seed)
    scene = vr.Scene(volume, colorful_transfer(), camera_towards(volume), 10, 8)
    larger = vr.Volume(volume.values, np.multiply(volume.spacing, scale), np.multiply(volume.origin, scale))
    transfer = dataclasses.replace(scene.transfer, extinction=scene.transfer.extinction / scale)
    camera = scene.camera
    view = camera.view_from_world.copy()
    view[:3, 3] *= scale
    camera = vr.Camera(view, "perspective", fov_y=35.0, near=camera.near * scale, far=camera.far * scale)
    other = vr.Scene(larger, transfer, camera, 10, 8)
    np.testing.assert_array_equal(vr.render(scene, **way).rgba, vr.render(other, **way).rgba)


@WAYS
@given(seed=st.integers(0, 20), factor=st.floats(0.1, 4))
@settings(max_examples=15)
def test_colour_is_linear_and_opacity_does_not_depend_on_it(way, seed, factor):
    scene = dataclasses.replace(scene_with_a_ball(seed), meshes=(), background=(0, 0, 0, 0))
    brighter = dataclasses.replace(scene.transfer, colors=scene.transfer.colors * factor)
    first, second = (vr.render(dim, **way) for dim in (scene, dataclasses.replace(scene, transfer=brighter)))
    alphas, colors = zip(*((out.rgba[..., 3], out.rgba[..., :3]) for out in (first, second)), strict=True)
    if way["method"] == "march":
        np.testing.assert_array_equal(*alphas)
        np.testing.assert_allclose(colors[1], factor * colors[0], rtol=1e-13)  # 40 segments
    else:  # brighter colours may ask for more pieces: each image is within its own bound
        bound = (np.maximum(factor, 1) * first.bound + second.bound)[..., None]
        assert (np.abs(alphas[1] - alphas[0])[..., None] <= bound).all()
        assert (np.abs(colors[1] - factor * colors[0]) <= bound).all()


@WAYS
@given(seed=st.integers(0, 20), value=st.floats(0, 1))
@settings(max_examples=15)
def test_a_white_scene_over_white_is_white(way, seed, value):
    # Emission and absorption in balance: with colour 1 everywhere, C + T B = 1 - T + T.
    scene = scene_with_a_ball(seed)
    white = dataclasses.replace(
        scene,
        transfer=dataclasses.replace(scene.transfer, colors=np.full((4, 3), value)),
        meshes=[vr.Mesh(mesh.vertices, mesh.faces, (value,) * 3) for mesh in scene.meshes],
        background=(value, value, value, 1),
    )
    out = vr.render(white, **way)
    # telescoped weights: one rounding per segment, of which there are at most 40
    allowed = 40 * 2.0**-52 if way["method"] == "march" else out.bound[..., None]
    assert (np.abs(out.rgba[..., :3] - value) <= allowed).all()


@WAYS
@given(seed=st.integers(0, 20), x=st.integers(0, 3), y=st.integers(0, 3))
@settings(max_examples=15)
def test_a_part_of_a_larger_image_is_that_part(way, seed, x, y):
    # An off-centre projection of a 5 x 4 window gives the pixels of the whole image.
    scene = scene_with_a_ball(seed)
    plan = vr.plan(scene, **way)
    whole = vr.render(scene, plan=plan)
    clip = scene.camera.clip_from_view(10, 8)
    window = np.eye(4)
    window[0, 0], window[1, 1] = 2.0, 2.0
    window[0, 3], window[1, 3] = (10 - 2 * x - 5) / 5, -(8 - 2 * y - 4) / 4
    camera = vr.Camera.from_matrices(scene.camera.view_from_world, window @ clip)
    part = vr.render(dataclasses.replace(scene, camera=camera, width=5, height=4), plan=plan)
    difference = np.abs(part.rgba - whole.rgba[y : y + 4, x : x + 5]).max(axis=-1)
    assert (difference <= 1e-11).all()
