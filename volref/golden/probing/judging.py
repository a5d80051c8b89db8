"""From answers to a fingerprint: which readings fit the images, and the device that follows from them.

A reading fits if the whole image lies inside the acceptance interval that it leads to.  What several
fitting readings disagree about stays unknown, and free in the device, as it is in "webgl-highp".  If one
known machine alone agrees with all that was found, what no probe asks is taken from it.
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace

import numpy as np

from volref.emulation.device import PRESETS, Device
from volref.emulation.switches import Plain
from volref.errors import SceneError
from volref.golden.probing.catalogue import DELIVERY, PROBES
from volref.golden.probing.probe import Probe, Reading
from volref.oracle.accepting import accept
from volref.oracle.candidate import Candidate, ImageSource, read_candidate
from volref.oracle.delivery import Delivery
from volref.oracle.faults.fault import Subject
from volref.oracle.judging import judged

# What is free until a probe settles it.
FREE = "webgl-highp"

ENCODINGS = ("none", "srgb")

# Presets that are machines; the others are ideals and sets.
MACHINES = ("swiftshader", "llvmpipe", "lavapipe")


@dataclass(frozen=True)
class Way:
    """How pictures got out of the program: their first row, their alpha, their encoding."""

    first_row: str
    alpha: str
    encoding: str


@dataclass(frozen=True)
class Finding:
    """What a probe told.

    outside: of each reading, by its label, the share of pixels outside the interval that it leads to.
    fitting: labels of the readings without any.
    facts: what all of them agree on.
    """

    probe: Probe
    outside: Mapping[str, float]
    fitting: tuple[str, ...]
    facts: Mapping[str, Plain]

    @property
    def nearest(self) -> str:
        """The reading that leaves the fewest pixels outside."""
        return min(self.outside, key=lambda label: self.outside[label])


@dataclass(frozen=True)
class Fingerprint:
    """What the probes told of a machine and a program.

    way: how pictures got out, None if that was not found.
    findings: by probe.
    device: what to hand to `accept`: what was found, the rest free.
    machines: those known that agree with all that was found.
    confirmed: of each probe, the share of pixels outside the intervals of the device that was found.
    """

    way: Way | None
    findings: Mapping[str, Finding]
    device: Device
    machines: tuple[str, ...]
    confirmed: Mapping[str, float]

    @property
    def settled(self) -> bool:
        """Whether each probe has an answer that fits, and the device found draws them all."""
        fitting = all(finding.fitting for finding in self.findings.values())
        return self.way is not None and fitting and not any(self.confirmed.values())


def fingerprint(answers: Mapping[str, ImageSource]) -> Fingerprint:
    """Return what images of the probes tell.

    Parameters
    ----------
    answers
        Images by the probe's name, arrays or files; "delivery" has to be there, any of the others may be
        left out.

    Raises
    ------
    SceneError
        If an image is of no probe or of another size, or "delivery" is left out.
    """
    images = _checked(answers)
    device = Device.named(FREE)
    way = _way(images[DELIVERY.name], DELIVERY.subject(device))
    if way is None:
        return Fingerprint(None, {}, device, (), {})
    findings = {}
    for name, probe in PROBES.items():
        if name in images:
            findings[name] = _finding(probe, images[name], way, device)
            device = _settled(probe, findings[name], device)
    machines = tuple(name for name in MACHINES if _agrees(PRESETS[name], findings))
    if len(machines) == 1:
        device = PRESETS[machines[0]]
    device = replace(device, name="probed")
    confirmed = {
        name: _outside(
            images[name], replace(_best(finding).applied(finding.probe.subject()), device=device), way
        )
        for name, finding in findings.items()
    }
    return Fingerprint(way, findings, device, machines, confirmed)


def _checked(answers: Mapping[str, ImageSource]) -> dict[str, Candidate]:
    known = {DELIVERY.name: DELIVERY} | PROBES
    if DELIVERY.name not in answers:
        message = f"answers must hold the probe {DELIVERY.name!r}, got {', '.join(answers) or 'none'}; "
        raise SceneError(message + "draw it too: it tells how the others got out")
    images = {}
    for name, source in answers.items():
        if name not in known:
            message = f"answers must be named after probes, got {name!r}; use names of {', '.join(known)}"
            raise SceneError(message)
        images[name] = read_candidate(source)
        scene = known[name].make()
        got, wanted = images[name].numbers.shape[1::-1], (scene.width, scene.height)
        if got != wanted:
            size = "{} x {}"
            message = f"answers[{name!r}] must be {size.format(*wanted)} pixels, got {size.format(*got)}; "
            raise SceneError(message + "draw it at its own size, with a device-pixel ratio of 1")
    return images


def _way(image: Candidate, subject: Subject) -> Way | None:
    """Return how a picture got out of a program, None if no way is known that leads to it."""
    for first_row in ("top", "bottom"):
        for alpha in ("premultiplied", "straight") if image.has_alpha else ("ignored",):
            for encoding in ENCODINGS:
                way = Way(first_row, alpha, encoding)
                if _outside(image, subject, way) == 0:
                    return way
    return None


def _finding(probe: Probe, image: Candidate, way: Way, device: Device) -> Finding:
    subject = probe.subject(device)
    outside = {reading.label: _outside(image, reading.applied(subject), way) for reading in probe.readings}
    fitting = [reading for reading in probe.readings if outside[reading.label] == 0]
    facts = dict(fitting[0].facts) if fitting else {}
    for reading in fitting:
        facts = {name: value for name, value in facts.items() if reading.facts[name] == value}
    return Finding(probe, outside, tuple(reading.label for reading in fitting), facts)


def _outside(image: Candidate, subject: Subject, way: Way) -> float:
    """Return the share of the pixels outside the intervals."""
    numbers = image.numbers if way.first_row == "top" else image.numbers[::-1]
    turned = replace(image, numbers=numbers)
    acceptance = accept(subject.scene, subject.pipeline, subject.device, subject.jitter, subject.frames)
    nothing = np.zeros(numbers.shape[:2], np.bool_)
    judgement = judged(turned, acceptance, Delivery(way.alpha, way.encoding), nothing)
    return judgement.count / nothing.size


def _settled(probe: Probe, finding: Finding, device: Device) -> Device:
    """Return the device with what one reading alone says of it, if one alone fits."""
    return _best(finding).applied(probe.subject(device)).device if len(finding.fitting) == 1 else device


def _best(finding: Finding) -> Reading:
    """Return the reading that fits, or is the nearest to it."""
    return next(one for one in finding.probe.readings if one.label == finding.nearest)


def _agrees(machine: Device, findings: Mapping[str, Finding]) -> bool:
    """Tell whether a machine has all that was found."""
    names = {field.name for field in fields(Device)}
    found = [fact for finding in findings.values() for fact in finding.facts.items() if fact[0] in names]
    return bool(found) and all(getattr(machine, name) == value for name, value in found)
