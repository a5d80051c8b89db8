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
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from volref.arrays import Floats, Numbers
from volref.scene.volume import Volume
from volref.workspace import Workspace

PAD = 1  # layers added on each side


@dataclass(frozen=True, eq=False)
class Grid:
    """A padded volume, laid out for gathering.

    corners: for each corner (dz, dy, dx) of a cell, in that order, the flat values from that corner on,
    so that one index fetches all eight.  strides (z, y): steps of the flat index; along x it is 1.
    """

    corners: tuple[Numbers, ...]
    strides: tuple[int, int]
    index_type: type[np.signedinteger[Any]]


def padded_grid(volume: Volume) -> Grid:
    """Return the gatherable form of a volume, in its own type (a uint8 volume stays one byte a voxel)."""
    nz, ny, nx = volume.values.shape
    padded = np.empty((nz + 2 * PAD, ny + 2 * PAD, nx + 2 * PAD), volume.values.dtype)
    padded[1:-1, 1:-1, 1:-1] = volume.values
    for axis in range(3):
        planes = np.moveaxis(padded, axis, 0)
        planes[0], planes[-1] = planes[1], planes[-2]
    flat = padded.reshape(-1)
    stride_y, stride_z = padded.shape[2], padded.shape[1] * padded.shape[2]
    corners = tuple(
        flat[dz * stride_z + dy * stride_y + dx :] for dz in (0, 1) for dy in (0, 1) for dx in (0, 1)
    )
    # int32 arithmetic is twice as fast; it holds every index of a grid of fewer than 2^31 samples.
    index_type = np.int32 if flat.size < 2**31 else np.int64
    return Grid(corners, (stride_z, stride_y), index_type)


def trilinear(grid: Grid, position: Floats, work: Workspace) -> Floats:
    """Return the interpolated value at each padded index position (3, n); destroys `position`.

    v = sum over the corners of v_corner times the product of f or 1 - f per axis, evaluated as seven
    a + f (b - a) in float64: exact on constant cells, and off by at most 7 eps max|v| elsewhere.
    The result lies in `work` until the next call.
    """
    n = position.shape[1]
    fraction = position
    base = work.get("base", n, grid.index_type)
    whole = work.get("whole", n, grid.index_type)
    for axis, stride in ((2, None), (1, grid.strides[0] // grid.strides[1]), (0, grid.strides[1])):
        np.copyto(whole, position[axis], casting="unsafe")
        if stride is None:
            np.copyto(base, whole)
        else:
            np.multiply(base, stride, out=base)
            np.add(base, whole, out=base)
        np.subtract(position[axis], whole, out=fraction[axis])
    index = work.get("index", n, np.intp)
    np.copyto(index, base)
    other = work.get("other", n)
    along_x = [_lerp_gathered(grid, k, index, fraction[0], other, work) for k in range(4)]
    for low, high in ((0, 1), (2, 3)):
        _lerp(along_x[low], along_x[high], fraction[1])
    return _lerp(along_x[0], along_x[2], fraction[2])


def _lerp_gathered(
    grid: Grid, pair: int, index: Numbers, fraction: Floats, other: Floats, work: Workspace
) -> Floats:
    """Interpolate along x between corners 2 pair and 2 pair + 1."""
    low = work.get(f"pair {pair}", len(index))
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
