"""What the oracle makes of faults that real WebGL draws: `python -m tests.webgl.power` writes docs/power.md.

With words it only prints, for the implementations and the faults whose names hold all of them:

    python -m tests.webgl.power swiftshader T2 grey-slab
"""

import sys
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from tests.webgl.engine import Engine, engine
from tests.webgl.faulty import draw_chart
from tests.webgl.faulty_rows import FAULTY, Faulty
from volref.oracle.accepting import accept
from volref.oracle.explanation import explain
from volref.emulation.device import Device
from volref.golden.charts import CHARTS
from volref.oracle.acceptance import Acceptance
from volref.oracle.faults.fault import Subject

ENGINES = ("swiftshader", "llvmpipe")

PAGE = Path(__file__).parents[2] / "docs" / "power.md"

# A pixel that a fault moves by more than its interval is wide, and a code, cannot be inside.
CODE = 1 / 255


@dataclass(frozen=True)
class Outcome:
    """What became of one picture.

    effect: the most by which the fault moves a number, in 1/255.  leaves: pixels that it moves out of any
    interval of that width.  outside: pixels that lie outside.  named: the first name that `explain` gives.
    rank: of the right name, 0 if it is not among those given.
    """

    effect: float
    leaves: int
    outside: int
    rejected: bool
    named: str
    rank: int


@cache
def subject_of(chart: str, device: str) -> Subject:
    """Chart on a machine."""
    return CHARTS[chart].subject(Device.named(device))


@cache
def acceptance_of(chart: str, device: str) -> Acceptance:
    """Interval of every pixel of a chart."""
    one = subject_of(chart, device)
    return accept(one.scene, one.pipeline, one.device, one.jitter, one.frames)


def outcome(engine: Engine, row: Faulty) -> Outcome:
    """Draw a fault, judge the picture, and have it explained."""
    one, accepted = subject_of(row.chart, engine.name), acceptance_of(row.chart, engine.name)
    clean, faulty = draw_chart(engine, row.on()), draw_chart(engine, row.on(), row.drawn_as, row.strength)
    moved = np.abs(faulty.astype(int) - clean) / 255
    leaves = (moved > accepted.hi - accepted.lo + CODE).any(axis=-1)
    why = explain(
        faulty, one.scene, one.pipeline, one.device, one.jitter, one.frames, acceptance=accepted, pairs=False
    )
    names = [ranked.fault for ranked in why.ranking]
    return Outcome(
        effect=255 * float(moved.max()),
        leaves=int(leaves.sum()),
        outside=int(why.verdict.outside.sum()),
        rejected=not why.verdict.passed,
        named=names[0] if names else why.status,
        rank=names.index(row.key) + 1 if row.key in names else 0,
    )
