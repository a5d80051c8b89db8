"""Stage 3 of the exact integrator: the pieces of rays inside the cells of the grid.

R rays, m crossings of a ray, n pieces; rays are (3, R) in padded index space (see `sampling`), and t stays
in world units.  Within one cell the trilinear field is a cubic along a ray, so a ray is cut at the planes
where a padded index is whole; in 2-D with 5 crossings:

    +---+---+---+
    |   |   | / |      t_near --1--2-------3--4--5-- t_far
    |   |  /|   |      between two crossings the ray is in one cell
    |  /|   |   |
    +---+---+---+

Cells that cannot be seen are dropped before their cubic is made.
"""

from dataclasses import dataclass

import numpy as np

from volref.arrays import Booleans, Floats, Indices, Numbers
from volref.records import Pieces, Spans

# Unit roundoff of float64.
ROUNDOFF = 2.0**-53

# A ray that moves less than this many indices along an axis over its whole length is taken as parallel.
PARALLEL = 2.0**-60


@dataclass(frozen=True, eq=False)
class CellGrid:
    """A padded grid as cells, and which of them can be seen.

    corners, strides: as in `sampling.Grid`.
    seen: a flag for each block of 2^`shift` cells a side, (bz, by, bx), with one layer of blocks around; block 1
    begins at padded index 1, the first sample of the volume.
    near: the same for blocks of 2^`near_shift` cells, set where anything at most half a block away from it
    along each axis can be seen.
    """

    corners: tuple[Numbers, ...]
    strides: tuple[int, int]
    seen: Booleans
    shift: int
    near: Booleans
    near_shift: int
    steepest: float


def cells_along(grid: CellGrid, origins: Floats, directions: Floats, spans: Spans) -> Pieces:
    """Return the pieces of rays (3, R) within `spans` whose cells can be seen.

    A piece of world length H about the padded position p has the value f(p + v H d), v from -1/2 to 1/2.
    """
    rays, t_near, t_far = _near_part(grid, origins, directions, spans)
    if len(rays) == 0:
        nothing = np.empty(0)
        return Pieces(rays, nothing, np.empty((4, 0)), nothing, nothing, rays, nothing)
    origins, directions = origins[:, rays], directions[:, rays]
    ray, length, middle = _between_planes(origins, directions, t_near, t_far)
    positions, wholes = _positions(origins, directions, ray, middle)
    chosen = np.flatnonzero(_lookup(grid.seen, wholes, grid.shift))
    ray, length = ray.take(chosen), length.take(chosen)
    fractions, base = [], np.zeros(len(chosen), np.intp)
    for axis, stride in ((0, 1), (1, grid.strides[1]), (2, grid.strides[0])):
        whole = wholes[axis].take(chosen)
        fractions.append(positions[axis].take(chosen) - whole)
        base += whole if stride == 1 else np.multiply(whole, stride, dtype=np.intp)
    strides = [d.take(ray) * length for d in directions]
    cubic, spread = _cubic(grid.corners, base, fractions, strides)
    slack, astray = _slack(
        position_error(grid, origins, directions, t_far), directions, ray, length, cubic, spread
    )
    n = len(ray)
    return Pieces(rays.take(ray), length, cubic, slack, astray, np.full(n, -1, np.intp), np.zeros(n))


def _near_part(
    grid: CellGrid, origins: Floats, directions: Floats, spans: Spans
) -> tuple[Indices, Floats, Floats]:
    """Return the rays that come near anything seen, and the part of each that does: from t to t.

    A ray is sampled so densely that every point of it is within half a block of a sample along each axis.
    """
    block = 1 << grid.near_shift
    fastest = np.abs(directions).max(axis=0)
    length = np.maximum(spans.t_far - spans.t_near, 0.0)
    stride = block / fastest
    count = np.ceil(length / stride)
    most = int(count.max(initial=0.0))
    if most == 0:
        return np.empty(0, np.intp), np.empty(0), np.empty(0)
    number = np.arange(most)
    t = spans.t_near[:, None] + (number + 0.5) * stride[:, None]
    np.minimum(t, spans.t_far[:, None], out=t)
    index = np.zeros(t.shape, np.int32)
    for axis, blocks in zip((2, 1, 0), grid.near.shape, strict=True):
        place = t * (directions[axis] / block)[:, None]
        place += ((origins[axis] - 1.0) / block + 1.0)[:, None]
        index *= blocks
        index += place.astype(np.int32)
    near = grid.near.reshape(-1).take(index, mode="clip")
    near &= number < count[:, None]
    rays = np.flatnonzero(near.any(axis=1))
    near = near[rays]
    stride, start = stride[rays], spans.t_near[rays]
    first = near.argmax(axis=1)
    last = most - near[:, ::-1].argmax(axis=1)
    return rays, start + first * stride, np.minimum(start + last * stride, spans.t_far[rays])


def _between_planes(
    origins: Floats, directions: Floats, t_near: Floats, t_far: Floats
) -> tuple[Indices, Floats, Floats]:
    """Return ray, world length and middle t of the parts of rays between grid planes, in order."""
    parts = [t_near[:, None], t_far[:, None]]
    for o, d in zip(origins, directions, strict=True):
        with np.errstate(divide="ignore"):
            inverse = np.where(np.abs(d) * t_far < PARALLEL, 0.0, 1.0 / d)
        ends = o + t_near * d, o + t_far * d
        first = np.ceil(np.minimum(*ends))
        most = int((np.floor(np.maximum(*ends)) - first).max()) + 1
        if most > 0:
            t = (first - o)[:, None] + np.arange(most)
            t *= inverse[:, None]
            parts.append(t)
    edges = np.concatenate(parts, axis=1)
    np.maximum(edges, t_near[:, None], out=edges)
    np.minimum(edges, t_far[:, None], out=edges)
    edges.sort(axis=1)
    length = np.diff(edges, axis=1)
    ray, piece = np.nonzero(length > 0)
    flat = ray * edges.shape[1] + piece
    length = length[ray, piece]
    return ray, length, edges.reshape(-1).take(flat) + 0.5 * length


def _positions(
    origins: Floats, directions: Floats, ray: Indices, t: Floats
) -> tuple[list[Floats], list[Numbers]]:
    """Return per axis the padded positions at t and their whole parts."""
    positions = [d.take(ray) * t + o.take(ray) for o, d in zip(origins, directions, strict=True)]
    return positions, [position.astype(np.int32) for position in positions]


def _lookup(flags: Booleans, wholes: list[Numbers], shift: int) -> Booleans:
    index = np.zeros(len(wholes[0]), np.int32)
    for axis, blocks in zip((2, 1, 0), flags.shape, strict=True):
        index *= blocks
        index += (wholes[axis] + ((1 << shift) - 1)) >> shift
    return np.asarray(flags.reshape(-1).take(index, mode="clip"))


def _cubic(
    corners: tuple[Numbers, ...], base: Indices, fraction: list[Floats], stride: list[Floats]
) -> tuple[Floats, Floats]:
    """Return the cubic (4, n) of f(fraction + v stride) in the cell at `base`, and the cell's spread (n,).

    f = k0 + kx x + ky y + kz z + kxy x y + kxz x z + kyz y z + kxyz x y z; the spread, the sum of the
    magnitudes of all but k0, bounds each partial derivative and the rounding of f - k0.
    """
    # corner (dz, dy, dx) is number 4 dz + 2 dy + dx
    at = [corner.take(base).astype(np.float64, copy=False) for corner in corners]
    k0 = at[0]
    kx, ky, kz = at[1] - k0, at[2] - k0, at[4] - k0
    kxy, kxz, kyz = at[3] - k0 - kx - ky, at[5] - k0 - kx - kz, at[6] - k0 - ky - kz
    kxyz = at[7] - k0 - kx - ky - kz - kxy - kxz - kyz
    x, y, z = fraction
    dx, dy, dz = stride
    cubic = np.empty((4, len(base)))
    cross_x, cross_y, cross_z = kyz + kxyz * x, kxz + kxyz * y, kxy + kxyz * z
    slope_x = kx + kxy * y + cross_y * z
    slope_y = ky + kxy * x + cross_x * z
    slope_z = kz + kxz * x + cross_x * y
    cubic[0] = k0 + (kx * x + (ky + kxy * x) * y + slope_z * z)
    cubic[1] = slope_x * dx + slope_y * dy + slope_z * dz
    cubic[2] = cross_z * dx * dy + cross_y * dx * dz + cross_x * dy * dz
    cubic[3] = kxyz * dx * dy * dz
    spread = np.abs(kx)
    for k in (ky, kz, kxy, kxz, kyz, kxyz):
        spread += np.abs(k)
    return cubic, spread


def position_error(grid: CellGrid, origins: Floats, directions: Floats, t_far: Floats) -> Floats:
    """Return how far positions along rays (3, R) may be off along each axis, in indices (R,).

    With u the unit roundoff: o was shifted by the padding (u |o|), t d is rounded (u t |d|) and so is the sum,
    which is at most the grid's size n (u n), and neighbouring pieces meet to u t: u (2 t |d| + |o| + n + 4).
    """
    reach = np.abs(origins) + 2 * t_far * np.abs(directions)
    size = max(grid.seen.shape) << grid.shift
    return ROUNDOFF * (reach.max(axis=0) + size + 4)


def _slack(
    error: Floats, directions: Floats, ray: Indices, length: Floats, cubic: Floats, spread: Floats
) -> tuple[Floats, Floats]:
    """Return how far the field may be from the cubic, and the share of the piece that may be astray, (n,) each.

    A position that is off by `error` (R,) moves the value by that times `spread`; within `error` / |d| of the ends
    the ray may already be in the next cell; the arithmetic of the cubic costs 64 u `spread`, and the sum with k0
    one rounding of the result, none in a constant cell.
    """
    moving = np.where(directions == 0, np.inf, np.abs(directions)).min(axis=0)
    astray = np.minimum(2 * (error / moving).take(ray) / length, 1.0)
    arithmetic = np.where(spread > 0, ROUNDOFF * np.abs(cubic[0]), 0.0)
    return (error.take(ray) + 64 * ROUNDOFF) * spread + arithmetic, astray
