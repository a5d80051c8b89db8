"""What the precision study found: as data, as JSON, as CSV, as a table for people, and as a page."""

import csv
import io
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from volref.studies.precision.frontier import frontier
from volref.studies.precision.machine import Machine
from volref.studies.precision.methods import METHODS, setting_words
from volref.studies.precision.page import precision_page, seconds_words
from volref.studies.precision.points import SceneStudy


@dataclass(frozen=True)
class PrecisionReport:
    """Error against time of all methods on all scenes that were measured.

    Parameters
    ----------
    machine
        Where it was timed, on one thread.
    scenes
        What was measured, scene by scene.
    budget
        Seconds that each scene had for repeated runs.
    seconds
        Wall time of it all.
    """

    machine: Machine
    scenes: tuple[SceneStudy, ...]
    budget: float
    seconds: float

    @property
    def problems(self) -> tuple[str, ...]:
        """Broken certificates, and tolerances that a certified method missed."""
        return tuple(problem for study in self.scenes for problem in study.problems)

    @property
    def passed(self) -> bool:
        """Whether every certificate holds and every tolerance of a certified method is met."""
        return not self.problems

    @property
    def sentence(self) -> str:
        """How many certificates were put to the test, and what failed."""
        certified = sum(p.bound_kind == "certified" for study in self.scenes for p in study.points)
        images = f"{certified or 'no'} certified image{'s' * (certified != 1)}"
        if not self.passed:
            return f"{images}; {'; '.join(self.problems)}"
        return f"{images}, every pixel within its bound and every tolerance met" if certified else images

    def as_dict(self) -> dict[str, Any]:
        """Return plain data for JSON."""
        return {
            "passed": self.passed,
            "problems": list(self.problems),
            "machine": asdict(self.machine),
            "budget": self.budget,
            "seconds": self.seconds,
            "scenes": [study.as_dict() for study in self.scenes],
        }

    def csv(self) -> str:
        """Return a row per point under one line of names; None is an empty cell."""
        rows = [
            {"scene": s.name, "width": s.width, "height": s.height, "reference": s.reference, **p.as_dict()}
            for s in self.scenes
            for p in s.points
        ]
        text = io.StringIO()
        writer = csv.DictWriter(text, list(rows[0]) if rows else ["scene"], lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
        return text.getvalue()

    def markdown(self, images: Mapping[str, str] | None = None) -> str:
        """Return the results as a page; `images` are paths of plots by name of the scene."""
        return precision_page(self.machine, self.scenes, self.sentence, images or {})

    def __str__(self) -> str:
        """Return, scene by scene, the points that no other beats, and what the certificates gave."""
        parts = [str(self.machine), *(_frontier_table(study) for study in self.scenes), self.sentence]
        return "\n\n".join(parts)


def _frontier_table(study: SceneStudy) -> str:
    by_name = {method.name: method for method in METHODS}
    lines = [
        f"{study.name}, {study.width} x {study.height}: {study.meaning}",
        f"  {'not beaten by any other':<40}  {'seconds':>7}  {'largest error':>13}  {'RMS':>10}  its bound",
    ]
    for point in frontier(study.points):
        method = by_name[point.method]
        name = f"{method.title}, {setting_words(method, point.setting)}"
        bound = "" if point.bound is None else f"{point.bound:.2g}"
        lines.append(
            f"  {name:<40}  {seconds_words(point.seconds):>7}  {point.errors.largest!s:>13}  "
            f"{point.errors.rms!s:>10}  {bound:>9}"
        )
    return "\n".join([*lines, *(f"  left out: {words}" for words in study.stopped)])
