"""A number 0..1 in the four bytes of an RGBA8 target, and back (Arbelaz et al. 2016, packFloat, unpackFloat).

The digits of v to the base 256 are red (the last) to alpha (the first): v = a + b / 256 + g / 256^2 +
r / 256^3 with a, b and g whole 256ths.  A target holds 255ths.  "printed" stores k / 256 as it is, which
becomes rint(255 k / 256) / 255; "working" stores k / 255 and takes it back.  The paper's
`res -= res.xyz * bitMsk` does not compile; `res.xxyz` is what it was copied from.  All numbers are in the
control type of the device.
"""

import numpy as np

from volref.arrays import Floats

# 256^3, 256^2, 256, 1, and what each digit is less than by the one before it.
SHIFTS = tuple(256.0**power for power in (3, 2, 1, 0))
MASK = (0.0, 1 / 256, 1 / 256, 1 / 256)


def packed(value: Floats, packing: str) -> Floats:
    """Return numbers (n,) as the colours (n, 4) that a fragment writes; "exact" ones as they are, (n, 1).

    Examples
    --------
    1/2 is the digit 128, which the printed form stores as rint(127.5) = 128 of 255:

    >>> packed(np.array([0.5]), "printed").tolist()
    [[0.0, 0.0, 0.0, 0.5]]
    >>> (packed(np.array([0.5]), "working") * 255).tolist()
    [[0.0, 0.0, 0.0, 128.0]]
    """
    if packing == "exact":
        return value[:, None]
    kind = value.dtype.type
    shifted = value[:, None] * np.array(SHIFTS, kind)
    digits = shifted - np.floor(shifted)
    digits = digits - digits[:, [0, 0, 1, 2]] * np.array(MASK, kind)
    return np.asarray(digits if packing == "printed" else digits * kind(256 / 255))


def unpacked(color: Floats, packing: str) -> Floats:
    """Return the numbers (n,) in fetched colours (n, 4); dot(color, 1 / shifts) from left to right.

    Examples
    --------
    >>> unpacked(np.array([[0.0, 0.0, 0.0, 128 / 255]]), "working").tolist()
    [0.5]
    """
    if packing == "exact":
        return color[:, 0]
    kind = color.dtype.type
    if packing == "working":
        color = color * kind(255 / 256)
    red, green, blue, alpha = (color[:, k] * kind(1 / shift) for k, shift in enumerate(SHIFTS))
    return np.asarray(red + green + blue + alpha)
