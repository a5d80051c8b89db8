"""The exact integrator: the emission-absorption integral with a proven bound on its error.

R rays of a chunk, n pieces.  A ray is cut into pieces inside the cells of the grid; the transfer function is
replaced on each by a low polynomial that is off by a known amount; the polynomial model is integrated; and
the bound adds up what the model, the quadrature and rounding may be off (docs/certificate.md).  Rays whose
bound exceeds the tolerance are cut further where it matters: at the bends of the transfer function, where the
model then is exact, or into shorter parts.
"""

import dataclasses
from dataclasses import dataclass

import numpy as np

from volref.arrays import Booleans, Floats, Indices
from volref.planning import Plan, may_be_seen
from volref.records import Pieces, Spans
from volref.scene.blocks import block_ranges
from volref.scene.scene import Scene
from volref.scene.volume import Volume
from volref.scene.transform import transform_directions, transform_points
from volref.stages.cells import CellGrid, cells_along, position_error, recentred
from volref.stages.models import Models, look_up, models_of, piece_of
from volref.stages.radiance import ROUNDOFF, Gathered, gathered
from volref.stages.rays import pixel_rays
from volref.stages.sampling import PAD, Grid, padded_grid, trilinear
from volref.stages.spans import box_spans, cut_at_surface
from volref.stages.splitting import split_at_bends, split_geometrically, value_range
from volref.truth.modelling import Solved, modelled
from volref.workspace import Workspace

MOST_PASSES = 40

# Above this many pieces of a chunk none is cut any more, and the bound stands as it is.
MOST_PIECES = 1 << 20

# Below this tolerance pieces are cut at bends before they are first integrated.
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
    volume, transfer = scene.volume, scene.transfer
    assert volume is not None
    assert transfer is not None
    grid = padded_grid(volume)
    shift, near_shift = (1, 2) if volume.values.size <= FINE_FLAGS else (2, 3)
    half = 1 << (near_shift - 1)

    def flags(block: int, reach: int) -> Booleans:
        low, high = block_ranges(volume, block, (reach, reach, reach))
        seen = (
            may_be_seen(transfer, low, high) if plan.includes("empty space") else np.ones(low.shape, np.bool_)
        )
        return np.pad(seen, 1, mode="edge")

    cells = CellGrid(
        grid.corners,
        grid.strides,
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
    prepared: Prepared | None,
    pixels: Indices,
    distance: Floats,
    behind: Floats,
    tolerance: float,
) -> "Integral":
    """Integrate along the rays of `pixels` (R,) to `distance` (R,), over what lies `behind` (R, 4)."""
    if prepared is None:
        return Integral(behind.copy(), np.zeros(len(pixels)), np.ones(len(pixels)), 0)
    rays = pixel_rays(scene.camera, scene.width, scene.height, pixels)
    origins = transform_points(prepared.index_from_world, rays.origins).T
    directions = transform_directions(prepared.index_from_world, rays.directions).T
    spans = cut_at_surface(box_spans(origins, directions, prepared.low, prepared.high), distance)
    origins, spans = _recentred(prepared, origins, directions, spans, distance)
    done = integrate(prepared.grid, prepared.models, origins, directions, spans, behind, tolerance)
    done.bound[:] += _error_of_ends(prepared, origins, directions, spans, behind, done)
    return done


def _recentred(
    prepared: Prepared, origins: Floats, directions: Floats, spans: Spans, distance: Floats
) -> tuple[Floats, Spans]:
    """Return padded origins in the middle of the spans, and the spans from there, their ends computed afresh.

    Only a span that begins at the origin, or ends at a surface, keeps that end as it was.
    """
    moved, moved_spans = recentred(origins + PAD, directions, spans)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        faces = [(face[:, None] + PAD - moved) / directions for face in (prepared.low, prepared.high)]
    parallel = directions == 0
    near = np.where(parallel, -np.inf, np.minimum(*faces)).max(axis=0)
    far = np.where(parallel, np.inf, np.maximum(*faces)).min(axis=0)
    inside = spans.t_far > spans.t_near
    near = np.where(inside & (spans.t_near > 0), near, moved_spans.t_near)
    far = np.where(inside & (spans.t_far < distance), far, moved_spans.t_far)
    return moved, Spans(near, np.maximum(near, far))


def _error_of_ends(
    prepared: Prepared, origins: Floats, directions: Floats, spans: Spans, behind: Floats, done: "Integral"
) -> Floats:
    """Return what rounding of the spans' ends can add to the error (R,).

    The distance of a face, (face - o) / d, is off by at most 3 u of itself with u the unit roundoff: a piece of
    that length may be missing or too much.  With tau its depth, it changes the light that leaves it by at most
    1 - e^-tau times the difference of its colour and of what arrives: at the near end that is the image itself,
    at the far end what lies behind, seen through all the rest.
    """
    error = np.zeros(len(done.bound))
    inside = np.flatnonzero(spans.t_far > spans.t_near)
    low, high = prepared.low[:, None] + PAD, prepared.high[:, None] + PAD
    near_end = spans.t_near, done.rgba, np.ones(len(error))
    far_end = spans.t_far, behind, done.clear
    for t, arriving, seen in (near_end, far_end):
        t_inside = t[inside]
        position = np.clip(origins[:, inside] + t_inside * directions[:, inside], low, high)
        extinction, color, off = look_up(prepared.models, trilinear(prepared.samples, position, Workspace()))
        contrast = np.abs(color.T - arriving[inside, :3]).max(axis=1) + off
        contrast = np.maximum(contrast, 1.0 - arriving[inside, 3]) + done.bound[inside]
        depth = np.minimum(3 * ROUNDOFF * np.abs(t_inside) * extinction, 1.0)
        error[inside] += depth * contrast * seen[inside]
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
    grid: CellGrid,
    models: Models,
    origins: Floats,
    directions: Floats,
    spans: Spans,
    behind: Floats,
    tolerance: float,
) -> Integral:
    """Return the integral along rays (3, R) in padded index space over what lies `behind` (R, 4)."""
    rgba, bound, clear = behind.copy(), np.zeros(len(behind)), np.ones(len(behind))
    pieces = cells_along(grid, origins, directions, spans, precise=tolerance < PRECISE)
    astray = 6 * grid.steepest * float(position_error(grid, origins, directions, spans).max(initial=0.0))
    if models.blur:
        pieces = dataclasses.replace(pieces, slack=pieces.slack + models.blur)
    brightest = _brightest(models, behind)
    if tolerance < CUT_AT_ONCE:
        pieces = _cut_at_bends(models, pieces, np.arange(len(pieces.ray)))
    integrated = 0
    for _ in range(MOST_PASSES):
        if len(pieces.ray) == 0:
            break
        rays = pieces.ray[np.append(True, pieces.ray[1:] != pieces.ray[:-1])]
        rgba[rays], bound[rays], clear[rays] = behind[rays], 0.0, 1.0  # all that is left of a ray may turn out to be clear
        solved = modelled(models, pieces, astray, tolerance)
        integrated += len(solved.row)
        if len(solved.row) == 0:
            break
        rays = solved.layout.rays
        result = gathered(solved.integrals, solved.layout, behind[rays], brightest)
        rgba[rays], bound[rays], clear[rays] = result.rgba, result.bound, result.clear
        bad = result.bound > tolerance
        if not bad.any() or len(solved.row) > MOST_PIECES:
            break
        pieces = _refined(models, solved, result, bad, tolerance)
    return Integral(rgba, bound, clear, integrated)


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
        pieces.take(crossing), models.bends, lambda x: piece_of(models.bend_locator, x), models.exact
    )
    return _in_place_of(pieces, crossing, parts, of)


def _in_place_of(pieces: Pieces, replaced: Indices, parts: Pieces, of: Indices) -> Pieces:
    """Return the pieces with those at `replaced` in favour of their parts, in order along the rays."""
    kept = np.ones(len(pieces.ray), np.bool_)
    kept[replaced] = False
    stay = np.flatnonzero(kept)
    order = np.argsort(np.concatenate([stay, replaced[of]]), kind="stable")
    rest = pieces.take(stay)
    joined = (
        np.concatenate([getattr(rest, field.name), getattr(parts, field.name)], axis=-1).take(order, axis=-1)
        for field in dataclasses.fields(Pieces)
    )
    return Pieces(*joined)


def _refined(models: Models, solved: Solved, result: Gathered, bad: Booleans, tolerance: float) -> Pieces:
    """Return the pieces of the rays that are `bad` (k,), the heavy ones among them cut.

    Rays of which no piece can be made better by cutting are left out.
    """
    layout = solved.layout
    count = layout.last - layout.first + 1
    heavy = result.share * (2 * count.take(layout.member)) > tolerance
    bent, thick, curved = _remedies(models, solved, result, heavy)
    helped = np.zeros(len(bad), np.bool_)
    helped[layout.member[bent | thick | curved]] = True
    chosen = np.flatnonzero((bad & helped).take(layout.member))
    pieces = solved.pieces.take(chosen)
    bent, thick, curved = bent[chosen], thick[chosen], curved[chosen]
    steps = np.minimum(0.75 * TRANSLUCENT / solved.steepest[chosen], 0.5)
    # From the last to the first, so that what is cut later keeps its place; thick ones are cut with the others.
    shorter = np.flatnonzero(thick | curved)
    if len(shorter):
        first = np.where(thick, steps, 0.25)[shorter]
        parts, of = split_geometrically(pieces.take(shorter), first)
        place = np.ones(len(chosen), np.intp)
        place[shorter] = np.bincount(of, minlength=len(shorter))
        bent = np.repeat(bent, place)
        pieces = _in_place_of(pieces, shorter, _with_edges(models, parts), of)
    return _cut_at_bends(models, pieces, np.flatnonzero(bent))


def _with_edges(models: Models, parts: Pieces) -> Pieces:
    """Return parts of exact pieces without the edge that only their neighbours have."""
    low, high = value_range(parts.cubic)
    piece = parts.row - models.exact
    inside = (low - models.bends.take(piece) > parts.slack) & (
        models.bends.take(piece + 1) - high > parts.slack
    )
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
