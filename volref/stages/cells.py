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

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from volref.arrays import Booleans, Floats, Indices, Numbers
from volref.records import Pieces, Spans

# Unit roundoff of float64.
ROUNDOFF = 2.0**-53

# Roundings of the arithmetic of a cubic, of at most the differences of a cell's samples each: 3 of size 1 in
# the first differences, 5 each in the second and 35 in the third, and 14 in putting them together.
ARITHMETIC = 70

# Splits a float64 into two halves of 26 bits.
SPLITTER = 2.0**27 + 1

# A ray that moves less than this many indices along an axis over its whole length is taken as parallel.
PARALLEL = 2.0**-60


@dataclass(frozen=True, eq=False)
class CellGrid:
    """A padded grid as cells, and which of them can be seen.

    samples: the eight samples of cells whose padded indices along x, y and z are given, x fastest.
    seen: a flag for each block of 2^`shift` cells a side, (bz, by, bx), with one layer of blocks around;
    block 1 begins at padded index 1, the first sample of the volume. near: the same for blocks of
    2^`near_shift` cells, set where anything at most half a block away from it along each axis can be seen.
    """

    samples: Callable[[list[Numbers]], list[Floats]]
    seen: Numbers
    shift: int
    near: Numbers
    near_shift: int
    steepest: float


def cells_along(
    grid: CellGrid, origins: Floats, rests: Floats, directions: Floats, spans: Spans, *, precise: bool
) -> Pieces:
    """Return the pieces of rays (3, R) within `spans` whose cells can be seen.

    A piece of world length H about the padded position p has the value f(p + v H d), v from -1/2 to 1/2.
    rests (3, R) is what rounding took off the origins.  `precise` asks for a tight bound on the error, at
    some cost.
    """
    return placed_cells(grid, origins, rests, directions, spans, precise=precise)[0]


def placed_cells(
    grid: CellGrid,
    origins: Floats,
    rests: Floats,
    directions: Floats,
    spans: Spans,
    *,
    precise: bool,
    beaten: Floats | None = None,
) -> tuple[Pieces, Floats]:
    """Return the pieces as `cells_along` does, and t in the middle of each (n,).

    With `beaten` (R,) those count as seen whose number in `seen` and `near` is greater than their ray's.
    """
    rays, t_near, t_far = _near_part(grid, origins, directions, spans, beaten)
    if len(rays) == 0:
        nothing = np.empty(0)
        return Pieces(rays, nothing, np.empty((4, 0)), nothing, nothing, rays, nothing), nothing
    error = position_error(grid, origins, directions, spans)[rays]
    origins, directions, rests = origins[:, rays], directions[:, rays], rests[:, rays]
    ray, length, middle = _between_planes(origins, directions, t_near, t_far)
    direction = [d.take(ray) for d in directions]
    positions = [d * middle + o.take(ray) for o, d in zip(origins, direction, strict=True)]
    wholes = [position.astype(np.int32) for position in positions]
    seen = _of_blocks(grid.seen, wholes, grid.shift)
    if beaten is not None:
        seen = seen > beaten.take(rays).take(ray)
    chosen = np.flatnonzero(seen)
    ray, length = ray.take(chosen), length.take(chosen)
    wholes = [whole.take(chosen) for whole in wholes]
    fractions = [position.take(chosen) - whole for position, whole in zip(positions, wholes, strict=True)]
    strides = [d.take(chosen) * length for d in direction]
    cubic, moved, size = _cubic(grid.samples(wholes), fractions, strides, precise=precise)
    slack = error.take(ray) * moved + (ARITHMETIC * ROUNDOFF) * size
    slack += np.where(size > 0, ROUNDOFF * np.abs(cubic[0]), 0.0)
    slowest = np.where(directions == 0, np.inf, np.abs(directions)).min(axis=0)
    with np.errstate(over="ignore"):
        share = 2 * error / slowest
    # A ray along a plane is astray throughout if rounding has put it there.
    on_plane = (directions == 0) & (rests != 0) & (np.abs(origins - np.rint(origins)) <= error)
    share[on_plane.any(axis=0)] = np.inf
    astray = np.minimum(share.take(ray) / length, 1.0)
    n = len(ray)
    row = np.full(n, -1, np.intp)
    return Pieces(rays.take(ray), length, cubic, slack, astray, row, np.zeros(n)), middle.take(chosen)


def position_error(grid: CellGrid, origins: Floats, directions: Floats, spans: Spans) -> Floats:
    """Return how far positions along rays (3, R) may be off along each axis, in indices (R,).

    With u the unit roundoff: o is rounded (u |o|), t d is (u t |d|) and so is the sum, which is at most the
    grid's size n (u n), and neighbouring pieces meet to u t: u (2 t |d| + |o| + n + 4).  Within twice this
    from the end of a piece along each axis the ray may be in the next cell: it is astray.
    """
    furthest = np.maximum(np.abs(spans.t_near), np.abs(spans.t_far))
    reach = np.abs(origins) + 2 * furthest * np.abs(directions)
    size = max(grid.seen.shape) << grid.shift
    return np.asarray(ROUNDOFF * (reach.max(axis=0) + size + 4))


def recentred(
    origins: Floats, directions: Floats, spans: Spans, shift: float
) -> tuple[Floats, Floats, Spans]:
    """Return origins (3, R) in the middle of each span plus `shift`, their rests, and the spans.

    The rests are what rounding took off the origins.

    A ray that starts far away loses digits in o + t d at each of its pieces; moved once, with the sums and
    the product kept to twice the digits (Dekker 1971; Knuth 1969), it loses half an ulp of the new origin.
    """
    inside = spans.t_far > spans.t_near
    t_near, t_far = (np.where(inside, t, 0.0) for t in (spans.t_near, spans.t_far))
    middle = 0.5 * (t_near + t_far)
    product = directions * middle
    moved, rest = _two_sum(origins, product)
    rest = rest + _product_error(directions, middle, product)
    moved, more = _two_sum(moved, np.full_like(moved, shift))
    moved, rest = _two_sum(moved, rest + more)
    return moved, rest, Spans(t_near - middle, t_far - middle)


def sharp_values(
    grid: CellGrid, rays: tuple[Floats, Floats, Floats], t: Floats, error: Floats, at_end: Booleans
) -> Floats:
    """Return the values (n,) at t (n,) of rays (origins, rests and directions, (3, n) each) to some ulp.

    Positions o + t d are kept to twice the digits.  Where a piece ends, `at_end` (n,), t is corrected for the
    plane of whole or half indices that lies nearest, if that is within `error` (n,).
    """
    origins, rests, directions = rays
    product = directions * t
    place, lost = _two_sum(origins, product)
    lost += rests + _product_error(directions, np.broadcast_to(t, product.shape), product)
    plane = 0.5 * np.rint(2 * place)
    beyond = np.where(directions == 0, np.inf, (place - plane) + lost)
    axis = np.abs(beyond).argmin(axis=0)[None]
    by = np.take_along_axis(beyond, axis, axis=0)[0]
    snap = at_end & (np.abs(by) <= error)
    with np.errstate(divide="ignore", invalid="ignore"):
        shift = np.where(snap, -by / np.take_along_axis(directions, axis, axis=0)[0], 0.0)
    lost += directions * shift
    whole = np.floor(place)
    fraction = (place - whole) + lost
    exact = np.take_along_axis(plane - whole, axis, axis=0)[0]
    kept = np.take_along_axis(fraction, axis, axis=0)[0]
    np.put_along_axis(fraction, axis, np.where(snap, exact, kept)[None], axis=0)
    values = grid.samples([w.astype(np.int32) for w in whole])
    for f in fraction:
        values = [(1 - f) * a + f * b for a, b in zip(values[::2], values[1::2], strict=True)]
    return values[0]


def _two_sum(a: Floats, b: Floats) -> tuple[Floats, Floats]:
    """Return a + b rounded, and what rounding took off it, exactly."""
    total = a + b
    virtual = total - a
    return total, (a - (total - virtual)) + (b - virtual)


def _product_error(a: Floats, b: Floats, product: Floats) -> Floats:
    """Return a b - product exactly, for the rounded product, by splitting each into halves of 26 bits."""
    with np.errstate(over="ignore", invalid="ignore"):
        a_high, b_high = (x * SPLITTER - (x * SPLITTER - x) for x in (a, b))
        a_low, b_low = a - a_high, b - b_high
        rest = ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low
    return np.where(np.isfinite(rest), rest, 0.0)


def _near_part(
    grid: CellGrid, origins: Floats, directions: Floats, spans: Spans, beaten: Floats | None = None
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
    if beaten is not None:
        near = near > beaten[:, None]
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
    furthest = np.maximum(np.abs(t_near), np.abs(t_far))
    for o, d in zip(origins, directions, strict=True):
        with np.errstate(divide="ignore", over="ignore"):
            inverse = np.where(np.abs(d) * furthest < PARALLEL, 0.0, 1.0 / d)
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
    flat = np.flatnonzero(length > 0)
    counts = np.count_nonzero(length > 0, axis=1)
    ray = np.repeat(np.arange(len(counts)), counts)
    length = length.reshape(-1).take(flat)
    flat += ray  # edges have one column more
    return ray, length, edges.reshape(-1).take(flat) + 0.5 * length


def _of_blocks(values: Numbers, wholes: list[Numbers], shift: int) -> Numbers:
    """Return the value (n,) of the block of each cell, of `values` laid out as `CellGrid.seen`."""
    index = np.zeros(len(wholes[0]), np.int32)
    for axis, blocks in zip((2, 1, 0), values.shape, strict=True):
        index *= blocks
        index += (wholes[axis] + ((1 << shift) - 1)) >> shift
    return np.asarray(values.reshape(-1).take(index, mode="clip"))


def _cubic(
    at: list[Floats], fraction: list[Floats], stride: list[Floats], *, precise: bool
) -> tuple[Floats, Floats, Floats]:
    """Return the cubic (4, n) of f(fraction + v stride) in cells of corners `at`, and two sizes (n,).

    f = k0 + kx x + ky y + kz z + kxy x y + kxz x z + kyz y z + kxyz x y z.  The first size bounds the sum of
    the partial derivatives on the piece, the second the differences of the cell's samples.
    """
    # corner (dz, dy, dx) is number 4 dz + 2 dy + dx
    k0 = at[0]
    kx, ky, kz = at[1] - k0, at[2] - k0, at[4] - k0
    kxy, kxz, kyz = at[3] - k0 - kx - ky, at[5] - k0 - kx - kz, at[6] - k0 - ky - kz
    kxyz = at[7] - k0 - kx - ky - kz - kxy - kxz - kyz
    x, y, z = fraction
    dx, dy, dz = stride
    cubic = np.empty((4, len(k0)))
    cross_x, cross_y, cross_z = kyz + kxyz * x, kxz + kxyz * y, kxy + kxyz * z
    slope_x = kx + kxy * y + cross_y * z
    slope_y = ky + kxy * x + cross_x * z
    slope_z = kz + kxz * x + cross_x * y
    cubic[0] = k0 + (kx * x + (ky + kxy * x) * y + slope_z * z)
    cubic[1] = slope_x * dx + slope_y * dy + slope_z * dz
    turn_x, turn_y, turn_z = (
        cross_z * dy + cross_y * dz,
        cross_z * dx + cross_x * dz,
        cross_y * dx + cross_x * dy,
    )
    cubic[2] = 0.5 * (turn_x * dx + turn_y * dy + turn_z * dz)
    cubic[3] = kxyz * dx * dy * dz
    if not precise:
        mixed = np.abs(kxy)
        mixed += np.abs(kxz)
        mixed += np.abs(kyz)
        mixed *= 2  # each is part of two derivatives, and the last of three
        mixed += 3 * np.abs(kxyz)
        for k in (kx, ky, kz):
            mixed += np.abs(k)
        return cubic, mixed, mixed
    moved = np.abs(slope_x) + np.abs(slope_y) + np.abs(slope_z)
    moved += 0.5 * (np.abs(turn_x) + np.abs(turn_y) + np.abs(turn_z))
    moved += 0.25 * np.abs(kxyz) * (np.abs(dx * dy) + np.abs(dx * dz) + np.abs(dy * dz))
    low, high = at[0], at[0]
    for corner in at[1:]:
        low, high = np.minimum(low, corner), np.maximum(high, corner)
    return cubic, moved, high - low
