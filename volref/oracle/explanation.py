"""`explain`: which fault of a renderer makes an image as it is, in numbers and in words."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from volref.arrays import Floats
from volref.emulation.catalogue import named
from volref.emulation.device import Device
from volref.emulation.files.candidates import Candidates
from volref.emulation.loop.offsets import checked_jitter
from volref.emulation.pipeline import Pipeline
from volref.errors import SceneError
from volref.oracle.acceptance import Acceptance
from volref.oracle.accepting import accept
from volref.oracle.candidate import ImageSource
from volref.oracle.explaining import combinations
from volref.oracle.explaining.drawing import canvas_at
from volref.oracle.explaining.findings import Finding, ranked
from volref.oracle.explaining.measuring import Measure, measure_of
from volref.oracle.explaining.searching import ENOUGH, KEPT, pairs_of, singles
from volref.oracle.explaining.trying import Progress, Trials, drawn_with
from volref.oracle.explaining.wording import explained_by, none_of_these, not_identifiable
from volref.oracle.faults.fault import Fault, Subject
from volref.oracle.faults.table import FAULTS
from volref.oracle.verdict import Verdict, check
from volref.scene.scene import Scene

NONE = "none"
EXPLAINED = "explained"
NONE_OF_THESE = "none of these"
NOT_IDENTIFIABLE = "not identifiable here"

# The share of what is outside that a fault has to explain to be the explanation.
ACCEPTED = 0.8

# Two faults are one here if the second leaves no more unexplained than this times as much as the first, and
# this share of what is outside: it is fitted by a few steps only.
SAME_TIMES, SAME = 1.25, 0.005

# How many pixels are looked at while faults are tried; the best are measured on all.
SCREENED = 2048


class Ranked(NamedTuple):
    """A fault, or two joined by " + ", its strength, or two, and the share of what is outside it explains."""

    fault: str
    strength: float | tuple[float, ...]
    explained: float


@dataclass(frozen=True, eq=False)
class Explanation:
    """Why an image lies outside its acceptance intervals.

    Parameters
    ----------
    status
        "none": it does not.  "explained".  "none of these": no known fault explains 80 % of what is outside.
        "not identifiable here": several do that draw the same picture of this scene.
    ranking
        Faults, the best first: (fault, strength, explained), where 1 is all of what is outside, and less than
        0 is worse than no fault.
    identifiable
        Whether no other row of the table of faults draws the same picture of this scene.
    runner_up
        The best of another row, "" if there is none.
    message
        The explanation in words.
    counterfactual
        What the program with the best fault draws (H, W, 4); None where the status is "none".
    charts
        Names of test charts that tell apart what this scene does not.
    verdict
        The image held against the intervals.
    """

    status: str
    ranking: tuple[Ranked, ...]
    identifiable: bool
    runner_up: str
    message: str
    counterfactual: Floats | None
    charts: tuple[str, ...]
    verdict: Verdict

    def __str__(self) -> str:
        """Return the message."""
        return self.message

    def as_dict(self, most: int | None = None) -> dict[str, Any]:
        """Return the explanation as plain data for JSON, with so many of the ranking."""
        return {
            "status": self.status,
            "message": self.message,
            "identifiable": self.identifiable,
            "runner_up": self.runner_up,
            "charts": list(self.charts),
            "ranking": [one._asdict() for one in self.ranking[:most] if np.isfinite(one.explained)],
            "verdict": self.verdict.as_dict(),
        }


def explain(
    candidate: ImageSource,
    scene: Scene,
    pipeline: str | Pipeline | Candidates,
    device: str | Device | None = None,
    jitter: ArrayLike | None = None,
    frames: int = 1,
    *,
    acceptance: Acceptance | None = None,
    faults: Sequence[str] | None = None,
    pairs: bool = True,
    alpha: str | None = None,
    encoding: str | None = None,
    mask: ImageSource | None = None,
    progress: Progress | None = None,
) -> Explanation:
    """Return which fault of a renderer makes an image as it is.

    The program is drawn with each fault that it can have, at several strengths; what matters is how much of
    the image's distance to its acceptance intervals is gone when they are put around that picture instead.
    The strengths of the best are fitted, and where one fault does not suffice, two are tried together.

    Parameters
    ----------
    candidate, alpha, encoding, mask
        The image and how it was delivered, as for `check`.
    scene, pipeline, device, jitter, frames
        What should have been drawn, as for `accept`.  Of a set of pipelines (`Candidates`), the combination
        of open switches that explains the image best takes the place of a fault.
    acceptance
        From `accept` of the same, where it is at hand.
    faults
        Keys of the faults to try, such as "O1-uncorrected"; default all.
    pairs
        Whether two faults are tried together where one does not suffice, which takes as long again.
    progress
        Called with how many pictures have been drawn and how many there may be.

    Raises
    ------
    SceneError
        If `emulate` or `check` refuses an argument, or a fault has no such name.

    Examples
    --------
    >>> import volref as vr
    >>> values = np.linspace(0, 255, 512).reshape(8, 8, 8).astype(np.uint8)
    >>> look = vr.TransferFunction.from_opacity([0, 255], [(0.2, 0.4, 1), (1, 0.8, 0.2)], [0, 0.6], 2)
    >>> camera = vr.Camera.look_at((18, 9, 14), (3.5, 3.5, 3.5), (0, 1, 0), 30, 1, 60)
    >>> scene = vr.Scene(vr.Volume(values), look, camera, 16, 16)
    >>> stale = vr.pipelines()["texture3d"].with_switches(opacity={"rule": "as-is"})
    >>> why = vr.explain(vr.emulate(scene, stale).rgba8, scene, "texture3d", pairs=False)
    >>> why.ranking[0].fault, round(why.ranking[0].explained, 2)
    ('O1-uncorrected', 1.0)
    """
    machine = Device.named(device) if isinstance(device, str) else Device() if device is None else device
    if isinstance(pipeline, Candidates):
        program = pipeline.pipeline
    else:
        program = named(pipeline) if isinstance(pipeline, str) else pipeline
    size = frames, scene.height, scene.width
    offsets = None if jitter is None else checked_jitter(jitter, size)
    if acceptance is not None and acceptance.lo.shape[:2] != size[1:]:
        height, width = acceptance.lo.shape[:2]
        message = f"acceptance must be of {scene.width} x {scene.height} pixels as the scene, got "
        raise SceneError(message + f"{width} x {height}; accept this scene, or leave it out")
    subject = Subject(scene, program, machine, offsets, frames)
    tried = _chosen(faults)
    intervals = accept(scene, program, machine, jitter, frames) if acceptance is None else acceptance
    verdict = check(candidate, intervals, alpha=alpha, encoding=encoding, mask=mask)
    if isinstance(pipeline, Candidates):
        return _of_set(pipeline, subject, intervals, verdict, progress)
    if verdict.passed or not verdict.outside.any():
        return _clean(verdict)
    return _searched(subject, intervals, verdict, tried, progress, pairs=pairs)


def _chosen(faults: Sequence[str] | None) -> list[Fault]:
    """Return the faults of these names, in the order of the table."""
    if faults is None:
        return list(FAULTS.values())
    for key in faults:
        if key not in FAULTS:
            message = f"faults must be keys of the table of faults, got {key!r}; "
            raise SceneError(message + f"use some of {', '.join(FAULTS)}")
    return [fault for key, fault in FAULTS.items() if key in faults]


def _clean(verdict: Verdict) -> Explanation:
    return Explanation(
        status=NONE,
        ranking=(),
        identifiable=True,
        runner_up="",
        message=verdict.message,
        counterfactual=None,
        charts=(),
        verdict=verdict,
    )


def _searched(
    subject: Subject,
    acceptance: Acceptance,
    verdict: Verdict,
    faults: list[Fault],
    progress: Progress | None,
    *,
    pairs: bool,
) -> Explanation:
    """Return the explanation of an image that lies outside."""
    trials = Trials(subject, measure_of(verdict, acceptance, subject, SCREENED), progress)
    alone = singles(trials, faults)
    findings, whole = _measured(trials, alone, measure_of(verdict, acceptance, subject))
    if pairs and len(alone) > 1 and findings[0].explained < ENOUGH:
        together = pairs_of(trials, faults, alone)
        findings, whole = _measured(trials, [*findings, *together], whole.measure)
    trials.finished()
    return _told(findings, alone, whole, verdict)


def _measured(trials: Trials, findings: list[Finding], measure: Measure) -> tuple[list[Finding], Trials]:
    """Return the best findings measured at all pixels, in the order of belief, and their pictures."""
    whole = Trials(trials.subject, measure)
    if measure.chosen.sum() == trials.measure.chosen.sum():
        whole.seen, whole.looked_at = trials.seen, trials.looked_at
    return ranked([whole.tried(*one.parts) for one in ranked(findings)[:KEPT]]), whole


def _told(findings: list[Finding], alone: list[Finding], whole: Trials, verdict: Verdict) -> Explanation:
    """Return findings as an explanation, with the faults that were not measured at all pixels behind them."""
    best = findings[0] if findings else None
    keys = {one.key for one in findings}
    every = [*findings, *(one for one in alone if one.key not in keys)]
    if best is None:
        return _nothing(verdict)
    others = [one for one in every[1:] if not set(one.rows) & set(best.rows)]
    runner_up = others[0] if others else None
    simple = (one for one in others if len(one.parts) <= len(best.parts))
    rivals = [one for one in simple if _as_good(best.explained, one.explained)]
    status = _status(best.explained, rivals=bool(rivals))
    charts: tuple[str, ...] = ()
    if status == NONE_OF_THESE:
        message = none_of_these(best)
    elif rivals:
        message, charts = not_identifiable(best, rivals)
    else:
        message = explained_by(best, runner_up)
    everywhere = np.ones_like(verdict.outside)
    return Explanation(
        status,
        tuple(Ranked(one.key, _strength(one), one.explained) for one in every),
        not rivals,
        runner_up.key if runner_up else "",
        message,
        drawn_with(whole.subject, best.parts, everywhere, rounds=True),
        charts,
        verdict,
    )


def _status(explained: float, *, rivals: bool) -> str:
    if explained < ACCEPTED:
        return NONE_OF_THESE
    return NOT_IDENTIFIABLE if rivals else EXPLAINED


def _nothing(verdict: Verdict) -> Explanation:
    """Return that none of the chosen faults can be had in the program."""
    message = none_of_these(None)
    return Explanation(NONE_OF_THESE, (), not verdict.passed, "", message, None, (), verdict)


def _strength(finding: Finding) -> float | tuple[float, ...]:
    strengths = tuple(part.strength for part in finding.parts)
    return strengths[0] if len(strengths) == 1 else strengths


def _as_good(best: float, other: float) -> bool:
    """Tell whether what explains so much is as good an explanation as the best one, as far as can be told."""
    return other >= ACCEPTED and 1 - other <= SAME_TIMES * (1 - best) + SAME


def _of_set(
    candidates: Candidates,
    subject: Subject,
    acceptance: Acceptance,
    verdict: Verdict,
    progress: Progress | None,
) -> Explanation:
    """Return which combination of open switches explains an image."""
    measure = measure_of(verdict, acceptance, subject)
    found = combinations.tried(candidates, subject, measure, progress)
    best = found[0]
    same = [one for one in found[1:] if _as_good(best.explained, one.explained)]
    ranking = tuple(Ranked(one.words, 1.0, one.explained) for one in found)
    status = _status(best.explained, rivals=bool(same))
    message = combinations.words_of(found, same, known=status != NONE_OF_THESE)
    runner_up = found[1].words if len(found) > 1 else ""
    picture = canvas_at(best.subject, np.ones_like(verdict.outside), rounds=True)
    return Explanation(status, ranking, not same, runner_up, message, picture, (), verdict)
