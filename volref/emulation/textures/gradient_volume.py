"""The gradient volume: value and gradient in the four channels of one texture (seed 004).

g is *minus* the gradient per voxel by Sobel's operator over 27: along x, of the weighted sum of f(x - 1) less
that of f(x + 1), with the weights 1 2 1 / 2 4 2 / 1 2 1, 16 in all, so that a ramp of slope s has
g = -32 s / 27 and an edge from 0 to 1 has |g| = 16 / 27 = 0.593.  f is 0..1, as the texture holds it.  A
component lies in a byte as

    zero "half"    round((g + 1) / 2 255), read as 2 c - 1            g = 0 is byte 128, read as +1 / 255
    zero "exact"   round(128 + 127 g),     read as (255 c - 128) / 127   g = 0 is byte 128, read as 0

where round(x) = floor(x + 1/2), as JavaScript has it.  Voxels on the border have g = 0.
"""

import numpy as np

from volref.arrays import Floats, Integers, Numbers
from volref.emulation.groups import Lighting
from volref.emulation.rays.paths import vector_length
from volref.formats import stored
from volref.stages.gradients import cej_kernels, differentiated, sobel_kernels

DIVISOR = 27

# |g| of a field that grows by 1 per voxel.
SOBEL_GAIN = 32 / 27


def has_gradient_volume(lighting: Lighting) -> bool:
    """Tell whether the volume's texture holds gradients."""
    return lighting.gradient in ("sobel-bytes", "sobel-bytes-printed")


def gradient_weights(lighting: Lighting) -> Integers:
    """Return the weights (3, 3, 3, 3) of 27 g over the samples [z, y, x], whole numbers.

    Examples
    --------
    >>> weights = gradient_weights(Lighting(gradient="sobel-bytes-printed"))
    >>> weights[0, 1, 1].tolist(), [int(w.sum()) for w in weights]
    ([4, 0, -4], [0, 0, -1])
    """
    printed = lighting.gradient == "sobel-bytes-printed"
    kernels = DIVISOR * cej_kernels() if printed else -32.0 * sobel_kernels()
    return np.rint(kernels).astype(np.int64)


def with_gradient(values: Numbers, lighting: Lighting, kind: str) -> Numbers:
    """Return texels (D, H, W, 4) of value, gx, gy and gz for those (D, H, W, 1) of the value.

    Bytes give bytes, by whole numbers without rounding errors; floats give floats, in the number format
    `kind`.

    Examples
    --------
    >>> edge = np.zeros((3, 3, 3, 1), np.uint8)
    >>> edge[..., 2:, :] = 255
    >>> with_gradient(edge, Lighting(gradient="sobel-bytes"), "unorm8")[1, 1, 1].tolist()
    [0, 53, 128, 128]
    """
    sums = differentiated(values[..., 0].astype(np.float64), gradient_weights(lighting).astype(np.float64))
    inner = np.zeros(sums.shape[1:], np.bool_)
    inner[1:-1, 1:-1, 1:-1] = True
    sums = np.where(inner, sums, 0.0)
    # Twice the byte that stands for 0, and twice the bytes from there to 1.
    middle, reach = (255, 255) if lighting.zero == "half" else (256, 254)
    if values.dtype == np.uint8:
        whole = 2 * 255 * DIVISOR
        bytes_ = (reach * sums.astype(np.int64) + (middle + 1) * (whole // 2)) // whole
        packed: Numbers = np.clip(bytes_, 0, 255).astype(np.uint8)
    else:
        packed = stored((reach * sums / DIVISOR + middle) / 510, kind)
    return np.concatenate([values, np.moveaxis(packed, 0, -1).astype(values.dtype)], axis=-1)


def unpacked(channels: Floats, lighting: Lighting) -> tuple[Floats, Floats]:
    """Return g (3, n) and its length (n,) for fetched channels (3, n).

    Examples
    --------
    >>> flat = np.full((3, 1), 128 / 255)
    >>> g, length = unpacked(flat, Lighting(zero="half"))
    >>> (g * 255).round(9).ravel().tolist(), unpacked(flat, Lighting(zero="exact"))[1].tolist()
    ([1.0, 1.0, 1.0], [0.0])
    """
    kind = channels.dtype.type
    if lighting.zero == "half":
        g = channels * kind(2) - kind(1)
    else:
        g = (channels * kind(255) - kind(128)) / kind(127)
    return g, vector_length(g)
