"""volref's verdict on the images of the experiment."""

import dataclasses
from dataclasses import dataclass
from functools import cache

from data_gen.why_intervals.drawing import Drawn, on
from volref.emulation.device import Device
from volref.formats import codes_of
from volref.oracle.acceptance import Acceptance
from volref.oracle.accepting import accept
from volref.oracle.faults.fault import Subject
from volref.oracle.verdict import OUTSIDE, check

# A set of machines: what WebGL 2 in highp may be, where one does not know more.
ANY_MACHINE = Device.named("webgl-highp")


@dataclass(frozen=True)
class Verdict:
    """status as `check` has it; how many pixels lie outside, and the worst by how much in 1/255."""

    status: str
    outside: int
    excess: float

    @property
    def caught(self) -> bool:
        """Whether the image is rejected."""
        return self.status == OUTSIDE


class Judge:
    """Accepts a scene on the machines that are asked for, on each once."""

    def __init__(self, subject: Subject) -> None:
        self.subject = subject
        self.accepted: dict[Device, Acceptance] = {}

    def accepts(self, machine: Device) -> Acceptance:
        """Return the intervals of the scene on a machine, or on a set of them."""
        if machine not in self.accepted:
            one = on(self.subject, machine)
            found = accept(one.scene, one.pipeline, one.device, one.jitter, one.frames)
            # What coarser filters may draw is asked for with each image that is outside.
            coarse = None if found.low_quality is None else cache(found.low_quality)
            self.accepted[machine] = dataclasses.replace(found, low_quality=coarse)
        return self.accepted[machine]

    def verdict(self, drawn: Drawn, machine: Device) -> Verdict:
        """Return whether a machine may draw the canvas."""
        found = check(codes_of(drawn.canvas, 8), self.accepts(machine))
        return Verdict(found.status, int(found.outside.sum()), round(255 * float(found.excess.max()), 2))
