"""Where the rays of a program start, how far apart their samples are, and when they end.

R rays.  Positions and steps are (3, R) in texture space and in the control type of the device, which is where
a shader has them; all else is (R,).
"""

from dataclasses import dataclass, field

import numpy as np

from volref.arrays import Floats, Indices, Integers
from volref.emulation.device import Device
from volref.emulation.groups import Stepping
from volref.emulation.pipeline import Pipeline
from volref.emulation.rays.box import Box
from volref.scene.radar import RadarVolume
from volref.scene.scene import Scene
from volref.scene.volume import Volume


@dataclass(frozen=True, eq=False)
class Ends:
    """Where rays enter and leave the box.

    pixel (R,): flat indices.  entry, exit (3, R): in the control type.  For programs that do not know the
    exit it lies one unit of texture space behind the entry, and `along` (3, R) is that unit.  blank: pixels
    whose fragments are transparent black without a ray.
    """

    pixel: Indices
    entry: Floats
    exit: Floats
    blank: Indices = field(default_factory=lambda: np.zeros(0, np.intp))
    along: Floats | None = None


@dataclass(frozen=True, eq=False)
class Paths:
    """Rays ready to be walked.

    entry, exit, delta (3, R): delta is the step.  length (R,): what is walked, in the units of `step`.
    step (R,): the length of a step in texture space or in the world, or of the parameter.  count (R,): steps
    of a ray, for programs that count.  texture_step, world_step (R,): the step's length, for the opacity.
    """

    entry: Floats
    exit: Floats
    delta: Floats
    length: Floats
    step: Floats
    count: Integers
    texture_step: Floats
    world_step: Floats

    def take(self, chosen: Indices) -> "Paths":
        """Return some of the rays."""
        return Paths(*(np.take(getattr(self, name), chosen, axis=-1) for name in self.__dataclass_fields__))


def paths_of(ends: Ends, scene: Scene, pipeline: Pipeline, box: Box, device: Device) -> Paths:
    """Return the steps of rays between their ends, computed in the order in which shaders do."""
    stepping, kind = pipeline.stepping, device.control_type
    ray = ends.exit - ends.entry
    length = vector_length(ray)
    count = np.full(len(length), stepping.steps)
    with np.errstate(divide="ignore", invalid="ignore"):
        if stepping.rule == "count":
            share = kind(1) / kind(stepping.steps)
            # Programs of this kind have the number of steps in their text: it is known to the compiler.
            multiplied = device.constant_divisor == "multiplied"
            delta = ray * share if multiplied else ray / kind(stepping.steps)
            step = np.full_like(length, share)
            length = np.ones_like(length)
        elif stepping.rule == "texture-length":
            size = kind(stepping.length or 1.0 / stepping.steps)
            if stepping.end == "length-left":
                # The rest of the ray is counted down by the step's nominal length.
                delta, step = size * ray / length, np.full_like(length, size)
            else:
                delta = (ray / length if ends.along is None else ends.along) * size
                step = vector_length(delta)
        elif stepping.rule == "voxel-count":
            voxels = vector_length(ray * np.array(_size(scene), kind)[:, None])
            count = (voxels / kind(stepping.length or 1.0) + kind(0.5)).astype(np.int64)
            delta, step = ray / np.maximum(count, 1).astype(kind), np.ones_like(length)
        else:
            world = _world_length(ray, box)
            size = kind(world_step_of(stepping, scene))
            length = world.astype(kind)
            delta, step = ray / length * size, np.full_like(length, size)
    texture_step = vector_length(delta)
    world_step = _world_length(delta, box)
    return Paths(ends.entry, ends.exit, delta, length, step, count, texture_step, world_step)


def world_step_of(stepping: Stepping, scene: Scene) -> float:
    """Return the length of a step of rule "world-length"."""
    if stepping.length is not None:
        return stepping.length
    assert scene.volume is not None
    if isinstance(scene.volume, RadarVolume):
        return scene.volume.gate_length / 2
    return min(scene.volume.spacing) / 2


def vector_length(vectors: Floats) -> Floats:
    """Return the lengths (R,) of vectors (3, R), x^2 + y^2 + z^2 from left to right, in their type."""
    x, y, z = vectors
    return np.asarray(np.sqrt(x * x + y * y + z * z))


def _world_length(vectors: Floats, box: Box) -> Floats:
    return np.asarray(np.linalg.norm(box.world_from_texture[:3, :3] @ vectors.astype(np.float64), axis=0))


def _size(scene: Scene) -> tuple[int, int, int]:
    assert isinstance(scene.volume, Volume)
    return scene.volume.size
