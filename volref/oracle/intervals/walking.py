"""The loop of a program along rays whose numbers are known up to a radius.

n rays of a walk.  A position, a length or a depth that is added up is kept as a pair of numbers, low and
high, that go through the same rounded additions as the program's: rounding keeps their order, so the
program's own number stays between them, and pairs that begin a few units apart end so.

Each test has three answers: the ray ends here, it may end here, it goes on.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from volref.arrays import Booleans, Floats, Indices
from volref.emulation.drawing import Drawing
from volref.emulation.loop.marching import LONGEST_LOOP, Cut
from volref.oracle.intervals.finding import Finder
from volref.oracle.intervals.rays import Rays
from volref.oracle.intervals.slack import UNIT
from volref.oracle.intervals.walks import Walks


class Test(NamedTuple):
    """Which rays (n,) surely end, and which may."""

    sure: Booleans
    maybe: Booleans


class Pair(NamedTuple):
    """Numbers between `low` and `high`."""

    low: Floats
    high: Floats

    def plus(self, step: "Pair") -> "Pair":
        """Return the sum, rounded as the program rounds its own."""
        return Pair(self.low + step.low, self.high + step.high)

    def take(self, at: Indices) -> "Pair":
        """Return some of them."""
        return Pair(np.take(self.low, at, axis=-1), np.take(self.high, at, axis=-1))


def around(middle: Floats, off: Floats) -> Pair:
    """Return the pair off to both sides of numbers; exactly those where it is 0."""
    kind = middle.dtype.type
    low, high = ((middle.astype(np.float64) + side * off).astype(kind) for side in (-1, 1))
    low = np.where(off > 0, np.nextafter(low, kind(-np.inf)), middle)
    high = np.where(off > 0, np.nextafter(high, kind(np.inf)), middle)
    return Pair(low, high)


@dataclass(eq=False)
class Walk:
    """Rays on their way: which they are, and the pairs that change from iteration to iteration."""

    ray: Indices
    position: Pair
    delta: Pair
    walked: Pair
    depth: Pair
    offset: Pair

    def take(self, at: Indices) -> None:
        """Keep some of the rays."""
        self.ray = self.ray[at]
        for name in ("position", "delta", "walked", "depth", "offset"):
            setattr(self, name, getattr(self, name).take(at))


@dataclass(frozen=True, eq=False)
class Course:
    """What stays the same: the drawing, its rays and paths, the textures, where first samples lie (R,)."""

    drawing: Drawing
    finder: Finder
    rays: Rays
    walks: Walks
    offset: Pair


def begun(course: Course, ray: Indices) -> Walk:
    """Return the walk of some rays before their first iteration."""
    stepping, walks, unit = course.drawing.pipeline.stepping, course.walks, course.finder.slack.control
    paths, offset = walks.paths.take(ray), course.offset.take(ray)
    entry_off = walks.entry_off[ray]
    position = around(paths.entry, entry_off)
    walked = Pair(np.zeros_like(paths.length), np.zeros_like(paths.length))
    if stepping.advance == "parameter":
        walked = Pair(paths.step * offset.low, paths.step * offset.high)
        if (unit > 0) and course.drawing.device.freedom == "khronos":
            walked = around((walked.low + walked.high) / 2, (walked.high - walked.low) / 2 + 2 * unit)
    elif stepping.advance == "add":
        middle = (offset.low + offset.high) / 2
        step = np.abs(paths.delta).max(axis=0).astype(np.float64)
        off = entry_off + (offset.high - offset.low) / 2 * step + walks.delta_off[ray] * offset.high
        off = off + np.where(off > 0, 4 * unit, 0.0)
        position = around(paths.entry + paths.delta * middle.astype(paths.delta.dtype), off)
        if course.drawing.pipeline.rays.kind != "slab" and course.drawing.device.freedom == "rounded":
            position = _on_faces(paths.entry, position)
    if stepping.end == "length-left":
        walked = around(paths.length, walks.length_off[ray])
    depth = walked
    if course.rays.cut is not None and course.rays.cut_off is not None:
        depth = around(course.rays.cut.depth[ray], course.rays.cut_off.depth[ray])
    delta = around(paths.delta, np.broadcast_to(walks.delta_off[ray], paths.delta.shape))
    return Walk(ray, position, delta, walked, depth, offset)


def _on_faces(entry: Floats, position: Pair) -> Pair:
    """Return positions (3, n) of fragments, of which those on a face at 1 are not beyond it, nor at 0.

    A varying that is 1 at all corners is x / x, or x times the rounded 1 / x, which is never above 1.
    """
    low = np.where(entry == 0, entry, position.low)
    high = np.where(entry == 1, entry, position.high)
    return Pair(np.minimum(low, high), high)


def place_of(course: Course, walk: Walk, number: int) -> tuple[Floats, Floats, Pair | None]:
    """Return positions (3, n), their radius (n,), and for what share of a whole step they stand."""
    stepping, walks, unit = course.drawing.pipeline.stepping, course.walks, course.finder.slack.control
    ray = walk.ray
    if stepping.advance == "add":
        low, high = walk.position
        kind = low.dtype.type
        return (low + high) * kind(0.5), _half_width(low, high, unit), None
    paths = walks.paths
    entry, entry_off = paths.entry[:, ray], walks.entry_off[ray]
    if stepping.advance == "parameter":
        kind = entry.dtype.type
        t = (walk.walked.low + walk.walked.high) * kind(0.5)
        along = paths.exit[:, ray] - entry
        half = (walk.walked.high - walk.walked.low) / 2
        radius = np.maximum(entry_off, walks.exit_off[ray]) + np.abs(along).max(axis=0) * half + 6 * unit
        return entry + along * t, radius, None
    left = _left(course, ray, number)
    share = part = None if left is None else Pair(*(np.clip(side, 0.0, 1.0) for side in left))
    if left is not None and share is not None and stepping.last_step == "doubled":
        part = _doubled(left, share)
    middle = (walk.offset.low + walk.offset.high) / 2
    half = (walk.offset.high - walk.offset.low) / 2
    if share is not None:
        whole = (share.low + share.high) / 2
        half, middle = half * whole + middle * (share.high - share.low) / 2, middle * whole
    delta = paths.delta[:, ray]
    kind = delta.dtype.type
    position = entry + delta * (kind(number) + middle).astype(delta.dtype)
    step = paths.texture_step[ray]
    # A place on the machine's own line, a known distance behind its entry.
    radius = walks.path_off[ray] + step * half + 8 * unit
    return position, radius, part


def _half_width(low: Floats, high: Floats, unit: float) -> Floats:
    """Return half the largest width (n,) of pairs (3, n); what the middle is rounded by is added."""
    x, y, z = high - low
    wide = np.maximum(np.maximum(x, y), z)
    return np.asarray(wide * wide.dtype.type(0.5) + np.where(wide > 0, 2 * unit, 0.0))


def _left(course: Course, ray: Indices, number: int) -> Pair | None:
    """Return how many steps are left of rays before iteration `number`; None where every step is whole."""
    stepping, walks = course.drawing.pipeline.stepping, course.walks
    if stepping.last_step not in ("partial", "doubled") or stepping.end != "length-before":
        return None
    step = walks.paths.step[ray].astype(np.float64)
    left = walks.paths.length[ray].astype(np.float64) - number * step
    off = walks.length_off[ray]
    return Pair(*((left + side * off) / step for side in (-1, 1)))


def _doubled(left: Pair, share: Pair) -> Pair:
    """Return for how many steps samples stand whose step is counted twice where no more than it is left."""
    twice = left.high <= 1
    maybe = (left.low <= 1) & ~twice
    low = np.where(maybe, np.minimum(2 * share.low, 1), np.where(twice, 2, 1) * share.low)
    return Pair(low, np.where(twice | maybe, 2, 1) * share.high)


def advanced(course: Course, walk: Walk) -> None:
    """Go a step on."""
    stepping, walks, ray = course.drawing.pipeline.stepping, course.walks, walk.ray
    paths = walks.paths
    if stepping.advance == "add":
        walk.position = walk.position.plus(walk.delta)
    counted = (
        stepping.end == "length-left" or stepping.end == "length-after" or stepping.advance == "parameter"
    )
    if counted:
        step = around(paths.step[ray], walks.step_off[ray])
        if stepping.end == "length-left":
            walk.walked = Pair(walk.walked.low - step.high, walk.walked.high - step.low)
        else:
            walk.walked = walk.walked.plus(step)


def ended_before(course: Course, walk: Walk, number: int) -> Test:
    """Tell which rays end before iteration `number`."""
    stepping, ray = course.drawing.pipeline.stepping, walk.ray
    paths = course.walks.paths
    if stepping.end == "count":
        count, more = paths.count[ray], course.walks.count_off[ray]
        return Test(number >= count + more, number >= count - more)
    if stepping.end == "parameter":
        return Test(~(walk.walked.low < 1), ~(walk.walked.high < 1))
    if stepping.end == "length-left":
        return Test(~(walk.walked.high > 0), ~(walk.walked.low > 0))
    if stepping.end == "length-before":
        length, off = paths.length[ray].astype(np.float64), course.walks.length_off[ray]
        begin = (paths.step.dtype.type(number) * paths.step[ray]).astype(np.float64)
        if stepping.last_step == "dropped":
            begin = begin + paths.step[ray]
            return Test(begin > length + off, begin > length - off)
        return Test(~(begin < length + off), ~(begin < length - off))
    nowhere = np.zeros(len(ray), np.bool_)
    return Test(nowhere, nowhere)


def own_end_after(course: Course, walk: Walk, sampled: Pair) -> Test:
    """Tell which rays end after a sample at `sampled` by where they are, or by how far they have gone."""
    end, ray, (low, high) = course.drawing.pipeline.stepping.end, walk.ray, walk.position
    if end == "length-after":
        length, off = course.walks.paths.length[ray], course.walks.length_off[ray]
        return Test(np.asarray(walk.walked.low >= length + off), np.asarray(walk.walked.high >= length - off))
    if end == "outside":
        sure, maybe = (low > 1) | (high < 0), (high > 1) | (low < 0)
        return Test(np.any(sure, axis=0), np.any(maybe, axis=0))
    if end == "outside-above":
        return Test(np.any(sampled.low > 1, axis=0), np.any(sampled.high > 1, axis=0))
    nowhere = np.zeros(len(ray), np.bool_)
    return Test(nowhere, nowhere)


def opaque(course: Course, alpha: Pair, threshold: float) -> Test:
    """Tell which rays are opaque, by an alpha that some roundings may have moved.

    Where a machine leaves nothing free, sums are still not rounded here as they are in an emulation.
    """
    off = 64 * max(course.finder.slack.values, UNIT["float64"])
    return Test(alpha.low - off > threshold, alpha.high + off > threshold)


def met(course: Course, walk: Walk) -> Test | None:
    """Tell which rays reach a surface before the sample that they would take now, and go a step on."""
    cut, off = course.rays.cut, course.rays.cut_off
    if cut is None or off is None:
        return None
    ray = walk.ray
    step, surface = around(cut.step[ray], off.step[ray]), _surface(cut, off, ray)
    if cut.early:
        sure = walk.depth.low - surface.high > -step.low
        maybe = walk.depth.high - surface.low > -step.high
    else:
        sure, maybe = walk.depth.low >= surface.high, walk.depth.high >= surface.low
    walk.depth = walk.depth.plus(step)
    return Test(sure, maybe)


def _surface(cut: Cut, off: Cut, ray: Indices) -> Pair:
    return around(cut.surface[ray], off.surface[ray])


def most_iterations(course: Course) -> int:
    """Return how many iterations the loop has at most."""
    return course.drawing.pipeline.stepping.cap or LONGEST_LOOP
