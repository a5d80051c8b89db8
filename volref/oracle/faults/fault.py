"""What a fault is: a named change of what is drawn, with a strength."""

from collections.abc import Callable
from dataclasses import dataclass

from volref.arrays import Floats
from volref.emulation.device import Device
from volref.emulation.pipeline import Pipeline
from volref.scene.scene import Scene


@dataclass(frozen=True, eq=False)
class Subject:
    """What is drawn and judged: all that `emulate` and `accept` take."""

    scene: Scene
    pipeline: Pipeline
    device: Device
    jitter: Floats | None = None
    frames: int = 1


def unchanged(image: Floats, _: Subject, __: float) -> Floats:
    """Return an image as it is."""
    return image


@dataclass(frozen=True)
class Fault:
    """A fault of a renderer.

    key
        Row of the table of faults, and a word: "O1-uncorrected".
    title
        What is wrong, as a sentence's end: "opacity is not corrected for the step".
    strengths
        What strengths are tried; of a fault that is there or not, 1 alone.
    fitted
        Whether strengths between those are tried too: the fault has a derivative.
    suits
        Whether it can be had in a subject at all.
    changed
        The subject that a program with the fault draws.
    after
        What it does to the finished canvas (H, W, 4).
    """

    key: str
    title: str
    strengths: tuple[float, ...]
    fitted: bool
    suits: Callable[[Subject], bool]
    changed: Callable[[Subject, float], Subject]
    after: Callable[[Floats, Subject, float], Floats] = unchanged
