"""`accept`: what any correct machine may draw of a scene with a program."""

import time

import numpy as np
from numpy.typing import ArrayLike

from volref.emulation.ambiguity import ambiguous
from volref.emulation.catalogue import named
from volref.emulation.device import Device
from volref.emulation.passes import emulate
from volref.emulation.pipeline import Pipeline
from volref.oracle.acceptance import Acceptance
from volref.scene.scene import Scene


def accept(
    scene: Scene,
    pipeline: str | Pipeline,
    device: str | Device | None = None,
    jitter: ArrayLike | None = None,
    frames: int = 1,
) -> Acceptance:
    """Return the interval of every pixel in which a correct machine's image lies."""
    began = time.perf_counter()
    program = named(pipeline) if isinstance(pipeline, str) else pipeline
    machine = Device.named(device) if isinstance(device, str) else Device() if device is None else device
    out = emulate(scene, program, machine, jitter, frames)
    marked = ambiguous(scene, program, machine, jitter, frames)
    slack = np.where(marked[..., None], 0.5, 1.0 / 255)
    lo, hi = np.clip(out.rgba - slack, 0, None), np.minimum(out.rgba + slack, 1)
    drawn = out.samples > 0
    spent = time.perf_counter() - began
    return Acceptance(lo, hi, out.rgba, lo, hi, marked, drawn, {}, "", program, machine, frames, spent)
