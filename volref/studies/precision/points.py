"""What was measured: errors that know how far they can be told, points, and all points of a scene."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from volref.arrays import Floats
from volref.planning import HALF_LEVEL


class Error(NamedTuple):
    """An error against a reference that is itself known to a bound.

    Where the difference from the reference exceeds the reference's own bound, it is `resolved`, and `value`
    is the difference.  Where it does not, the error is at most `value`, the sum of the two.
    """

    value: float
    resolved: bool

    def __str__(self) -> str:
        """Return two digits, after "<=" if that is all that is known."""
        return f"{'' if self.resolved else '<= '}{self.value:.2g}"


@dataclass(frozen=True)
class Errors:
    """The error of an image; that of a pixel is the largest over its four channels.

    largest, rms, p99: over all pixels.  above_half_level: share of the pixels with more than 1/510.
    """

    largest: Error
    rms: Error
    p99: Error
    above_half_level: float


@dataclass(frozen=True)
class Point:
    """One method at one setting: how far off it was and what it cost.

    Parameters
    ----------
    method, setting
        A name and a setting of `volref.studies.precision.METHODS`.
    answered
        The method that "auto" chose; else the method itself.
    errors
        Against the reference.
    seconds
        CPU seconds on one thread, from scene to image: the least of `runs` runs.
    runs
        How often it was timed.
    preparation
        Seconds of those for grid and tables (wall time of the first run), or None where not told apart.
    samples
        Values interpolated; for the exact method pieces integrated.
    bound_kind
        What the method says of its own error: "certified", "estimate" or "none".
    bound
        The largest error that it admits to, or None.
    held
        Share of the pixels whose error is within their bound (give or take the reference's), or None.
    tolerance
        What it was asked for, or None.
    """

    method: str
    setting: float
    answered: str
    errors: Errors
    seconds: float
    runs: int
    preparation: float | None
    samples: int
    bound_kind: str
    bound: float | None
    held: float | None
    tolerance: float | None

    @property
    def ns_per_sample(self) -> float | None:
        """CPU nanoseconds per sample; None without samples."""
        return self.seconds / self.samples * 1e9 if self.samples else None

    @property
    def met(self) -> bool | None:
        """Whether the bound meets the tolerance asked for; None where there is none of either."""
        return None if self.tolerance is None or self.bound is None else self.bound <= self.tolerance

    @property
    def true(self) -> bool:
        """Whether what it claims is so: a certificate must hold in every pixel."""
        return self.bound_kind != "certified" or self.held == 1.0

    def as_dict(self) -> dict[str, Any]:
        """Return plain data for JSON and CSV; numbers that JSON does not have become words."""
        row: dict[str, Any] = {"method": self.method, "setting": self.setting, "answered": self.answered}
        for name in ("largest", "rms", "p99"):
            error: Error = getattr(self.errors, name)
            row[f"error_{name}"], row[f"error_{name}_resolved"] = plain(error.value), error.resolved
        return row | {
            "above_half_level": self.errors.above_half_level,
            "seconds": self.seconds,
            "runs": self.runs,
            "preparation": self.preparation,
            "samples": self.samples,
            "ns_per_sample": self.ns_per_sample,
            "bound_kind": self.bound_kind,
            "bound": plain(self.bound),
            "held": self.held,
            "tolerance": self.tolerance,
            "met": self.met,
        }


@dataclass(frozen=True)
class SceneStudy:
    """All points of one scene.

    Parameters
    ----------
    name, meaning
        Of the scene.
    width, height
        Of its image.
    volume
        Voxels (x, y, z).
    reference
        The largest bound of the reference's pixels.
    points
        Method by method, coarse to fine.
    stopped
        What was left out because a run took too long, in words.
    """

    name: str
    meaning: str
    width: int
    height: int
    volume: tuple[int, int, int]
    reference: float
    points: tuple[Point, ...]
    stopped: tuple[str, ...]

    @property
    def methods(self) -> tuple[str, ...]:
        """Names of the methods, in order."""
        return tuple(dict.fromkeys(point.method for point in self.points))

    def of(self, method: str) -> tuple[Point, ...]:
        """Return the points of one method."""
        return tuple(point for point in self.points if point.method == method)

    @property
    def problems(self) -> tuple[str, ...]:
        """Certificates that do not hold, and tolerances that a certified method was asked for and missed."""
        return tuple(
            f"{self.name}: {point.method} at {point.setting:.3g} {words}"
            for point in self.points
            for words, bad in (
                (f"broke its certificate in {1 - (point.held or 0):.2%} of the pixels", not point.true),
                (
                    f"missed its tolerance: bound {point.bound or 0:.3g}",
                    point.bound_kind == "certified" and point.met is False,
                ),
            )
            if bad
        )

    def as_dict(self) -> dict[str, Any]:
        """Return plain data for JSON."""
        return {
            "name": self.name,
            "meaning": self.meaning,
            "width": self.width,
            "height": self.height,
            "volume": list(self.volume),
            "reference": plain(self.reference),
            "stopped": list(self.stopped),
            "points": [point.as_dict() for point in self.points],
        }


def errors_of(difference: Floats, reference: Floats) -> Errors:
    """Return the errors of an image whose pixels differ from the reference by `difference` (H, W).

    `reference` (H, W) is the reference's own bound.  A difference that is no number counts as infinite.

    Examples
    --------
    >>> errors = errors_of(np.array([[0.5, 1e-14]]), np.full((1, 2), 1e-13))
    >>> print(errors.largest, errors.p99, errors.above_half_level)
    0.5 0.5 0.5
    >>> print(errors_of(np.zeros((1, 2)), np.full((1, 2), 1e-13)).largest)
    <= 1e-13
    """
    difference = np.where(np.isnan(difference), np.inf, difference)
    at_most = difference + reference

    def judged(statistic: Callable[[Floats], float]) -> Error:
        value = statistic(difference)
        resolved = value > statistic(reference)
        return Error(value if resolved else statistic(at_most), resolved)

    return Errors(
        judged(lambda x: float(x.max())),
        judged(_rms),
        judged(lambda x: float(np.percentile(x, 99, method="higher"))),
        float((difference > HALF_LEVEL).mean()),
    )


def _rms(values: Floats) -> float:
    """Return the root of the mean square, whose squares may exceed the largest float64."""
    largest = float(values.max())
    if largest in (0.0, math.inf):
        return largest
    return largest * float(np.sqrt(((values / largest) ** 2).mean()))


def share_held(difference: Floats, bound: Floats, reference: Floats) -> float:
    """Return the share of pixels whose difference from the reference is explained by the two bounds.

    Examples
    --------
    >>> share_held(np.array([0.1, 0.3]), np.array([0.2, 0.2]), np.zeros(2))
    0.5
    """
    return float((difference <= bound + reference).mean())


def plain(number: float | None) -> float | str | None:
    """Return a number that JSON has, or a word for one that it has not.

    Examples
    --------
    >>> plain(0.5), plain(math.inf), plain(None)
    (0.5, 'inf', None)
    """
    return number if number is None or math.isfinite(number) else str(number)
