"""The experiment: every case with every fault and on every machine, measured and judged."""

import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from importlib.metadata import version

import numpy as np

from data_gen.why_intervals.drawing import (
    MACHINES,
    TESTED,
    Drawn,
    correct,
    correct_images,
    faulty_images,
    golden,
)
from data_gen.why_intervals.judging import ANY_MACHINE, Judge
from data_gen.why_intervals.measures import measured
from data_gen.why_intervals.mismatches import implementation
from data_gen.why_intervals.records import Findings, Interval, Record
from data_gen.why_intervals.scenes import CASES, Case

PACKAGES = ("flip-evaluator", "matplotlib", "numpy", "scikit-image", "vtk")

# Draws a case on real WebGL, on each implementation that can.
Drawer = Callable[[Case], Iterator[Drawn]]


def run(names: Sequence[str], *, webgl: bool = False) -> Findings:
    """Return the findings of the cases of these names; with `webgl`, real WebGL draws them too."""
    records: list[Record] = []
    intervals: list[Interval] = []
    with ExitStack() as closing:
        drawers = _drawers(closing) if webgl else ()
        for name in names:
            started = time.perf_counter()
            case = CASES[name]
            judge = Judge(case.subject(TESTED))
            records += records_of(case, judge, drawers)
            intervals += intervals_of(case, judge)
            print(f"why_intervals: {name}, {time.perf_counter() - started:.0f} s", file=sys.stderr)
    which, number = implementation()
    made_by = {package: version(package) for package in PACKAGES} | {which: number}
    return Findings(tuple(records), tuple(intervals), made_by)


def records_of(
    case: Case,
    judge: Judge,
    drawers: Sequence[Drawer] = (),
    keys: tuple[str, ...] | None = None,
    measures: Sequence[str] | None = None,
) -> list[Record]:
    """Return the records of a case: correct images first, then all faults or those of `keys`."""
    reference = golden(case).picture
    drawn = [*correct_images(case), *(image for draw in drawers for image in draw(case))]
    drawn += faulty_images(case, keys)
    without = {"correct": reference, "fault": correct(case, "tested", TESTED).picture}
    found = measured(reference, [image.picture for image in drawn], measures)
    return [
        Record(
            case.name,
            image.kind,
            image.name,
            image.strength,
            int(np.abs(image.picture.astype(int) - without[image.kind].astype(int)).max()),
            row,
            judge.verdict(image, image.subject.device),
            judge.verdict(image, ANY_MACHINE),
        )
        for image, row in zip(drawn, found, strict=True)
    ]


def intervals_of(case: Case, judge: Judge) -> list[Interval]:
    """Return how wide the intervals are on each machine and on the set of machines."""
    rows = []
    for machine in (*MACHINES.values(), ANY_MACHINE):
        accepted = judge.accepts(machine)
        p50, p99 = (round(accepted.percentile(percent), 3) for percent in (50, 99))
        rows.append(Interval(case.name, machine.name, p50, p99, round(accepted.share_ambiguous, 5)))
    return rows


def _drawers(closing: ExitStack) -> tuple[Drawer, ...]:
    from data_gen.why_intervals.webgl import drawer

    return tuple(drawer(closing, name) for name in ("swiftshader", "llvmpipe"))
