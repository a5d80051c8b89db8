"""Faults of opacity and of how samples are put together: rows O and M of the table."""

from volref.emulation.loop.opacity import factor_of
from volref.emulation.rays.box import box_of
from volref.oracle.faults.fault import Subject
from volref.oracle.faults.making import fault, replaced, switched, switching

CORRECTED = ("corrected", "per-step", "per-length")


def _knows_the_step(subject: Subject) -> bool:
    return subject.pipeline.opacity.rule in CORRECTED


def _stale(subject: Subject, ratio: float) -> Subject:
    factor = factor_of(subject.scene, subject.pipeline, box_of(subject.scene))
    return switched(subject, opacity={"factor": ratio * factor})


OPACITY = (
    fault(
        "O1-uncorrected",
        "opacity is not corrected for the step",
        switching(opacity={"rule": "as-is", "factor": 1.0}),
        where=_knows_the_step,
    ),
    fault(
        "O1-stale",
        "opacity is corrected for a step of another length",
        _stale,
        where=_knows_the_step,
        strengths=(0.5, 2.0),
        fitted=True,
    ),
    fault(
        "O2-add-alpha",
        "alpha is added without what is in front",
        replaced("accumulation", "rule", {"over": "add-alpha"}),
    ),
    fault(
        "O5-straight-as-premultiplied",
        "straight colour is taken for premultiplied",
        replaced("accumulation", "normalize", {"none": "always", "above-one": "always"}),
    ),
)
