"""Pictures of render targets for people; the exact numbers are what .npy files are for."""

import math

import numpy as np

from volref.arrays import Bytes, Floats
from volref.formats import codes_of

# Distances from here on stand for nothing: what programs clear a target to, or +inf.
NOTHING = 1e9


def target_picture(target: Floats) -> Bytes:
    """Return a target (H, W, 1 to 4), or a volume (D, H, W, 4) as its slices side by side, as codes.

    Numbers in 0..1 are shown as the bytes of such a target are, packed ones too.  Others are scaled to what
    there is: the least number that is not 0 is black, the greatest white; what stands for nothing plays no
    part in that.

    Examples
    --------
    >>> target_picture(np.array([[[0.5], [1.0]]])).tolist()
    [[128, 255]]
    >>> target_picture(np.array([[[10.0], [20.0], [0.0], [np.inf]]])).tolist()
    [[0, 255, 0, 255]]
    """
    if target.ndim == 4:
        # Value, and below it the gradient, whose channels are colours.
        value, gradient = mosaic(target[..., :1]), mosaic(target[..., 1:4])
        return _codes(np.concatenate([value.repeat(3, axis=-1), gradient]))
    return _codes(target[..., 0] if target.shape[-1] == 1 else target)


def mosaic(slices: Floats) -> Floats:
    """Return slices (D, H, W, C) side by side, as square as can be, the first at the top left.

    Examples
    --------
    >>> mosaic(np.arange(3.0).reshape(3, 1, 1, 1))[..., 0].tolist()
    [[0.0, 1.0], [2.0, 0.0]]
    """
    count, height, width, channels = slices.shape
    across = math.isqrt(count - 1) + 1
    down = -(-count // across)
    grid = np.zeros((down * across, height, width, channels), slices.dtype)
    grid[:count] = slices
    return (
        grid.reshape(down, across, height, width, channels)
        .swapaxes(1, 2)
        .reshape(down * height, across * width, channels)
    )


def _codes(numbers: Floats) -> Bytes:
    if numbers.shape[-1] == 2 and numbers.ndim == 3:
        numbers = np.concatenate([numbers, np.zeros_like(numbers[..., :1])], axis=-1)
    if ((numbers >= 0) & (numbers <= 1)).all():
        return codes_of(numbers)
    with np.errstate(invalid="ignore"):
        seen = numbers[(np.abs(numbers) < NOTHING) & (numbers != 0)]
    low, high = (seen.min(), seen.max()) if seen.size else (0.0, 1.0)
    return codes_of(np.clip((numbers - low) / max(high - low, 1e-300), 0.0, 1.0))
