"""What the experiment leaves: a record of each image and of each scene, as JSON."""

import json
from dataclasses import astuple, dataclass
from pathlib import Path
from typing import Any

from data_gen.why_intervals.judging import Verdict
from data_gen.why_intervals.measures import ALL, Measures
from volref.io.atomic import write_text

FORMAT, VERSION = "volref-why-intervals", 1

HEAD = ("scene", "kind", "name", "strength", "apart")
VERDICTS = ("known", "any")


@dataclass(frozen=True)
class Record:
    """All that is known of an image.

    Parameters
    ----------
    scene, kind, name, strength
        See `Drawn`.
    apart
        Largest difference, in 1/255, from what the same machine draws without the fault; of a correct image,
        from the golden.
    measures
        What the criteria measure, against the golden.
    known, any
        volref's verdict for the machine that drew it, and for a set of machines.
    """

    scene: str
    kind: str
    name: str
    strength: float
    apart: int
    measures: Measures
    known: Verdict
    any: Verdict


@dataclass(frozen=True)
class Interval:
    """How wide the intervals of a scene are, in 1/255 before the canvas rounds, by device."""

    scene: str
    device: str
    p50: float
    p99: float
    ambiguous: float


@dataclass(frozen=True)
class Findings:
    """All records, all intervals' widths, and by what they were made."""

    records: tuple[Record, ...]
    intervals: tuple[Interval, ...]
    made_by: dict[str, str]


def save(findings: Findings, path: Path) -> None:
    """Write the findings, a line for each image."""
    rows = [_row(record) for record in findings.records]
    widths = [list(astuple(interval)) for interval in findings.intervals]
    columns = [*HEAD, *ALL, *VERDICTS]
    lines = ",\n".join("  " + json.dumps(row) for row in rows)
    wide = ",\n".join("  " + json.dumps(row) for row in widths)
    head = {"format": FORMAT, "version": VERSION, "made_by": findings.made_by, "columns": columns}
    text = json.dumps(head, indent=1)[:-2]
    text += f',\n "records": [\n{lines}\n ],\n "intervals": [\n{wide}\n ]\n}}\n'
    write_text(path, text, overwrite=True)


def load(path: Path) -> Findings:
    """Return the findings of a file that `save` wrote."""
    document = json.loads(path.read_text(encoding="utf-8"))
    records = tuple(_record(dict(zip(document["columns"], row, strict=True))) for row in document["records"])
    return Findings(records, tuple(Interval(*row) for row in document["intervals"]), document["made_by"])


def rounded(value: float) -> float:
    """Return a number to six digits, as the file holds it."""
    return float(f"{value:.6g}")


def _row(record: Record) -> list[Any]:
    head = [getattr(record, name) for name in HEAD]
    verdicts = [list(astuple(getattr(record, name))) for name in VERDICTS]
    return head + [rounded(record.measures[name]) for name in ALL] + verdicts


def _record(row: dict[str, Any]) -> Record:
    measures = {name: row[name] for name in ALL}
    verdicts = {name: Verdict(*row[name]) for name in VERDICTS}
    return Record(**{name: row[name] for name in HEAD}, measures=measures, **verdicts)
