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
from typing import NamedTuple

import numpy as np

from volref.arrays import Booleans, Floats, Indices
from volref.oracle.intervals import gradients
from volref.oracle.intervals.finding import find
from volref.oracle.intervals.gradients import Lit
from volref.oracle.intervals.opacities import Share, share_of
from volref.oracle.intervals.walking import (
    Course,
    Pair,
    Test,
    advanced,
    begun,
    ended_after,
    ended_before,
    met,
    most_iterations,
    place_of,
)
from volref.workspace import Workspace

# Rays taken together: their samples are kept until the way back.
CHUNK = 1 << 12


class Step(NamedTuple):
    """One iteration of the rays at `at` (n,) of a chunk: what they may add, and how the ray may end.

    share: None where no ray may take this sample.  before, hit, after: which ends there may be.
    """

    at: Indices
    share: Share | None
    before: Test
    hit: Test | None
    after: Test | None


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
        found = _backwards(course, steps, behind.take(ray))
        low[:, ray], high[:, ray], branch[ray] = found
    return Outcome(low, high, branch)


def _steps(course: Course, lit: Lit | None, ray: Indices, work: Workspace) -> list[Step]:
    """Return the iterations of rays, as far as any of them may go."""
    steps: list[Step] = []
    alpha = Pair(np.zeros(len(ray)), np.zeros(len(ray)))
    walk, at = begun(course, ray), np.arange(len(ray))
    thresholded = course.drawing.pipeline.stepping.opaque_at is not None
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        for number in range(most_iterations(course)):
            before = ended_before(course, walk, number)
            hit = met(course, walk)
            over = before.sure if hit is None else before.sure | hit.sure
            if over.any():
                if over.all() or hit is not None:
                    # What they meet must be known even where none goes on.
                    gone = np.flatnonzero(over)
                    part = None if hit is None else Test(hit.sure[gone], hit.maybe[gone])
                    steps.append(
                        Step(at[gone], None, Test(before.sure[gone], before.maybe[gone]), part, None)
                    )
                kept = np.flatnonzero(~over)
                walk.take(kept)
                at, alpha = at[kept], alpha.take(kept)
                before = Test(before.sure[kept], before.maybe[kept])
                hit = None if hit is None else Test(hit.sure[kept], hit.maybe[kept])
            if not len(at):
                break
            position, radius, part_of_step = place_of(course, walk, number)
            reach = find(course.finder, position, radius, work)
            if lit is not None:
                reach = gradients.shaded(lit, course.finder, position, reach, walk.ray, radius)
            share = share_of(course, reach, walk.ray, part_of_step)
            if thresholded:
                alpha = _more(alpha, share)
            sampled = walk.position
            advanced(course, walk)
            after = ended_after(course, walk, sampled, alpha)
            steps.append(Step(at, share, before, hit, after))
            if after.sure.any():
                kept = np.flatnonzero(~after.sure)
                walk.take(kept)
                at, alpha = at[kept], alpha.take(kept)
                if not len(at):
                    break
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
    for step in reversed(steps):
        at = step.at
        every = len(at) == low.shape[1]
        here = (low, high) if every else (low[:, at], high[:, at])
        spread = branch if every else branch[at]
        if step.after is not None:
            spread = _or_else(here, spread, behind.end, at, step.after.maybe)
        if step.share is not None:
            here, spread = _in_front(step.share, here, spread)
            taken[at] += 1
        spread = _or_else(here, spread, behind.end, at, step.before.maybe, step.before.sure)
        if step.hit is not None:
            spread = _or_else(
                here, spread, behind.mesh, at, step.hit.maybe, step.hit.sure & ~step.before.maybe
            )
        low[:, at], high[:, at], branch[at] = *here, spread
    # An alpha of n sums is off by at most n u A, a colour by n u C and by n u A times the brightest sample.
    largest = np.maximum(np.abs(low), np.abs(high))
    brightest = _brightest(course)
    rounding = course.finder.slack.values * (2 * taken + 8) * np.maximum(largest, largest[-1] * brightest)
    return low - rounding, high + rounding, branch


def _brightest(course: Course) -> float:
    """Return a bound of the colours of samples."""
    table = float(np.abs(course.finder.textures.table.texels[..., :3]).max(initial=0.0))
    lights = 1.0 + sum(float(np.max(light.color)) for light in course.drawing.scene.lights)
    lit = course.drawing.pipeline.lighting
    return max(table, 1.0) * max(lit.factor, 1.0) * (2 * lights if lit.model != "none" else 1.0)


def _or_else(
    here: tuple[Floats, Floats],
    spread: Floats,
    other: Pair,
    at: Indices,
    maybe: Booleans,
    sure: Booleans | None = None,
) -> Floats:
    """Widen results (C + 1, n), in place, by another outcome where it may be had; return what ends decide."""
    chosen = np.flatnonzero(maybe)
    if not len(chosen):
        return spread
    low, high = here
    outcome = other.take(at[chosen])
    before = low[:, chosen], high[:, chosen]
    least, most = np.minimum(before[0], outcome.low), np.maximum(before[1], outcome.high)
    widened = ((most - least) - (before[1] - before[0])).max(axis=0)
    if sure is not None:
        only = sure[chosen]
        least, most = np.where(only, outcome.low, least), np.where(only, outcome.high, most)
        widened = np.where(only, 0.0, widened)
    low[:, chosen], high[:, chosen] = least, most
    spread = spread.copy()
    spread[chosen] += widened
    return spread


def _in_front(
    share: Share, here: tuple[Floats, Floats], spread: Floats
) -> tuple[tuple[Floats, Floats], Floats]:
    """Return results (C + 1, n) behind another sample, and what ends decide of them."""
    low, high = here
    (a0, a1), (c0, c1) = share.opacity, share.color
    channels = len(low) - 1
    new_low, new_high = np.empty_like(low), np.empty_like(high)
    q0, q1 = 1 - a0, 1 - a1
    if a0.max(initial=0.0) > 1 or a1.max(initial=0.0) > 1:
        return _in_front_of_more(share, here, spread)
    p0, p1 = a0 * c0, a1 * c1
    np.minimum(p0 + q0 * low[:channels], p1 + q1 * low[:channels], out=new_low[:channels])
    np.maximum(p0 + q0 * high[:channels], p1 + q1 * high[:channels], out=new_high[:channels])
    apart = np.abs(a1 - a0)
    most = np.maximum(a0, a1) + share.opacity_off
    brightest = np.maximum(np.abs(c0), np.abs(c1)) + share.color_off
    beside = most * share.color_off + 0.25 * apart * np.abs(c1 - c0)
    beside += share.opacity_off * np.maximum(brightest, np.abs(high[:channels]))
    new_low[:channels] -= beside
    new_high[:channels] += beside
    least, greatest = np.minimum(q0, q1) - share.opacity_off, np.maximum(q0, q1) + share.opacity_off
    new_low[channels] = np.maximum(1 - greatest * (1 - low[channels]), 0)
    new_high[channels] = np.minimum(1 - np.maximum(least, 0) * (1 - high[channels]), 1)
    return (new_low, new_high), spread * np.minimum(greatest, 1)


def _in_front_of_more(
    share: Share, here: tuple[Floats, Floats], spread: Floats
) -> tuple[tuple[Floats, Floats], Floats]:
    """Return the same where opacities may be above 1, and more behind makes less of the result."""
    ones = np.ones((1, share.opacity.shape[1]))
    results = []
    for a in (share.opacity.min(axis=0) - share.opacity_off, share.opacity.max(axis=0) + share.opacity_off):
        for color in (share.color.min(axis=0) - share.color_off, share.color.max(axis=0) + share.color_off):
            front = a * np.concatenate([color, ones])
            results += [front + (1 - a) * bound for bound in here]
    stacked = np.array(results)
    widest = np.abs(1 - share.opacity).max(axis=0) + share.opacity_off
    return (stacked.min(axis=0), stacked.max(axis=0)), spread * widest
