"""The box of a volume: where texture space lies in the world, and which way its faces look."""

import numpy as np
import pytest

from tests.emulation.scenes import radar_example
from volref import Camera, Scene, TransferFunction, Volume
from volref.emulation.rays.box import CORNERS, box_of

TRANSFER = TransferFunction.from_opacity([0, 255], [(1, 1, 1)] * 2, [0, 0.5])
TURNED = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
MIRRORED = TURNED * (-1, 1, 1)
CAMERAS = {
    "perspective": Camera.look_at((9, -7, 12), (1, 2, 3), (0, 1, 0), 50, 1, 60),
    "parallel": Camera.orthographic((9, -7, 12), (1, 2, 3), (0, 1, 0), 9, 1, 60),
}


def scene(direction=TURNED, centering="cell", camera="perspective"):
    volume = Volume(np.zeros((4, 3, 5)), (0.5, 2.0, 1.0), (1.0, 2.0, 3.0), direction, centering)
    return Scene(volume, TRANSFER, CAMERAS[camera], 12, 8)


@pytest.mark.parametrize("centering", ["cell", "node"])
@pytest.mark.parametrize("direction", [TURNED, MIRRORED])
def test_corners_of_texture_space_are_those_of_the_volume(direction, centering):
    shown = scene(direction, centering)
    box = box_of(shown)
    counts = np.array([5, 3, 4]) - (centering == "node")
    margin = 0.5 if centering == "cell" else 0.0
    for corner in CORNERS:
        index = corner * counts - margin
        expected = np.array([1.0, 2.0, 3.0]) + direction @ (index * (0.5, 2.0, 1.0))
        found = box.world_from_texture @ [*corner, 1.0]
        # Float64, some products.
        np.testing.assert_allclose(found, [*expected, 1.0], rtol=0, atol=1e-13)
        np.testing.assert_allclose(box.texture_from_world @ found, [*corner, 1.0], rtol=0, atol=1e-13)
    np.testing.assert_allclose(box.sides, counts * (0.5, 2.0, 1.0), rtol=1e-13)


@pytest.mark.parametrize("camera", CAMERAS)
def test_clip_positions_are_the_cameras_own(camera):
    shown = scene(camera=camera)
    box = box_of(shown)
    project = shown.camera.clip_from_view(12, 8) @ shown.camera.view_from_world
    expected = [project @ box.world_from_texture @ [*corner, 1.0] for corner in CORNERS]
    np.testing.assert_allclose(box.clip_corners, expected, rtol=0, atol=1e-12)


@pytest.mark.parametrize("direction", [TURNED, MIRRORED])
def test_faces_turn_counter_clockwise_seen_from_outside_and_cover_the_box(direction):
    box = box_of(scene(direction))
    world = CORNERS @ box.world_from_texture[:3, :3].T + box.world_from_texture[:3, 3]
    middle, area, volume = world.mean(axis=0), 0.0, 0.0
    for triangle in box.triangles:
        a, b, c = world[triangle]
        normal = np.cross(b - a, c - a)
        assert normal @ (a - middle) > 0
        area += np.linalg.norm(normal) / 2
        volume += normal @ (a - middle) / 6
    x, y, z = box.sides
    np.testing.assert_allclose([area, volume], [2 * (x * y + y * z + z * x), x * y * z], rtol=1e-12)


def test_the_box_of_a_radar_is_a_cube_around_its_antenna_that_its_last_gates_touch():
    shown = radar_example()
    box = box_of(shown)
    # Twelve gates of 8 km, the middle of the first at 4 km.
    assert box.sides[0] == box.sides[1] == box.sides[2]
    np.testing.assert_allclose(
        box.world_from_texture @ [0.5, 0.5, 0.5, 1], [*shown.volume.origin, 1], atol=1e-9
    )
    np.testing.assert_allclose(box.sides[0] / 2, 12 * 8e3, rtol=1e-12)
