"""Faults of where the volume lies: rows G of the table."""

from collections.abc import Callable

import numpy as np

from volref.arrays import Floats
from volref.emulation.rays.box import box_of
from volref.emulation.rays.paths import world_step_of
from volref.emulation.targets.canvas import cleared, missed
from volref.oracle.faults.fault import Fault, Subject
from volref.oracle.faults.making import (
    fault,
    grid_of,
    has_grid,
    in_same_box,
    switched,
    switching,
    with_volume,
)
from volref.scene.transform import transform_points

# Sides of a box that differ by less than this share are called equal.
EQUAL = 1e-6


def _read_further(subject: Subject, voxels: float) -> Subject:
    return switched(subject, volume={"shift": voxels})


def _moved(subject: Subject, voxels: float) -> Subject:
    volume = grid_of(subject)
    return with_volume(subject, origin=volume.world_from_index[:3] @ np.array([voxels] * 3 + [1.0]))


def _other_centering(subject: Subject, _: float) -> Subject:
    return with_volume(subject, centering="node" if grid_of(subject).centering == "cell" else "cell")


def _flipped(axis: int) -> Callable[[Subject, float], Subject]:
    """Return the change that turns an axis round: 0 is x."""

    def changed(subject: Subject, _: float) -> Subject:
        return with_volume(subject, values=np.flip(grid_of(subject).values, 2 - axis))

    return changed


def _swapped(subject: Subject, pair: float) -> Subject:
    """Exchange two axes: 1 is x and y, 2 is y and z, 3 is x and z."""
    one, other = {1: (1, 2), 2: (0, 1), 3: (0, 2)}[int(pair)]
    return in_same_box(subject, np.swapaxes(grid_of(subject).values, one, other))


def _measured_in_texture(subject: Subject, _: float) -> Subject:
    """Return a subject whose step, of one world length, is one of texture space times the longest side."""
    stepping, opacity = subject.pipeline.stepping, subject.pipeline.opacity
    if stepping.rule != "world-length" or opacity.rule != "corrected":
        return subject
    length = world_step_of(stepping, subject.scene) / float(box_of(subject.scene).sides.max())
    return switched(
        subject,
        stepping={"rule": "texture-length", "length": length},
        opacity={"rule": "corrected-in-texture"},
    )


def _unturned(subject: Subject, _: float) -> Subject:
    return with_volume(subject, direction=np.eye(3))


def _turned(subject: Subject) -> bool:
    return has_grid(subject) and not np.array_equal(grid_of(subject).direction, np.eye(3))


def _in_bricks(subject: Subject, side: float) -> Subject:
    if side >= max(grid_of(subject).size):
        return subject
    return switched(subject, volume={"brick": round(side)})


def _eye_inside(subject: Subject) -> bool:
    """Tell whether the eye is in the box, and the program draws something then."""
    camera = subject.scene.camera
    if camera.is_parallel or not has_grid(subject) or subject.pipeline.rays.kind == "coordinates":
        return False
    place = transform_points(box_of(subject.scene).texture_from_world, camera.world_from_view[:3, 3])
    return bool(((place > 0) & (place < 1)).all())


def _nothing(image: Floats, subject: Subject, _: float) -> Floats:
    output = subject.pipeline.output
    canvas = cleared(subject.scene, output, subject.device)
    missed(canvas, np.zeros(0, np.intp), output)
    return canvas.reshape(image.shape).astype(image.dtype)


def _uneven_sides(subject: Subject) -> bool:
    sides = box_of(subject.scene).sides
    return bool(sides.max() > sides.min() * (1 + EQUAL))


def _flip(letter: str, axis: int) -> Fault:
    return fault(
        f"G4-flip-{letter}", f"the volume is turned round along {letter}", _flipped(axis), where=has_grid
    )


GEOMETRY = (
    fault(
        "G1-half-voxel",
        "the volume is read beside its voxels",
        _read_further,
        where=has_grid,
        strengths=(0.5, -0.5),
        fitted=True,
    ),
    fault(
        "G1-moved-box",
        "the volume and its box lie beside their place",
        _moved,
        where=has_grid,
        strengths=(0.5, -0.5),
        fitted=True,
    ),
    fault(
        "G2-node-centred",
        "the outer voxels are taken to lie on the faces of the box",
        switching(volume={"reach": "centers"}),
        where=has_grid,
    ),
    fault(
        "G2-node-box",
        "the box ends at the centres of the outer voxels, or half a voxel behind where it should end there",
        _other_centering,
        where=has_grid,
    ),
    fault(
        "G3-step-in-texture-space",
        "steps and their opacity are measured in texture space of a box whose sides differ",
        _measured_in_texture,
        where=_uneven_sides,
    ),
    _flip("x", 0),
    _flip("y", 1),
    _flip("z", 2),
    fault(
        "G4-swapped-axes",
        "two axes of the volume are exchanged",
        _swapped,
        where=has_grid,
        strengths=(1.0, 2.0, 3.0),
    ),
    fault(
        "G6-brick-seams",
        "bricks of the volume know nothing of their neighbours",
        _in_bricks,
        where=has_grid,
        strengths=(4.0, 8.0, 16.0, 32.0),
    ),
    fault("G5-transform-ignored", "the volume's turn is ignored", _unturned, where=_turned),
    fault(
        "G5-vanishes-inside",
        "nothing is drawn when the eye is in the volume",
        where=_eye_inside,
        after=_nothing,
    ),
)
