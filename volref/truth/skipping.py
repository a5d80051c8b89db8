"""Which blocks of segments a march samples: those in which anything can be seen.

R rays, b blocks of the ray that has most of them.
"""

import numpy as np

from volref.arrays import Booleans, Floats, Indices
from volref.planning import Occupancy, Plan
from volref.stages.sampling import PAD


def blocks_to_march(
    plan: Plan, start: Floats, stride: Floats, segments: Indices
) -> tuple[Indices, Indices, Floats]:
    """Return how many blocks each ray has (R,), those with any in falling order of that, and their segments.

    The last is (b, R) in the new order: the first segment of each block, b of them at most.
    """
    existing = -(-segments // plan.block)
    most = int(existing.max(initial=0))
    occupancy = plan.occupancy
    # An occupancy holds for the step that it was made for.
    if occupancy is None or plan.step * plan.block / 2 > occupancy.reach * (1 + 1e-9):
        order = _falling(existing)
        first = np.arange(0.0, most * plan.block, plan.block)[:, None]
        return existing, order, np.broadcast_to(first, (most, len(order)))
    seen = _seen(occupancy, start, stride * plan.block, existing)
    blocks = np.zeros(len(existing), np.intp)
    for row in seen:
        blocks += row
    order = _falling(blocks)
    place = np.empty(len(blocks), np.intp)
    place[order] = np.arange(len(order))
    first = np.zeros((int(blocks.max(initial=0)), len(order)))
    filled = np.zeros(len(order), np.intp)
    for number, row in enumerate(seen):
        rays = place.take(np.flatnonzero(row))
        slots = filled.take(rays)
        first[slots, rays] = number * plan.block
        filled[rays] = slots + 1
    return blocks, order, first


def _falling(counts: Indices) -> Indices:
    """Return the order that sorts counts from high to low, equal ones as they stand, without those of 0."""
    # NumPy sorts 16-bit numbers by their digits, ten times as fast.
    small = len(counts) == 0 or counts.max() < 2**15
    keys = counts.astype(np.int16 if small else np.int64)
    return np.argsort(np.negative(keys), kind="stable")[: np.count_nonzero(counts)]


def _seen(occupancy: Occupancy, start: Floats, stride: Floats, blocks: Indices) -> Booleans:
    """Tell of each block of each ray, `stride` (3, R) apart, whether anything can be seen in it, (most, R).

    The block around the middle of its segments answers for all of them: they lie within its reach.
    """
    most, count = int(blocks.max(initial=0)), len(blocks)
    # The occupancy reaches far enough for the rounding of float32 where blocks are few along each axis.
    kind = np.dtype(np.float32 if max(occupancy.blocks.shape) < 2**10 else np.float64)
    low, size = (np.array(vector)[:, None] for vector in (occupancy.low, occupancy.size))
    # A ray that has no blocks may start anywhere.
    begin = (np.where(blocks > 0, start - PAD - low, 0.0) / size).astype(kind)
    along = (stride / size).astype(kind)
    seen = np.empty((most, count), np.bool_)
    flags = occupancy.blocks.reshape(-1)
    flat, whole, place = np.empty(count, np.int32), np.empty(count, np.int32), np.empty(count, kind)
    for row in range(most):
        flat[:] = 0
        for axis, length in zip((2, 1, 0), occupancy.blocks.shape, strict=True):
            np.multiply(along[axis], row + 0.5, out=place)
            np.add(place, begin[axis], out=place)
            np.copyto(whole, place, casting="unsafe")
            np.multiply(flat, length, out=flat)
            np.add(flat, whole, out=flat)
        np.take(flags, flat, mode="clip", out=seen[row])
    seen &= np.arange(most)[:, None] < blocks
    return seen
