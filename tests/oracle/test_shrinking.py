import dataclasses

import numpy as np
import pytest

import volref as vr
from tests.emulation.scenes import example
from volref.oracle.faults.fault import Subject
from volref.oracle.shrinking import shrink

PROGRAM = vr.pipelines()["texture3d"]
# It reads the nearest voxel, which shows where there are two that differ.
FAULTY = PROGRAM.with_switches("faulty", volume={"filter": "nearest"})


def subject_of(scene=None, program=PROGRAM, **more):
    return Subject(
        scene or example(mesh=True, lit=True, background=(0.1, 0.2, 0.3, 1.0)), program, vr.Device(), **more
    )


def size(subject):
    scene = subject.scene
    faces = sum(len(mesh.faces) for mesh in scene.meshes)
    return (
        scene.width,
        scene.height,
        scene.volume.size,
        len(scene.transfer.values),
        faces,
        len(scene.lights),
    )


def test_what_always_fails_shrinks_to_a_pixel_a_voxel_and_a_knot():
    noise = np.zeros((3, 12, 16))
    found = shrink(subject_of(jitter=noise, frames=3), lambda _: True)
    assert size(found) == (1, 1, (1, 1, 1), 1, 0, 0)
    assert (found.frames, found.jitter, found.scene.background) == (1, None, (0, 0, 0, 0))


def needs_a_bright_voxel(subject):
    """A failure that takes one voxel of 255 and a light."""
    return bool(subject.scene.lights) and bool((subject.scene.volume.values == 255).any())


def test_what_a_failure_needs_is_kept_where_it_was():
    scene = example(lit=True)
    values = np.minimum(scene.volume.values, 254).copy()
    values[6, 2, 9] = 255
    before = dataclasses.replace(scene.volume, values=values)
    found = shrink(subject_of(dataclasses.replace(scene, volume=before)), needs_a_bright_voxel)
    assert size(found) == (1, 1, (1, 1, 1), 1, 0, 1)
    place = before.world_from_index @ (9, 2, 6, 1)
    # An origin moved by whole voxels: three products and sums, each rounded once.
    np.testing.assert_allclose(found.scene.volume.origin, place[:3], rtol=0, atol=1e-14)


def test_a_face_that_is_needed_is_found_among_many_and_keeps_its_colour():
    scene = example(mesh=True)
    colors = np.random.default_rng(0).random((len(scene.meshes[0].faces), 3))
    mesh = dataclasses.replace(scene.meshes[0], colors=colors, coloring="face")
    scene = dataclasses.replace(scene, meshes=(mesh,))
    wanted = mesh.vertices[mesh.faces[37]]

    def fails(subject):
        return any((one.vertices[face] == wanted).all() for one in subject.scene.meshes for face in one.faces)

    (left,) = shrink(subject_of(scene), fails).scene.meshes
    assert left.colors.tolist() == [colors[37].tolist()]


def test_no_more_is_asked_than_allowed_and_the_smallest_by_then_is_returned():
    asked, told = [], []

    def fails(subject):
        asked.append(size(subject))
        return True

    found = shrink(subject_of(), fails, trials=7, progress=lambda done, total: told.append((done, total)))
    assert told == [(i, 7) for i in range(1, 8)]
    assert size(found) == asked[-1]


def test_equal_failures_give_equal_scenes_by_equal_questions():
    def asked():
        sizes = []
        shrink(
            subject_of(example(lit=True)), lambda one: sizes.append(size(one)) or needs_a_light_and_size(one)
        )
        return sizes

    assert asked() == asked()


def needs_a_light_and_size(subject):
    return len(subject.scene.lights) > 0 and subject.scene.volume.size[2] >= 3


def test_what_a_program_refuses_does_not_count_as_the_failure():
    def fails(subject):
        if subject.scene.width < 4:
            message = "scene.width must be 4 or more, got less; enlarge it"
            raise vr.SceneError(message)
        return True

    assert shrink(subject_of(), fails).scene.width == 4


def test_a_subject_that_passes_is_refused():
    with pytest.raises(vr.SceneError, match="subject must fail to be shrunk, got one that passes"):
        shrink(subject_of(), lambda _: False)
    with pytest.raises(vr.SceneError, match="trials must be a whole number from 1"):
        shrink(subject_of(), lambda _: True, trials=0)


def test_a_camera_of_a_matrix_keeps_its_aspect():
    scene = example()
    clip = np.diag([1.0, 16 / 12, -1.0, 0.0])
    clip[2, 3], clip[3, 2] = -4.0, -1.0
    camera = vr.Camera.from_matrices(scene.camera.view_from_world, clip)
    found = shrink(subject_of(dataclasses.replace(scene, camera=camera)), lambda _: True)
    assert (found.scene.width, found.scene.height) == (4, 3)


def test_a_program_with_a_fault_is_left_with_what_shows_it():
    """It needs two voxels: one alone is drawn right."""

    def fails(subject):
        if max(subject.scene.volume.size) == 1:
            return False  # nothing to read but the one
        acceptance = vr.accept(subject.scene, PROGRAM, subject.device)
        drawn = vr.emulate(subject.scene, FAULTY, subject.device)
        return vr.check(drawn.rgba8, acceptance).status == "outside"

    found = shrink(subject_of(example()), fails, trials=60)
    assert fails(found)
    width, height, voxels, knots, *_ = size(found)
    assert width * height <= 12
    assert 2 <= np.prod(voxels) <= 8
    assert knots <= 2
