"""Faults of where samples lie and what ends a ray: rows T and J of the table."""

import dataclasses
import math

import numpy as np

from volref.emulation.drawing import prepare
from volref.emulation.loop.opacity import factor_of
from volref.emulation.rays.box import box_of
from volref.emulation.rays.paths import world_step_of
from volref.emulation.switches import Plain
from volref.oracle.faults.fault import Subject
from volref.oracle.faults.making import fault, replaced, switched, switching


def _early(subject: Subject, threshold: float) -> Subject:
    now = subject.pipeline.stepping.opaque_at
    if now is not None and now <= threshold:
        return subject
    return switched(subject, stepping={"opaque_at": threshold})


def _capped(subject: Subject, share: float) -> Subject:
    """Return a subject whose loop ends after a share of the steps that its longest ray needs."""
    return switched(subject, stepping={"cap": max(1, round(share * needed_steps(subject)))})


def needed_steps(subject: Subject) -> int:
    """Return the most steps that a ray of a subject takes, were it not for opacity and caps."""
    stepping = subject.pipeline.stepping
    if stepping.rule == "count":
        return stepping.steps
    paths = prepare(subject.scene, subject.pipeline, subject.device).paths
    if stepping.rule == "voxel-count":
        return int(paths.count.max(initial=1))
    lengths = paths.length / paths.step
    return math.ceil(float(lengths[np.isfinite(lengths)].max(initial=1)))


def _one_sided(subject: Subject, _: float) -> Subject:
    stepping = subject.pipeline.stepping
    cap = stepping.cap or 2 * needed_steps(subject)
    return switched(subject, stepping={"end": "outside-above", "cap": cap})


def _without_last(subject: Subject, _: float) -> Subject:
    stepping = subject.pipeline.stepping
    if stepping.rule == "count":
        return switched(subject, stepping={"cap": max(1, stepping.steps - 1)})
    return switched(subject, stepping={"last_step": "dropped"})


def _ends_with_a_part(subject: Subject) -> bool:
    stepping = subject.pipeline.stepping
    whole = stepping.end == "length-before" and stepping.advance == "multiply"
    return whole and stepping.last_step == "partial"


def _has_a_last_step(subject: Subject) -> bool:
    stepping = subject.pipeline.stepping
    counted = stepping.rule == "count" and stepping.cap is None and stepping.end in ("count", "parameter")
    return counted or _ends_with_a_part(subject)


def _other_step(subject: Subject, ratio: float) -> Subject:
    """Return a subject with steps of another length, and the opacity of the old one."""
    pipeline, stepping = subject.pipeline, subject.pipeline.stepping
    factor = factor_of(subject.scene, pipeline, box_of(subject.scene))
    changes: dict[str, Plain] = {}
    if stepping.rule == "count":
        changes["steps"] = max(1, round(stepping.steps / ratio))
        ratio = stepping.steps / max(1, round(stepping.steps / ratio))
    elif stepping.rule == "world-length":
        changes["length"] = ratio * world_step_of(stepping, subject.scene)
    else:
        usual = 1.0 if stepping.rule == "voxel-count" else 1.0 / stepping.steps
        changes["length"] = ratio * (stepping.length or usual)
    # What the opacity's rule would make of the new step is taken back.
    by_count = pipeline.opacity.rule == "per-step" and stepping.rule == "count"
    follows = by_count or pipeline.opacity.rule in ("per-length", "corrected")
    changed = switched(subject, stepping=changes)
    return switched(changed, opacity={"factor": factor / ratio if follows else factor})


def _biased(subject: Subject, mean: float) -> Subject:
    """Return a subject whose samples lie at another mean place in their steps; at 0 jitter is none at all."""
    if subject.jitter is not None and mean == 0:
        return subject
    if subject.jitter is not None:
        return dataclasses.replace(subject, jitter=np.clip(2 * mean * subject.jitter, 0.0, 1.0))
    if subject.pipeline.stepping.jitter or subject.pipeline.stepping.offset == mean:
        return subject
    return switched(subject, stepping={"offset": mean})


def _filled(subject: Subject, threshold: float) -> Subject:
    """Return a subject whose rays are opaque once they are at a threshold."""
    return switched(_early(subject, threshold), stepping={"stopped": "opaque"})


def _in_step(subject: Subject, _: float) -> Subject:
    return subject if subject.jitter is None else dataclasses.replace(subject, jitter=None)


STEPPING = (
    fault(
        "T1-early-stop",
        "rays are ended before they are opaque",
        _early,
        strengths=(0.95, 0.9, 0.8, 0.5),
        fitted=True,
    ),
    fault(
        "T1-never-reached",
        "opaque rays are never ended",
        switching(stepping={"opaque_at": None}),
    ),
    fault(
        "T1-not-renormalised",
        "rays that are ended early count as opaque without the colour that they lack",
        _filled,
        strengths=(0.95, 0.9, 0.8),
        fitted=True,
    ),
    fault(
        "T1-above-one",
        "colour is not divided by an alpha above 1",
        replaced("accumulation", "normalize", {"above-one": "none"}),
    ),
    fault(
        "T2-first-step-dropped",
        "the first step of each ray is left out",
        lambda subject, _: switched(subject, stepping={"skipped": subject.pipeline.stepping.skipped + 1}),
    ),
    fault(
        "T2-last-step-dropped",
        "the last step of each ray is left out",
        _without_last,
        where=_has_a_last_step,
    ),
    fault(
        "T2-last-step-whole",
        "the rest of a ray counts as a whole step",
        replaced("stepping", "last_step", {"partial": "whole"}),
        where=_ends_with_a_part,
    ),
    fault(
        "T2-last-step-doubled",
        "the last step of each ray is counted twice",
        replaced("stepping", "last_step", {"partial": "doubled"}),
        where=_ends_with_a_part,
    ),
    fault(
        "T3-loop-cap",
        "the loop ends before the longest rays do",
        _capped,
        strengths=(0.75, 0.5),
        fitted=True,
    ),
    fault(
        "T3-one-sided-exit",
        "faces at 0 do not end a ray, only those at 1 do",
        _one_sided,
        where=lambda subject: subject.pipeline.stepping.end != "outside-above",
    ),
    fault(
        "T4-step",
        "steps have another length than their opacity is meant for",
        _other_step,
        strengths=(0.5, 0.8, 1.25, 2.0),
        fitted=True,
    ),
    fault(
        "J1-biased-jitter",
        "samples lie at another place in their steps",
        _biased,
        strengths=(0.0, 0.5, 1.0),
        fitted=True,
    ),
    fault("J1-wood-grain", "all rays start in step, without their jitter", _in_step),
)
