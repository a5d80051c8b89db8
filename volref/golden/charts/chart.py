"""What a test chart is."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from volref.arrays import Floats
from volref.emulation.device import Device
from volref.emulation.pipeline import Pipeline
from volref.oracle.faults.fault import Subject
from volref.scene.scene import Scene

# Start offsets are multiples of this: an 8-bit texture holds them as they are.
CODES = 255

# Where the start offsets of charts come from.
SEED = 7


@dataclass(frozen=True)
class Chart:
    """A tiny scene and the program that draws it, made to tell faults apart.

    Parameters
    ----------
    name, title
        A short name; what is seen, in one line.
    make
        Makes the scene.
    pipeline
        The program.
    separates
        Rows of the table of faults, "G1", that show here.
    frames
        How many are averaged, each with start offsets of its own; 0: one without any.
    """

    name: str
    title: str
    make: Callable[[], Scene]
    pipeline: Pipeline
    separates: tuple[str, ...]
    frames: int = 0

    def subject(self, device: Device | None = None) -> Subject:
        """Return the chart on a machine: all that `emulate`, `accept` and `explain` take."""
        scene = self.make()
        machine = Device() if device is None else device
        return Subject(scene, self.pipeline, machine, self.jitter(scene), max(self.frames, 1))

    def jitter(self, scene: Scene) -> Floats | None:
        """Return the start offsets (frames, H, W), or None where there are none."""
        if not self.frames:
            return None
        codes = np.random.default_rng(SEED).integers(0, CODES, (self.frames, scene.height, scene.width))
        return np.asarray(codes / CODES)
