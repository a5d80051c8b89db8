"""What a ray may leave on the canvas where its sum is not *over*: intervals, front to back.

n rays of a chunk; colour, alpha and the weighted sum of own alpha are intervals.  These sums are not monotone
in what is behind them, so an interval is all that is carried; it is wider than need be.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from volref.arrays import Floats, Indices
from volref.oracle.intervals.compositing import CHUNK, Outcome
from volref.oracle.intervals.gradients import Lit
from volref.oracle.intervals.iterations import iterations
from volref.oracle.intervals.opacities import Share
from volref.oracle.intervals.walking import Course, Pair, Test, most_iterations, opaque
from volref.workspace import Workspace

# Intervals of sums that grow beyond all numbers end here, where their squares are still numbers.
LARGEST = 1e100


class Sum(NamedTuple):
    """Colours (C, n) and alpha (n,) between those of two."""

    low: Floats
    high: Floats
    alpha: Pair

    def take(self, at: Indices) -> "Sum":
        """Return some of them."""
        return Sum(self.low[:, at], self.high[:, at], self.alpha.take(at))


# From colour and alpha (C + 1, n) of rays that have met a mesh, and which rays these are, to what is left.
Meeting = Callable[[Floats, Floats, Indices], tuple[Floats, Floats]]


def summed(course: Course, lit: Lit | None, channels: int, meeting: Meeting | None) -> Outcome:
    """Return what rays may leave, (channels + 1, R), by the program's own sum."""
    count = len(course.rays.pixel)
    low, high = np.full((channels + 1, count), np.inf), np.full((channels + 1, count), -np.inf)
    ends = np.zeros(count)
    work = Workspace()
    for first in range(0, count, CHUNK):
        _run(course, lit, np.arange(first, min(first + CHUNK, count)), (low, high, ends), meeting, work)
    low, high = np.nan_to_num(low, nan=-LARGEST), np.nan_to_num(high, nan=LARGEST)
    low, high = (np.clip(side, -LARGEST, LARGEST) for side in (low, high))
    return Outcome(low, high, np.where(ends > 1, (high - low).max(axis=0), 0.0))


def _run(
    course: Course,
    lit: Lit | None,
    ray: Indices,
    result: tuple[Floats, Floats, Floats],
    meeting: Meeting | None,
    work: Workspace,
) -> None:
    count, channels = len(ray), len(result[0]) - 1
    total = Sum(
        np.zeros((channels, count)), np.zeros((channels, count)), Pair(np.zeros(count), np.zeros(count))
    )
    gone, threshold = np.zeros(count, np.bool_), course.drawing.pipeline.stepping.opaque_at
    with np.errstate(invalid="ignore", over="ignore"):
        for number, one in enumerate(iterations(course, lit, ray, gone, work)):
            left = ~gone[one.at]
            _put_down(course, result, ray, total, one.at[one.before.maybe & left], number)
            going = left & ~one.before.sure
            if one.hit is not None:
                _put_down(course, result, ray, total, one.at[one.hit.maybe & going], number, meeting)
                going &= ~one.hit.sure
            _add(course, total, one.share, one.at[one.some], ray)
            after = one.after
            if threshold is not None:
                full = opaque(course, total.alpha.take(one.at), threshold)
                after = Test(after.sure | full.sure, after.maybe | full.maybe)
            _put_down(course, result, ray, total, one.at[after.maybe & going], number + 1)
            gone[one.at] |= ~going | after.sure
    last = np.flatnonzero(~gone)
    _put_down(course, result, ray, total, last, most_iterations(course))


def _put_down(
    course: Course,
    result: tuple[Floats, Floats, Floats],
    ray: Indices,
    total: Sum,
    at: Indices,
    number: int,
    meeting: Meeting | None = None,
) -> None:
    """Widen the results of rays by what they have if they end now."""
    if not len(at):
        return
    here = ray[at]
    off = course.finder.slack.values * (4 * number + 8)
    grown = 1 + np.maximum(np.abs(total.low[:, at]), np.abs(total.high[:, at]))
    low = np.concatenate([total.low[:, at] - off * grown, total.alpha.low[None, at] - off])
    high = np.concatenate([total.high[:, at] + off * grown, (total.alpha.high[at] * (1 + off) + off)[None]])
    stepping = course.drawing.pipeline.stepping
    if stepping.stopped == "opaque" and stepping.opaque_at is not None:
        full = opaque(course, total.alpha.take(at), stepping.opaque_at)
        low[-1] = np.where(full.sure, 1.0, np.where(full.maybe, np.minimum(low[-1], 1.0), low[-1]))
        high[-1] = np.where(full.sure, 1.0, np.where(full.maybe, np.maximum(high[-1], 1.0), high[-1]))
    if meeting is not None:
        low, high = meeting(low, high, here)
    result[0][:, here] = np.minimum(result[0][:, here], low)
    result[1][:, here] = np.maximum(result[1][:, here], high)
    result[2][here] += 1


def _add(course: Course, total: Sum, share: Share, at: Indices, ray: Indices) -> None:
    """Add samples to the sums of rays, in place."""
    if not len(at):
        return
    before = total.take(at)
    gathers = course.drawing.pipeline.accumulation.rule in ("mean", "greatest")
    grown = _gathered(course, before, share, ray[at]) if gathers else _added(course, before, share)
    total.low[:, at], total.high[:, at] = grown.low, grown.high
    total.alpha.low[at], total.alpha.high[at] = grown.alpha


def _gathered(course: Course, total: Sum, share: Share, ray: Indices) -> Sum:
    """Return sums with another sample, of programs that take the mean of samples or the most opaque one."""
    one, two = share.opacity
    a = Pair(np.minimum(one, two) - share.opacity_off, np.maximum(one, two) + share.opacity_off)
    c = Pair(share.color.min(axis=0) - share.color_off, share.color.max(axis=0) + share.color_off)
    shown = _product(a, c)
    if course.drawing.pipeline.accumulation.rule == "mean":
        walks = course.walks
        step, length = walks.paths.step[ray].astype(np.float64), walks.paths.length[ray].astype(np.float64)
        part = step / length
        off = part * (walks.length_off[ray] / length + walks.step_off[ray] / step)
        off = off + part * 8 * course.finder.slack.values
        each = Pair(part - off, part + off)
        more, new = _product(a, each), _product(shown, each)
        alpha = Pair(total.alpha.low + more.low, total.alpha.high + more.high)
        return Sum(total.low + new.low, total.high + new.high, alpha)
    sure, maybe = a.low > total.alpha.high, a.high > total.alpha.low
    low = np.where(maybe, np.minimum(total.low, shown.low), total.low)
    high = np.where(maybe, np.maximum(total.high, shown.high), total.high)
    alpha = Pair(np.maximum(total.alpha.low, a.low), np.maximum(total.alpha.high, a.high))
    return Sum(np.where(sure, shown.low, low), np.where(sure, shown.high, high), alpha)


def _added(course: Course, total: Sum, share: Share) -> Sum:
    """Return sums with another sample."""
    rule = course.drawing.pipeline.accumulation.rule
    one, two = share.opacity
    a = Pair(np.minimum(one, two) - share.opacity_off, np.maximum(one, two) + share.opacity_off)
    c = Pair(share.color.min(axis=0) - share.color_off, share.color.max(axis=0) + share.color_off)
    alpha = total.alpha
    if rule == "reversed-over":
        rest = _product(Pair(1 - a.high, 1 - a.low), alpha)
        kept = _product(rest, Pair(total.low, total.high))
        new = _product(a, c)
        left = _product(Pair(1 - a.high, 1 - a.low), alpha)
        return Sum(new.low + kept.low, new.high + kept.high, Pair(a.low + left.low, a.high + left.high))
    shown = Pair(1 - alpha.high, 1 - alpha.low)
    weight = _product(shown, a)
    new = _product(shown if course.drawing.pipeline.accumulation.color == "premultiplied" else weight, c)
    more = weight if rule == "over" else a
    grown = Pair(alpha.low + more.low, alpha.high + more.high)
    if rule == "over":
        # 1 - (1 - A) (1 - a) grows with both: nothing is gained by taking them apart.
        grown = Pair(1 - (1 - alpha.low) * (1 - a.low), 1 - (1 - alpha.high) * (1 - a.high))
    if rule == "add-clamped":
        grown = Pair(np.minimum(grown.low, 1), np.minimum(grown.high, 1))
    return Sum(total.low + new.low, total.high + new.high, grown)


def _product(one: Pair, two: Pair) -> Pair:
    """Return the interval of products."""
    products = np.array([one.low * two.low, one.low * two.high, one.high * two.low, one.high * two.high])
    return Pair(products.min(axis=0), products.max(axis=0))
