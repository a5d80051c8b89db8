import dataclasses

import numpy as np
import pytest

from tests.scenes import rough_scene
from volref import Mesh, Scene, SceneError


def test_records_are_frozen():
    scene = rough_scene()
    with pytest.raises(dataclasses.FrozenInstanceError):
        scene.width = 5


def test_replace_checks_again():
    with pytest.raises(SceneError, match=r"scene.width must be a whole number from 1 to 65536, got 0"):
        dataclasses.replace(rough_scene(), width=0)


def test_a_scene_of_meshes_only_is_allowed_and_an_empty_one_is_not():
    camera = rough_scene().camera
    mesh = Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)])
    assert Scene(None, None, camera, 4, 4, meshes=[mesh]).meshes == (mesh,)
    with pytest.raises(SceneError, match="got neither"):
        Scene(None, None, camera, 4, 4)


def test_a_volume_without_a_transfer_function_is_refused():
    scene = rough_scene()
    with pytest.raises(SceneError, match=r"scene.transfer must be given with the other one"):
        Scene(scene.volume, None, scene.camera, 4, 4)


def test_a_straight_background_is_recognised_where_it_can_be():
    with pytest.raises(SceneError, match=r"must be premultiplied"):
        rough_scene(background=(1, 1, 1, 0))
    assert rough_scene(background=np.array([2, 2, 2, 1])).background == (2, 2, 2, 1)


@pytest.mark.parametrize("width", [10**400, 4.0, "4", True])
def test_sizes_are_whole_numbers(width):
    with pytest.raises(SceneError, match=r"scene.width must be a whole number") as refusal:
        rough_scene(width=width)
    assert len(str(refusal.value)) < 200


def test_meshes_are_a_list():
    scene = rough_scene()
    with pytest.raises(SceneError, match=r"scene.meshes must be a list of meshes, got NoneType"):
        dataclasses.replace(scene, meshes=None)


def test_modes_take_what_they_need_and_nothing_else():
    scene = rough_scene()
    with pytest.raises(SceneError, match=r"scene.isovalue must be given in mode 'isosurface'.*got none"):
        dataclasses.replace(scene, mode="isosurface")
    with pytest.raises(SceneError, match=r"scene.isovalue must be given.*got one in mode 'mip'"):
        dataclasses.replace(scene, mode="mip", isovalue=1.0)
    with pytest.raises(SceneError, match=r"scene.slice_plane must be given in mode 'slice'"):
        dataclasses.replace(scene, mode="slice")
    with pytest.raises(SceneError, match=r"scene.mode must be 'composite' or"):
        dataclasses.replace(scene, mode="sum")
    with pytest.raises(SceneError, match=r"scene.lights\[0\] must be a volref.Light, got tuple"):
        dataclasses.replace(scene, lights=[(1, 1, 1)])
