"""What the figures say: seconds to an error, by how many times volref is faster, where it loses.

A point is {"setting", "seconds", "frames", "rms", "largest", ...}, a run the points of one renderer on one
problem, as `comparing.compare` returns them.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from tests.benchmarks.peers.measure import is_falling
from tests.benchmarks.peers.renderers import RENDERERS

LEVELS = (1e-3, 1e-4, 1e-5, 1e-7)

Point = dict[str, Any]
Run = dict[str, Any]


@dataclass(frozen=True)
class Reached:
    """What it takes to reach an error.

    Parameters
    ----------
    kind
        "met" between two rungs; "at once": by the cheapest rung, so perhaps by less; "beyond": the ladder
        ended while the error still fell; "never": it fell no more.
    seconds
        To reach it; of the dearest rung if "beyond"; infinite if "never".
    """

    kind: str
    seconds: float

    @property
    def done(self) -> bool:
        """Whether it was reached."""
        return self.kind in ("met", "at once")


def reach(points: Sequence[Point], level: float) -> Reached:
    """Return the seconds to an RMS error of `level`, by interpolation between rungs on a log-log scale.

    Examples
    --------
    >>> rungs = [{"seconds": 1.0, "rms": 1e-2}, {"seconds": 4.0, "rms": 1e-4}]
    >>> [reach(rungs, level) for level in (1e-2, 1e-3)]
    [Reached(kind='at once', seconds=1.0), Reached(kind='met', seconds=2.0)]
    >>> reach(rungs, 1e-5).kind, reach([*rungs, {"seconds": 8.0, "rms": 9e-5}], 1e-5).kind
    ('beyond', 'never')
    """
    rungs = sorted(points, key=lambda point: float(point["seconds"]))
    if not rungs:
        return Reached("never", math.inf)
    for before, rung in zip([None, *rungs], rungs, strict=False):
        if rung["rms"] > level:
            continue
        if before is None:
            return Reached("at once", rung["seconds"])
        part = math.log(before["rms"] / level) / math.log(before["rms"] / max(rung["rms"], 1e-300))
        return Reached("met", before["seconds"] * (rung["seconds"] / before["seconds"]) ** part)
    return Reached("beyond", rungs[-1]["seconds"]) if is_falling(rungs) else Reached("never", math.inf)


def runs_on(figures: dict[str, Any], problem: str) -> dict[str, Run]:
    """Return the runs on a problem by renderer."""
    return {run["renderer"]: run for run in figures["runs"] if run["problem"] == problem}


def fastest_of_ours(runs: dict[str, Run], level: float) -> tuple[str, Reached] | None:
    """Return which of volref's ways reaches an error first, and what it takes; None if none does."""
    found = [(name, reach(run["points"], level)) for name, run in runs.items() if RENDERERS[name].ours]
    return min((entry for entry in found if entry[1].done), key=lambda entry: entry[1].seconds, default=None)


@dataclass(frozen=True)
class Duel:
    """A renderer against the fastest of volref's ways to an error: `ours`, if any, by `ours_by`."""

    problem: str
    renderer: str
    level: float
    theirs: Reached
    ours: Reached | None
    ours_by: str

    @property
    def ratio(self) -> float:
        """Its seconds over volref's; NaN if neither reaches the error."""
        if self.ours is None:
            return 0.0 if self.theirs.done else math.nan
        return self.theirs.seconds / self.ours.seconds

    @property
    def certain(self) -> str:
        """How to read the ratio.

        "=", "<=" (it may need less), ">=" (it needs more, or volref may need less), "~" (both may need less).
        """
        mine = self.ours is not None and self.ours.kind == "at once"
        if self.theirs.kind == "at once":
            return "~" if mine else "<="
        return ">=" if mine or self.theirs.kind == "beyond" else "="

    @property
    def outcome(self) -> str:
        """What came of it for volref: "won", "lost", or "open".

        It is open where neither reached the error, or the other's ladder ended before volref's time.
        """
        if self.theirs.done:
            return "lost" if self.ratio < 1 else "won"
        return "won" if self.ours is not None and self.ratio >= 1 else "open"


def duels(figures: dict[str, Any], levels: Iterable[float] = LEVELS) -> list[Duel]:
    """Return all duels, problem by problem."""
    found = []
    for problem in figures["problems"]:
        runs = runs_on(figures, problem["name"])
        for level in levels:
            best = fastest_of_ours(runs, level)
            name, ours = best if best is not None else ("", None)
            found += [
                Duel(problem["name"], renderer, level, reach(run["points"], level), ours, name)
                for renderer, run in runs.items()
                if not RENDERERS[renderer].ours
            ]
    return found


def at_setting(run: Run | None, setting: float) -> Point | None:
    """Return the point of a run at a setting, if there is one."""
    points = [] if run is None else run["points"]
    return next((point for point in points if point["setting"] == setting), None)
