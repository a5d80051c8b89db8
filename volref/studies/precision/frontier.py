"""Which points no other beats, what is fastest to an error, and whether "auto" is near the fastest."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from volref.errors import SceneError
from volref.studies.precision.points import Error, Point, SceneStudy

# Panels and tables can be about these.
MEASURES = ("largest", "rms", "p99")

# The kinds of "auto", and the methods that each is compared with.
KINDS = ("certified", "estimate")
AUTO = {"certified": "auto", "estimate": "auto-estimate"}


def error_of(point: Point, measure: str = "largest") -> Error:
    """Return the error of a point by one of `MEASURES`."""
    error: Error = getattr(point.errors, measure)
    return error


def frontier(points: Iterable[Point], measure: str = "largest") -> tuple[Point, ...]:
    """Return the points that no other beats: none is both as fast and as near the truth; by rising time.

    An error that is only known to be at most so much counts as that much.

    Examples
    --------
    >>> from volref.studies.precision.points import Errors
    >>> def point(seconds, error):
    ...     errors = Errors(Error(error, True), Error(error, True), Error(error, True), 0.0)
    ...     return Point("march", 1.0, "march", errors, seconds, 1, None, 1, "none", None, None, None)
    >>> [p.seconds for p in frontier([point(3, 0.1), point(1, 0.5), point(2, 0.5), point(4, 0.01)])]
    [1, 3, 4]
    """
    best, kept = math.inf, []
    for point in sorted(points, key=lambda p: (p.seconds, error_of(p, measure).value)):
        error = error_of(point, measure).value
        if error < best:
            best = error
            kept.append(point)
    return tuple(kept)


def reaches(point: Point, error: float) -> bool:
    """Tell whether no pixel of a point is further off than `error`, and it says so where it was asked to.

    Methods that are asked for a tolerance must meet it by their own bound; of the others we know only by
    hindsight, from the reference.
    """
    claimed = point.tolerance is None or (point.bound is not None and point.bound <= error)
    return claimed and point.errors.largest.value <= error


def fastest(points: Iterable[Point], error: float) -> Point | None:
    """Return the fastest of the points that reach an error, or None."""
    return min((p for p in points if reaches(p, error)), key=lambda p: p.seconds, default=None)


@dataclass(frozen=True)
class Check:
    """How "auto" did at one tolerance on one scene, against the fastest method that does the same.

    Parameters
    ----------
    scene, kind, tolerance
        The scene; "certified" or "estimate"; what was asked for.
    met
        Whether its bound met the tolerance.
    error
        Its largest error.
    held
        Share of pixels within their bound.
    seconds
        Its CPU time.
    fastest, setting
        The fastest: for "certified" among certified images whose bound meets the tolerance; for "estimate"
        among all methods, by hindsight.  None if there is none.
    ratio
        Its time over the fastest's, at least 1; None if there is none.
    """

    scene: str
    kind: str
    tolerance: float
    met: bool
    error: float
    held: float
    seconds: float
    fastest: str | None
    setting: float | None
    ratio: float | None


@dataclass(frozen=True)
class FrontierCheck:
    """All checks of one kind, in short.

    Parameters
    ----------
    kind
        "certified" or "estimate".
    checks
        One per scene and tolerance.
    met
        Share of them whose bound met the tolerance.
    kept
        Share of them whose largest error did.
    held
        Share of all pixels that were within their bound.
    median, worst
        Of the ratios.
    """

    kind: str
    checks: tuple[Check, ...]
    met: float
    kept: float
    held: float
    median: float
    worst: float

    def as_dict(self) -> dict[str, Any]:
        """Return plain data for JSON, the checks as rows."""
        return {**vars(self), "checks": [vars(check) for check in self.checks]}

    def __str__(self) -> str:
        """Return two lines: what held, and what it cost."""
        runs = len(self.checks)
        slow = max((c for c in self.checks if c.ratio), key=lambda c: c.ratio or 0.0, default=None)
        where = f" ({slow.scene} at {slow.tolerance:.0e}, {slow.fastest})" if slow else ""
        return (
            f"auto, {self.kind}: bound meets the tolerance in {self.met:.1%} of {runs} runs, the error in "
            f"{self.kept:.1%}; {self.held:.3%} of the pixels within their bound\n"
            f"  time over the fastest that does the same: median {self.median:.2f}, "
            f"worst {self.worst:.2f}{where}"
        )


def frontier_check(scenes: Iterable[SceneStudy], kind: str = "certified") -> FrontierCheck:
    """Return how near to the fastest "auto" is, over all scenes and tolerances that were measured.

    Raises
    ------
    SceneError
        If no scene has points of "auto" of that kind.
    """
    studied = tuple(scenes)
    checks = tuple(_check(study, kind, point) for study in studied for point in study.of(AUTO[kind]))
    if not checks:
        message = f"the scenes must have been measured with {AUTO[kind]!r}, got none; add it to the methods"
        raise SceneError(message)
    pixels = {study.name: study.width * study.height for study in studied}
    weights = [pixels[check.scene] for check in checks]
    ratios = [check.ratio for check in checks if check.ratio is not None]
    return FrontierCheck(
        kind,
        checks,
        met=float(np.mean([check.met for check in checks])),
        kept=float(np.mean([check.error <= check.tolerance for check in checks])),
        held=float(np.average([check.held for check in checks], weights=weights)),
        median=float(np.median(ratios)) if ratios else math.nan,
        worst=max(ratios, default=math.nan),
    )


def _check(study: SceneStudy, kind: str, point: Point) -> Check:
    tolerance = point.setting
    if kind == "certified":
        able = (p for p in study.points if p.bound_kind == "certified" and (p.bound or 0.0) <= tolerance)
    else:
        able = (p for p in study.points if p.errors.largest.value <= tolerance)
    best = min(able, key=lambda p: p.seconds, default=None)
    return Check(
        study.name,
        kind,
        tolerance,
        met=bool(point.met),
        error=point.errors.largest.value,
        held=1.0 if point.held is None else point.held,
        seconds=point.seconds,
        fastest=None if best is None else best.method,
        setting=None if best is None else best.setting,
        ratio=None if best is None else max(point.seconds / best.seconds, 1.0),
    )
