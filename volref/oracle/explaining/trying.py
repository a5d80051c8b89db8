"""Trying faults: their pictures at the pixels of a measure, and how much each explains."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np

from volref.arrays import Booleans, Floats
from volref.errors import SceneError
from volref.oracle.explaining.drawing import canvas_at
from volref.oracle.explaining.findings import Finding, Part
from volref.oracle.explaining.measuring import Measure
from volref.oracle.faults.fault import Subject

Progress: TypeAlias = Callable[[int, int], None]
Key: TypeAlias = tuple[tuple[str, float], ...]


@dataclass(eq=False)
class Trials:
    """Pictures of a subject with faults, each drawn once.

    count: how many have been drawn.  expected: how many there may be.  seen: what was tried, by keys and
    strengths.  looked_at: what the measure sees of it (P, C), None if it cannot be had.
    """

    subject: Subject
    measure: Measure
    progress: Progress | None = None
    expected: int = 0
    count: int = 0
    seen: dict[Key, Finding] = field(default_factory=dict)
    looked_at: dict[Key, Floats | None] = field(default_factory=dict)

    def tried(self, *parts: Part) -> Finding:
        """Return how much faults explain together; -inf if they cannot be had together."""
        key = key_of(parts)
        if key not in self.seen:
            picture = drawn_with(self.subject, parts, self.measure.chosen)
            seen = self.looked_at[key] = None if picture is None else self.measure.looked_at(picture)
            explained = -np.inf if seen is None else self.measure.explained(seen)
            self.seen[key] = Finding(parts, float(explained))
            self._tell()
        return self.seen[key]

    def _tell(self) -> None:
        self.count += 1
        if self.progress is not None:
            self.expected = max(self.expected, self.count)
            self.progress(self.count, self.expected)

    def finished(self) -> None:
        """Tell that nothing is left to be tried."""
        if self.progress is not None:
            self.progress(self.count, self.count)


def key_of(parts: tuple[Part, ...]) -> Key:
    """Return what tells faults with strengths from others."""
    return tuple((part.fault.key, part.strength) for part in parts)


def drawn_with(
    subject: Subject, parts: tuple[Part, ...], chosen: Booleans, *, rounds: bool = False
) -> Floats | None:
    """Return the picture (H, W, 4) of a program with faults at some pixels; None if it cannot be had."""
    subjects = [subject]
    try:
        for part in parts:
            if not part.fault.suits(subjects[-1]):
                return None
            subjects.append(part.fault.changed(subjects[-1], part.strength))
        picture = canvas_at(subjects[-1], chosen, rounds=rounds)
    except SceneError:
        return None
    for part, before in zip(parts, subjects, strict=False):
        picture = part.fault.after(picture, before, part.strength)
    return picture
