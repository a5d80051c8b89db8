"""OpenEXR images: float32 RGBA, linear, premultiplied as the format defines ("associated alpha")."""

from pathlib import Path
from types import ModuleType

import numpy as np

from volref.arrays import Floats, Numbers
from volref.errors import FormatError
from volref.io.atomic import atomic_path
from volref.io.guard import Foreign, check_deflated, check_memory, existing_file, extra, one_line, wrapped

MAGIC = b"\x76\x2f\x31\x01"
COLORS = ("R", "G", "B")
PLAIN_PARTS = ("scanlineimage", "tiledimage")


def read_exr(path: str | Path, max_bytes: int) -> Numbers:
    """Return the pixels of an EXR file: (height, width, 4) of R, G, B, A, or less where it has less.

    Chromaticities and other channels are not looked at.

    Raises
    ------
    FormatError
        If it is no such file, has several parts, or needs too much memory.
    """
    openexr = extra("OpenEXR", "EXR", "OpenEXR")
    file = existing_file(path)
    with wrapped(file, "EXR image"):
        with file.open("rb") as stream:
            if stream.read(4) != MAGIC:
                message = f"{file.name} must be an EXR image, got other bytes at its start; check its suffix"
                raise FormatError(message)
        names = _check_header(openexr, file, max_bytes)
        with openexr.File(str(file), separate_channels=True) as image:
            channels = image.channels()
            pixels: Numbers = np.stack([np.asarray(channels[name].pixels) for name in names], axis=-1)
    if pixels.dtype.kind != "f":
        message = f"{file.name} must hold half or float pixels, got {pixels.dtype}; convert them"
        raise FormatError(message)
    return pixels


def write_exr(path: str | Path, rgba: Floats, *, overwrite: bool = False) -> None:
    """Write a premultiplied image (height, width, 4) as float32 RGBA, ZIP compressed, whole or not at all.

    Raises
    ------
    FormatError
        If the file exists and `overwrite` is False.
    """
    openexr = extra("OpenEXR", "EXR", "OpenEXR")
    header = {"compression": openexr.ZIP_COMPRESSION, "type": openexr.scanlineimage}
    with atomic_path(path, overwrite=overwrite) as temporary, wrapped(Path(path), "EXR image", "use .npy"):
        openexr.File(header, {"RGBA": np.asarray(rgba, dtype=np.float32)}).write(str(temporary))


def _check_header(openexr: ModuleType, file: Path, max_bytes: int) -> list[str]:
    """Return the names of the channels to read, after checking that they are there and small enough."""
    # The header is emptied when the file is closed.
    with openexr.File(str(file), header_only=True) as image:
        header, parts = image.header(), len(image.parts)
        if parts != 1 or header["type"].name not in PLAIN_PARTS:
            message = f"{file.name} must hold one flat image, got {parts} parts of {header['type'].name}; "
            raise FormatError(message + "save one of them as scan lines")
        (left, top), (right, bottom) = (end.tolist() for end in header["dataWindow"])
        shown = [end.tolist() for end in header["displayWindow"]]
        if shown != [[left, top], [right, bottom]]:
            message = f"{file.name} must have its pixels where its display window is, {shown}, got "
            raise FormatError(message + f"{[[left, top], [right, bottom]]}; crop or pad it")
        names = _names(file, header["channels"])
        width, height, count = right - left + 1, bottom - top + 1, len(header["channels"])
    # 4 bytes a sample in the file, 4 more in the array that joins the channels.
    what = f"{width} x {height} pixels of {count} channels"
    check_memory(file, width * height * 4 * (count + len(names)), max_bytes, what)
    check_deflated(file, width * height * 2, file.stat().st_size, what)
    return names


def _names(file: Path, channels: Foreign) -> list[str]:
    found = {channel.name: (channel.xSampling, channel.ySampling) for channel in channels}
    names = [*COLORS, *(["A"] if "A" in found else [])] if set(COLORS) <= set(found) else ["Y"]
    if any(found.get(name) != (1, 1) for name in names):
        message = f"{file.name} must have the channels R, G, B (and A), or Y, for every pixel, got "
        raise FormatError(message + f"{one_line(', '.join(sorted(found))) or 'none'}; rename them")
    return names
