"""The modes that reduce a ray to one value: greatest, least, mean, the first at an isovalue, that on a plane.

R rays of a part, n pieces of them.  The value is found exactly but for rounding, and the table is asked once
for each ray: what rounding can do to the value, and whether it decides if a ray meets anything at all, is the
bound (docs/guide/modes.md).

    mip, minip     the extremes of the cubics of those cells that can beat a few samples of the ray
    average        the mean of the cubics of all cells
    isosurface     the first root of the cubics of the cells whose block holds the isovalue
    slice          the value at one point (see `truth.modes.slicing`)
"""

from dataclasses import dataclass
from functools import partial

import numpy as np

from volref.arrays import Booleans, Floats, Indices, Numbers
from volref.records import Pieces, Spans
from volref.scene.blocks import block_ranges, flag_blocks
from volref.scene.scene import Scene
from volref.scene.transfer import TransferFunction
from volref.scene.transform import transform_directions, transform_points
from volref.scene.volume import Volume
from volref.stages.cells import CellGrid, placed_cells, position_error, sharp_values
from volref.stages.isosurface import first_crossing
from volref.stages.rays import pixel_rays
from volref.stages.reductions import Estimates, greatest_along, greatest_of, mean_along, near_greatest
from volref.stages.sampling import PAD, Grid, cell_corners, grid_of, trilinear
from volref.stages.spans import box_spans, cut_spans
from volref.stages.unit_layers import straight_colors, unit_layers
from volref.truth.modes.slicing import slice_pixels
from volref.truth.recentring import recentred_spans
from volref.workspace import Workspace

ROUNDOFF = 2.0**-53

# Below this tolerance the bound on rounding is made tight.
PRECISE = 1e-8

# Voxels up to which blocks have 2, and 4, cells a side; beyond, 8.
FINE, MEDIUM = 1 << 23, 1 << 27

# Crossings of rays with planes of the grid that are worked on together, so that their arrays fit the cache.
CROSSINGS = 1 << 15

# Indices between the samples of a ray that say what a cell has to beat.
SAMPLES_APART = 2.0

# Blocks count as holding an isovalue that lies up to this part of the volume's values beyond theirs.
MARGIN = 1e-9


@dataclass(frozen=True, eq=False)
class Reducible:
    """A volume made ready for the mode of its scene.

    For "mip" and "minip" the grid's blocks hold their greatest value, of the negative field for "minip".
    values: the least and greatest value of the volume.
    """

    samples: Grid
    grid: CellGrid
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

    error (R,): how far positions may be off, in indices.
    off (R,): how far values may be off where rounding puts a ray into the next cell, or misplaces its ends.
    touching, doubtful (R,): whether rounding decides that the span is empty, or that it is not.
    """

    origins: Floats
    rests: Floats
    directions: Floats
    spans: Spans
    middle: Floats
    error: Floats
    off: Floats
    touching: Booleans
    doubtful: Booleans

    def part(self, chosen: Indices) -> "_Ways":
        """Return the rays at the indices `chosen`."""
        return _Ways(
            self.origins[:, chosen],
            self.rests[:, chosen],
            self.directions[:, chosen],
            Spans(self.spans.t_near[chosen], self.spans.t_far[chosen]),
            self.middle[chosen],
            self.error[chosen],
            self.off[chosen],
            self.touching[chosen],
            self.doubtful[chosen],
        )


def prepare_reduction(scene: Scene) -> Reducible:
    """Return the volume of `scene` made ready for its mode; costs a pass over its voxels or none."""
    volume = scene.volume
    assert isinstance(volume, Volume)
    samples = grid_of(volume)
    shift = 1 if volume.values.size <= FINE else 2 if volume.values.size <= MEDIUM else 3
    near_shift = shift + 1
    seen: Numbers
    near: Numbers
    if scene.mode in ("mip", "minip"):
        seen = _greatest(volume, scene.mode, shift, 0)
        near = _greatest(volume, scene.mode, near_shift, 1 << shift)
    elif scene.mode == "isosurface":
        assert scene.isovalue is not None
        seen = _held(volume, scene.isovalue, shift, 0)
        near = _held(volume, scene.isovalue, near_shift, 1 << shift)
    else:
        seen, near = (
            np.ones([-(-n >> k) + 2 for n in volume.values.shape], np.bool_) for k in (shift, near_shift)
        )
    least, most = volume.value_bounds
    grid = CellGrid(partial(cell_corners, samples), seen, shift, near, near_shift, most - least)
    low, high = volume.index_bounds
    return Reducible(samples, grid, volume.index_from_world, low, high, volume.value_bounds)


def _greatest(volume: Volume, mode: str, shift: int, reach: int) -> Numbers:
    """Return the greatest value of each block, of the negative field for "minip"."""
    low, high = block_ranges(volume, 1 << shift, (reach, reach, reach))
    return np.asarray(np.pad(high if mode == "mip" else -low, 1, mode="edge"))


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
    rays = pixel_rays(scene.camera, scene.width, scene.height, pixels)
    if scene.mode == "slice":
        place = prepared.index_from_world, prepared.low, prepared.high
        rgba, bound = slice_pixels(scene, prepared.samples, place, rays, begin, distance, behind)
        return Reduced(rgba, bound, np.full(len(bound), np.inf), np.zeros(len(bound)), len(bound))
    origins = transform_points(prepared.index_from_world, rays.origins).T
    directions = transform_directions(prepared.index_from_world, rays.directions).T
    ways = _ways(prepared, origins, directions, begin, distance)
    crossings = ((ways.spans.t_far - ways.spans.t_near) * np.abs(directions).sum(axis=0)).sum()
    count = int(min(1 + crossings // CROSSINGS, max(len(pixels), 1)))
    parts = np.array_split(np.arange(len(pixels)), count)
    return _joined([_reduce(scene, prepared, ways.part(part), behind[part], tolerance) for part in parts])


def _joined(parts: list[Reduced]) -> Reduced:
    if len(parts) == 1:
        return parts[0]
    return Reduced(
        np.concatenate([part.rgba for part in parts]),
        np.concatenate([part.bound for part in parts]),
        np.concatenate([part.hit for part in parts]),
        np.concatenate([part.off for part in parts]),
        sum(part.pieces for part in parts),
    )


def _reduce(scene: Scene, prepared: Reducible, ways: _Ways, behind: Floats, tolerance: float) -> Reduced:
    """Reduce rays (R,) over `behind` (R, 4)."""
    assert isinstance(scene.transfer, TransferFunction)
    if scene.mode == "isosurface":
        return _isosurface(scene, prepared, ways, behind)
    if scene.mode == "average":
        found, pieces = _mean(prepared, ways, precise=tolerance < PRECISE)
    else:
        found, pieces = _extreme(scene.mode, prepared, ways)
    rgba, bound = _over(scene.transfer, found.within(*prepared.values), ways, behind)
    return Reduced(rgba, bound, np.full(len(bound), np.inf), np.zeros(len(bound)), pieces)


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
    6 s e.  Where the ends are misplaced by h in all, extremes lie at most h away, and so do means, whose
    interval is longer or shorter by h, at most 2 h: they are off by 2 h s (|dx| + |dy| + |dz|).
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
    misplaced = ends.t_near + ends.t_far
    error = position_error(grid, moved, directions, spans)
    off = grid.steepest * (6 * error + 2 * misplaced * np.abs(directions).sum(axis=0))
    inside &= spans.t_far > spans.t_near
    touching = ~inside & (misplaced > 0)
    doubtful = inside & (spans.t_far - spans.t_near <= misplaced)
    return _Ways(moved, rests, directions, spans, middle, error, off, touching, doubtful)


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
    """Return the values (..., R) at t (..., R) along rays, held to the box."""
    position = np.empty((3, *t.shape))
    for axis in range(3):
        along = ways.origins[axis] + t * ways.directions[axis]
        np.clip(along, prepared.low[axis] + PAD, prepared.high[axis] + PAD, out=position[axis])
    return np.array(trilinear(prepared.samples, position.reshape(3, -1), Workspace())).reshape(t.shape)


def _extreme(mode: str, prepared: Reducible, ways: _Ways) -> tuple[Estimates, int]:
    """Return the greatest or least value along rays, and how many pieces it took.

    A few samples of each ray come first: a block whose values all lie below them cannot hold the extreme.
    """
    sign = 1.0 if mode == "mip" else -1.0
    known = _sampled(sign, prepared, ways)
    off = ways.off + 16 * ROUNDOFF * np.abs(known)
    highest = prepared.values[1] if mode == "mip" else -prepared.values[0]
    beaten = np.where(known < highest, known - off, highest)
    pieces, middle = placed_cells(
        prepared.grid, ways.origins, ways.rests, ways.directions, ways.spans, precise=True, beaten=beaten
    )
    pieces.cubic[:] *= sign
    here, at = greatest_of(pieces.cubic)
    sharp = here.copy()
    close = near_greatest(pieces, here, off)
    sharp[close] = sign * _sharpened(prepared, ways, pieces.take(close), middle.take(close), at.take(close))
    found = greatest_along(pieces, here, sharp, off, known)
    return (found if mode == "mip" else found.negative()), len(pieces.ray)


def _sharpened(prepared: Reducible, ways: _Ways, pieces: Pieces, middle: Floats, at: Floats) -> Floats:
    """Return the values of pieces at v = `at` (n,) with less rounding than their cubics have."""
    ray = pieces.ray
    rays = ways.origins[:, ray], ways.rests[:, ray], ways.directions[:, ray]
    t = middle + at * pieces.length
    return sharp_values(prepared.grid, rays, t, ways.error.take(ray), np.abs(at) == 0.5)


def _sampled(sign: float, prepared: Reducible, ways: _Ways) -> Floats:
    """Return the greatest of some values along each ray (R,), of the field times `sign`."""
    length = ways.spans.t_far - ways.spans.t_near
    stride = SAMPLES_APART / np.abs(ways.directions).max(axis=0)
    count = max(int(np.ceil((length / stride).max(initial=0.0))), 1)
    # A ray's samples do not depend on those beside it: what is too much lies at its far end.
    along = np.minimum((np.arange(count) + 0.5)[:, None] * stride, length)
    return np.asarray((sign * _values_at(prepared, ways, ways.spans.t_near + along)).max(axis=0))


def _mean(prepared: Reducible, ways: _Ways, *, precise: bool) -> tuple[Estimates, int]:
    """Return the mean value along rays, and how many pieces it took."""
    pieces, _ = placed_cells(
        prepared.grid, ways.origins, ways.rests, ways.directions, ways.spans, precise=precise
    )
    found = mean_along(pieces, ways.off)
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
