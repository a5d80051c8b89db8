"""The images of the experiment: those with a fault, and correct ones from different machines."""

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from data_gen.why_intervals.scenes import Case
from volref.arrays import Bytes, Floats
from volref.emulation.device import Device
from volref.emulation.passes import emulate
from volref.formats import codes_of
from volref.oracle.faults.fault import Subject
from volref.oracle.faults.making import strengths_for
from volref.oracle.faults.table import FAULTS

# What a project's golden is drawn on, and what its continuous integration draws on.
IDEAL = Device()
TESTED = Device.named("swiftshader")

# Machines that draw correctly.  "8-bit weights" is what graphics cards do: Direct3D asks for 8 bits.
MACHINES = {
    "float64": Device.named("exact"),
    "float32": Device("float32", values="float32"),
    "8-bit weights": Device("8-bit weights", values="float32", weight_bits=8, subpixel_bits=8),
    "swiftshader": TESTED,
    "llvmpipe": Device.named("llvmpipe"),
    "lavapipe": Device.named("lavapipe"),
}

# A fault that comes in several strengths is drawn with the first that suits, or with these.
STRENGTHS = {"L2-short-table": 64.0, "L2-quantised-table": 6.0, "T4-step": 2.0, "O1-stale": 2.0}


@dataclass(frozen=True, eq=False)
class Drawn:
    """A canvas, and what it is.

    kind is "fault" or "correct"; name a fault's key or a machine; strength 1 unless a fault has others.
    canvas holds numbers in the canvas's format (H, W, 4), subject what a correct machine would draw.
    """

    kind: str
    name: str
    strength: float
    canvas: Floats
    subject: Subject

    @property
    def picture(self) -> Bytes:
        """What a screenshot holds (H, W, 3): the canvas over a white page."""
        codes = codes_of(self.canvas, 8).astype(np.int64)
        return np.minimum(codes[..., :3] + 255 - codes[..., 3:], 255).astype(np.uint8)


def golden(case: Case) -> Drawn:
    """Return what a project would keep: the case drawn by ideal arithmetic."""
    return correct(case, "golden", IDEAL)


def correct(case: Case, name: str, machine: Device) -> Drawn:
    """Return the case drawn by a machine that makes no mistake."""
    subject = case.subject(machine)
    return Drawn("correct", name, 1.0, _canvas(subject), subject)


def correct_images(case: Case) -> Iterator[Drawn]:
    """Yield the case drawn by all machines."""
    for name, machine in MACHINES.items():
        yield correct(case, name, machine)


def faulty_images(case: Case, keys: tuple[str, ...] | None = None) -> Iterator[Drawn]:
    """Yield the case with each fault that it can have, drawn by the machine that tests run on."""
    subject = case.subject(TESTED)
    for key in FAULTS if keys is None else keys:
        fault = FAULTS[key]
        strengths = strengths_for(fault, subject)
        if not strengths:
            continue
        strength = STRENGTHS[key] if STRENGTHS.get(key) in strengths else strengths[0]
        canvas = fault.after(_canvas(fault.changed(subject, strength)), subject, strength)
        yield Drawn("fault", key, strength, canvas, subject)


def on(subject: Subject, machine: Device) -> Subject:
    """Return a subject on another machine."""
    return dataclasses.replace(subject, device=machine)


def _canvas(subject: Subject) -> Floats:
    return emulate(subject.scene, subject.pipeline, subject.device, subject.jitter, subject.frames).rgba
