"""Lookup tables of straight RGBA as .npy or PNG: the textures that programs upload.

A table (n, 4) is a transfer function of the value, one of (m, n, 4) of the gradient magnitude (rows) too.
"""

from pathlib import Path

import numpy as np

from volref.arrays import Numbers
from volref.errors import FormatError
from volref.io.npy import read_npy
from volref.io.png import read_png

LARGEST_TABLE_BYTES = 2**28


def read_table(file: Path) -> Numbers:
    """Return the entries in a .npy or .png file, as they are.

    Raises
    ------
    FormatError
        If a PNG has rows that differ, or either cannot be read.
    """
    if file.suffix.lower() == ".npy":
        return np.asarray(read_npy(file, LARGEST_TABLE_BYTES))
    codes = read_png(file, LARGEST_TABLE_BYTES)
    if codes.ndim != 3 or (codes != codes[:1]).any():
        message = (
            f"{file.name} must hold one row of 8-bit RGBA pixels, or equal rows, got shape {codes.shape}"
        )
        raise FormatError(message + " with rows that differ; crop it to one row")
    return np.asarray(codes[0])
