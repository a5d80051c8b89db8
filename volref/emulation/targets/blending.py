"""How a fragment meets what a target already holds: blend states, in floating point and in whole numbers.

F fragments; colours are (F, 4), floats or codes 0..255.
"""

import numpy as np

from volref.arrays import Bytes, Floats, Integers

# Blend states whose fragment replaces what is there: the shader itself has seen to the background, or none.
REPLACING = ("none", "environment", "shader", "shader-straight")


def blended(source: Floats, behind: Floats, blend: str) -> Floats:
    """Return what a blend state makes of fragments (F, 4) and what is behind them (F, 4).

    Examples
    --------
    >>> half, red = np.array([[0.5, 0.5, 0.5, 0.5]]), np.array([[1.0, 0.0, 0.0, 1.0]])
    >>> blended(half, red, "premultiplied").tolist(), blended(half, red, "straight").tolist()
    ([[1.0, 0.5, 0.5, 1.0]], [[0.75, 0.25, 0.25, 0.75]])
    """
    alpha = source[:, 3:]
    if blend in REPLACING:
        return source
    if blend == "premultiplied":
        return np.asarray(source + (1 - alpha) * behind)
    mixed = source * alpha + (1 - alpha) * behind
    if blend == "additive-alpha":
        mixed[:, 3] = source[:, 3] + behind[:, 3]
    return np.asarray(mixed)


def blended_codes(source: Bytes, behind: Bytes, blend: str) -> Bytes:
    """Return the same of codes as Mesa computes it: the fragment is stored first, and so is each product.

    Examples
    --------
    >>> over, under = np.array([[100, 0, 0, 128]], np.uint8), np.array([[51, 0, 0, 255]], np.uint8)
    >>> blended_codes(over, under, "straight").tolist(), blended_codes(over, under, "premultiplied").tolist()
    ([[75, 0, 0, 191]], [[125, 0, 0, 255]])
    """
    if blend in REPLACING:
        return source
    one, two = source.astype(np.int64), behind.astype(np.int64)
    alpha = one[:, 3:]
    front = one if blend == "premultiplied" else _product(one, alpha)
    back = _product(two, 255 - alpha)
    if blend == "additive-alpha":
        front[:, 3], back[:, 3] = one[:, 3], two[:, 3]
    return np.asarray(np.minimum(front + back, 255), np.uint8)


def _product(one: Integers, other: Integers) -> Integers:
    """Return one x other / 255, rounded as Mesa does: now and then one less than the nearest."""
    product = one * other
    return np.asarray((product + (product >> 8) + 128) >> 8)
