"""Which combination of the open switches of a set of pipelines explains an image."""

import dataclasses
from typing import NamedTuple

from volref.emulation.files.candidates import Candidates
from volref.emulation.pipeline import Pipeline
from volref.errors import SceneError
from volref.oracle.explaining.drawing import canvas_at
from volref.oracle.explaining.measuring import NOISE, Measure
from volref.oracle.explaining.trying import Progress
from volref.oracle.faults.fault import Subject

# More combinations than this are refused: each is drawn.
MOST = 4096


class Combination(NamedTuple):
    """Switches in words, the share they explain of what the worst leaves outside, and the program."""

    words: str
    explained: float
    subject: Subject


def tried(
    candidates: Candidates, subject: Subject, measure: Measure, progress: Progress | None
) -> list[Combination]:
    """Return the combinations that can be drawn, the one that explains most first.

    Raises
    ------
    SceneError
        If there are too many, or none can be drawn.
    """
    if candidates.count > MOST:
        message = f"pipeline.unknown must leave at most {MOST} combinations, got {candidates.count}; "
        raise SceneError(message + "settle some of the switches")
    left: list[tuple[Subject, float]] = []
    for number, pipeline in enumerate(candidates, start=1):
        one = dataclasses.replace(subject, pipeline=pipeline)
        try:
            picture = canvas_at(one, measure.chosen)
        except SceneError:
            continue
        left.append((one, measure.outside(measure.looked_at(picture))))
        if progress is not None:
            progress(number, candidates.count)
    if not left:
        message = f"pipeline.unknown must leave a program that draws the scene, got {candidates.count} "
        raise SceneError(message + "that do not; open other switches")
    most = max(max(outside for _, outside in left), NOISE)
    found = (
        Combination(_switches(candidates, one.pipeline), 1.0 - outside / most, one) for one, outside in left
    )
    return sorted(found, key=lambda one: -one.explained)


def words_of(found: list[Combination], same: list[Combination], *, known: bool) -> str:
    """Return which combinations explain an image, in words."""
    best = found[0]
    if not known:
        return f"no combination explains the image; the nearest: {best.words}, {best.explained:.0%}"
    if same:
        others = ", or ".join(one.words for one in same)
        return f"not identifiable in this scene: {best.words}, or {others}"
    message = f"the image is that of {best.words}"
    return message + (f"; next: {found[1].words}, {found[1].explained:.0%}" if len(found) > 1 else "")


def _switches(candidates: Candidates, pipeline: Pipeline) -> str:
    """Return the open switches of a combination, such as "volume.slices=count"."""
    names = (name.partition(".")[::2] for name in candidates.unknown)
    return ", ".join(f"{group}.{word}={getattr(getattr(pipeline, group), word)}" for group, word in names)
