"""The modes that reduce a ray to one value: greatest, least, mean, the first at an isovalue, that on a plane.

R rays of a part, n pieces of them.  The value is found exactly but for rounding, and the table is asked once
for each ray: what rounding can do to the value, and whether it decides if a ray meets anything at all, is the
bound (docs/guide/modes.md).

    mip, minip     the extremes of the cubics of those cells that can beat a few samples of the ray
    average        the mean of the cubics of all cells
    isosurface     the first root of the cubics of the cells whose block holds the isovalue
    slice          the value at one point (see `truth.slicing`)
"""

from dataclasses import dataclass
from functools import partial

import numpy as np

from volref.arrays import Booleans, Floats, Indices, Numbers
from volref.records import Spans
from volref.scene.blocks import block_ranges, flag_blocks
from volref.scene.scene import Scene
from volref.scene.transfer import TransferFunction
from volref.scene.transform import transform_directions, transform_points
from volref.scene.volume import Volume
from volref.stages.cells import CellGrid, of_blocks, placed_cells, position_error
from volref.stages.isosurface import first_crossing
from volref.stages.rays import pixel_rays
from volref.stages.reductions import Estimates, greatest_along, mean_along
from volref.stages.sampling import PAD, Grid, cell_corners, grid_of, trilinear
from volref.stages.spans import box_spans, cut_spans
from volref.stages.unit_layers import straight_colors, unit_layers
from volref.truth.recentring import recentred_spans
from volref.truth.slicing import slice_pixels
from volref.workspace import Workspace

ROUNDOFF = 2.0**-53

# Below this tolerance the bound on rounding is made tight.
PRECISE = 1e-8

# Voxels up to which blocks have 2, and 4, cells a side; beyond, 8.
FINE, MEDIUM = 1 << 23, 1 << 27

# Indices between the samples of a ray that say what a cell has to beat.
SAMPLES_APART = 2.0

# Blocks count as holding an isovalue that lies up to this part of the volume's values beyond theirs.
MARGIN = 1e-9


@dataclass(frozen=True, eq=False)
class Reducible:
    """A volume made ready for the mode of its scene.

    best: the greatest value of each block, of the negative field for "minip", laid out as `grid.seen`; only
    for modes that need it.  values: the least and greatest value of the volume.
    """

    samples: Grid
    grid: CellGrid
    best: Floats | None
    index_from_world: Floats
    low: Floats
    high: Floats
    values: tuple[float, float]


@dataclass(frozen=True, eq=False)
class Reduced:
    """Of R rays: premultiplied rgba (R, 4), bound (R,), and how many pieces were made.

    hit (R,): the distance at which a ray meets the isosurface, +inf where it does not or the mode is another.
    off (R,): a bound on the error of `hit`, +inf where rounding decides whether there is one.
    """

    rgba: Floats
    bound: Floats
    hit: Floats
    off: Floats
    pieces: int


@dataclass(frozen=True, eq=False)
class _Ways:
    """Rays in padded index space about the middles of their spans, `middle` (R,) from where they start.

    off (R,): how far values may be off where rounding puts a ray into the next cell, or misplaces its ends.
    touching, doubtful (R,): whether rounding decides that the span is empty, or that it is not.
    """

    origins: Floats
    rests: Floats
    directions: Floats
    spans: Spans
    ends: Spans
    middle: Floats
    off: Floats
    touching: Booleans
    doubtful: Booleans


def prepare_reduction(scene: Scene) -> Reducible:
    """Return the volume of `scene` made ready for its mode; costs a pass over its voxels or none."""
    volume = scene.volume
    assert isinstance(volume, Volume)
    samples = grid_of(volume)
    shift = 1 if volume.values.size <= FINE else 2 if volume.values.size <= MEDIUM else 3
    best = None
    seen = near = np.ones([-(-n // (1 << shift)) + 2 for n in volume.values.shape], np.bool_)
    near_shift = shift
    if scene.mode in ("mip", "minip"):
        low, high = block_ranges(volume, 1 << shift, (0, 0, 0))
        best = np.pad(high if scene.mode == "mip" else -low, 1, mode="edge")
    elif scene.mode == "isosurface":
        near_shift = shift + 1
        assert scene.isovalue is not None
        seen = _held(volume, scene.isovalue, shift, 0)
        near = _held(volume, scene.isovalue, near_shift, 1 << shift)
    least, most = volume.value_bounds
    grid = CellGrid(partial(cell_corners, samples), seen, shift, near, near_shift, most - least)
    low, high = volume.index_bounds
    return Reducible(samples, grid, best, volume.index_from_world, low, high, volume.value_bounds)


def _held(volume: Volume, isovalue: float, shift: int, reach: int) -> Booleans:
    """Return flags, laid out as `CellGrid.seen`, of the blocks that hold the isovalue."""
    margin = _margin(volume.value_bounds)

    def holds(low: Floats, high: Floats) -> Booleans:
        return np.asarray((low - margin <= isovalue) & (isovalue <= high + margin))

    flags = flag_blocks(volume, 1 << shift, (reach, reach, reach), holds)
    return np.asarray(np.pad(flags, 1, mode="edge"))


def _margin(values: tuple[float, float]) -> float:
    return MARGIN * (values[1] - values[0])


def reduce_pixels(
    scene: Scene,
    prepared: Reducible,
    pixels: Indices,
    begin: Floats | float,
    distance: Floats,
    behind: Floats,
    tolerance: float,
) -> Reduced:
    """Reduce the rays of `pixels` (R,) from `begin` (R,) to `distance` (R,) over `behind` (R, 4)."""
    transfer = scene.transfer
    assert isinstance(transfer, TransferFunction)
    rays = pixel_rays(scene.camera, scene.width, scene.height, pixels)
    nowhere = np.full(len(pixels), np.inf)
    if scene.mode == "slice":
        place = prepared.index_from_world, prepared.low, prepared.high
        rgba, bound = slice_pixels(scene, prepared.samples, place, rays, begin, distance, behind)
        return Reduced(rgba, bound, nowhere, np.zeros(len(pixels)), len(pixels))
    origins = transform_points(prepared.index_from_world, rays.origins).T
    directions = transform_directions(prepared.index_from_world, rays.directions).T
    ways = _ways(prepared, origins, directions, begin, distance)
    if scene.mode == "isosurface":
        return _isosurface(scene, prepared, ways, behind)
    if scene.mode == "average":
        found, pieces = _mean(prepared, ways, precise=tolerance < PRECISE)
    else:
        found, pieces = _extreme(scene.mode, prepared, ways)
    rgba, bound = _over(transfer, found.within(*prepared.values), ways, behind)
    return Reduced(rgba, bound, nowhere, np.zeros(len(pixels)), pieces)


def _ways(
    prepared: Reducible,
    origins: Floats,
    directions: Floats,
    begin: Floats | float,
    distance: Floats,
) -> _Ways:
    """Return the rays about the middles of their spans, with what rounding may have done to them.

    With e the error of positions and s the steepest difference of neighbouring samples, each index along an
    axis changes the value by at most s: a ray that is in the next cell by 2 e along each axis is off by
    6 s e, and one whose span is longer or shorter by h at an end by h s (|dx| + |dy| + |dz|).
    """
    grid = prepared.grid
    known = cut_spans(box_spans(origins, directions, prepared.low, prepared.high), begin, distance)
    moved, rests, spans, ends = recentred_spans(
        prepared.low, prepared.high, origins, directions, known, begin, distance
    )
    inside = known.t_far > known.t_near
    middle = np.where(
        inside, 0.5 * (np.where(inside, known.t_near, 0) + np.where(inside, known.t_far, 0)), 0.0
    )
    longest = np.maximum(ends.t_near, ends.t_far)
    error = position_error(grid, moved, directions, spans)
    off = grid.steepest * (6 * error + longest * np.abs(directions).sum(axis=0))
    inside &= spans.t_far > spans.t_near
    touching = ~inside & (ends.t_near + ends.t_far > 0)
    doubtful = inside & (spans.t_far - spans.t_near <= ends.t_near + ends.t_far)
    return _Ways(moved, rests, directions, spans, ends, middle, off, touching, doubtful)


def _over(transfer: TransferFunction, found: Estimates, ways: _Ways, behind: Floats) -> tuple[Floats, Floats]:
    """Return the layers of what was found over `behind`, and what lies behind where a span is empty."""
    rgba, bound = unit_layers(transfer, found.value, found.least, found.most, behind)
    either = np.abs(rgba - behind).max(axis=1)
    inside = ways.spans.t_far > ways.spans.t_near
    # Where rounding decides whether there is a span, the image may be the one or the other.
    bound = np.where(ways.doubtful, np.maximum(bound, either), bound)
    bound = np.where(inside, bound, np.where(ways.touching, bound + either, 0.0))
    return np.where(inside[:, None], rgba, behind), bound


def _values_at(prepared: Reducible, ways: _Ways, t: Floats) -> Floats:
    """Return the values (R,) at t (R,) along rays, held to the box."""
    low, high = prepared.low[:, None] + PAD, prepared.high[:, None] + PAD
    position = np.clip(ways.origins + t * ways.directions, low, high)
    return np.array(trilinear(prepared.samples, position, Workspace()))


def _extreme(mode: str, prepared: Reducible, ways: _Ways) -> tuple[Estimates, int]:
    """Return the greatest or least value along rays, and how many pieces it took.

    A few samples of each ray come first: a block whose values all lie below them cannot hold the extreme.
    """
    sign = 1.0 if mode == "mip" else -1.0
    known = _sampled(sign, prepared, ways)
    off = ways.off + 16 * ROUNDOFF * np.abs(known)
    assert prepared.best is not None
    wanted = partial(_may_beat, prepared.best, prepared.grid.shift, known)
    pieces, _ = placed_cells(
        prepared.grid, ways.origins, ways.rests, ways.directions, ways.spans, precise=True, wanted=wanted
    )
    pieces.cubic[:] *= sign
    found = greatest_along(pieces, off, known)
    return (found if mode == "mip" else found.negative()), len(pieces.ray)


def _may_beat(best: Floats, shift: int, known: Floats, ray: Indices, wholes: list[Numbers]) -> Booleans:
    return np.asarray(of_blocks(best, wholes, shift) > known.take(ray))


def _sampled(sign: float, prepared: Reducible, ways: _Ways) -> Floats:
    """Return the greatest of some values along each ray (R,), of the field times `sign`."""
    length = ways.spans.t_far - ways.spans.t_near
    fastest = np.abs(ways.directions).max(axis=0)
    count = max(int(np.ceil((length * fastest).max(initial=0.0) / SAMPLES_APART)), 1)
    known = np.full(len(length), -np.inf)
    for k in range(count):
        t = ways.spans.t_near + (k + 0.5) / count * length
        np.maximum(known, sign * _values_at(prepared, ways, t), out=known)
    return known


def _mean(prepared: Reducible, ways: _Ways, *, precise: bool) -> tuple[Estimates, int]:
    """Return the mean value along rays, and how many pieces it took.

    An end that is misplaced by h changes the mean by at most h / length of all that values can differ.
    """
    pieces, _ = placed_cells(
        prepared.grid, ways.origins, ways.rests, ways.directions, ways.spans, precise=precise
    )
    length = ways.spans.t_far - ways.spans.t_near
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(length > 0, (ways.ends.t_near + ways.ends.t_far) / length, 0.0)
    found = mean_along(pieces, ways.off + prepared.grid.steepest * share)
    # A ray that only touches the box may see the value there.
    at = np.flatnonzero(ways.touching)
    found.value[at] = _values_at(prepared, ways, ways.spans.t_near)[at]
    off = ways.off[at] + 16 * ROUNDOFF * np.abs(found.value[at])
    found.least[at], found.most[at] = found.value[at] - off, found.value[at] + off
    return found, len(pieces.ray)


def _isosurface(scene: Scene, prepared: Reducible, ways: _Ways, behind: Floats) -> Reduced:
    """Return the isosurface in the colour that the table has there, or what lies behind.

    The bound is 0 unless rounding decides whether a ray meets it: then it is the contrast of the two.
    """
    assert scene.isovalue is not None
    assert isinstance(scene.transfer, TransferFunction)
    pieces, middle = placed_cells(
        prepared.grid, ways.origins, ways.rests, ways.directions, ways.spans, precise=True
    )
    inside = ways.spans.t_far > ways.spans.t_near
    found = first_crossing(pieces, middle, ways.off, scene.isovalue)
    hit = ways.middle + found.t
    color, slack = _color_at(scene.transfer, scene.isovalue)
    surface = np.append(color, 1.0)
    rgba = np.where(np.isfinite(hit)[:, None], surface, behind)
    # Blocks that do not hold the isovalue are left out: nothing is known where values are off by more.
    unknown = (ways.off > _margin(prepared.values)) | ways.doubtful
    unknown |= ways.touching & _may_touch(scene.isovalue, prepared, ways)
    either = np.isfinite(found.earliest) & ~np.isfinite(found.latest)
    certain = ~(either | unknown)
    bound = np.where(
        certain, np.where(np.isfinite(hit), slack, 0.0), np.abs(surface - behind).max(axis=1) + slack
    )
    with np.errstate(invalid="ignore"):
        off = np.maximum(found.t - found.earliest, found.latest - found.t)
    off += 4 * ROUNDOFF * (np.abs(ways.middle) + np.abs(np.where(np.isfinite(found.t), found.t, 0.0)))
    off = np.where(certain, np.where(np.isfinite(hit), off, 0.0), np.inf)
    return Reduced(rgba, bound, np.where(inside, hit, np.inf), off, len(pieces.ray))


def _may_touch(isovalue: float, prepared: Reducible, ways: _Ways) -> Booleans:
    """Tell whether the isovalue may lie where rays (R,) enter their spans."""
    away = np.abs(_values_at(prepared, ways, ways.spans.t_near) - isovalue)
    return np.asarray(away <= ways.off + 16 * ROUNDOFF * max(map(abs, prepared.values)))


def _color_at(transfer: TransferFunction, value: float) -> tuple[Floats, float]:
    """Return the straight colour (3,) of a value, and how far rounding may put it off."""
    color, rounding = straight_colors(transfer, np.array([value]))
    return color[:, 0], float(rounding.max())
