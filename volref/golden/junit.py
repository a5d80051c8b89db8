"""Verdicts as JUnit XML, which CI servers read."""

from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple
from xml.sax.saxutils import quoteattr

from volref.io.atomic import write_text


class Outcome(NamedTuple):
    """What came of one test: its name, what it belongs to, whether it passed, and what is said of it."""

    name: str
    group: str
    passed: bool
    message: str


def junit_text(outcomes: Iterable[Outcome], suite: str = "volref") -> str:
    """Return outcomes as JUnit XML.

    Examples
    --------
    >>> print(junit_text([Outcome("ball", "x3dom", False, "outside: 3 < 4")]))
    <?xml version="1.0" encoding="utf-8"?>
    <testsuites><testsuite name="volref" tests="1" failures="1" errors="0" skipped="0">
    <testcase name="ball" classname="x3dom"><failure message="outside: 3 &lt; 4"/></testcase>
    </testsuite></testsuites>
    """
    every = list(outcomes)
    failures = sum(not outcome.passed for outcome in every)
    counts = f'tests="{len(every)}" failures="{failures}" errors="0" skipped="0"'
    head = f'<?xml version="1.0" encoding="utf-8"?>\n<testsuites><testsuite name={_quoted(suite)} {counts}>'
    return "\n".join([head, *map(_case, every), "</testsuite></testsuites>"]) + "\n"


def write_junit(path: str | Path, outcomes: Iterable[Outcome], *, overwrite: bool = False) -> None:
    """Write outcomes as JUnit XML, whole or not at all."""
    write_text(path, junit_text(outcomes), overwrite=overwrite)


def _case(outcome: Outcome) -> str:
    said = f"<system-out>{_quoted(outcome.message)[1:-1]}</system-out>"
    inside = said if outcome.passed else f"<failure message={_quoted(outcome.message)}/>"
    return f"<testcase name={_quoted(outcome.name)} classname={_quoted(outcome.group)}>{inside}</testcase>"


def _quoted(text: str) -> str:
    """Return a text as an attribute, without the letters that XML does not have."""
    plain = "".join(letter if letter.isprintable() else " " for letter in text)
    return quoteattr(plain, {'"': "&quot;"})
