"""Ranges of values over blocks of a volume, for leaving out what is transparent."""

import numpy as np

from volref.arrays import Floats, Numbers
from volref.scene.volume import Volume


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
    low = high = volume.values
    for axis, reach_of_axis in ((0, reach[2]), (1, reach[1]), (2, reach[0])):
        low = _reduce(np.minimum, low, axis, block, reach_of_axis)
        high = _reduce(np.maximum, high, axis, block, reach_of_axis)
    return low.astype(np.float64), high.astype(np.float64)


def _reduce(ufunc: np.ufunc, values: Numbers, axis: int, block: int, reach: int) -> Numbers:
    samples = values.shape[axis]
    first = np.arange(-(-samples // block)) * block
    result: Numbers | None = None
    for offset in range(-reach, block + reach + 1):
        layer = np.take(values, np.clip(first + offset, 0, samples - 1), axis=axis)
        result = layer if result is None else ufunc(result, layer, out=result)
    assert result is not None
    return result
