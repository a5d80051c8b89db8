"""What was found, as plain numbers: docs/faults.json, which CI holds against a few charts drawn again.

    {"charts": {chart: {"clean": share outside, "faults": {key: ROW}}},   ROW, the fields of `Told`:
                        [size, outside, outside_any, explained, rank, [named]]
     "never_caught": [key], "never_apart": [[one, other]]}

Sizes are in 1/255; see `volref.golden.confusion` for the rest.
"""

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from volref.golden.confusion import Confusion, Told, never_apart, never_caught
from volref.oracle.faults.table import FAULTS

FORMAT, VERSION = "volref-faults", 1


@dataclass(frozen=True)
class Figures:
    """What was found on all charts.

    told: by chart and key.  clean: share of pixels outside without a fault, by chart.  never_caught: keys
    that leave the intervals on no chart.  never_apart: (one, other) where no image with one is told from the
    other.
    """

    told: Mapping[str, Mapping[str, Told]]
    clean: Mapping[str, float]
    never_caught: tuple[str, ...]
    never_apart: tuple[tuple[str, str], ...]

    @property
    def keys(self) -> list[str]:
        """All faults that some chart can have, in the order of their table."""
        found = {key for told in self.told.values() for key in told}
        return [key for key in FAULTS if key in found]

    def best(self, key: str) -> str:
        """Return the chart that shows a fault best: named alone rather than not, and then the largest."""

        def merit(chart: str) -> tuple[bool, bool, float]:
            told = self.told[chart][key]
            return told.named == (key,), told.caught, told.size

        return max((chart for chart in self.told if key in self.told[chart]), key=merit)


def figures(studies: Iterable[Confusion]) -> Figures:
    """Return what studies of charts found."""
    done = list(studies)
    told = {study.chart: study.told for study in done}
    clean = {study.chart: study.clean for study in done}
    return Figures(told, clean, tuple(never_caught(done)), tuple(never_apart(done)))


def to_json(found: Figures) -> str:
    """Return figures as JSON text, a line for each chart."""
    charts = {
        chart: {"clean": found.clean[chart], "faults": {key: _numbers(one) for key, one in told.items()}}
        for chart, told in found.told.items()
    }
    lines = ",\n".join(f"  {json.dumps(chart)}: {json.dumps(document)}" for chart, document in charts.items())
    head = f'{{"format": "{FORMAT}", "version": {VERSION},\n "charts": {{\n{lines}\n }},\n'
    pairs = [list(pair) for pair in found.never_apart]
    tail = f' "never_caught": {json.dumps(found.never_caught)},\n "never_apart": {json.dumps(pairs)}}}\n'
    return head + tail


def from_json(text: str) -> Figures:
    """Return the figures of `to_json`."""
    document: Any = json.loads(text)
    charts = document["charts"]
    told = {chart: {key: _told(*row) for key, row in one["faults"].items()} for chart, one in charts.items()}
    clean = {chart: one["clean"] for chart, one in charts.items()}
    pairs = tuple((one, other) for one, other in document["never_apart"])
    return Figures(told, clean, tuple(document["never_caught"]), pairs)


def _told(
    size: float, outside: float, outside_any: float, explained: float, rank: int, named: list[str]
) -> Told:
    return Told(size, outside, outside_any, explained, tuple(named), rank)


def _numbers(told: Told) -> list[Any]:
    shares = round(told.outside, 5), round(told.outside_any, 5), round(told.explained, 4)
    return [round(told.size, 2), *shares, told.rank, list(told.named)]
