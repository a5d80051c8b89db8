"""The marcher: the emission-absorption integral by the midpoint rule at a uniform step.

R rays of a chunk, S segments of a block.  Ray state is (rows, R) so that one gather fetches all of it.

With extinction sigma and colour c along a ray from t_near to t_far (Max 1995, eq. 5),

    C = integral of c sigma T dt + T(t_far) B,     T(t) = exp(-integral of sigma from t_near to t)

Segments have the length `step` but for the last, which is shortened to end at t_far, be that the box or
an opaque surface.  Each is taken as homogeneous with the value at its middle, which is of second order in
the step wherever sigma and c are continuous.
"""

from dataclasses import dataclass

import numpy as np

from volref.arrays import Booleans, Floats, Indices, Numbers
from volref.planning import BLOCK, SEGMENTS_PER_BLOCK, Plan
from volref.records import Spans
from volref.scene.scene import Scene
from volref.scene.transform import transform_directions, transform_points
from volref.stages.classify import Table, classify, lookup_table, segment_opacity
from volref.stages.composite import composite_block, composite_block_coarse, over
from volref.stages.rays import pixel_rays
from volref.stages.sampling import PAD, Grid, padded_grid, trilinear
from volref.stages.spans import box_spans, cut_at_surface
from volref.workspace import Workspace

# Rows of the ray state.
DIRECTION, T_NEAR, TRANSMITTANCE, COLOR = slice(0, 3), 3, 4, slice(5, 8)
COARSE_TRANSMITTANCE, COARSE_COLOR, ORIGIN = 8, slice(9, 12), slice(12, 15)
ROWS = 15


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

    The bound is an estimate: half the difference to the midpoint rule at three times the step (from the
    same samples), which a rule of any order of at least 1 obeys once its leading term rules, plus rounding
    of one eps per segment, plus what lies behind an early end, which is certain.
    """
    if field is None:
        return Chunk(behind.copy(), np.zeros(len(pixels)), 0)
    rays = pixel_rays(scene.camera, scene.width, scene.height, pixels)
    origins = np.ascontiguousarray(transform_points(field.index_from_world, rays.origins).T)
    directions = np.ascontiguousarray(transform_directions(field.index_from_world, rays.directions).T)
    spans = cut_at_surface(box_spans(origins, directions, field.low, field.high), distance)
    counts, last = segment_counts(spans, plan.step)
    order = np.argsort(-counts, kind="stable")[: np.count_nonzero(counts)]
    state = np.zeros((ROWS, len(order)))
    state[DIRECTION], state[T_NEAR], state[ORIGIN] = (
        directions[:, order],
        spans.t_near[order],
        origins[:, order],
    )
    state[TRANSMITTANCE] = state[COARSE_TRANSMITTANCE] = 1.0
    samples = _march(field, plan, state, counts[order], last[order], work)
    return _finish(field, plan, state, order, counts, behind, samples)


def segment_counts(spans: Spans, step: float) -> tuple[Indices, Floats]:
    """Return the number of segments (R,) of each span and the length (R,) of its last one.

    A span of 0.3 has 3 segments of 0.1, although 0.3 / 0.1 rounds to more than 3: a last segment shorter
    than 1e-12 steps is joined to the one before it.

    Examples
    --------
    >>> counts, last = segment_counts(Spans(np.array([0.0, 1.0, 2.0]), np.array([0.1 * 3, 1.25, 1.0])), 0.1)
    >>> counts.tolist(), last.round(3).tolist()
    ([3, 3, 0], [0.1, 0.05, 0.0])
    """
    length = np.maximum(spans.t_far - spans.t_near, 0.0)
    counts = np.ceil(length / step * (1 - 1e-12)).astype(np.intp)
    return counts, np.where(counts > 0, length - (counts - 1) * step, 0.0)


def _march(field: Field, plan: Plan, state: Floats, counts: Indices, last: Floats, work: Workspace) -> int:
    """March all rays of `state`, sorted by falling `counts`, in place; return the values interpolated."""
    samples = 0
    segments = np.arange(SEGMENTS_PER_BLOCK)
    for first in range(0, int(counts[0]) if len(counts) else 0, SEGMENTS_PER_BLOCK):
        existing = int(np.searchsorted(-counts, -first, side="left"))
        live = _live(plan, state[:, :existing], first)
        if live is None:
            part, block_counts, block_last = state[:, :existing], counts[:existing], last[:existing]
        elif len(live) == 0:
            continue
        else:
            part, block_counts, block_last = state.take(live, axis=1), counts[live], last[live]
        rays = part.shape[1]
        sample_counts = np.searchsorted(-block_counts, -(first + segments), side="left")
        opacity, colors = _sample_block(field, plan.step, part, first, block_counts, block_last, work)
        composite_block(part[TRANSMITTANCE], part[COLOR], opacity, colors, sample_counts, work)
        unshortened = np.searchsorted(-block_counts, -(first + segments[2::3] + 1), side="left")
        composite_block_coarse(
            part[COARSE_TRANSMITTANCE], part[COARSE_COLOR], opacity, colors, sample_counts, unshortened
        )
        if live is not None:
            state[TRANSMITTANCE : COARSE_COLOR.stop, live] = part[TRANSMITTANCE : COARSE_COLOR.stop]
        samples += rays * SEGMENTS_PER_BLOCK
    return samples


def _live(plan: Plan, state: Floats, first: int) -> Indices | None:
    """Return the rays that can still change in the block of segments from `first` on; None for all."""
    live: Booleans | None = None
    if plan.occupied is not None:
        middle = state[T_NEAR] + (first + SEGMENTS_PER_BLOCK / 2) * plan.step
        flat: Numbers = np.zeros(len(middle), np.intp)
        for axis, blocks in ((2, 0), (1, 1), (0, 2)):
            index = state[ORIGIN.start + axis] + middle * state[axis]
            index *= 1.0 / BLOCK
            block = np.clip(index, 0, plan.occupied.shape[blocks] - 1, out=index).astype(np.intp)
            flat = flat * plan.occupied.shape[blocks] + block
        live = plan.occupied.reshape(-1)[flat]
    if plan.termination > 0:
        shining = state[TRANSMITTANCE] >= plan.termination
        live = shining if live is None else live & shining
    if live is None or live.all():
        return None
    return np.flatnonzero(live)


def _sample_block(
    field: Field, step: float, rays: Floats, first: int, counts: Indices, last: Floats, work: Workspace
) -> tuple[Floats, Floats]:
    """Return opacity (S, R) and colours (3, S, R) of the segments from `first` on.

    Segments beyond a ray's end hold numbers without meaning; compositing leaves them out.
    """
    count = rays.shape[1]
    t: Floats = work.get("t", SEGMENTS_PER_BLOCK * count).reshape(SEGMENTS_PER_BLOCK, count)
    np.add((np.arange(first, first + SEGMENTS_PER_BLOCK) + 0.5)[:, None] * step, rays[T_NEAR], out=t)
    ending = int(np.searchsorted(-counts, -(first + SEGMENTS_PER_BLOCK), side="right"))
    enders = np.arange(ending, count)
    final = counts[ending:] - 1 - first
    t[final, enders] = rays[T_NEAR, ending:] + (counts[ending:] - 1) * step + last[ending:] / 2
    position: Floats = work.get("position", 3 * t.size).reshape(3, SEGMENTS_PER_BLOCK, count)
    for axis in range(3):
        np.multiply(t, rays[axis], out=position[axis])
        np.add(position[axis], rays[ORIGIN.start + axis] + PAD, out=position[axis])
    values = trilinear(field.grid, position.reshape(3, -1), work)
    colors, strength = classify(field.table, values, work)
    strength = strength.reshape(SEGMENTS_PER_BLOCK, count)
    ending_strength = strength[final, enders]
    opacity = segment_opacity(field.table, strength, step)
    opacity[final, enders] = segment_opacity(field.table, ending_strength, last[ending:])
    return opacity, colors.reshape(3, SEGMENTS_PER_BLOCK, count)


def _finish(
    field: Field, plan: Plan, state: Floats, order: Indices, counts: Indices, behind: Floats, samples: int
) -> Chunk:
    """Put the marched rays over what lies behind them and work out the bound."""
    rgba, bound = behind.copy(), np.zeros(len(counts))
    rgba[order] = over(state[COLOR], state[TRANSMITTANCE], behind[order])
    coarse = over(state[COARSE_COLOR], state[COARSE_TRANSMITTANCE], behind[order])
    brightest = np.maximum(behind[order].max(axis=1), max(field.color_limit, 1.0))
    cut = np.where(state[TRANSMITTANCE] < plan.termination, state[TRANSMITTANCE], 0.0)
    rounding = np.finfo(np.float64).eps * counts[order]
    difference = np.abs(rgba[order] - coarse).max(axis=1)
    bound[order] = difference / 2 + (rounding + cut) * brightest
    return Chunk(rgba, bound, samples)
