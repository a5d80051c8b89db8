"""What the stability study found, as data, as JSON and as a page."""

import math
from dataclasses import dataclass
from itertools import groupby
from typing import Any

from volref.studies.stability.case import Case

INTRODUCTION = """\
# Stability

Stiff and extreme inputs, each with its true value, what the obvious formula makes of it, and what volref
makes of it. Every case says how far off volref may be and why; it fails beyond that, and also if a result is
NaN or infinite or anything warns.

This page is written by

```console
$ volref stability --markdown docs/stability.md --force
```

and a test holds that its cases are those of the code. The digits are of the machine that wrote it. Of cases
with many numbers the table shows the one at which the textbook formula is furthest off; errors are the
largest of all. `volref stability --only NAME` runs one case or one family, `--list` names them, and the exit
status is 1 if any fails.

- **textbook**: really computed, mostly in float64, where it says so in float32. *The shader* is a ray marcher
  as a first WebGL program has it (`volref/studies/stability/shader.py`): float32, midpoint samples at half a
  voxel, exponential opacities, a slab test with products by 1 / direction, rays that end below a
  transmittance of 1e-3.
- **volref**: the function in question, or `render` with the method named. The marcher runs at a step that
  the case chooses. Where a certificate is shown, every error is within its own pixel's certificate.
- **limit**: of the error, or, for certified results, of the certificate.
"""


@dataclass(frozen=True)
class Judged:
    """One answer of volref, judged.

    Parameters
    ----------
    who
        "volref", or the method of `render`.
    value
        Its number where the textbook formula is furthest off.
    error
        Its largest error, over all numbers of the case.
    limit
        What the error, or the certificate where there is one, may be.
    certificate
        Its largest certificate, or None.
    passed
        Whether it holds.
    """

    who: str
    value: float
    error: float
    limit: float
    certificate: float | None
    passed: bool


@dataclass(frozen=True)
class Result:
    """What one case gave; without numbers where it raised `problem`."""

    case: Case
    reference: float | None
    textbook: float | None
    textbook_error: float | None
    answers: tuple[Judged, ...]
    problem: str

    @property
    def passed(self) -> bool:
        """Whether every answer holds."""
        return not self.problem and all(answer.passed for answer in self.answers)

    def as_dict(self) -> dict[str, Any]:
        """Return plain data for JSON; numbers that JSON does not have become words."""
        case = self.case
        return {
            "name": case.name,
            "family": case.family,
            "question": case.question,
            "passed": self.passed,
            "problem": self.problem,
            "reference": {"value": _plain(self.reference), "source": case.reference},
            "textbook": {
                "value": _plain(self.textbook),
                "error": _plain(self.textbook_error),
                "formula": case.textbook,
            },
            "answers": [
                {
                    "who": answer.who,
                    "value": _plain(answer.value),
                    "error": _plain(answer.error),
                    "certificate": _plain(answer.certificate),
                    "limit": answer.limit,
                    "passed": answer.passed,
                }
                for answer in self.answers
            ],
            "error": case.error,
            "reason": case.reason,
        }


@dataclass(frozen=True)
class StabilityReport:
    """The results of all cases that ran, and the seconds that took."""

    results: tuple[Result, ...]
    seconds: float

    @property
    def passed(self) -> bool:
        """Whether all cases hold."""
        return all(result.passed for result in self.results)

    @property
    def sentence(self) -> str:
        """How many cases hold, and which do not."""
        failed = [result.case.name for result in self.results if not result.passed]
        held = f"{len(self.results) - len(failed)} of {len(self.results)} cases hold"
        return f"{held}; not: {', '.join(failed)}" if failed else held

    def as_dict(self) -> dict[str, Any]:
        """Return plain data for JSON."""
        return {
            "passed": self.passed,
            "cases": len(self.results),
            "seconds": self.seconds,
            "results": [result.as_dict() for result in self.results],
        }

    def __str__(self) -> str:
        """Return a table for people: the errors, a line per answer."""
        width = max((len(result.case.name) for result in self.results), default=0)
        lines = [f"{'case':<{width}}  {'textbook':>10}  volref"]
        for result in self.results:
            name, textbook = result.case.name, _short(result.textbook_error)
            for answer in result.answers:
                lines.append(f"{name:<{width}}  {textbook:>10}  {_answer_line(answer)}")
                name = textbook = ""
            if result.problem:
                lines.append(f"{name:<{width}}  {'':>10}  FAILED: {result.problem}")
        return "\n".join([*lines, self.sentence])

    def markdown(self) -> str:
        """Return the results as a page, a table per family with what its columns mean below it."""
        parts = [INTRODUCTION, f"{self.sentence}.\n"]
        for family, group in groupby(self.results, key=lambda result: result.case.family):
            results = list(group)
            parts += [f"## {family}\n", _family_table(results), _family_notes(results)]
        return "\n".join(parts)


def _answer_line(answer: Judged) -> str:
    verdict = "" if answer.passed else "FAILED: "
    certificate = "" if answer.certificate is None else f", certificate {_short(answer.certificate)}"
    return f"{verdict}{answer.who} {_short(answer.error)}{certificate}, limit {_short(answer.limit)}"


def _family_table(results: list[Result]) -> str:
    lines = [
        "| case | reference | textbook (error) | volref (error) | limit | verdict |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    for result in results:
        name, reference = f"`{result.case.name}`", _digits(result.reference)
        textbook = f"{_digits(result.textbook)} ({_short(result.textbook_error)})"
        if result.problem:
            lines.append(f"| {name} | | | {_cell(result.problem)} | | **failed** |")
        for answer in result.answers:
            found = f"{_digits(answer.value)} ({_short(answer.error)})"
            if answer.who != "volref":
                found = f"{answer.who}: {found}"
            if answer.certificate is not None:
                found += f", certificate {_short(answer.certificate)}"
            verdict = "holds" if answer.passed else "**failed**"
            lines.append(
                f"| {name} | {reference} | {textbook} | {found} | {_short(answer.limit)} | {verdict} |"
            )
            name = reference = textbook = ""
    return "\n".join(lines) + "\n"


def _family_notes(results: list[Result]) -> str:
    return "\n".join(_note(result.case) for result in results)


def _note(case: Case) -> str:
    lines = (
        f"`{case.name}`: {case.question}",
        f"- Reference: {case.reference}.",
        f"- Textbook: {case.textbook}.",
        f"- Limit ({case.error} error): {case.reason}.",
    )
    return "\n".join((lines[0], "", *lines[1:], ""))


def _digits(number: float | None) -> str:
    """Return up to nine digits."""
    return "" if number is None else f"{number:.9g}"


def _short(number: float | None) -> str:
    """Return up to two digits."""
    return "" if number is None else f"{number:.2g}"


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "/")


def _plain(number: float | None) -> float | str | None:
    return number if number is None or math.isfinite(number) else str(number)
