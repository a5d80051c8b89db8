"""Is "auto" near the fastest?  Error against time on the precision suites, and what the choice costs.

    python -m tests.benchmarks.frontier                      all suites and the chest CT: about an hour
    python -m tests.benchmarks.frontier smooth spiky         some of them
    python -m tests.benchmarks.frontier --size 48x36 --budget 60
    python -m tests.benchmarks.frontier --certified          certified methods only: a few minutes

Certified `auto` is compared with the fastest certified image whose bound meets the same tolerance;
`certified=False` with the fastest of all methods whose error does, by hindsight.  Times are CPU seconds on
one thread, the least of up to 5 runs.
"""

import argparse
from pathlib import Path

from volref import load_scene
from volref.cli.options import image_size
from volref.studies.precision import (
    METHODS,
    SUITES,
    PrecisionReport,
    Subject,
    frontier_check,
    resized,
    run_precision,
    subject_of,
)

REAL_CT = Path(__file__).parents[1] / "data" / "real_ct.json"

# What the issue asks for.
MEDIAN, WORST, HELD = 1.3, 2.0, 0.999


def subjects(names: list[str], size: tuple[int, int] | None = None) -> list[Subject]:
    """Return the named suites and the chest CT ("real_ct"); all if none is named."""
    found = [subject_of(suite, size) for suite in SUITES if not names or suite.name in names]
    if not names or REAL_CT.stem in names:
        found.append(Subject(REAL_CT.stem, "a chest CT", resized(load_scene(REAL_CT), size)))
    return found


def verdicts(report: PrecisionReport, kinds: tuple[str, ...]) -> list[str]:
    """Return what each kind of "auto" gave, and whether that is what is asked for."""
    lines = []
    for kind in kinds:
        found = frontier_check(report.scenes, kind)
        good = found.met == 1.0 and found.median <= MEDIAN and found.worst <= WORST
        held = found.held == 1.0 if kind == "certified" else found.held >= HELD
        lines += [str(found), f"  {'as' if good and held else 'NOT as'} asked for"]
        lines += [
            f"    {check.scene:<12} {check.tolerance:8.1e}  {check.seconds:8.3f} s  "
            f"{'met   ' if check.met else 'MISSED'}  error {check.error:8.1e}  held {check.held:9.4%}  "
            f"x {check.ratio or float('nan'):5.2f} of {check.fastest} {check.setting or 0:g}"
            for check in found.checks
        ]
    return lines


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("names", nargs="*", help="suites, or real_ct; default all")
    parser.add_argument("--size", type=image_size)
    parser.add_argument("--budget", type=float, default=240.0, help="seconds for each scene")
    parser.add_argument("--certified", action="store_true", help="leave the estimates and the rivals out")
    options = parser.parse_args()
    kinds = ("certified",) if options.certified else ("certified", "estimate")
    methods = ["exact", "auto"] if options.certified else [method.name for method in METHODS]
    report = run_precision(subjects(options.names, options.size), methods=methods, budget=options.budget)
    print(report.machine)
    print("\n".join(verdicts(report, kinds)))
    print(report.sentence)


if __name__ == "__main__":
    main()
