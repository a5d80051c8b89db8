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
from volref.emulation.loop.marching import LONGEST_LOOP
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
    """Rays on their way: which they are, their paths, and pairs that change from iteration to iteration.

    over (n,): those that have ended, and are still there.  delta, step, deeper: what position, walked and
    depth change by.  surface: the depth at which rays meet a mesh.
    """

    ray: Indices
    over: Booleans
    walks: Walks
    position: Pair
    delta: Pair
    walked: Pair
    step: Pair
    depth: Pair
    deeper: Pair
    surface: Pair
    offset: Pair

    def take(self, at: Indices) -> None:
        """Keep some of the rays."""
        self.ray, self.over, self.walks = self.ray[at], self.over[at], self.walks.take(at)
        for name in ("position", "delta", "walked", "step", "depth", "deeper", "surface", "offset"):
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
    stepping, unit = course.drawing.pipeline.stepping, course.finder.slack.control
    walks, offset = course.walks.take(ray), course.offset.take(ray)
    paths, entry_off = walks.paths, walks.entry_off
    position = around(paths.entry, entry_off)
    walked = Pair(np.zeros_like(paths.length), np.zeros_like(paths.length))
    if stepping.advance == "parameter":
        walked = Pair(paths.step * offset.low, paths.step * offset.high)
        if (unit > 0) and course.drawing.device.freedom == "khronos":
            walked = around((walked.low + walked.high) / 2, (walked.high - walked.low) / 2 + 2 * unit)
    elif stepping.advance == "add":
        middle = (offset.low + offset.high) / 2
        step = np.abs(paths.delta).max(axis=0).astype(np.float64)
        off = entry_off + (offset.high - offset.low) / 2 * step + walks.delta_off * offset.high
        off = off + np.where(off > 0, 4 * unit, 0.0)
        position = around(paths.entry + paths.delta * middle.astype(paths.delta.dtype), off)
        if course.drawing.pipeline.rays.kind != "slab" and course.drawing.device.freedom == "rounded":
            position = _on_faces(paths.entry, position)
    if stepping.end == "length-left":
        walked = around(paths.length, walks.length_off)
    delta = around(paths.delta, np.broadcast_to(walks.delta_off, paths.delta.shape))
    step = around(paths.step, walks.step_off)
    depth = deeper = surface = walked
    cut, off = course.rays.cut, course.rays.cut_off
    if cut is not None and off is not None:
        depth, deeper, surface = (around(one[ray], by[ray]) for one, by in zip(cut[:3], off[:3], strict=True))
    over = np.zeros(len(ray), np.bool_)
    return Walk(ray, over, walks, position, delta, walked, step, depth, deeper, surface, offset)


def _on_faces(entry: Floats, position: Pair) -> Pair:
    """Return positions (3, n) of fragments, of which those on a face at 1 are not beyond it, nor at 0.

    A varying that is 1 at all corners is x / x, or x times the rounded 1 / x, which is never above 1.
    """
    low = np.where(entry == 0, entry, position.low)
    high = np.where(entry == 1, entry, position.high)
    return Pair(np.minimum(low, high), high)


def place_of(course: Course, walk: Walk, number: int) -> tuple[Floats, Floats, Pair | None]:
    """Return positions (3, n), their radius (n,), and for what share of a whole step they stand."""
    stepping, walks, unit = course.drawing.pipeline.stepping, walk.walks, course.finder.slack.control
    if stepping.advance == "add":
        low, high = walk.position
        kind = low.dtype.type
        return (low + high) * kind(0.5), _half_width(low, high, unit), None
    paths = walks.paths
    entry, entry_off = paths.entry, walks.entry_off
    if stepping.advance == "parameter":
        kind = entry.dtype.type
        t = (walk.walked.low + walk.walked.high) * kind(0.5)
        along = paths.exit - entry
        half = (walk.walked.high - walk.walked.low) / 2
        radius = np.maximum(entry_off, walks.exit_off) + np.abs(along).max(axis=0) * half + 6 * unit
        return entry + along * t, radius, None
    left = _left(course, walks, number)
    share = part = None if left is None else Pair(*(np.clip(side, 0.0, 1.0) for side in left))
    if left is not None and share is not None and stepping.last_step == "doubled":
        part = _doubled(left, share)
    middle = (walk.offset.low + walk.offset.high) / 2
    half = (walk.offset.high - walk.offset.low) / 2
    if share is not None:
        whole = (share.low + share.high) / 2
        half, middle = half * whole + middle * (share.high - share.low) / 2, middle * whole
    delta = paths.delta
    kind = delta.dtype.type
    position = entry + delta * (kind(number) + middle).astype(delta.dtype)
    radius = _path_off(course, walks, number) + paths.texture_step * half
    return position, radius + 6 * unit + 2 * course.finder.slack.division, part


def _path_off(course: Course, walks: Walks, number: int) -> Floats:
    """Return how far (n,) the beginning of step `number` may be off, but for the roundings of its making."""
    paths, rule = walks.paths, course.drawing.pipeline.stepping.rule
    if course.rays.ends.along is not None:
        return np.asarray(walks.path_off + number * walks.delta_off)
    if rule in ("count", "voxel-count"):
        # A share of the way to the exit, another one where the number of steps may be another.
        other = number * walks.count_off / np.maximum(paths.count, 1)
        return np.asarray(np.maximum(walks.entry_off, walks.exit_off) + paths.texture_step * other)
    # A place on the machine's own line, a known distance behind its entry.
    return walks.path_off


def _half_width(low: Floats, high: Floats, unit: float) -> Floats:
    """Return half the largest width (n,) of pairs (3, n); what the middle is rounded by is added."""
    x, y, z = high - low
    wide = np.maximum(np.maximum(x, y), z)
    return np.asarray(wide * wide.dtype.type(0.5) + np.where(wide > 0, 2 * unit, 0.0))


def _left(course: Course, walks: Walks, number: int) -> Pair | None:
    """Return how many steps are left of rays before iteration `number`; None where every step is whole."""
    stepping = course.drawing.pipeline.stepping
    if stepping.last_step not in ("partial", "doubled") or stepping.end != "length-before":
        return None
    step = walks.paths.step.astype(np.float64)
    left = walks.paths.length.astype(np.float64) - number * step
    off = walks.length_off
    return Pair(*((left + side * off) / step for side in (-1, 1)))


def _doubled(left: Pair, share: Pair) -> Pair:
    """Return for how many steps samples stand whose step is counted twice where no more than it is left."""
    twice = left.high <= 1
    maybe = (left.low <= 1) & ~twice
    low = np.where(maybe, np.minimum(2 * share.low, 1), np.where(twice, 2, 1) * share.low)
    return Pair(low, np.where(twice | maybe, 2, 1) * share.high)


def advanced(course: Course, walk: Walk) -> None:
    """Go a step on."""
    stepping = course.drawing.pipeline.stepping
    if stepping.advance == "add":
        walk.position = walk.position.plus(walk.delta)
    if stepping.end == "length-left":
        walk.walked = Pair(walk.walked.low - walk.step.high, walk.walked.high - walk.step.low)
    elif stepping.end == "length-after" or stepping.advance == "parameter":
        walk.walked = walk.walked.plus(walk.step)


def ended_before(course: Course, walk: Walk, number: int) -> Test:
    """Tell which rays end before iteration `number`."""
    stepping, walks = course.drawing.pipeline.stepping, walk.walks
    paths = walks.paths
    if stepping.end == "count":
        count, more = paths.count, walks.count_off
        return Test(number >= count + more, number >= count - more)
    if stepping.end == "parameter":
        return Test(~(walk.walked.low < 1), ~(walk.walked.high < 1))
    if stepping.end == "length-left":
        return Test(~(walk.walked.high > 0), ~(walk.walked.low > 0))
    if stepping.end == "length-before":
        length, off = paths.length.astype(np.float64), walks.length_off
        begin = (paths.step.dtype.type(number) * paths.step).astype(np.float64)
        if stepping.last_step == "dropped":
            begin = begin + paths.step
            return Test(begin > length + off, begin > length - off)
        return Test(~(begin < length + off), ~(begin < length - off))
    nowhere = np.zeros(len(walk.ray), np.bool_)
    return Test(nowhere, nowhere)


def own_end_after(course: Course, walk: Walk, sampled: Pair) -> Test:
    """Tell which rays end after a sample at `sampled` by where they are, or by how far they have gone."""
    end, (low, high) = course.drawing.pipeline.stepping.end, walk.position
    if end == "length-after":
        length, off = walk.walks.paths.length, walk.walks.length_off
        return Test(np.asarray(walk.walked.low >= length + off), np.asarray(walk.walked.high >= length - off))
    if end == "outside":
        sure, maybe = (low > 1) | (high < 0), (high > 1) | (low < 0)
        return Test(np.any(sure, axis=0), np.any(maybe, axis=0))
    if end == "outside-above":
        return Test(np.any(sampled.low > 1, axis=0), np.any(sampled.high > 1, axis=0))
    nowhere = np.zeros(len(walk.ray), np.bool_)
    return Test(nowhere, nowhere)


def opaque(course: Course, alpha: Pair, threshold: float) -> Test:
    """Tell which rays are opaque, by an alpha that some roundings may have moved.

    Where a machine leaves nothing free, sums are still not rounded here as they are in an emulation.
    """
    off = 64 * max(course.finder.slack.values, UNIT["float64"])
    return Test(alpha.low - off > threshold, alpha.high + off > threshold)


def met(course: Course, walk: Walk) -> Test | None:
    """Tell which rays reach a surface before the sample that they would take now, and go a step on."""
    cut = course.rays.cut
    if cut is None:
        return None
    step, surface = walk.deeper, walk.surface
    if cut.early:
        sure = walk.depth.low - surface.high > -step.low
        maybe = walk.depth.high - surface.low > -step.high
    else:
        sure, maybe = walk.depth.low >= surface.high, walk.depth.high >= surface.low
    walk.depth = walk.depth.plus(step)
    return Test(sure, maybe)


def most_iterations(course: Course) -> int:
    """Return how many iterations the loop has at most."""
    return course.drawing.pipeline.stepping.cap or LONGEST_LOOP
