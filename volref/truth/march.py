"""The marcher: the emission-absorption integral by the midpoint rule at a uniform step.

R rays of a chunk, S segments of a block.  Ray state is (rows, R) so that one gather fetches all of it.

With extinction sigma and colour c along a ray from t_near to t_far (Max 1995, eq. 5),

    C = integral of c sigma T dt + T(t_far) B,     T(t) = exp(-integral of sigma from t_near to t)

Segments have the length `step` but for the last, which is shortened to end at t_far, be that the box or
an opaque surface; a span of up to three steps has three equal segments, so that its error can be
estimated too.  Each is taken as homogeneous with the value at its middle, which is of second order in the
step wherever sigma and c are continuous.
"""

from dataclasses import dataclass

import numpy as np

from volref.arrays import Booleans, Floats, Indices
from volref.planning import BLOCK, SEGMENTS_PER_BLOCK, Occupancy, Plan
from volref.records import Spans
from volref.scene.scene import Scene
from volref.scene.transform import transform_directions, transform_points
from volref.stages.classify import Table, classify, lookup_table, segment_opacity
from volref.stages.composite import composite_block, composite_block_coarse, over
from volref.stages.rays import pixel_rays
from volref.stages.sampling import PAD, Grid, padded_grid, trilinear
from volref.stages.spans import box_spans, cut_at_surface
from volref.workspace import Workspace

# Rows of the ray state.  What stays: where the span begins and how far one segment goes, in padded index
# space; the length of a segment in the world; the length of the last one as a fraction of that.
START, STRIDE, STEP, LAST = slice(0, 3), slice(3, 6), 6, 7
# What accumulates, at the step and at three times the step.
TRANSMITTANCE, COLOR = 8, slice(9, 12)
COARSE_TRANSMITTANCE, COARSE_COLOR = 12, slice(13, 16)
ACCUMULATED = slice(TRANSMITTANCE, 16)
ROWS = 16

# Where no more than this part of a block's samples is visible, only those are classified.
MOST_VISIBLE = 0.5


@dataclass(frozen=True, eq=False)
class Field:
    """A volume made ready to be sampled and classified along rays."""

    grid: Grid
    table: Table
    index_from_world: Floats
    low: Floats
    high: Floats
    color_limit: float


def field_of(scene: Scene) -> Field:
    """Prepare the volume of `scene` for marching; costs one pass over its voxels."""
    volume, transfer = scene.volume, scene.transfer
    assert volume is not None
    assert transfer is not None
    low, high = volume.index_bounds
    return Field(
        padded_grid(volume),
        lookup_table(transfer, volume.value_bounds),
        volume.index_from_world,
        low,
        high,
        float(transfer.colors.max()),
    )


@dataclass(frozen=True, eq=False)
class Chunk:
    """The marched pixels of a chunk: rgba (R, 4), bound (R,), and the values interpolated."""

    rgba: Floats
    bound: Floats
    samples: int


def march_chunk(
    scene: Scene,
    plan: Plan,
    field: Field | None,
    pixels: Indices,
    distance: Floats,
    behind: Floats,
    work: Workspace,
) -> Chunk:
    """March the rays of `pixels` (R,) to `distance` (R,) and put the result over `behind` (R, 4).

    The bound is an estimate: the difference to the midpoint rule at three times the step (from the same
    samples), plus rounding of one eps per segment, plus what lies behind an early end, which is certain.
    Where the leading term of the error rules, that difference is 8 times the error at second order and
    twice the error at first; a feature that both rules step over escapes it.
    """
    if field is None:
        return Chunk(behind.copy(), np.zeros(len(pixels)), 0)
    rays = pixel_rays(scene.camera, scene.width, scene.height, pixels)
    origins = transform_points(field.index_from_world, rays.origins).T
    directions = transform_directions(field.index_from_world, rays.directions).T
    spans = cut_at_surface(box_spans(origins, directions, field.low, field.high), distance)
    counts, steps, last = segments_of(spans, plan.step)
    order = np.argsort(-counts, kind="stable")[: np.count_nonzero(counts)]
    counts, steps = counts[order], steps[order]
    state = np.zeros((ROWS, len(order)))
    state[START] = origins[:, order] + PAD + directions[:, order] * spans.t_near[order]
    state[STRIDE], state[STEP], state[LAST] = directions[:, order] * steps, steps, last[order] / steps
    state[TRANSMITTANCE] = state[COARSE_TRANSMITTANCE] = 1.0
    samples = _march(field, plan, state, counts, work)
    rgba, bound = behind.copy(), np.zeros(len(pixels))
    rgba[order], bound[order] = _finish(field, plan, state, counts, behind[order])
    return Chunk(rgba, bound, samples)


def segments_of(spans: Spans, step: float) -> tuple[Indices, Floats, Floats]:
    """Return for each span how many segments it has, their length, and the length of the last, (R,) each.

    A span of 0.4 has 4 segments of 0.1, although rounding may make 0.4 / 0.1 more than 4: a last segment
    shorter than 1e-12 of the span is joined to the one before it.

    Examples
    --------
    >>> spans = Spans(np.array([0.0, 1.0, 0.0, 2.0]), np.array([0.1 + 0.3, 1.35, 0.15, 1.0]))
    >>> [part.round(3).tolist() for part in segments_of(spans, 0.1)]
    [[4, 4, 3, 0], [0.1, 0.1, 0.05, 0.1], [0.1, 0.05, 0.05, 0.0]]
    """
    length = np.maximum(spans.t_far - spans.t_near, 0.0)
    counts = np.ceil(length / step * (1 - 1e-12)).astype(np.intp)
    short = (length > 0) & (counts <= 3)
    counts = np.where(short, 3, counts)
    steps = np.where(short, length / 3, step)
    last = np.where(short, steps, length - (counts - 1) * step)
    return counts, steps, np.where(counts > 0, last, 0.0)


def _march(field: Field, plan: Plan, state: Floats, counts: Indices, work: Workspace) -> int:
    """March all rays of `state`, sorted by falling `counts`, in place; return the values interpolated."""
    samples = 0
    most = int(counts[0]) if len(counts) else 0
    blocks_along = _blocks_along(plan, state)
    for first in range(0, most, SEGMENTS_PER_BLOCK):
        existing = int(np.searchsorted(-counts, -first, side="left"))
        live = np.ones(existing, np.bool_)
        if blocks_along is not None:
            live &= _occupied(*blocks_along, existing, first, work)
        if plan.termination > 0:
            live &= state[TRANSMITTANCE, :existing] >= plan.termination
        if live.all():
            _march_block(field, plan.step, state[:, :existing], counts[:existing], first, work)
            samples += existing * SEGMENTS_PER_BLOCK
        elif live.any():
            chosen = np.flatnonzero(live)
            part = state.take(chosen, axis=1)
            _march_block(field, plan.step, part, counts[chosen], first, work)
            state[ACCUMULATED, chosen] = part[ACCUMULATED]
            samples += len(chosen) * SEGMENTS_PER_BLOCK
    return samples


def _blocks_along(plan: Plan, rays: Floats) -> tuple[Occupancy, Floats, Floats] | None:
    """Return the occupancy, and the start and stride of rays (3, R) counted in its blocks.

    None where all is to be taken for occupied: by the plan, or because a block of segments is longer than
    the reach that the occupancy was made for.
    """
    occupancy = plan.occupancy
    if occupancy is None or plan.step * SEGMENTS_PER_BLOCK / 2 > occupancy.reach:
        return None
    start = (rays[START] - PAD) / BLOCK + np.array(occupancy.layers)[:, None]
    return occupancy, start, rays[STRIDE] / BLOCK


def _occupied(
    occupancy: Occupancy, start: Floats, stride: Floats, count: int, first: int, work: Workspace
) -> Booleans:
    """Tell which of the first `count` rays can see something in the block of segments from `first` on.

    The block around the middle of the segments answers for all of them: they lie within its reach.
    """
    place = work.get("place in blocks", count)
    flat, whole = np.zeros(count, np.intp), work.get("whole block", count, np.int32)
    for axis, length in zip((2, 1, 0), occupancy.blocks.shape, strict=True):
        np.multiply(stride[axis, :count], first + SEGMENTS_PER_BLOCK / 2, out=place)
        np.add(place, start[axis, :count], out=place)
        np.copyto(whole, place, casting="unsafe")
        np.multiply(flat, length, out=flat)
        np.add(flat, whole, out=flat)
    return np.take(occupancy.blocks.reshape(-1), flat, mode="clip")


def _march_block(
    field: Field, step: float, rays: Floats, counts: Indices, first: int, work: Workspace
) -> None:
    """Sample and composite the segments from `first` on, in place."""
    # How many rays have each segment of the block, and the one after it; they come first.
    existing = np.searchsorted(-counts, -np.arange(first, first + SEGMENTS_PER_BLOCK + 1), side="left")
    opacity, colors = _sample_block(field, step, rays, counts - first, first, int(existing[-1]), work)
    existing = existing[:-1]
    composite_block(rays[TRANSMITTANCE], rays[COLOR], opacity, colors, existing, work)
    lengths = counts - first - 1 + rays[LAST]
    composite_block_coarse(rays[COARSE_TRANSMITTANCE], rays[COARSE_COLOR], opacity, colors, existing, lengths)


def _sample_block(
    field: Field, step: float, rays: Floats, remaining: Indices, first: int, ending: int, work: Workspace
) -> tuple[Floats, Floats]:
    """Return opacity (S, R) and colours (3, S, R) of the segments from `first` on.

    `remaining` (R,) segments are left of each ray; the rays from `ending` on end in this block, and their
    lengths differ, from each other and within.  Segments beyond a ray's end hold numbers without meaning;
    compositing leaves them out.
    """
    final, columns = remaining[ending:] - 1, np.arange(len(remaining) - ending)
    last = rays[LAST, ending:]
    middles = (np.arange(first, first + SEGMENTS_PER_BLOCK) + 0.5)[:, None]
    shape = SEGMENTS_PER_BLOCK, len(remaining)
    position: Floats = work.get("position", 3 * SEGMENTS_PER_BLOCK * len(remaining)).reshape(3, *shape)
    for place, start, stride in zip(position, rays[START], rays[STRIDE], strict=True):
        np.multiply(middles, stride, out=place)
        place[:, ending:][final, columns] = (first + final + last / 2) * stride[ending:]
        np.add(place, start, out=place)
    values = trilinear(field.grid, position.reshape(3, -1), work)
    lengths = np.tile(rays[STEP, ending:], (SEGMENTS_PER_BLOCK, 1))
    lengths[final, columns] *= last
    _, strength = classify(field.table, values.reshape(shape)[:, ending:].ravel(), work)
    end_opacity = segment_opacity(field.table, strength.reshape(lengths.shape), lengths).copy()
    opacity, colors = _classified(field.table, values, step, work)
    opacity, colors = opacity.reshape(shape), colors.reshape(3, *shape)
    opacity[:, ending:] = end_opacity
    return opacity, colors


def _classified(table: Table, values: Floats, step: float, work: Workspace) -> tuple[Floats, Floats]:
    """Return the opacities (n,) of segments `step` long and the colours (3, n) of their values.

    Colours of what is transparent are left as they were: nothing is ever multiplied by them but 0.
    """
    low, high = table.visible
    seen = work.get("seen", len(values), np.bool_)
    np.greater_equal(values, low, out=seen)
    seen &= values <= high
    if np.count_nonzero(seen) > MOST_VISIBLE * len(values):
        colors, strength = classify(table, values, work)
        return segment_opacity(table, strength, step), colors
    chosen = np.flatnonzero(seen)
    few_colors, strength = classify(table, values[chosen], work)
    opacity: Floats = work.get("opacity", len(values))
    colors = work.get("colors", 3 * len(values)).reshape(3, -1)
    opacity[:] = 0.0
    opacity[chosen] = segment_opacity(table, strength, step)
    for color, few in zip(colors, few_colors, strict=True):
        color[chosen] = few
    return opacity, colors


def _finish(
    field: Field, plan: Plan, state: Floats, counts: Indices, behind: Floats
) -> tuple[Floats, Floats]:
    """Return rgba (R, 4) over what lies behind, and the bound (R,), of marched rays."""
    rgba = over(state[COLOR], state[TRANSMITTANCE], behind)
    coarse = over(state[COARSE_COLOR], state[COARSE_TRANSMITTANCE], behind)
    brightest = np.maximum(behind.max(axis=1), max(field.color_limit, 1.0))
    cut = np.where(state[TRANSMITTANCE] < plan.termination, state[TRANSMITTANCE], 0.0)
    rounding = np.finfo(np.float64).eps * counts
    return rgba, np.abs(rgba - coarse).max(axis=1) + (rounding + cut) * brightest
