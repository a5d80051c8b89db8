"""Which fault is taken for which: every fault on a chart, drawn by one machine, explained for another.

For a chart, each fault of the table is drawn twice: as an image, by a machine of the set that is accepted,
and as the pictures, one for each of its strengths, by which an image is explained.  An image is *caught* if
it leaves the acceptance interval [lo, hi] of the clean program.  Around each picture f lies an interval of
the same widths, as for the clean picture n, and

    explained = 1 - (sum of how far the image is outside around f) / (the same around n)

decides which fault is named, as `explain` does before it fits strengths and tries pairs.

V pictures, K faults, H, W the image; differences in 1/255.
"""

import itertools
from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np

from volref.arrays import Floats
from volref.emulation.device import Device
from volref.errors import SceneError
from volref.formats import codes_of
from volref.golden.charts.chart import Chart
from volref.oracle.acceptance import Acceptance
from volref.oracle.accepting import accept
from volref.oracle.explaining.findings import Part
from volref.oracle.explaining.measuring import NOISE, finite, rounding_of
from volref.oracle.explaining.trying import drawn_with
from volref.oracle.faults.fault import Fault, Subject
from volref.oracle.faults.making import strengths_for

# What draws: a machine of the set "webgl-highp".  What is known of it when its images are judged: its filter
# and its snapping, as a probe tells them, but not how it rounds.  What nobody has to know: that set.
DRAWN_ON = Device("8-bit weights", values="float32", weight_bits=8, subpixel_bits=8)
JUDGED_ON = Device("8-bit weights, known", weight_bits=8, subpixel_bits=8)
ANY = Device.named("webgl-highp")

# Shares explained that are as good as equal; a fitted strength costs as much in `explain`.
EQUAL = 0.005


@dataclass(frozen=True)
class Told:
    """What is told of a fault on a chart.

    size: the largest difference from the clean program, in 1/255.
    outside: share of the pixels that leave their intervals; 0 is not caught.
    outside_any: share that leaves the intervals of the whole set.
    explained: share of what is outside that the fault itself explains.
    named: keys of the faults that explain it best, up to EQUAL; none if it is not caught.
    rank: 1 + how many faults explain it better than itself; 0 if it is not caught.
    """

    size: float
    outside: float
    outside_any: float
    explained: float
    named: tuple[str, ...]
    rank: int

    @property
    def caught(self) -> bool:
        """Whether any pixel leaves its interval."""
        return self.outside > 0


@dataclass(frozen=True, eq=False)
class Confusion:
    """A chart with every fault that it can have.

    clean: share of the pixels outside without any fault: 0.  told: by key.  apart: how far the image of a
    fault (rows) is outside the interval around the nearest picture of another one (columns), at its worst
    pixel, in 1/255 (K, K); 0 is not told from it.
    """

    chart: str
    clean: float
    told: Mapping[str, Told]
    apart: Floats

    @property
    def keys(self) -> list[str]:
        """The faults, in the order of the table, which is that of `apart`."""
        return list(self.told)


def confusion(
    chart: Chart, faults: Mapping[str, Fault], drawn_on: Device = DRAWN_ON, judged_on: Device = JUDGED_ON
) -> Confusion:
    """Return which faults are caught and named on a chart."""
    subject, other = chart.subject(judged_on), chart.subject(drawn_on)
    accepted, by_any = _accepted(subject), _accepted(chart.subject(ANY))
    parts = {key: [Part(one, by) for by in strengths_for(one, subject)] for key, one in faults.items()}
    plan = [part for several in parts.values() for part in several]
    owners = [part.fault.key for part in plan]
    pictures = np.array([finite(_drawn(subject, (part,))) for part in plan])
    measure = _measure_of(subject, accepted)
    images = {key: on_canvas(other, several[0]) for key, several in parts.items() if several}
    told = {
        key: _told(key, image, (accepted, by_any), owners, measure.explained(image, pictures))
        for key, image in images.items()
    }
    apart = _apart(images, owners, pictures, measure)
    return Confusion(chart.name, _outside(on_canvas(other), accepted), told, apart)


def _accepted(subject: Subject) -> Acceptance:
    return accept(subject.scene, subject.pipeline, subject.device, subject.jitter, subject.frames)


def on_canvas(subject: Subject, *parts: Part) -> Floats:
    """Return the canvas (H, W, 4) of bytes of a program with faults, as multiples of 1/255.

    Raises
    ------
    SceneError
        If the program cannot have the faults.
    """
    return np.asarray(codes_of(_drawn(subject, parts, rounds=True), 8) / 255)


def _drawn(subject: Subject, parts: tuple[Part, ...], *, rounds: bool = False) -> Floats:
    everywhere = np.ones((subject.scene.height, subject.scene.width), np.bool_)
    picture = drawn_with(subject, parts, everywhere, rounds=rounds)
    if picture is None:
        keys = " + ".join(part.fault.key for part in parts)
        message = f"fault must be one that {subject.pipeline.name} can have, got {keys}; choose another chart"
        raise SceneError(message)
    return picture


@dataclass(frozen=True, eq=False)
class _Measure:
    """How far an image may lie below and above a picture (H, W, 4), and the clean picture."""

    nominal: Floats
    below: Floats
    above: Floats

    def beyond(self, image: Floats, pictures: Floats) -> Floats:
        """Return how far an image (H, W, 4) is outside the interval around each picture (V, H, W, 4)."""
        apart = image - pictures
        return np.asarray(np.maximum(np.maximum(apart - self.above, -apart - self.below), 0.0))

    def explained(self, image: Floats, pictures: Floats) -> Floats:
        """Return the share (V,) of what is outside that each picture explains; 0 if nothing is."""
        nothing = float(self.beyond(image, self.nominal).sum())
        if nothing == 0:
            return np.zeros(len(pictures))
        return np.asarray(1 - self.beyond(image, pictures).sum(axis=(1, 2, 3)) / nothing)


def _measure_of(subject: Subject, accepted: Acceptance) -> _Measure:
    nominal = finite(_drawn(subject, ()))
    rounding = rounding_of(accepted) + NOISE
    below = np.maximum(nominal - finite(accepted.raw_lo), 0.0) + rounding
    above = np.maximum(finite(accepted.raw_hi) - nominal, 0.0) + rounding
    return _Measure(nominal, below, above)


def _outside(image: Floats, accepted: Acceptance) -> float:
    """Return the share of the pixels outside their intervals."""
    return float(((image < accepted.lo) | (image > accepted.hi)).any(axis=-1).mean())


def _told(
    key: str, image: Floats, accepted: tuple[Acceptance, Acceptance], owners: list[str], shares: Floats
) -> Told:
    size = 255 * float(np.abs(image - accepted[0].nominal).max())
    outside, by_any = (_outside(image, one) for one in accepted)
    if outside == 0:
        return Told(size, 0.0, by_any, 0.0, (), 0)
    best = {one: float(max(shares[np.array(owners) == one])) for one in dict.fromkeys(owners)}
    most = max(best.values())
    named = tuple(one for one, share in best.items() if share >= most - EQUAL)
    rank = 1 + sum(share > best[key] + EQUAL for share in best.values())
    return Told(size, outside, by_any, best[key], named, rank)


def _apart(images: Mapping[str, Floats], owners: list[str], pictures: Floats, measure: _Measure) -> Floats:
    """Return how far the images of faults are from all pictures of others, beyond the interval (K, K)."""
    beyond = [measure.beyond(image, pictures).max(axis=(1, 2, 3)) for image in images.values()]
    kinds = np.array(owners)
    nearest = [[farthest[kinds == other].min() for other in images] for farthest in beyond]
    return 255 * np.array(nearest).reshape(len(images), len(images))


def never_caught(studies: Collection[Confusion]) -> list[str]:
    """Return the faults that leave the intervals on no chart."""
    caught: dict[str, bool] = {}
    for study in studies:
        for key, told in study.told.items():
            caught[key] = caught.get(key, False) or told.caught
    return [key for key, found in caught.items() if not found]


def never_apart(studies: Collection[Confusion]) -> list[tuple[str, str]]:
    """Return (one, other): a chart catches one and can have the other, and none of these tells them apart."""
    seen: dict[tuple[str, str], float] = {}
    for study in studies:
        for (i, one), (j, other) in itertools.permutations(enumerate(study.keys), 2):
            if study.told[one].caught:
                seen[one, other] = max(seen.get((one, other), 0.0), float(study.apart[i, j]))
    return [pair for pair, apart in seen.items() if apart == 0]
