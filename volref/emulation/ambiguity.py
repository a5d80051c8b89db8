"""Pixels that hang on a comparison: where a nudge as small as float32's own error changes the image.

A GPU program is full of them: is the ray at its end, is alpha at its threshold, is the surface met, does the
pixel centre lie inside an edge, which byte is nearest.  Two correct machines may answer differently where the
two sides are all but equal, and the pixel then differs by a whole sample.  They are found by drawing the
scene again with the eye moved by a few millionths of the box, and the threshold of alpha and the length of a
step by as much: what stays the same within half an 8-bit step does not hang on a comparison.  (A step of
another length is needed where a ray goes through two parallel faces: no move of the eye changes how long it
is there.)
"""

import dataclasses
from collections.abc import Iterator
from itertools import product

import numpy as np
from numpy.typing import ArrayLike

from volref.arrays import Booleans, Floats
from volref.emulation.device import Device
from volref.emulation.drawing import prepare
from volref.emulation.groups import Stepping
from volref.emulation.passes import emulate
from volref.emulation.pipeline import Pipeline
from volref.emulation.rays.box import box_of
from volref.emulation.rays.paths import vector_length, world_step_of
from volref.emulation.switches import Plain
from volref.scene.camera import Camera
from volref.scene.scene import Scene
from volref.scene.transform import affine

# 32 units in the last place of float32 at 1; positions are off by a few after some hundred additions.
NUDGE = 2.0**-19

# What `Stepping.opaque_at` goes up to.
HIGHEST_THRESHOLD = 2.0

# A pixel that changes by more than this hangs on a comparison; one that does not, changes by about NUDGE.
VISIBLE = 0.5 / 255


def ambiguous(
    scene: Scene,
    pipeline: Pipeline,
    device: Device | None = None,
    jitter: ArrayLike | None = None,
    frames: int = 1,
) -> Booleans:
    """Return which pixels (H, W) of an emulation hang on a comparison; arguments as for `emulate`.

    A coordinate that is stored in 8 bits counts: where it is near the middle between two bytes, the ray is
    another one.  So does a mean of frames in 8 bits: next to black a tone map makes many steps of one.
    """
    base = _floating(pipeline)
    found = _without_direction(scene, base, device or Device())
    in_bytes = pipeline.output.mean_format == pipeline.output.format == "unorm8"
    for program, visible in ((base, VISIBLE), (pipeline, 1.5 / 255))[: 1 + in_bytes]:
        plain = emulate(scene, program, device, jitter, frames).rgba
        for moved, changed in _nudged(scene, program):
            found |= _differ(plain, emulate(moved, changed, device, jitter, frames).rgba, visible)
    return found


def _without_direction(scene: Scene, pipeline: Pipeline, device: Device) -> Booleans:
    """Return the pixels (H, W) whose rays are so short that it is rounding whether they have a direction.

    One whose ends are equal has none: it is NaN, and the next machine draws a sample there.
    """
    ends = prepare(scene, pipeline, device).ends
    found = np.zeros(scene.height * scene.width, np.bool_)
    found[ends.pixel] = vector_length(ends.exit - ends.entry) < NUDGE
    return found.reshape(scene.height, scene.width)


def _floating(pipeline: Pipeline) -> Pipeline:
    """Return the program with a canvas of floats, whose changes are not rounded away."""
    changes = {"format": "float"} | ({"mean_format": "float"} if pipeline.output.mean_format else {})
    return pipeline.with_switches(output=changes)


def _nudged(scene: Scene, pipeline: Pipeline) -> Iterator[tuple[Scene, Pipeline]]:
    """Yield the scene from the corners of a small cube around the eye, thresholds and steps on both sides."""
    size = NUDGE * float(box_of(scene).sides.min())
    threshold, length = pipeline.stepping.opaque_at, _step_length(scene, pipeline.stepping)
    for corner in product((-1.0, 1.0), repeat=3):
        changes: dict[str, Plain] = {}
        if threshold is not None:
            changes["opaque_at"] = min(max(threshold + corner[0] * NUDGE, 0.0), HIGHEST_THRESHOLD)
        if length is not None:
            changes["length"] = length * (1 + corner[1] * NUDGE)
        camera = _moved(scene.camera, size * np.array(corner))
        yield dataclasses.replace(scene, camera=camera), pipeline.with_switches(stepping=changes)


def _step_length(scene: Scene, stepping: Stepping) -> float | None:
    """Return the length of a step in the units of its rule; None where a count decides."""
    if stepping.rule == "count":
        return None
    if stepping.rule == "world-length":
        return world_step_of(stepping, scene)
    return stepping.length or (1.0 if stepping.rule == "voxel-count" else 1.0 / stepping.steps)


def _moved(camera: Camera, by: Floats) -> Camera:
    """Return a camera moved by a vector of view space."""
    return dataclasses.replace(camera, view_from_world=affine(np.eye(3), -by) @ camera.view_from_world)


def _differ(one: Floats, other: Floats, visible: float) -> Booleans:
    apart = np.abs(one - other) > visible
    return np.asarray((apart | (np.isnan(one) != np.isnan(other))).any(axis=-1))
