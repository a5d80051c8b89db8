"""The iterations of a chunk of rays, several looked up at once: small arrays cost more calls than arithmetic.

n rays of an iteration, m of them with a sample that is not transparent.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from volref.arrays import Booleans, Floats, Indices
from volref.oracle.intervals import gradients
from volref.oracle.intervals.gradients import Lit
from volref.oracle.intervals.opacities import Share, share_of
from volref.oracle.intervals.samples import find
from volref.oracle.intervals.walking import (
    Course,
    Pair,
    Test,
    Walk,
    advanced,
    begun,
    ended_before,
    met,
    most_iterations,
    own_end_after,
    place_of,
)
from volref.workspace import Workspace

# Rays that have ended are dropped when they are more than this share.
MOST_OVER = 0.1

# Samples looked up together; more leave the second-level cache.
BLOCK = 1 << 14


class Iteration(NamedTuple):
    """One iteration of the rays at `at` (n,) of a chunk, and how they may end.

    before: before the sample.  hit: at a mesh, None for programs without.  after: by their own end after it.
    some (m,): which of the rays have a sample that is not transparent.  share: what these may add.
    """

    at: Indices
    before: Test
    hit: Test | None
    after: Test
    some: Indices
    share: Share


class _Placed(NamedTuple):
    """One iteration before it is looked up."""

    number: int
    at: Indices
    ray: Indices
    over: Booleans
    before: Test
    hit: Test | None
    after: Test
    position: Floats
    radius: Floats
    part: Pair | None


def iterations(
    course: Course, lit: Lit | None, ray: Indices, gone: Booleans, work: Workspace
) -> Iterator[Iteration]:
    """Yield the iterations of rays, as far as any may go; `gone` (n,) are those that nobody asks for more."""
    walk, at = begun(course, ray), np.arange(len(ray))
    number, most = 0, most_iterations(course)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        while len(at) and number < most:
            placed: list[_Placed] = []
            samples = 0
            while len(at) and number < most and samples < BLOCK:
                one, at = _placed(course, walk, at, number)
                placed.append(one)
                samples += len(one.radius)
                number += 1
            yield from _looked_up(course, lit, placed, work)
            at = _left(walk, at, walk.over | gone[at])


def _placed(course: Course, walk: Walk, at: Indices, number: int) -> tuple[_Placed, Indices]:
    """Return the next iteration of a walk, and which rays of the chunk go on after it."""
    before = ended_before(course, walk, number)
    hit = met(course, walk)
    over = walk.over | (before.sure if hit is None else before.sure | hit.sure)
    here = walk.ray
    position, radius, part = place_of(course, walk, number)
    if over.any():
        # What is looked up where a ray is over is not used, but what it meets must be known.
        position = np.where(over, position.dtype.type(0), position)
        radius = np.where(over, 0.0, radius)
    sampled = walk.position
    advanced(course, walk)
    after = own_end_after(course, walk, sampled)
    one = _Placed(number, at, here, over, before, hit, after, position, radius, part)
    return one, _left(walk, at, over | after.sure)


def _left(walk: Walk, at: Indices, over: Booleans) -> Indices:
    """Put down which rays are over, and drop them where they are many; return those that are left."""
    walk.over = over
    done = np.count_nonzero(over)
    if done <= MOST_OVER * len(over) and done < len(over):
        return at
    kept = np.flatnonzero(~over)
    walk.take(kept)
    return at[kept]


def _looked_up(
    course: Course, lit: Lit | None, placed: list[_Placed], work: Workspace
) -> Iterator[Iteration]:
    """Yield iterations with what their samples may add."""
    position = np.concatenate([one.position for one in placed], axis=1)
    radius = np.concatenate([one.radius for one in placed])
    # A ray without a direction is nowhere, and so anywhere in the box.
    radius = np.where(radius <= 1, radius, 1.0)
    ray = np.concatenate([one.ray for one in placed])
    part = _joined_parts([one.part for one in placed])
    skipped = course.drawing.pipeline.stepping.skipped
    over = np.concatenate([one.over | (one.number < skipped) for one in placed])
    chosen, some = find(course.finder, position, radius, work)
    if over.any():
        left = np.flatnonzero(~over[some])
        chosen, some = chosen.take(left), some[left]
    if lit is not None:
        chosen = gradients.shaded(lit, course.finder, position[:, some], chosen, ray[some], radius[some])
    share = share_of(course, chosen, ray[some], None if part is None else part.take(some))
    counts = np.cumsum([0, *(len(one.at) for one in placed)])
    bounds = np.searchsorted(some, counts)
    for k, one in enumerate(placed):
        part_of = slice(bounds[k], bounds[k + 1])
        yield Iteration(
            one.at, one.before, one.hit, one.after, some[part_of] - counts[k], share.part(part_of)
        )


def _joined_parts(parts: list[Pair | None]) -> Pair | None:
    known = [part for part in parts if part is not None]
    if not known:
        return None
    return Pair(np.concatenate([part.low for part in known]), np.concatenate([part.high for part in known]))
