"""A case from what was judged and how: passes and provenance are found here."""

import hashlib
from collections.abc import Mapping
from pathlib import Path

from volref.emulation.passes import emulate
from volref.oracle.acceptance import Acceptance
from volref.oracle.explanation import Explanation
from volref.oracle.faults.fault import Subject
from volref.oracle.verdict import Verdict
from volref.planning import Plan, plan
from volref.report.figures import KINDS, levels
from volref.report.verdicts.cases import Case
from volref.truth.result import Render


def case_of(
    name: str,
    acceptance: Acceptance,
    verdict: Verdict,
    *,
    explanation: Explanation | None = None,
    subject: Subject | None = None,
    truth: Render | None = None,
    files: Mapping[str, str | Path] | None = None,
) -> Case:
    """Return a case with all that follows from its parts.

    Parameters
    ----------
    name, acceptance, verdict, explanation
        As for `Case`.
    subject
        What was accepted, where its scene is at hand: it is emulated once more for its targets, and planned.
    truth
        The image of the scene by `volref.render`: its error and its plan are told.
    files
        Files that went into it, by what they are, such as "candidate": their hashes are told.
    """
    known = {f"sha256 of the {what}": digest_of_file(path) for what, path in (files or {}).items()}
    passes = {}
    if subject is not None:
        parts = subject.scene, subject.pipeline, subject.device, subject.jitter, subject.frames
        passes = dict(emulate(*parts).passes)
        known["plan of the truth"] = plan_words(plan(subject.scene))
    if truth is not None:
        known["plan of the truth"] = plan_words(truth.plan)
        known["error of the truth"] = (
            "unknown"
            if truth.bound_kind == "none"
            else f"at most {levels(truth.bound.max())}/255 ({KINDS[truth.bound_kind][0]})"
        )
    return Case(name, acceptance, verdict, explanation, passes, known)


def plan_words(chosen: Plan) -> str:
    """Return a plan with a line for each stage."""
    lines = [
        f"{stage.name}{'' if stage.included else ', left out'}: {stage.reason}" for stage in chosen.stages
    ]
    return "\n".join([f"method {chosen.method}", *lines])


def digest_of_file(path: str | Path) -> str:
    """Return the SHA-256 of a file in hexadecimal digits."""
    with Path(path).open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
