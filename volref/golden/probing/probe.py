"""What a probe is: a tiny scene whose image tells one thing of the machine or the program that drew it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

from volref.emulation.device import Device
from volref.emulation.pipeline import Pipeline
from volref.emulation.switches import Plain, switches_of
from volref.oracle.faults.fault import Subject
from volref.scene.scene import Scene


@dataclass(frozen=True)
class Reading:
    """One answer that an image may give.

    label
        In words.
    facts
        The same as names and values: fields of `Device`, or a name of the probe's own.
    applied
        The subject that is drawn if it is so.
    """

    label: str
    facts: Mapping[str, Plain]
    applied: Callable[[Subject], Subject]


@dataclass(frozen=True)
class Probe:
    """A scene and the answers between which its image decides.

    Parameters
    ----------
    name, title
        A short name; the question.
    make
        Makes the scene.
    pipeline
        What draws it.
    readings
        All answers that are known.
    """

    name: str
    title: str
    make: Callable[[], Scene]
    pipeline: Pipeline
    readings: tuple[Reading, ...]

    def subject(self, device: Device | None = None) -> Subject:
        """Return what is drawn, on a machine."""
        return Subject(self.make(), self.pipeline, Device() if device is None else device)


def of_device(label: str, settled: Mapping[str, Plain], **facts: Plain) -> Reading:
    """Return the answer that fields of the device have these values.

    settled: what else of a set of machines is then no longer free, such as {"weight_slack": 0.0}.
    """

    def applied(subject: Subject) -> Subject:
        switches = {switch.name: getattr(subject.device, switch.name) for switch in switches_of(Device)}
        device = Device.from_dict("device", switches | dict(settled) | facts)
        return replace(subject, device=replace(device, name=subject.device.name))

    return Reading(label, facts, applied)


def of_pipeline(label: str, fact: str, group: str, **switches: Plain) -> Reading:
    """Return the answer that switches of one group of the program have these values."""

    def applied(subject: Subject) -> Subject:
        return replace(subject, pipeline=subject.pipeline.with_switches(None, **{group: switches}))

    return Reading(label, {fact: label}, applied)


def of_scene(label: str, fact: str, changed: Callable[[Scene], Scene]) -> Reading:
    """Return the answer that the program draws another scene than it was given."""
    return Reading(label, {fact: label}, lambda subject: replace(subject, scene=changed(subject.scene)))
