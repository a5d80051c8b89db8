"""The marcher: the emission-absorption integral by the midpoint rule at a uniform step.

R rays of a chunk, S segments of a block, c colour channels.

With extinction sigma and colour c along a ray from t_near to t_far (Max 1995, eq. 5),

    C = integral of c sigma T dt + T(t_far) B,     T(t) = exp(-integral of sigma from t_near to t)

A span is cut into equal segments, at most `step` long and three by three, be its end the box or an opaque
surface.  Each is taken as homogeneous with the value at its middle, which is of second order in the step
wherever sigma and c are continuous.  Taken three by three, the same samples are the midpoint rule at three
times the step: the difference of both is the estimate of the error.

Blocks of six segments, or three where those are long, in which nothing can be seen are left out before
anything is sampled, and the rays are sorted by how many are left, so that at any time those that still have
one come first:

    ray 0   . . # # . # #            its blocks   2 3 5 6
    ray 1   # # # . . . .      ->                 0 1 2
    ray 2   . . . . # . .                         4
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from volref.arrays import Floats, Indices
from volref.planning import Plan
from volref.records import Spans
from volref.scene.scene import Scene
from volref.scene.transform import transform_directions, transform_points
from volref.stages.classify import segment_opacity
from volref.stages.composite import composite_block, composite_block_coarse, over
from volref.stages.rays import pixel_rays
from volref.stages.sampling import PAD
from volref.stages.spans import box_spans, cut_spans
from volref.truth.fields import Field, Samples
from volref.truth.skipping import blocks_to_march
from volref.workspace import Workspace

# Bytes of the samples taken together: fewer, and NumPy's cost per call shows; more, and they leave the cache.
BATCH = 147456

# Rays that have ended early are dropped when they are more than this part of those at work.
MOST_ENDED = 1 / 8


@dataclass(frozen=True, eq=False)
class Chunk:
    """The marched pixels of a chunk: rgba (R, 4), bound (R,), and the values interpolated."""

    rgba: Floats
    bound: Floats
    samples: int


@dataclass(eq=False)
class _State:
    """Rays at work: where they start and how far a segment goes (3, R) in the padded space of the field.

    viewer (3, R): the unit world direction towards the viewer, or (0, R) if the field does not ask for it.
    place (1, R): where in its segments a ray takes its samples, or (0, R) if all do in the middle.
    number (R,): which ray of the chunk it is.  length (R,): of a segment, in the world.  segments (R,): how
    many there are.  blocks (R,): how many of its blocks are marched; rays are sorted by it.  first (b, R):
    the first segment of each of them.  coarse_transmittance and coarse_color are those at three times the
    step.
    """

    number: Indices
    start: Floats
    stride: Floats
    viewer: Floats
    place: Floats
    length: Floats
    segments: Indices
    blocks: Indices
    first: Floats
    transmittance: Floats
    color: Floats
    coarse_transmittance: Floats
    coarse_color: Floats

    def take(self, rays: Indices) -> "_State":
        return _State(**{name: array.take(rays, axis=-1) for name, array in vars(self).items()})


def march_chunk(
    scene: Scene,
    plan: Plan,
    field: Field,
    pixels: Indices,
    begin: Floats | float,
    distance: Floats,
    behind: Floats,
    work: Workspace,
) -> Chunk:
    """March the rays of `pixels` (R,) from `begin` (R,) to `distance` (R,), over what lies `behind` (R, 4).

    The bound is an estimate: the difference to the midpoint rule at three times the step, plus what rounding
    may be off, plus what lies behind an early end, which is certain.  Where the leading term of the error
    rules, that difference is 8 times the error at second order and twice the error at first; a feature that
    both rules step over escapes it.
    """
    rays = pixel_rays(scene.camera, scene.width, scene.height, pixels)
    eyes = rays.origins if scene.camera.is_parallel else rays.origins[:1]
    origins = transform_points(field.space_from_world, eyes).T
    directions = transform_directions(field.space_from_world, rays.directions).T
    origins = np.broadcast_to(origins, directions.shape)
    spans = cut_spans(box_spans(origins, directions, field.low, field.high), begin, distance)
    viewer = -rays.directions.T if field.sees_viewer else np.empty((0, len(pixels)))
    place = np.empty((0, len(pixels))) if plan.offsets is None else plan.offsets[pixels][None]
    state = _state_of(plan, field, origins, directions, spans, viewer, place)
    rgba, bound, samples = behind.copy(), np.zeros(len(pixels)), 0
    for part in _marched(plan, field, state, work):
        samples += int(part.blocks.sum()) * plan.block
        rgba[part.number], bound[part.number] = _finish(field, plan, part, behind[part.number])
    return Chunk(rgba, bound, samples)


def segments_of(spans: Spans, step: float) -> tuple[Indices, Floats]:
    """Return how many segments each span has, a multiple of three, and how long they are, (R,) each.

    They are at most `step` long.  A span of 0.6 has 6 segments of 0.1, although rounding may make 0.6 / 0.1
    more than 6: they may be longer than the step by 1e-12 of it.

    Examples
    --------
    >>> spans = Spans(np.array([0.0, 1.0, 0.0, 2.0]), np.array([0.7 - 0.1, 1.7, 0.15, 1.0]))
    >>> [part.round(3).tolist() for part in segments_of(spans, 0.1)]
    [[6, 9, 3, 0], [0.1, 0.078, 0.05, 0.0]]
    """
    length = np.maximum(spans.t_far - spans.t_near, 0.0)
    counts = 3 * np.ceil(length / (3 * step) * (1 - 1e-12)).astype(np.intp)
    counts = np.where((length > 0) & (counts == 0), 3, counts)
    return counts, length / np.maximum(counts, 1)


def _state_of(
    plan: Plan,
    field: Field,
    origins: Floats,
    directions: Floats,
    spans: Spans,
    viewer: Floats,
    place: Floats,
) -> _State:
    """Return the rays that have something to march, sorted, before anything is marched."""
    segments, length = segments_of(spans, plan.step)
    start = directions * np.where(segments > 0, spans.t_near, 0.0)
    start += origins
    start += PAD
    stride = directions * length
    blocks, order, first = blocks_to_march(plan, start, stride, segments)
    kind = field.dtype
    count, channels = len(order), plan.palette.composited
    return _State(
        order,
        start.take(order, axis=1),
        stride.take(order, axis=1),
        viewer.take(order, axis=1),
        place.take(order, axis=1),
        length.take(order).astype(kind),
        segments.take(order),
        blocks.take(order),
        first,
        np.ones(count, kind),
        np.zeros((channels, count), kind),
        np.ones(count, kind),
        np.zeros((channels, count), kind),
    )


def _marched(plan: Plan, field: Field, state: _State, work: Workspace) -> Iterator[_State]:
    """March all rays of `state`; yield them as they end."""
    offsets, live = _offsets(field, state, plan.block), _live(state.blocks)
    row = 0
    while len(state.blocks) and row < state.blocks[0]:
        if plan.termination > 0:
            shining = state.transmittance >= plan.termination
            if len(shining) - np.count_nonzero(shining) > MOST_ENDED * live[row]:
                gone = state.take(np.flatnonzero(~shining))
                gone.blocks = np.minimum(gone.blocks, row)
                yield gone
                kept = np.flatnonzero(shining)
                state, offsets = state.take(kept), offsets.take(kept, axis=-1)
                live = _live(state.blocks)
                continue
        counts = _batch(live, row, BATCH // (plan.block * state.length.itemsize))
        _march_batch(plan, field, state, offsets, row, counts, work)
        row += len(counts) - 1
    yield state


def _offsets(field: Field, state: _State, block: int) -> Floats:
    """Return how far the samples of a block lie from `reach` before its beginning, (3, S, R)."""
    kind = state.length.dtype
    inside = state.place[0] if len(state.place) else 0.5
    offsets = state.stride.astype(kind)[:, None] * (np.arange(block)[:, None] + inside).astype(kind)
    offsets += kind.type(field.reach)
    return np.asarray(offsets)


def _live(blocks: Indices) -> list[int]:
    """Return how many of the rays, sorted by falling `blocks`, have one in each row; 0 for the one beyond."""
    most = int(blocks[0]) if len(blocks) else 0
    counts: list[int] = np.searchsorted(-blocks, -np.arange(most + 1), side="left").tolist()
    return counts


def _batch(live: list[int], row: int, most: int) -> list[int]:
    """Return how many rays have a block in each of the next rows, up to `most`, and in the row after them."""
    end, total = row + 1, live[row]
    while live[end] and total + live[end] <= most:
        total, end = total + live[end], end + 1
    return live[row : end + 1]


def _march_batch(
    plan: Plan, field: Field, state: _State, offsets: Floats, row: int, counts: list[int], work: Workspace
) -> None:
    """Sample rows of blocks together, and composite them one after the other, in place."""
    total, kind = sum(counts[:-1]), state.length.dtype
    shape = plan.block, total
    position: Floats = work.get("position", 3 * plan.block * total, kind).reshape(3, *shape)
    lengths: Floats = work.get("lengths", total, kind)
    whole: Indices = work.get("corners", 3 * total, np.int32).reshape(3, total)
    viewer: Floats = work.get("viewer", len(state.viewer) * total).reshape(-1, total)
    begin = 0
    for number, count in enumerate(counts[:-1], start=row):
        columns = slice(begin, begin + count)
        corner = state.stride[:, :count] * state.first[number, :count]
        corner += state.start[:, :count]
        np.copyto(whole[:, columns], corner, casting="unsafe")
        corner -= whole[:, columns]
        for place, offset, begin_at in zip(position, offsets, corner.astype(kind), strict=True):
            np.add(offset[:, :count], begin_at, out=place[:, columns])
        lengths[columns] = state.length[:count]
        viewer[:, columns] = state.viewer[:, :count]
        begin += count
    whole -= field.reach
    colors, strength = field.look(Samples(position.reshape(3, -1), whole, viewer), work)
    opacity = segment_opacity(field, strength.reshape(shape), lengths)
    colors = colors.reshape(len(colors), *shape)
    begin = 0
    for number, (count, others) in enumerate(pairwise(counts), start=row):
        columns = slice(begin, begin + count)
        _composite(plan, state, number, others, opacity[:, columns], colors[..., columns], work)
        begin += count


def _composite(
    plan: Plan, state: _State, row: int, others: int, opacity: Floats, colors: Floats, work: Workspace
) -> None:
    """Add one row of blocks to the rays that have one, in place; the first `others` of them have another."""
    count = opacity.shape[1]
    # The last block of a ray may have three segments only.
    half = np.flatnonzero(state.segments[others:count] - state.first[row, others:count] < plan.block)
    opacity[3:, others + half] = 0.0
    if plan.termination > 0:
        ended = np.flatnonzero(state.transmittance[:count] < plan.termination)
        opacity[:, ended] = 0.0
    coarse = state.coarse_transmittance[:count], state.coarse_color[:, :count]
    composite_block_coarse(*coarse, opacity, colors, work)
    composite_block(state.transmittance[:count], state.color[:, :count], opacity, colors, work)


def _finish(field: Field, plan: Plan, state: _State, behind: Floats) -> tuple[Floats, Floats]:
    """Return rgba (R, 4) over what lies behind, and the bound (R,), of marched rays."""
    clear, coarse_clear = (
        values.astype(np.float64) for values in (state.transmittance, state.coarse_transmittance)
    )
    color = plan.palette.spread(state.color)
    rgba = over(color, clear, behind)
    # By how much the image over what lies behind differs at three times the step.
    change = plan.palette.spread(state.coarse_color)
    change -= color
    coarse_clear -= clear
    bound = np.abs(coarse_clear * (1.0 - behind[:, 3]))
    for channel in range(3):
        change[channel] += coarse_clear * behind[:, channel]
        np.maximum(bound, np.abs(change[channel]), out=bound)
    cut = np.where(clear < plan.termination, clear, 0.0)
    cut += float(np.finfo(state.length.dtype).eps) * state.segments
    cut += plan.rounding
    bound += cut * np.maximum(behind.max(axis=1), max(field.color_limit, 1.0))
    return rgba, bound
