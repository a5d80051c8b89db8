"""An image to judge, as it was delivered: numbers that nothing has decoded or multiplied yet.

H, W the image.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from volref.arrays import Booleans, Floats, Numbers, plain_array
from volref.errors import SceneError
from volref.io.guard import DEFAULT_MAX_BYTES
from volref.io.images import read_codes
from volref.io.png import read_png, read_png_header

ImageSource: TypeAlias = ArrayLike | Path

# Colour types of PNG without alpha: grey and RGB.
WITHOUT_ALPHA = (0, 2)

# Whatever type an image is kept in, shaders computed it in float32: a code times the rounded 1 / 255, as GPUs
# read it, is rounded twice, each time by up to 2^-24.
SHADER_ROUNDING = 2.0**-23


@dataclass(frozen=True, eq=False)
class Candidate:
    """An image to judge.

    Parameters
    ----------
    numbers
        RGB or RGBA (H, W, 3 or 4), row 0 at the top: codes 0..`levels`, or parts of 1.
    levels
        255 for bytes, 65535 for 16 bits, None for floats.
    rounding
        What a float is off by its type, relative.
    """

    numbers: Floats
    levels: int | None
    rounding: float

    @property
    def has_alpha(self) -> bool:
        """Whether there is a fourth channel."""
        return int(self.numbers.shape[2]) == 4

    @property
    def unit(self) -> Floats:
        """The numbers as parts of 1."""
        return self.numbers if self.levels is None else self.numbers / self.levels


def read_candidate(source: ImageSource, max_bytes: int = DEFAULT_MAX_BYTES) -> Candidate:
    """Return the image to judge in an array or in a .png, .npy, .npz or .exr file.

    Arrays are (H, W, 3 or 4), or (H, W) for grey, of uint8, uint16 or floats; grey and RGB have no alpha.

    Raises
    ------
    SceneError
        If an array is none of these.
    FormatError
        If a file is none.

    Examples
    --------
    >>> found = read_candidate(np.full((2, 2, 3), 51, np.uint8))
    >>> found.levels, found.has_alpha, found.unit[0, 0].tolist()
    (255, False, [0.2, 0.2, 0.2])
    """
    codes = _read(Path(source), max_bytes) if isinstance(source, str | Path) else _checked(source)
    if codes.ndim == 2:
        codes = np.repeat(codes[..., None], 3, axis=2)
    if codes.dtype.kind == "u":
        return Candidate(codes.astype(np.float64), int(np.iinfo(codes.dtype).max), 0.0)
    rounding = max(float(np.finfo(codes.dtype).eps) / 2, SHADER_ROUNDING)
    return Candidate(codes.astype(np.float64), None, rounding)


def read_mask(source: ImageSource | None, height: int, width: int) -> Booleans:
    """Return the pixels (H, W) to leave out: those that are not 0 in an array (H, W[, 3 or 4]) or a file.

    Of a file with alpha, the pixels that are neither black nor transparent.

    Raises
    ------
    SceneError
        If the mask has another size than the image.
    """
    if source is None:
        return np.zeros((height, width), np.bool_)
    given = read_codes(source) if isinstance(source, str | Path) else plain_array("mask", source)
    if given.ndim not in (2, 3) or given.shape[:2] != (height, width):
        got = " x ".join(str(n) for n in given.shape[1::-1]) or "one number"
        message = f"mask must be {width} x {height} pixels as the image, got {got}; draw it over the image"
        raise SceneError(message)
    marked: Booleans = np.asarray(given != 0)
    if marked.ndim == 2:
        return marked
    colors: Booleans = np.asarray(marked[..., :3].any(axis=-1))
    return colors & marked[..., 3] if marked.shape[2] == 4 else colors


def _read(file: Path, max_bytes: int) -> Numbers:
    if file.suffix.lower() != ".png":
        return read_codes(file, max_bytes)
    codes, header = read_png(file, max_bytes), read_png_header(file)
    opaque = codes.ndim == 3 and header.color_type in WITHOUT_ALPHA and bool((codes[..., 3] == 255).all())
    return codes[..., :3] if opaque else codes


def _checked(source: ArrayLike) -> Numbers:
    array = plain_array("candidate", source)
    image = array.ndim == 2 or (array.ndim == 3 and array.shape[2] in (3, 4))
    known = array.dtype.kind == "f" or array.dtype in (np.uint8, np.uint16)
    if image and known and array.size:
        return array
    message = "candidate must be an image (height, width, 3 or 4) of uint8, uint16 or floats, got "
    raise SceneError(message + f"{array.dtype} of shape {array.shape}; read it from the canvas again")
