"""Stage 3: the value of the field at points, by trilinear interpolation.

n points; positions are (3, n) in padded index space, all else (n,).

The field is padded by one layer that repeats its border, so that sample i of the volume is sample i + 1
of the grid.  That layer is the clamp of a GPU texture: a "cell" volume reaches half a voxel beyond its
outer centres and stays constant there.  Along x, with 3 samples a b c:

    index            -0.5   0     1     2   2.5
    padded index      0.5   1     2     3   3.5
    grid        a     |     a     b     c    |     c
                ^ 0                                ^ 4

A point on the far face needs no special case either: index 2.5 lies between grid samples 3 and 4.

A large memory-mapped volume is not copied for that: its grid is bare, and positions are held to its outer
samples instead, which is the same field at the cost of a few more passes.
"""

from dataclasses import dataclass
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from volref.arrays import Floats, Indices, Numbers
from volref.scene.volume import Volume, in_memory_order, mapped_file
from volref.workspace import Workspace

PAD = 1  # layers added on each side

# A memory-mapped volume of more samples than this is left where it is.
MOST_COPIED = 1 << 26

# A grid of at most this many bytes is kept in the type that it is computed in, and for the next image.
MOST_KEPT = 1 << 26

_kept: WeakKeyDictionary[Volume, dict[np.dtype[Any], "Grid"]] = WeakKeyDictionary()


@dataclass(frozen=True, eq=False)
class Grid:
    """A volume laid out for gathering.

    corners: for each corner (dz, dy, dx) of a cell, in that order, the flat values from that corner on,
    so that one index fetches all eight.  strides (z, y, x): steps of the flat index.  last (x, y, z): where
    the grid is bare, the index of the last sample along each axis; None: it is padded.
    """

    corners: tuple[Numbers, ...]
    strides: tuple[int, int, int]
    index_type: type[np.signedinteger[Any]]
    last: tuple[int, int, int] | None = None


def grid_of(volume: Volume, dtype: np.typing.DTypeLike = np.float64) -> Grid:
    """Return the gatherable form of a volume, for values wanted in `dtype`.

    It is padded and in `dtype` if that is small, else in the volume's own type (a uint8 volume stays one byte
    a voxel), and bare if the volume is large and memory-mapped.
    """
    wanted: np.dtype[Any] = np.dtype(dtype)
    kept = _kept.setdefault(volume, {})
    if wanted not in kept:
        if volume.values.size > MOST_COPIED and mapped_file(volume.values) is not None:
            return bare_grid(volume)
        small = volume.values.size * wanted.itemsize <= MOST_KEPT
        grid = padded_grid(volume, wanted if small else None)
        if not small:
            return grid
        kept[wanted] = grid
    return kept[wanted]


def padded_grid(volume: Volume, dtype: np.dtype[Any] | None = None) -> Grid:
    """Return a padded copy of a volume for gathering, in `dtype` or its own type."""
    return padded_samples(volume.values, dtype)


def padded_samples(values: Numbers, dtype: np.dtype[Any] | None = None) -> Grid:
    """Return a padded copy of samples (nz, ny, nx) for gathering, in `dtype` or their own type."""
    nz, ny, nx = values.shape
    padded = np.empty((nz + 2 * PAD, ny + 2 * PAD, nx + 2 * PAD), dtype or values.dtype)
    padded[1:-1, 1:-1, 1:-1] = values
    for axis in range(3):
        planes = np.moveaxis(padded, axis, 0)
        planes[0], planes[-1] = planes[1], planes[-2]
    return _grid(padded.reshape(-1), (padded.shape[1] * padded.shape[2], padded.shape[2], 1), None)


def bare_grid(volume: Volume) -> Grid:
    """Return a volume itself for gathering; its samples lie one after the other, in any order of the axes."""
    values = volume.values
    flat = values.transpose(in_memory_order(values)).reshape(-1)
    z, y, x = (stride // values.itemsize for stride in values.strides)
    return _grid(flat, (z, y, x), (values.shape[2] - 1, values.shape[1] - 1, values.shape[0] - 1))


def _grid(flat: Numbers, strides: tuple[int, int, int], last: tuple[int, int, int] | None) -> Grid:
    z, y, x = strides
    corners = tuple(
        flat[min(dz * z + dy * y + dx * x, flat.size - 1) :]
        for dz in (0, 1)
        for dy in (0, 1)
        for dx in (0, 1)
    )
    # int32 arithmetic is twice as fast; it holds every index of a grid of fewer than 2^31 samples.
    return Grid(corners, strides, np.int32 if flat.size < 2**31 else np.int64, last)


def trilinear(grid: Grid, position: Floats, work: Workspace, corner: Indices | None = None) -> Floats:
    """Return the interpolated value at each padded index position (3, n), in its type; destroys `position`.

    With `corner` (3, b), whole numbers, the positions are counted from there: n = S b of them, S rows of one
    for each corner.  Small numbers have more digits left after the point, which float32 needs.

    v = sum over the corners of v_corner times the product of f or 1 - f per axis, evaluated as seven
    a + f (b - a): exact on constant cells, and off by at most 7 eps max|v| elsewhere.
    The result lies in `work` until the next call.
    """
    n, dtype = position.shape[1], position.dtype
    base, whole = (work.get(name, n, grid.index_type) for name in ("base", "whole"))
    floor = work.get("floor", n, dtype)
    if corner is None:
        corner = np.zeros((3, 1), np.intp)
    for axis in (2, 1, 0):
        fraction = position[axis]
        if grid.last is not None:
            _hold(fraction.reshape(-1, corner.shape[1]), grid.last[axis], corner[axis])
        np.copyto(whole, fraction, casting="unsafe")
        np.copyto(floor, whole)
        np.subtract(fraction, floor, out=fraction)
        stride = grid.strides[2 - axis]
        if stride != 1:
            np.multiply(whole, stride, out=whole)
        if axis == 2:
            np.copyto(base, whole)
        else:
            np.add(base, whole, out=base)
    if corner.any():
        x, y, z = corner.astype(grid.index_type, copy=False)
        first = (z * grid.strides[0] + y * grid.strides[1]) + x * grid.strides[2]
        np.add(base.reshape(-1, len(first)), first, out=base.reshape(-1, len(first)))
    index = work.get("index", n, np.intp)
    np.copyto(index, base)
    other = work.get("other", n, dtype)
    along_x = [_lerp_gathered(grid, k, index, position[0], other, work) for k in range(4)]
    for low, high in ((0, 1), (2, 3)):
        _lerp(along_x[low], along_x[high], position[1])
    return _lerp(along_x[0], along_x[2], position[2])


def _hold(position: Floats, last: int, corner: Indices) -> None:
    """Bring padded positions (S, b) to those of a bare grid, held to its outer samples, in place.

    On the last sample the fraction is 0, so that it does not matter which number is found beyond it.
    """
    low, high = (np.asarray(end - corner, position.dtype) for end in (0, last))
    np.subtract(position, position.dtype.type(PAD), out=position)
    np.maximum(position, low, out=position)
    np.minimum(position, high, out=position)


def cell_corners(grid: Grid, wholes: list[Numbers]) -> list[Floats]:
    """Return the eight samples (n,) of cells of padded indices `wholes` along x, y and z, as float64."""
    if grid.last is None:
        base = np.zeros(len(wholes[0]), np.intp)
        for whole, stride in zip(wholes, grid.strides[::-1], strict=True):
            base += whole if stride == 1 else np.multiply(whole, stride, dtype=np.intp)
        return [corner.take(base).astype(np.float64, copy=False) for corner in grid.corners]
    sides: list[tuple[Indices, Indices]] = []
    for whole, stride, last in zip(wholes, grid.strides[::-1], grid.last, strict=True):
        low, high = (np.clip(whole - PAD + side, 0, last).astype(np.intp) * stride for side in (0, 1))
        sides.append((low, high))
    flat = grid.corners[0]
    return [
        flat.take(sides[2][dz] + sides[1][dy] + sides[0][dx]).astype(np.float64, copy=False)
        for dz in (0, 1)
        for dy in (0, 1)
        for dx in (0, 1)
    ]


def _lerp_gathered(
    grid: Grid, pair: int, index: Numbers, fraction: Floats, other: Floats, work: Workspace
) -> Floats:
    """Interpolate along x between corners 2 pair and 2 pair + 1."""
    low = work.get(f"pair {pair}", len(index), fraction.dtype)
    _gather(grid.corners[2 * pair], index, low, work)
    _gather(grid.corners[2 * pair + 1], index, other, work)
    return _lerp(low, other, fraction)


def _gather(values: Numbers, index: Numbers, out: Floats, work: Workspace) -> None:
    # mode="wrap" writes straight into `out`; "raise" would go through a buffer.
    if values.dtype == out.dtype:
        np.take(values, index, out=out, mode="wrap")
    else:
        narrow = work.get("narrow", len(index), values.dtype)
        np.take(values, index, out=narrow, mode="wrap")
        np.copyto(out, narrow, casting="unsafe")


def _lerp(low: Floats, high: Floats, fraction: Floats) -> Floats:
    """Overwrite `low` with low + fraction (high - low), and `high` with scratch."""
    np.subtract(high, low, out=high)
    np.multiply(high, fraction, out=high)
    np.add(low, high, out=low)
    return low
