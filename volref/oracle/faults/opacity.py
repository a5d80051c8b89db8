"""Faults of opacity and of how samples are put together: rows O and M of the table."""

from volref.emulation.loop.opacity import factor_of
from volref.emulation.rays.box import box_of
from volref.oracle.faults.fault import Subject
from volref.oracle.faults.making import fault, replaced, switched, switching

CORRECTED = ("corrected", "per-step", "per-length")


def _knows_the_step(subject: Subject) -> bool:
    return subject.pipeline.opacity.rule in CORRECTED


def _uncorrected(subject: Subject, rest: float) -> Subject:
    """Return a subject with the table's opacity; rest of 2: what is left of a ray has all of it too."""
    changed = switched(subject, opacity={"rule": "as-is", "factor": 1.0})
    if rest == 1:
        return changed
    if subject.pipeline.stepping.last_step != "partial":
        return subject
    return switched(changed, stepping={"last_step": "whole"})


def _stale(subject: Subject, ratio: float) -> Subject:
    factor = factor_of(subject.scene, subject.pipeline, box_of(subject.scene))
    return switched(subject, opacity={"factor": ratio * factor})


def _at_each_sample(subject: Subject, factor: float) -> Subject:
    return switched(subject, opacity={"times": factor})


def _by_ray(subject: Subject, _: float) -> Subject:
    """Return a subject whose opacity hangs on the length of the ray."""
    rule, counted = subject.pipeline.opacity.rule, subject.pipeline.stepping.rule == "count"
    if rule == "corrected":
        return switched(subject, opacity={"rule": "corrected-by-ray"})
    return switched(subject, opacity={"rule": "per-step"}) if rule == "per-length" and counted else subject


def _gathered(subject: Subject, rule: str) -> Subject:
    return switched(subject, accumulation={"rule": rule}, opacity={"rule": "as-is", "factor": 1.0})


OPACITY = (
    fault(
        "O1-uncorrected",
        "opacity is not corrected for the step",
        _uncorrected,
        where=_knows_the_step,
        strengths=(1.0, 2.0),
    ),
    fault(
        "O1-stale",
        "opacity is corrected for a step of another length, or in a world of another scale",
        _stale,
        where=_knows_the_step,
        strengths=(0.25, 0.5, 2.0, 4.0),
        fitted=True,
    ),
    fault(
        "O2-add-alpha",
        "alpha is added without what is in front",
        replaced("accumulation", "rule", {"over": "add-alpha"}),
    ),
    fault(
        "O3-factor-per-sample",
        "a factor of the whole image is applied to each sample",
        _at_each_sample,
        strengths=(0.5, 0.8, 1.25),
        fitted=True,
    ),
    fault("O4-ray-length", "opacity hangs on how long the ray is", _by_ray),
    fault(
        "O5-premultiplied-twice",
        "the table's colours are multiplied by their opacity before they are uploaded and after",
        switching(table={"premultiplied": True}),
    ),
    fault(
        "O5-straight-as-premultiplied",
        "straight colours of samples are taken for premultiplied",
        switching(accumulation={"color": "premultiplied"}),
    ),
    fault(
        "O5-straight-output",
        "the colour that is written is straight where premultiplied is meant",
        replaced("accumulation", "normalize", {"none": "always", "above-one": "always"}),
    ),
    fault(
        "M1-average",
        "the mean of the samples is shown in place of their composition",
        lambda subject, _: _gathered(subject, "mean"),
    ),
    fault(
        "M1-maximum",
        "the most opaque sample is shown in place of the composition",
        lambda subject, _: _gathered(subject, "greatest"),
    ),
)
