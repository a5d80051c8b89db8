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

from tests.webgl.browser import RENDERER
from tests.webgl.engine import Engine, engine
from tests.webgl.faulty import draw_chart
from tests.webgl.faulty_rows import FAULTY, Faulty
from volref.emulation.device import Device
from volref.golden.charts import CHARTS
from volref.oracle.acceptance import Acceptance
from volref.oracle.accepting import accept
from volref.oracle.explanation import NONE, explain
from volref.oracle.faults.fault import Subject
from volref.oracle.verdict import Verdict, check

ENGINES = ("swiftshader", "llvmpipe")

PAGE = Path(__file__).parents[2] / "docs" / "power.md"

# A pixel that a fault moves by more than its interval is wide, and a code, cannot be inside.
CODE = 1 / 255


HEAD = """# Faults that real WebGL draws

A tolerance is worth what it catches. The systems' own GLSL under `tests/webgl` has a macro for each of
{keys} faults of real renderers, or their page uploads, filters, places or blends wrongly; that is a second
implementation of the faults in `volref.oracle.faults`. Headless Chromium draws them on the
[charts](guide/charts.md), {pictures} pictures in all, and `check` and `explain` are asked what they think.
`python -m tests.webgl.power` does that and writes this page; `tests/webgl/test_power.py` holds part of it.

{renderers}

- *strength* is what the fault is given: voxels, entries, a ratio, an alpha; 1 where it is there or not;
- *most* is the largest difference of a number to the picture without the fault, in 1/255;
- *left* are pixels that the fault moves by more than their interval is wide, and a code: such a pixel
  cannot be inside, whatever the device;
- *outside* are pixels that `check` finds outside;
- *rank* is the place of the right name among those that `explain` gives, single faults only.
"""

SUMMARY = """
## In sum

Shares are of the pictures that left their intervals.

| drawn by | clean charts inside | pictures | left | rejected | named first | first or second |
|---|---|---|---|---|---|---|
"""

SMALL = """
## Too small to be seen

Faults that leave no interval here, or are not rejected: correct machines differ by as much.

| fault | strength | chart | drawn by | most | rejected |
|---|---|---|---|---|---|
"""

TABLE = """
## All pictures

| fault | strength | program | chart | drawn by | most | left | outside | rank | named instead |
|---|---|---|---|---|---|---|---|---|---|
"""


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


@cache
def clean_canvas(engine: Engine, chart: str) -> np.ndarray:
    """Canvas (H, W, 4) of a chart."""
    return draw_chart(engine, CHARTS[chart])


@cache
def canvas(engine: Engine, row: Faulty) -> np.ndarray:
    """Canvas (H, W, 4) of a chart with a fault."""
    return draw_chart(engine, row.on(), row.drawn_as, row.strength)


def verdict_of(engine: Engine, row: Faulty) -> Verdict:
    """Judge the picture of a fault."""
    return check(canvas(engine, row), acceptance_of(row.chart, engine.name))


def moved_by(engine: Engine, row: Faulty) -> np.ndarray:
    """How far a fault moves each number (H, W, 4) of a picture."""
    return np.abs(canvas(engine, row).astype(int) - clean_canvas(engine, row.chart)) / 255


def leaving(moved: np.ndarray, accepted: Acceptance) -> np.ndarray:
    """Pixels (H, W) that cannot be inside: moved by more than the interval is wide, and a code."""
    return (moved > accepted.hi - accepted.lo + CODE).any(axis=-1)


def names_of(engine: Engine, row: Faulty, faults: Iterable[str] | None = None) -> list[str]:
    """Have the picture of a fault explained: the names of faults, the best first."""
    one, accepted = subject_of(row.chart, engine.name), acceptance_of(row.chart, engine.name)
    why = explain(
        canvas(engine, row),
        one.scene,
        one.pipeline,
        one.device,
        one.jitter,
        one.frames,
        acceptance=accepted,
        faults=None if faults is None else list(faults),
        pairs=False,
    )
    return [ranked.fault for ranked in why.ranking] or [why.status]


def outcome(engine: Engine, row: Faulty) -> Outcome:
    """Draw a fault, judge the picture, and have it explained."""
    moved, verdict = moved_by(engine, row), verdict_of(engine, row)
    names = [NONE] if verdict.passed else names_of(engine, row)
    return Outcome(
        effect=255 * float(moved.max()),
        leaves=int(leaving(moved, acceptance_of(row.chart, engine.name)).sum()),
        outside=int(verdict.outside.sum()),
        rejected=not verdict.passed,
        named=names[0],
        rank=names.index(row.key) + 1 if row.key in names else 0,
    )


def main(words: list[str]) -> None:
    """Print the outcomes of what the words choose; without any, write the page."""
    asked = [name for name in ENGINES if name in words] or list(ENGINES)
    rows = [row for row in FAULTY if all(word in str(row) for word in words if word not in ENGINES)]
    renderers, found, clean = {}, {}, {}
    for name in asked:
        with engine(name) as opened:
            renderers[name] = opened.call(RENDERER, "")
            for chart in sorted({row.chart for row in rows}):
                clean[name, chart] = check(clean_canvas(opened, chart), acceptance_of(chart, name)).status
                print(f"{name}, {chart}: {clean[name, chart]}", flush=True)
            for row in rows:
                found[name, row] = outcome(opened, row)
                print(f"{name}, {row}: {found[name, row]}", flush=True)
    if not words:
        PAGE.write_text("".join(page(renderers, found, clean)), encoding="utf-8")


def page(
    renderers: dict[str, str], found: dict[tuple[str, Faulty], Outcome], clean: dict[tuple[str, str], str]
) -> Iterator[str]:
    """Yield the parts of docs/power.md."""
    lines = "\n".join(f"- `{name}`: {renderer}" for name, renderer in renderers.items())
    yield HEAD.format(renderers=lines, keys=len({row.key for _, row in found}), pictures=len(found))
    yield SUMMARY
    for name in renderers:
        yield _summary(name, [one for (where, _), one in found.items() if where == name], clean)
    small = [(where, row, one) for (where, row), one in found.items() if not one.leaves or not one.rejected]
    yield SMALL
    for where, row, one in small:
        rejected = "yes" if one.rejected else "no"
        yield _cells(row.drawn_as, f"{row.strength:g}", row.chart, where, f"{one.effect:.0f}", rejected)
    yield TABLE
    for (where, row), one in found.items():
        named = f"`{one.named}`" if one.rank != 1 else ""
        counts = f"{one.effect:.0f}", str(one.leaves), str(one.outside), str(one.rank or "-")
        yield _cells(
            row.drawn_as, f"{row.strength:g}", row.on().pipeline.name, row.chart, where, *counts, named
        )


def _summary(name: str, outcomes: list[Outcome], clean: dict[tuple[str, str], str]) -> str:
    left = [one for one in outcomes if one.leaves]
    inside = [status for (where, _), status in clean.items() if where == name]
    return _cells(
        name,
        f"{inside.count('inside')} of {len(inside)}",
        str(len(outcomes)),
        str(len(left)),
        _share(sum(one.rejected for one in left), len(left)),
        _share(sum(one.rank == 1 for one in left), len(left)),
        _share(sum(one.rank in (1, 2) for one in left), len(left)),
    )


def _share(part: int, whole: int) -> str:
    """Share in words; rounded down: what says 100 % is."""
    return f"{part} of {whole}, {int(1000 * part / whole) / 10:g} %"


def _cells(*cells: str) -> str:
    return f"| {' | '.join(cells)} |\n"


if __name__ == "__main__":
    main(sys.argv[1:])
