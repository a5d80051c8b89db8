"""What a number becomes by being stored in a texture or a render target, and read back.

A number that is stored passes through float32 first: that is what a shader has in hand.  "unorm8" and
"unorm16" hold k / (2^bits - 1) for whole k; "half" and "float" are IEEE 754's; "exact" loses nothing.
The sRGB curve is in `volref.image`.
"""

import numpy as np

from volref.arrays import Floats, Numbers

KINDS = ("unorm8", "unorm16", "half", "float", "exact")

_BITS = {"unorm8": 8, "unorm16": 16}
_CODES: dict[int, type[np.unsignedinteger]] = {8: np.uint8, 16: np.uint16}


def stored(values: Floats, kind: str, *, nan: float = 0.0) -> Floats:
    """Return what is read back of `values`, any shape, stored as one of `KINDS`; in the type of `values`.

    `nan` is what a NaN becomes in a "unorm": 0.0, or 1.0 as on SwiftShader.  Others keep it.

    Examples
    --------
    >>> (stored(np.array([-1.0, 0.5, 2.0, np.nan]), "unorm8") * 255).tolist()
    [0.0, 128.0, 255.0, 0.0]
    >>> stored(np.array([0.1, 1e5]), "half").tolist()
    [0.0999755859375, inf]
    """
    if kind == "exact":
        return values
    if kind in _BITS:
        return decoded(codes_of(values, _BITS[kind], nan=nan), values.dtype)
    with np.errstate(over="ignore"):
        rounded = values.astype(np.float32)
        if kind == "half":
            rounded = rounded.astype(np.float16)
        return rounded.astype(values.dtype)


def codes_of(values: Floats, bits: int = 8, *, nan: float = 0.0) -> Numbers:
    """Return the codes 0..2^bits - 1 that `values` are stored as, uint8 or uint16, for 8 or 16 `bits`.

    code = rint(float32(value) (2^bits - 1)) in float32, ties to even, clamped: SwiftShader and Mesa do
    exactly that with 8 bits.  A NaN becomes the code of `nan`, 0.0 or 1.0.

    Examples
    --------
    >>> codes_of(np.array([-0.1, 0.5, 1.004, np.inf])).tolist()
    [0, 128, 255, 255]
    """
    most = np.float32(2**bits - 1)
    with np.errstate(over="ignore"):
        scaled = values.astype(np.float32)  # a copy, also of float32
        np.multiply(scaled, most, out=scaled)
    # fmin and fmax return the number if the other is NaN, so that whichever comes first decides.
    ends = ((np.fmin, most), (np.fmax, 0)) if nan else ((np.fmax, 0), (np.fmin, most))
    for hold, end in ends:
        hold(scaled, np.float32(end), out=scaled)
    return np.rint(scaled, out=scaled).astype(_CODES[bits])


def decoded(codes: Numbers, dtype: np.typing.DTypeLike = np.float64) -> Floats:
    """Return the numbers 0..1 of codes, uint8 or uint16, in `dtype`.

    In float32 they are code float32(1 / 255), as SwiftShader and Mesa have it; else nearest to code / 255.

    Examples
    --------
    >>> decoded(np.array([0, 51, 255], np.uint8)).tolist()
    [0.0, 0.2, 1.0]
    """
    most = np.iinfo(codes.dtype).max
    if np.dtype(dtype) == np.float32:
        return codes * np.float32(1 / most)
    return (codes / most).astype(dtype, copy=False)
