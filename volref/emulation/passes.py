"""`emulate`: the conductor of an emulation, pass by pass.

uploads --> coordinate targets --> ends of rays --> paths --> the loop --> fragment colours --> canvas
                                        ^                         ^                               ^
            mesh targets ---------------+-------------------------+-------------------------------+
"""

import time

import numpy as np
from numpy.typing import ArrayLike

from volref.arrays import Floats, whole_number
from volref.emulation.agreement import check_kinds
from volref.emulation.catalogue import named
from volref.emulation.device import Device
from volref.emulation.drawing import prepare
from volref.emulation.frames import last_targets, march_frame
from volref.emulation.loop.offsets import start_offsets
from volref.emulation.pipeline import Pipeline
from volref.emulation.result import Emulation
from volref.emulation.surfaces.composition import distance_shown
from volref.emulation.targets.canvas import (
    cleared,
)
from volref.scene.scene import Scene


def emulate(
    scene: Scene,
    pipeline: str | Pipeline,
    device: str | Device | None = None,
    jitter: ArrayLike | None = None,
    frames: int = 1,
) -> Emulation:
    """Return what a GPU program draws of a scene, with every target on the way.

    Parameters
    ----------
    pipeline
        The name of a system in the catalogue, or a `Pipeline`.
    device
        The machine; the default is ideal arithmetic, but for the float32 that decides how many samples a ray
        takes.  A name is a preset, see `Device.named`.
    jitter
        For programs with a start offset: numbers 0..1 of a step, (frames, H, W).  None is 0.
    frames
        Frames of which the running mean is shown.

    Raises
    ------
    SceneError
        If the scene holds what the program cannot draw, or an argument breaks a rule.

    Examples
    --------
    >>> import volref as vr
    >>> volume = vr.Volume(np.full((4, 4, 4), 255, np.uint8))
    >>> transfer = vr.TransferFunction.from_opacity([0, 255], [(1, 1, 1)] * 2, [0, 0.5])
    >>> camera = vr.Camera.look_at((1.5, 1.5, 9), (1.5, 1.5, 1.5), (0, 1, 0), 30, 1, 20)
    >>> out = emulate(vr.Scene(volume, transfer, camera, 3, 3), "texture3d")
    >>> out.rgba8[1, 1].tolist(), int(out.samples[1, 1])
    ([239, 239, 239, 239], 8)
    """
    began = time.perf_counter()
    program = named(pipeline) if isinstance(pipeline, str) else pipeline
    machine = Device.named(device) if isinstance(device, str) else Device() if device is None else device
    check_kinds(scene, program, machine)
    count = whole_number("frames", frames, low=1, high=1 << 20)
    offsets = start_offsets(scene, program, jitter, count)
    drawing = prepare(scene, program, machine)
    passes = dict(drawing.targets)
    mean = cleared(scene, program.output, machine)
    for number, offset in enumerate(offsets, start=1):
        marched = march_frame(drawing, offset)
        last, mean = last_targets(drawing, marched, number, mean)
    passes |= last
    size = scene.height, scene.width
    samples = np.zeros(size, np.int64)
    samples.reshape(-1)[drawing.ends.pixel] = marched.samples
    images = {name: _image(target, size) for name, target in passes.items()}
    distance = distance_shown(drawing.distance, drawing.ends.pixel, marched.alpha)
    seconds = time.perf_counter() - began
    return Emulation(images["canvas"], distance, images, samples, seconds, program, machine)


def _image(target: Floats, size: tuple[int, int]) -> Floats:
    """Return a target as (H, W, channels)."""
    return target if target.ndim > 2 else target.reshape(*size, -1)
