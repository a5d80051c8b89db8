"""Start offsets from files: the noise texture of a program."""

from pathlib import Path

import numpy as np

from volref.arrays import Floats, Numbers, float_array
from volref.errors import FormatError
from volref.io.guard import DEFAULT_MAX_BYTES, existing_file, one_line
from volref.io.npy import read_npy
from volref.io.png import read_png


def load_jitter(path: str | Path, *, max_bytes: int = DEFAULT_MAX_BYTES) -> Floats:
    """Return the start offsets (frames, height, width) in a file, 0 to 1: grey .png, or .npy.

    Whole numbers are codes, divided by the largest of their type as a texture unit does: 255 gives 1, the
    end of a segment.  A .npy holds (height, width) or (frames, height, width).

    Raises
    ------
    FormatError
        If the file is no such image, has colours, or holds numbers outside 0 to 1.
    """
    file = existing_file(path)
    suffix = file.suffix.lower()
    if suffix == ".png":
        codes = _grey(file, read_png(file, max_bytes))
    elif suffix == ".npy":
        codes = read_npy(file, max_bytes)
    else:
        message = f"{one_line(file.name)} must end in .png or .npy, got {suffix!r}; convert it to grey PNG"
        raise FormatError(message)
    if codes.ndim not in (2, 3) or codes.dtype.kind not in "uf":
        message = f"{file.name} must hold offsets (height, width) or (frames, height, width) of floats or "
        message += f"unsigned integers, got {codes.dtype} of shape {codes.shape}; save another array"
        raise FormatError(message)
    unit = codes / np.iinfo(codes.dtype).max if codes.dtype.kind == "u" else codes
    frames = unit if unit.ndim == 3 else unit[None]
    offsets = float_array(file.name, frames, ("frames", "height", "width"))
    if offsets.min() < 0 or offsets.max() > 1:
        message = f"{file.name} must hold offsets from 0 to 1, got {offsets.min():g} to {offsets.max():g}; "
        raise FormatError(message + "give them as shares of a step")
    return offsets


def _grey(file: Path, codes: Numbers) -> Numbers:
    """Return the one channel of a PNG whose colours are grey."""
    if codes.ndim == 2:
        return codes
    if (codes[..., :1] == codes[..., :3]).all():
        return codes[..., 0]
    message = f"{file.name} must be grey, got colours; save the channel that holds the offsets"
    raise FormatError(message)
