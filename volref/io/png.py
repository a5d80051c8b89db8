"""PNG files as arrays of codes, with the bit depth read from the header.

Pillow reads 16-bit colour by dropping the low byte of every sample, without a word; the header (IHDR) says
what the file holds, so such files are refused here.  16-bit grey is read whole.
"""

import struct
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from volref.arrays import Bytes, Numbers
from volref.errors import FormatError
from volref.io.atomic import atomic_path
from volref.io.guard import DEFAULT_MAX_BYTES, check_deflated, check_memory, existing_file, wrapped

SIGNATURE = b"\x89PNG\r\n\x1a\n"
GREY = 0
SAMPLES = {0: 1, 2: 3, 3: 1, 4: 2, 6: 4}
COLOR_TYPES = {0: "grey", 2: "RGB", 3: "palette", 4: "grey with alpha", 6: "RGBA"}


@dataclass(frozen=True)
class PngHeader:
    """What IHDR says: size, bits per sample, and colour type (see `COLOR_TYPES`)."""

    width: int
    height: int
    depth: int
    color_type: int

    @property
    def description(self) -> str:
        """Size and samples for a message."""
        return f"{self.width} x {self.height} pixels, {self.depth}-bit {COLOR_TYPES[self.color_type]}"


def read_png_header(path: str | Path) -> PngHeader:
    """Return the header of a PNG file.

    Raises
    ------
    FormatError
        If it is none.
    """
    file = existing_file(path)
    with wrapped(file, "PNG file"), file.open("rb") as stream:
        head = stream.read(33)
        if len(head) < 33 or head[:8] != SIGNATURE or head[12:16] != b"IHDR":
            message = f"{file.name} must be a PNG file, got other bytes at its start; convert it to PNG"
            raise FormatError(message)
        header = PngHeader(*struct.unpack(">IIBB", head[16:26]))
    if header.color_type not in COLOR_TYPES or 0 in (header.width, header.height):
        message = f"{file.name} must have a PNG header in order, got {header}; write the file again"
        raise FormatError(message)
    return header


def read_png(path: str | Path, max_bytes: int = DEFAULT_MAX_BYTES) -> Numbers:
    """Return a PNG as codes: (height, width) for grey, uint8 or uint16, else straight RGBA uint8 (..., 4).

    Grey of 1, 2 or 4 bits is stretched to 0..255, a palette is looked up, and a transparent colour becomes
    alpha 0.  Colour chunks (gamma, profiles) are not applied.

    Raises
    ------
    FormatError
        If the file is damaged, holds 16-bit colour, or would take more than `max_bytes`.
    """
    file = existing_file(path)
    header = read_png_header(file)
    if header.depth > 8 and header.color_type != GREY:
        message = f"{file.name} must have 8 bits per sample (16 for grey only), got {header.description}; "
        raise FormatError(message + "save it as .npy, or as 8-bit PNG")
    row = (header.width * SAMPLES[header.color_type] * header.depth + 7) // 8
    check_deflated(file, row * header.height, file.stat().st_size, header.description)
    check_memory(file, header.width * header.height * 4, max_bytes, header.description)
    with wrapped(file, "PNG file"):
        return _decoded(file, grey=header.color_type == GREY)


def write_png(path: str | Path, codes: Bytes, *, overwrite: bool = False) -> None:
    """Write codes as a PNG, whole or not at all.

    `codes` is uint8 (height, width), (height, width, 3) or straight RGBA (height, width, 4), or uint16
    (height, width).  `volref.image.encode_rgba8` makes RGBA codes of an image.

    Raises
    ------
    FormatError
        If the array is none of these, or the file exists and `overwrite` is False.
    """
    from PIL import Image

    array = np.asarray(codes)
    grey = array.ndim == 2 and array.dtype in (np.uint8, np.uint16)
    color = array.ndim == 3 and array.shape[2] in (3, 4) and array.dtype == np.uint8
    if not (grey or color) or array.size == 0:
        message = "image must be uint8 of shape (height, width[, 3 or 4]) or uint16 (height, width), got "
        message += f"{array.dtype} of shape {array.shape}; encode it with volref.image.encode_rgba8"
        raise FormatError(message)
    with atomic_path(path, overwrite=overwrite) as temporary:
        Image.fromarray(np.ascontiguousarray(array)).save(temporary, format="PNG")


def _decoded(file: Path, *, grey: bool) -> Numbers:
    # The plug-in itself, not Image.open: that one refuses large slice atlases as possible bombs, by a limit
    # that can only be moved for the whole process; the size was checked above.
    from PIL import PngImagePlugin

    with PngImagePlugin.PngImageFile(file) as image:
        if not grey or (image.mode != "I;16" and "transparency" in image.info):
            return np.asarray(image.convert("RGBA"))
        if "transparency" in image.info:
            message = f"{file.name} must have no transparent colour if it is 16-bit grey, got one; "
            raise FormatError(message + "save it without")
        return np.asarray(image if image.mode == "I;16" else image.convert("L"))
