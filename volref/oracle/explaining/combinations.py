"""Which combination of the open switches of a set of pipelines explains an image."""

import dataclasses
from typing import NamedTuple

from volref.arrays import Floats
from volref.emulation.files.candidates import Candidates
from volref.emulation.pipeline import Pipeline
from volref.errors import SceneError
from volref.oracle.explaining.drawing import canvas_at
from volref.oracle.explaining.measuring import Measure
from volref.oracle.explaining.trying import Progress
from volref.oracle.faults.fault import Subject

# More combinations than this are refused: each is drawn.
MOST = 4096


class Combination(NamedTuple):
    """Switches in words, the share of what is outside that they explain, and what they draw."""

    words: str
    explained: float
    looked_at: Floats
    picture: Floats


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
    found = []
    for number, pipeline in enumerate(candidates, start=1):
        one = dataclasses.replace(subject, pipeline=pipeline)
        try:
            picture = canvas_at(one, measure.chosen)
        except SceneError:
            continue
        seen = measure.looked_at(picture)
        words = _switches(candidates, pipeline)
        found.append(Combination(words, measure.explained(seen), seen, picture))
        if progress is not None:
            progress(number, candidates.count)
    if not found:
        message = f"pipeline.unknown must leave a program that draws the scene, got {candidates.count} "
        raise SceneError(message + "that do not; open other switches")
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
