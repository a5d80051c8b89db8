"""What a ray may leave on the canvas: intervals of colour and alpha, carried through its samples.

n rays of a chunk.  Programs that composite by *over* are taken back to front.  A sample of opacity a and
colour c in front of a result B gives

    a c + (1 - a) B

which grows with B: so its least is at the least B, its greatest at the greatest, each at an end of the
sample's chord, but for the chord's sag |da dc| / 4 and for what lies beside it.  Every number appears once;
front to back, transmittances would be intervals of intervals.  Where the ray may end, what lies behind
everything is an outcome too.

Programs with other sums are taken front to back, with intervals of colour and alpha: see `sums.py`.
"""

from dataclasses import dataclass
from functools import partial
from typing import NamedTuple, TypeAlias

import numpy as np

from volref.arrays import Booleans, Floats, Indices
from volref.oracle.intervals.gradients import Lit
from volref.oracle.intervals.iterations import Iteration, iterations
from volref.oracle.intervals.opacities import Share
from volref.oracle.intervals.walking import Course, Pair, Test, opaque
from volref.workspace import Workspace

# Results of rays on the way back, from least to greatest (C + 1, n), and what ends decide of them (n,).
Results: TypeAlias = tuple[Floats, Floats, Floats]

# Rays taken together: their samples are kept until the way back.
CHUNK = 1 << 13


class Step(NamedTuple):
    """An iteration, which of its rays (n,) may end after it, and which of them as opaque ones."""

    iteration: Iteration
    after: Test
    full: Test | None = None


class Outcome(NamedTuple):
    """What rays may leave: low and high (C + 1, R), alpha last; `branch` (R,): what ends decide of it.

    samples (R,): most that were taken.
    """

    low: Floats
    high: Floats
    branch: Floats


@dataclass(frozen=True, eq=False)
class Behind:
    """What lies behind rays that end by themselves, and that meet a mesh; pairs of (C + 1, R)."""

    end: Pair
    mesh: Pair

    def take(self, at: Indices) -> "Behind":
        """Return that of some of the rays."""
        return Behind(self.end.take(at), self.mesh.take(at))


def composited(course: Course, lit: Lit | None, behind: Behind) -> Outcome:
    """Return what rays may leave, composited by *over* upon what is behind them."""
    count = len(course.rays.pixel)
    channels = len(behind.end.low)
    low, high, branch = np.zeros((channels, count)), np.zeros((channels, count)), np.zeros(count)
    work = Workspace()
    for first in range(0, count, CHUNK):
        ray = np.arange(first, min(first + CHUNK, count))
        steps = _steps(course, lit, ray, work)
        # Opacities above 1 make infinities, where rays have long ended.
        with np.errstate(over="ignore", invalid="ignore"):
            found = _backwards(course, steps, behind.take(ray))
        low[:, ray], high[:, ray], branch[ray] = found
    return Outcome(low, high, branch)


def _steps(course: Course, lit: Lit | None, ray: Indices, work: Workspace) -> list[Step]:
    """Return the iterations of rays, as far as any of them may go."""
    steps: list[Step] = []
    low, high = np.zeros(len(ray)), np.zeros(len(ray))
    threshold, gone = course.drawing.pipeline.stepping.opaque_at, np.zeros(len(ray), np.bool_)
    apart = course.drawing.pipeline.stepping.stopped == "opaque"
    for one in iterations(course, lit, ray, gone, work):
        step = Step(one, one.after)
        if threshold is not None:
            some = one.at[one.some]
            low[some], high[some] = _more(Pair(low[some], high[some]), one.share)
            full = opaque(course, Pair(low[one.at], high[one.at]), threshold)
            gone[one.at] |= full.sure
            ends = Test(one.after.sure | full.sure, one.after.maybe | full.maybe)
            step = Step(one, one.after, full) if apart else Step(one, ends)
        steps.append(step)
    return steps


def _more(alpha: Pair, share: Share) -> Pair:
    """Return the alpha of rays with another sample in *over*."""
    one, two = share.opacity
    least = np.clip(np.minimum(one, two) - share.opacity_off, 0, 1)
    most = np.clip(np.maximum(one, two) + share.opacity_off, 0, 1)
    return Pair(alpha.low + (1 - alpha.low) * least, alpha.high + (1 - alpha.high) * most)


def _backwards(course: Course, steps: list[Step], behind: Behind) -> tuple[Floats, Floats, Floats]:
    """Return the least and the greatest of rays (C + 1, n), from the last sample to the first."""
    low, high = behind.end.low.copy(), behind.end.high.copy()
    branch, taken = np.zeros(low.shape[1]), np.zeros(low.shape[1])
    stopped = behind.end
    if course.drawing.pipeline.stepping.stopped == "opaque":
        # An alpha of 1 that nothing behind has had a part in: black behind it is all of 1 - A.
        black = np.zeros_like(low)
        black[-1] = 1.0
        stopped = Pair(black, black)
    in_front = partial(
        _premultiplied_in_front
        if course.drawing.pipeline.accumulation.color == "premultiplied"
        else _in_front,
        at_most_one=course.drawing.rule.at_most_one,
    )
    for (at, before, hit, _, some, share), after, full in reversed(steps):
        here = low, high, branch
        _or_else(here, behind.end, at, after.maybe, after.sure)
        if full is not None:
            _or_else(here, stopped, at, full.maybe, full.sure)
        if len(some):
            in_front(share, here, at[some])
            taken[at[some]] += 1
        _or_else(here, behind.end, at, before.maybe, before.sure)
        if hit is not None:
            _or_else(here, behind.mesh, at, hit.maybe, hit.sure & ~before.maybe)
    # An alpha of n sums is off by at most n u A, a colour by n u C and by n u A times the brightest sample.
    largest = np.maximum(np.abs(low), np.abs(high))
    brightness = largest[-1] * brightest(course)
    rounding = course.finder.slack.values * (2 * taken + 8) * np.maximum(largest, brightness)
    return low - rounding, high + rounding, branch


def brightest(course: Course) -> float:
    """Return a bound of the colours of samples."""
    table = float(np.abs(course.finder.textures.table.texels[..., :3]).max(initial=0.0))
    lights = 1.0 + sum(float(np.max(light.color)) for light in course.drawing.scene.lights)
    lit = course.drawing.pipeline.lighting
    return max(table, 1.0) * max(lit.factor, 1.0) * (2 * lights if lit.model != "none" else 1.0)


def _or_else(here: Results, other: Pair, at: Indices, maybe: Booleans, sure: Booleans) -> None:
    """Widen the results of rays, in place, by another outcome where it may be had, alone where it is sure."""
    chosen = np.flatnonzero(maybe)
    if not len(chosen):
        return
    low, high, branch = here
    ray, only = at[chosen], sure[chosen]
    outcome = other.take(ray)
    before = low[:, ray], high[:, ray]
    least, most = np.minimum(before[0], outcome.low), np.maximum(before[1], outcome.high)
    widened = ((most - least) - (before[1] - before[0])).max(axis=0)
    low[:, ray], high[:, ray] = np.where(only, outcome.low, least), np.where(only, outcome.high, most)
    branch[ray] = np.where(only, 0.0, branch[ray] + widened)


def _in_front(share: Share, here: Results, ray: Indices, *, at_most_one: bool) -> None:
    """Put samples in front of the results of rays, in place; at_most_one: no opacity is above 1."""
    # The last row is alpha.  Where one is above 1, more in front makes less of what is behind.
    most = share.opacity.max() if at_most_one else (share.opacity + share.opacity_off).max()
    if max(most, here[1][-1].max()) > 1:
        _in_front_of_more(share, here, ray)
        return
    every = len(ray) == here[0].shape[1]
    low, high = (side if every else np.take(side, ray, axis=1) for side in here[:2])
    (a0, a1), (c0, c1) = share.opacity, share.color
    count = len(c0)
    q0, q1 = 1 - a0, 1 - a1
    # Of the colours, alpha's own being 1: those of the samples come first, what is behind after them.
    p0, p1 = a0 * c0, a1 * c1
    least = np.minimum(p0 + q0 * low[:count], p1 + q1 * low[:count])
    most = np.maximum(p0 + q0 * high[:count], p1 + q1 * high[:count])
    beside = np.maximum(c0, c1)
    beside += share.color_off
    np.maximum(beside, high[:count], out=beside)
    beside *= share.opacity_off
    beside += (np.maximum(a0, a1) + share.opacity_off) * share.color_off
    sag = np.abs((a1 - a0) * (c1 - c0))
    sag *= 0.25
    beside += sag
    np.subtract(least, beside, out=least)
    np.add(most, beside, out=most)
    clear, thick = np.maximum(q0, q1) + share.opacity_off, np.minimum(q0, q1) - share.opacity_off
    opaque_low = np.maximum(1 - clear * (1 - low[count]), 0)
    opaque_high = np.minimum(1 - np.maximum(thick, 0) * (1 - high[count]), 1)
    here[0][:count, ray], here[1][:count, ray] = least, most
    here[0][count, ray], here[1][count, ray] = opaque_low, opaque_high
    here[2][ray] *= np.minimum(clear, 1)


def _premultiplied_in_front(share: Share, here: Results, ray: Indices, *, at_most_one: bool) -> None:
    """Do the same with colours that count as premultiplied: c + (1 - a) B, and alpha as ever."""
    count = len(share.color_off)
    behind = here[0][:count, ray], here[1][:count, ray]
    _in_front(share, here, ray, at_most_one=at_most_one)
    a = (share.opacity.min(axis=0) - share.opacity_off, share.opacity.max(axis=0) + share.opacity_off)
    rest = np.array([(1 - one) * bound for one in a for bound in behind])
    here[0][:count, ray] = share.color.min(axis=0) - share.color_off + rest.min(axis=0)
    here[1][:count, ray] = share.color.max(axis=0) + share.color_off + rest.max(axis=0)


def _in_front_of_more(share: Share, here: Results, ray: Indices) -> None:
    """Do the same where opacities may be above 1, and more behind makes less of the result."""
    ones = np.ones((1, share.opacity.shape[1]))
    behind = here[0][:, ray], here[1][:, ray]
    results: list[Floats] = []
    for a in (share.opacity.min(axis=0) - share.opacity_off, share.opacity.max(axis=0) + share.opacity_off):
        for color in (share.color.min(axis=0) - share.color_off, share.color.max(axis=0) + share.color_off):
            front = a * np.concatenate([color, ones])
            results += [front + (1 - a) * bound for bound in behind]
    stacked = np.array(results)
    here[0][:, ray], here[1][:, ray] = stacked.min(axis=0), stacked.max(axis=0)
    here[2][ray] *= np.abs(1 - share.opacity).max(axis=0) + share.opacity_off
