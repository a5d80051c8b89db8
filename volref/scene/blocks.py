"""Ranges of values over blocks of a volume, for leaving out what is transparent.

Along each axis a block has a window of samples.  Blocks of 4 cells with a reach of 1 along x:

    sample    0   1   2   3   4   5   6   7   8   9
    block 0   |---------------|                        0 ... 4, and with reach  0 ... 5
    block 1                   |---------------|        4 ... 8, and with reach  3 ... 9

One pass over the voxels makes the ranges of small blocks, and those of larger blocks and of a reach that is
longer by whole blocks are joined from them.  The last few passes are kept as long as the volume lives.
"""

import itertools
import math
from collections.abc import Callable, Iterator
from typing import NamedTuple, Protocol, TypeAlias
from weakref import WeakKeyDictionary

import numpy as np

from volref.arrays import Booleans, Floats, Numbers
from volref.scene.volume import Volume, in_memory_order
from volref.workspace import Workspace

# Cells per side of the blocks that a pass makes, and up to how many voxels it makes the smaller ones.
SMALL, LARGE, MOST_FOR_SMALL = 2, 4, 1 << 23

# Passes that are kept: of a volume of bytes in blocks of 4 each takes 1/32 of the volume.
MOST_KEPT = 4

# About how many bytes of voxels, and blocks, are worked on together.
CHUNK_BYTES, CHUNK_BLOCKS = 1 << 22, 1 << 18

# Lowest and highest sample of each block, (bz, by, bx) each, in the type of the volume.
Ranges: TypeAlias = tuple[Numbers, Numbers]


class Pass(NamedTuple):
    """Which ranges one pass over the voxels makes: of blocks of `block`^3 cells, with a `reach` (z, y, x)."""

    block: int
    reach: tuple[int, int, int]


class Keeper(Protocol):
    """What keeps the ranges of one volume for longer than the volume lives."""

    def read(self, made: Pass) -> Ranges | None:
        """Return the ranges that a pass made before, or None."""

    def write(self, made: Pass, ranges: Ranges) -> None:
        """Keep the ranges that a pass made, if that can be done."""


class _Window(NamedTuple):
    """Along one axis: block b holds `width` samples from b * stride - before on, as far as they exist."""

    stride: int
    before: int
    width: int

    def samples(self, blocks: range, count: int) -> range:
        """Return the samples of some blocks, of `count` that there are."""
        start, last = (b * self.stride - self.before for b in (blocks.start, blocks.stop - 1))
        return range(max(start, 0), min(last + self.width, count))


_KEPT: WeakKeyDictionary[Volume, dict[Pass, Ranges]] = WeakKeyDictionary()
_KEEPERS: WeakKeyDictionary[Volume, Keeper] = WeakKeyDictionary()


def block_ranges(volume: Volume, block: int, reach: tuple[int, int, int]) -> tuple[Floats, Floats]:
    """Return the least and greatest sample around each block of `block`^3 cells, (bz, by, bx) each.

    Block b holds the index points from b * block to (b + 1) * block along each axis.  The range bounds every
    interpolated value at most `reach` (x, y, z) indices away from a point of the block: it is over the
    samples from `reach` below the block to `reach` above its upper end, which is a sample of its last cells.

    Examples
    --------
    >>> volume = Volume(np.arange(8.0).reshape(1, 1, 8))
    >>> low, high = block_ranges(volume, 4, (1, 1, 1))
    >>> low.tolist(), high.tolist()
    ([[[0.0, 3.0]]], [[[5.0, 7.0]]])
    """
    low, high = _stored_ranges(volume, block, reach)
    return low.astype(np.float64), high.astype(np.float64)


def flag_blocks(
    volume: Volume,
    block: int,
    reach: tuple[int, int, int],
    flag: Callable[[Floats, Floats], Booleans],
) -> Booleans:
    """Return what `flag` says of the ranges that `block_ranges` returns, without making all of them float64.

    `flag` takes the least and greatest sample of any number of blocks, (n,) each, and says yes or no to each
    block by its own range alone.  For voxels of one byte it is asked once for each range that there can be.

    Examples
    --------
    >>> volume = Volume(np.arange(8.0).reshape(1, 1, 8))
    >>> flag_blocks(volume, 4, (1, 1, 1), lambda low, high: high > 6).tolist()
    [[[False, True]]]
    """
    low, high = _stored_ranges(volume, block, reach)
    result = np.empty(low.shape, np.bool_)
    flat_low, flat_high, flat = low.reshape(-1), high.reshape(-1), result.reshape(-1)
    answers = _answers(flag, low.dtype) if low.itemsize == 1 and low.size > 1 << 16 else None
    for first in range(0, flat.size, CHUNK_BLOCKS):
        part = slice(first, first + CHUNK_BLOCKS)
        if answers is None:
            flat[part] = flag(flat_low[part].astype(np.float64), flat_high[part].astype(np.float64))
        else:
            code = flat_low[part].view(np.uint8).astype(np.intp) * 256 + flat_high[part].view(np.uint8)
            np.take(answers, code, out=flat[part], mode="clip")
    return result


def keep_ranges(volume: Volume, keeper: Keeper) -> None:
    """Ask `keeper` for the ranges of `volume` before a pass is made, and hand it those that one made."""
    _KEEPERS[volume] = keeper


def _answers(flag: Callable[[Floats, Floats], Booleans], dtype: np.dtype[np.generic]) -> Booleans:
    """Return `flag` of each range of one-byte values, (65536,), at 256 x code of the least + the other."""
    codes = np.arange(256, dtype=np.uint8).view(dtype).astype(np.float64)
    low, high = (values.reshape(-1) for values in np.meshgrid(codes, codes, indexing="ij"))
    answers = np.zeros(1 << 16, np.bool_)
    ordered = low <= high
    answers[ordered] = flag(low[ordered], high[ordered])
    return answers


def _stored_ranges(volume: Volume, block: int, reach: tuple[int, int, int]) -> Ranges:
    """Return the ranges in the type of the volume: joined from those of smaller blocks."""
    sizes = (SMALL, LARGE) if volume.values.size <= MOST_FOR_SMALL else (LARGE,)
    size = next((size for size in sizes if block % size == 0), block)
    reach_zyx = reach[2], reach[1], reach[0]
    made = Pass(size, (reach_zyx[0] % size, reach_zyx[1] % size, reach_zyx[2] % size))
    ranges = _passed(volume, made)
    # Sample b * block - reach is the first of one of the smaller blocks.
    before = [(far - near) // size for far, near in zip(reach_zyx, made.reach, strict=True)]
    stride = block // size
    windows = [_Window(stride, count, stride + 2 * count) for count in before]
    return ranges if all(window == (1, 0, 1) for window in windows) else _reduced(ranges, windows)


def _passed(volume: Volume, made: Pass) -> Ranges:
    kept = _KEPT.setdefault(volume, {})
    if made in kept:
        return kept[made]
    keeper = _KEEPERS.get(volume)
    ranges = keeper.read(made) if keeper else None
    if ranges is None:
        windows = [_Window(made.block, reach, made.block + 2 * reach + 1) for reach in made.reach]
        ranges = _reduced((volume.values, volume.values), windows)
        if keeper:
            keeper.write(made, ranges)
    while len(kept) >= MOST_KEPT:
        kept.pop(next(iter(kept)), None)
    kept[made] = ranges
    return ranges


def _reduced(ranges: Ranges, windows: list[_Window]) -> Ranges:
    """Return the least of the first and the greatest of the second array over each block's windows."""
    axes = in_memory_order(ranges[0])
    low, high = (values.transpose(axes) for values in ranges)
    windows = [windows[axis] for axis in axes]
    shape = [-(-n // window.stride) for n, window in zip(low.shape, windows, strict=True)]
    least, greatest = np.empty(shape, low.dtype), np.empty(shape, high.dtype)
    work = Workspace()
    for part in _chunks(shape, math.prod(window.stride for window in windows) * low.itemsize):
        _reduce(np.minimum, low, windows, part, least, work)
        _reduce(np.maximum, high, windows, part, greatest, work)
    back = np.argsort(axes)
    return least.transpose(back), greatest.transpose(back)


def _chunks(shape: list[int], block_bytes: int) -> Iterator[tuple[range, ...]]:
    """Return boxes of blocks with about `CHUNK_BYTES` of voxels each, in the order of memory."""
    blocks = max(1, CHUNK_BYTES // block_bytes)
    along_x = min(blocks, shape[2])
    along_y = min(max(1, blocks // along_x), shape[1])
    along_z = max(1, blocks // (along_x * along_y))
    steps = zip(shape, (along_z, along_y, along_x), strict=True)
    return itertools.product(*([range(k, min(k + step, n)) for k in range(0, n, step)] for n, step in steps))


def _reduce(
    ufunc: np.ufunc,
    values: Numbers,
    windows: list[_Window],
    part: tuple[range, ...],
    out: Numbers,
    work: Workspace,
) -> None:
    """Write the blocks of `part` to `out`: reduced along z, then along y, and what is left along x."""
    near_z, near_y, near_x = part
    rows, columns = (windows[axis].samples(part[axis], values.shape[axis]) for axis in (1, 2))
    box = values[:, rows.start : rows.stop, columns.start : columns.stop]
    planes = _buffer(work, "planes", (len(near_z), len(rows), len(columns)), values.dtype)
    _join(ufunc, box, windows[0], near_z, 0, planes)
    stride, before, width = windows[2]
    lines = _buffer(
        work, "lines", (len(near_z), len(near_y), (len(near_x) - 1) * stride + width), values.dtype
    )
    missing = columns.start - near_x.start * stride + before
    there = lines[..., missing : missing + len(columns)]
    _join(ufunc, planes.swapaxes(0, 1), windows[1], near_y, rows.start, there.swapaxes(0, 1))
    lines[..., :missing], lines[..., missing + len(columns) :] = there[..., :1], there[..., -1:]
    target = out[tuple(slice(blocks.start, blocks.stop) for blocks in part)]
    np.copyto(target, _join_neighbours(ufunc, lines, width, work)[..., ::stride])


def _join(ufunc: np.ufunc, values: Numbers, window: _Window, blocks: range, start: int, out: Numbers) -> None:
    """Reduce `values`, of which the first is sample `start`, along their first axis to one for each block."""
    stride, before, width = window
    first = blocks.start * stride - start
    np.copyto(out, values[first : first + (len(blocks) - 1) * stride + 1 : stride])
    for sample in range(first - before, first - before + width):
        # Blocks whose window has this sample; beyond the ends there is none.
        low = max(0, -(sample // stride))
        high = min(len(blocks), -((sample - len(values)) // stride))
        if sample != first and low < high:
            layers = values[sample + low * stride : sample + (high - 1) * stride + 1 : stride]
            ufunc(out[low:high], layers, out=out[low:high])


def _join_neighbours(ufunc: np.ufunc, lines: Numbers, width: int, work: Workspace) -> Numbers:
    """Return lines whose element k is reduced from elements k to k + width - 1.

    Twice as many at each turn: whole lines are faster than every fourth element of them.
    """
    joined = 1
    while joined < width:
        step = min(joined, width - joined)
        shape = (*lines.shape[:2], lines.shape[2] - step)
        out = _buffer(work, f"joined {joined}", shape, lines.dtype)
        lines = ufunc(lines[..., :-step], lines[..., step:], out=out)
        joined += step
    return lines


def _buffer(work: Workspace, name: str, shape: tuple[int, ...], dtype: np.dtype[np.generic]) -> Numbers:
    return work.get(name, math.prod(shape), dtype).reshape(shape)
