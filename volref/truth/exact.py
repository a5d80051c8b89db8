"""The exact integrator: the emission-absorption integral with a proven bound on its error.

R rays of a chunk, n pieces.  A ray is cut into pieces inside the cells of the grid; the transfer function is
replaced on each by a low polynomial that is off by a known amount; the polynomial model is integrated; and
the bound adds up what the model, the quadrature and rounding may be off (docs/certificate.md).  Rays whose
bound exceeds the tolerance are cut further where it matters: at the bends of the transfer function, where the
model then is exact, or into shorter parts.
"""

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from itertools import pairwise

import numpy as np

from volref.arrays import Booleans, Floats, Indices
from volref.cubics import value_range
from volref.planning import Plan, may_be_seen
from volref.records import Pieces, Spans
from volref.scene.blocks import flag_blocks
from volref.scene.scene import Scene
from volref.scene.transform import transform_directions, transform_points
from volref.scene.volume import Volume
from volref.stages.cells import CellGrid, cells_along, position_error
from volref.stages.models import FEW_BENDS, Models, look_up, models_of, piece_of
from volref.stages.radiance import Gathered, gathered
from volref.stages.rays import pixel_rays
from volref.stages.sampling import PAD, Grid, cell_corners, grid_of, trilinear
from volref.stages.spans import box_spans, cut_spans
from volref.stages.splitting import split_at_bends, split_evenly, split_geometrically
from volref.truth.modelling import Solved, modelled
from volref.truth.recentring import recentred_spans
from volref.workspace import Workspace

MOST_PASSES = 40

# Pieces whose models are integrated together, and into how many parts one is cut at most.
BATCH, MOST_PARTS = 1 << 16, 16

# Above this many pieces of a batch none is cut any more, and the bound stands as it is.
MOST_PIECES = 1 << 20

# Below this tolerance, and where bends are few, pieces are cut at them before they are first integrated.
CUT_AT_ONCE = 1e-5

# Below this one the bound on rounding is made tight.
PRECISE = 1e-8

# A piece with an optical depth of more than this is cut if its quadrature is what is off, or its model.
THICK, TRANSLUCENT = 3.0, 0.75

# Voxels up to which flags of what is seen are kept for blocks of 2^1 cells a side, and above which of 2^2.
FINE_FLAGS = 1 << 23


@dataclass(frozen=True, eq=False)
class Prepared:
    """A volume and its transfer function made ready for the exact integrator."""

    samples: Grid
    grid: CellGrid
    models: Models
    index_from_world: Floats
    low: Floats
    high: Floats


def prepare(scene: Scene, plan: Plan) -> Prepared:
    """Return the volume of `scene` made ready; costs a few passes over its voxels."""
    volume, transfer = scene.gridded
    grid = grid_of(volume)
    shift, near_shift = (1, 2) if volume.values.size <= FINE_FLAGS else (2, 3)
    half = 1 << (near_shift - 1)

    def flags(block: int, reach: int) -> Booleans:
        if not plan.includes("empty space"):
            return np.ones([-(-n // block) + 2 for n in volume.values.shape], np.bool_)
        seen = flag_blocks(volume, block, (reach, reach, reach), partial(may_be_seen, transfer))
        return np.pad(seen, 1, mode="edge")

    cells = CellGrid(
        partial(cell_corners, grid),
        flags(1 << shift, 0),
        shift,
        flags(1 << near_shift, half),
        near_shift,
        _steepest(volume),
    )
    low, high = volume.index_bounds
    return Prepared(
        grid, cells, models_of(transfer, *volume.value_bounds), volume.index_from_world, low, high
    )


def _steepest(volume: Volume) -> float:
    """Return a bound on the difference of neighbouring samples."""
    low, high = volume.value_bounds
    return high - low


def integrate_pixels(
    scene: Scene,
    prepared: Prepared,
    pixels: Indices,
    begin: Floats | float,
    distance: Floats,
    behind: Floats,
    tolerance: float,
) -> "Integral":
    """Integrate the rays of `pixels` (R,) from `begin` (R,) to `distance` (R,) over `behind` (R, 4)."""
    rays = pixel_rays(scene.camera, scene.width, scene.height, pixels)
    origins = transform_points(prepared.index_from_world, rays.origins).T
    directions = transform_directions(prepared.index_from_world, rays.directions).T
    spans = cut_spans(box_spans(origins, directions, prepared.low, prepared.high), begin, distance)
    origins, rests, spans, ends = recentred_spans(
        prepared.low, prepared.high, origins, directions, spans, begin, distance
    )
    done = integrate(prepared, origins, rests, directions, spans, behind, tolerance)
    done.bound[:] += _error_of_ends(prepared, origins, directions, spans, ends, behind, done)
    return done


def _error_of_ends(
    prepared: Prepared,
    origins: Floats,
    directions: Floats,
    spans: Spans,
    ends: Spans,
    behind: Floats,
    done: "Integral",
) -> Floats:
    """Return what errors of the spans' ends, `ends`, can add to the error (R,).

    A piece of that length may be missing or too much.  With tau its depth, it changes the light that leaves
    it by at most 1 - e^-tau times the difference of its colour and of what arrives: at the near end that is
    the image itself, at the far end what lies behind, seen through all the rest.
    """
    error = np.zeros(len(done.bound))
    inside = np.flatnonzero(ends.t_near + ends.t_far > 0)
    # Where a ray has pieces, they know whether they may be opaque.
    most = np.where(spans.t_far > spans.t_near, prepared.models.most_sigma, np.inf)[inside]
    low, high = prepared.low[:, None] + PAD, prepared.high[:, None] + PAD
    near_end = spans.t_near, ends.t_near, done.rgba, np.ones(len(error))
    far_end = spans.t_far, ends.t_far, behind, done.clear
    for t, off_by, arriving, seen in (near_end, far_end):
        position = np.clip(origins[:, inside] + t[inside] * directions[:, inside], low, high)
        extinction, color, off = look_up(prepared.models, trilinear(prepared.samples, position, Workspace()))
        extinction = np.minimum(extinction, most)
        contrast = np.abs(color.T - arriving[inside, :3]).max(axis=1) + off
        contrast = np.maximum(contrast, 1.0 - arriving[inside, 3]) + done.bound[inside]
        error[inside] += np.minimum(off_by[inside] * extinction, 1.0) * contrast * seen[inside]
    return error


def _brightest(models: Models, behind: Floats) -> float:
    return float(max(models.largest.max(), behind.max(initial=0.0), 1.0))


@dataclass(frozen=True, eq=False)
class Integral:
    """Of R rays: premultiplied rgba (R, 4), bound (R,), and how many pieces were integrated.

    clear (R,): a bound on how much of what lies behind is seen.
    """

    rgba: Floats
    bound: Floats
    clear: Floats
    pieces: int


def integrate(
    prepared: Prepared,
    origins: Floats,
    rests: Floats,
    directions: Floats,
    spans: Spans,
    behind: Floats,
    tolerance: float,
) -> Integral:
    """Return the integral along rays (3, R) in padded index space over what lies `behind` (R, 4)."""
    grid, models = prepared.grid, prepared.models
    done = Integral(behind.copy(), np.zeros(len(behind)), np.ones(len(behind)), 0)
    pieces = cells_along(grid, origins, rests, directions, spans, precise=tolerance < PRECISE)
    astray = 6 * grid.steepest * float(position_error(grid, origins, directions, spans).max(initial=0.0))
    if models.blur:
        pieces = dataclasses.replace(pieces, slack=pieces.slack + models.blur)
    brightest = _brightest(models, behind)
    integrated = sum(
        _integrate_pieces(models, part, behind, astray, brightest, tolerance, done)
        for part in _batches(pieces)
    )
    return dataclasses.replace(done, pieces=integrated)


def _batches(pieces: Pieces) -> Iterator[Pieces]:
    """Yield the pieces in parts of whole rays whose arrays fit the cache."""
    begins = np.ones(len(pieces.ray), np.bool_)
    np.not_equal(pieces.ray[1:], pieces.ray[:-1], out=begins[1:])
    start = 0
    for begin, end in pairwise([*np.flatnonzero(begins).tolist(), len(pieces.ray)]):
        if end - start > BATCH and begin > start:
            yield pieces.part(start, begin)
            start = begin
    if start < len(pieces.ray):
        yield pieces.part(start, len(pieces.ray))


def _integrate_pieces(
    models: Models,
    pieces: Pieces,
    behind: Floats,
    astray: float,
    brightest: float,
    tolerance: float,
    done: Integral,
) -> int:
    """Integrate pieces into `done` until their rays meet the tolerance; return how many it took."""
    if tolerance < CUT_AT_ONCE or len(models.bends) <= FEW_BENDS:
        pieces = _cut_at_bends(models, pieces, np.arange(len(pieces.ray)))
    integrated = 0
    for _ in range(MOST_PASSES):
        if len(pieces.ray) == 0:
            break
        rays = pieces.ray[np.append(True, pieces.ray[1:] != pieces.ray[:-1])]
        # All that is left of a ray may turn out to be clear.
        done.rgba[rays], done.bound[rays], done.clear[rays] = behind[rays], 0.0, 1.0
        solved = modelled(models, pieces, astray, tolerance)
        integrated += len(solved.row)
        if len(solved.row) == 0:
            break
        rays = solved.layout.rays
        result = gathered(solved.integrals, solved.layout, behind[rays], brightest)
        done.rgba[rays], done.bound[rays], done.clear[rays] = result.rgba, result.bound, result.clear
        bad = result.bound > tolerance
        if not bad.any() or len(solved.row) > MOST_PIECES:
            break
        pieces = _refined(models, solved, result, bad, tolerance)
    return integrated


def _cut_at_bends(models: Models, pieces: Pieces, chosen: Indices) -> Pieces:
    """Cut the `chosen` pieces at the bends of the table; those without any only learn their row."""
    low, high = value_range(pieces.cubic.take(chosen, axis=1))
    slack = pieces.slack.take(chosen)
    first, last = piece_of(models.bend_locator, low - slack), piece_of(models.bend_locator, high + slack)
    row = pieces.row.copy()
    row[chosen] = np.where(first == last, models.exact + first, -1)
    pieces = dataclasses.replace(pieces, row=row)
    crossing = chosen[first != last]
    if len(crossing) == 0:
        return pieces
    parts, of = split_at_bends(
        pieces.take(crossing),
        models.bends,
        lambda x: piece_of(models.bend_locator, x),
        models.exact,
        jumps=models.most_jump > 0 or models.opaque,
    )
    return _in_place_of(pieces, crossing, parts, of)


def _in_place_of(pieces: Pieces, replaced: Indices, parts: Pieces, of: Indices) -> Pieces:
    """Return the pieces with those at `replaced` in favour of their parts, in order along the rays."""
    kept = np.ones(len(pieces.ray), np.bool_)
    kept[replaced] = False
    stay = np.flatnonzero(kept)
    order = np.argsort(np.concatenate([stay, replaced[of]]), kind="stable")
    return pieces.take(stay).and_then(parts).take(order)


def _refined(models: Models, solved: Solved, result: Gathered, bad: Booleans, tolerance: float) -> Pieces:
    """Return the pieces of the rays that are `bad` (k,), the heavy ones among them cut.

    Rays of which no piece can be made better by cutting are left out.
    """
    layout = solved.layout
    count = (layout.last - layout.first + 1).take(layout.member)
    excess = result.share * (2 * count) / tolerance
    bent, thick, curved = _remedies(models, solved, result, excess > 1)
    helped = np.zeros(len(bad), np.bool_)
    helped[layout.member[bent | thick | curved]] = True
    chosen = np.flatnonzero((bad & helped).take(layout.member))
    pieces = solved.pieces.take(chosen)
    bent, thick, curved, excess = bent[chosen], thick[chosen], curved[chosen], excess[chosen]
    # What a model is off by falls with the square of the length at least.
    parts = np.clip(np.ceil(np.sqrt(excess)), 1, MOST_PARTS).astype(np.intp)
    even = np.flatnonzero(bent)
    even = even[parts[even] < _bends_within(models, pieces, even)]
    bent[even] = False
    first: Floats = 1 / parts
    first[thick] = np.minimum(0.75 * TRANSLUCENT / solved.steepest[chosen][thick], 0.5)
    first[curved] = 0.25
    shorter = np.flatnonzero(thick | curved)
    halves = (
        split_evenly(pieces.take(even), parts[even]),
        split_geometrically(pieces.take(shorter), first[shorter]),
    )
    cut, of = np.append(even, shorter), np.append(halves[0][1], len(even) + halves[1][1])
    place = np.ones(len(chosen), np.intp)
    place[cut] = np.bincount(of, minlength=len(cut))
    if len(cut):
        pieces = _in_place_of(pieces, cut, _with_edges(models, halves[0][0].and_then(halves[1][0])), of)
    return _cut_at_bends(models, pieces, np.flatnonzero(np.repeat(bent, place)))


def _bends_within(models: Models, pieces: Pieces, at: Indices) -> Indices:
    """Return how many bends of the table lie within the values of the pieces `at`."""
    low, high = value_range(pieces.cubic.take(at, axis=1))
    return piece_of(models.bend_locator, high) - piece_of(models.bend_locator, low)


def _with_edges(models: Models, parts: Pieces) -> Pieces:
    """Return parts of exact pieces without the edge that only their neighbours have."""
    low, high = value_range(parts.cubic)
    piece = np.maximum(parts.row - models.exact, 0)
    above = low - models.bends.take(piece) > parts.slack
    inside = (above & (models.bends.take(piece + 1) - high > parts.slack)) | (parts.row < 0)
    return dataclasses.replace(parts, edge=np.where(inside, 0.0, parts.edge))


def _remedies(
    models: Models, solved: Solved, result: Gathered, heavy: Booleans
) -> tuple[Booleans, Booleans, Booleans]:
    """Tell which heavy pieces are to be cut at bends, from their near end on, and evenly."""
    exact = solved.row >= models.exact
    by_quadrature = solved.quadrature * 2 > result.share
    limit = np.where(by_quadrature, THICK, TRANSLUCENT)
    thick = heavy & exact & (solved.steepest > limit)
    return heavy & ~exact, thick, heavy & solved.unsettled & ~thick
