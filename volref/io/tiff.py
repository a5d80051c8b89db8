"""TIFF stacks: the pages of a file as slices, with the spacing that ImageJ and OME write into their text.

A plain TIFF has no spacing between its slices, so it must be stated; the resolution of plain pages is that of
paper and not used.  Rows are y and stay in their order.
"""

import math
import struct
from pathlib import Path
from types import ModuleType
from typing import Any
from xml.etree import ElementTree as Xml

import numpy as np

from volref.arrays import Numbers
from volref.errors import FormatError
from volref.io.guard import (
    Foreign,
    check_chunk,
    check_deflated,
    check_held,
    check_inflated,
    check_memory,
    existing_file,
    extra,
    one_line,
    wrapped,
)

# Dialects of one file that state their axes; others follow their headers to further files or keep pyramids.
KINDS = ("imagej", "ome", "shaped", "generic", "uniform")
# Unknown sequences of pages are slices: I and Q are tifffile's names for them.
STACKS = ("YX", "ZYX", "IYX", "QYX")
# Of TIFF and BigTIFF: where the first directory is named, its count, the bytes of an entry, an offset.
DIRECTORY = {42: (4, "H", 12, "I"), 43: (8, "Q", 20, "Q")}
GREY = ("MINISBLACK", "MINISWHITE", "PALETTE")
DEFLATES = ("ADOBE_DEFLATE", "DEFLATE")


def read_tiff(path: str | Path, max_bytes: int) -> tuple[Numbers, dict[str, Any]]:
    """Return the samples (nz, ny, nx) of a TIFF stack, and its spacing if ImageJ or OME text states it.

    Memory-mapped where the samples lie in one piece.  The unit is that of the text.

    Raises
    ------
    FormatError
        If the file is damaged, needs too much memory, or holds more than one grey stack.
    """
    tifffile = extra("tifffile", "TIFF", "tifffile")
    file = existing_file(path)
    _check_directories(file)
    # Not several files: OME text names them by any path.
    with wrapped(file, "TIFF stack"), tifffile.TiffFile(str(file), _multifile=False) as tiff:
        series = _only_stack(file, tiff)
        return _samples(tifffile, file, tiff, series, max_bytes), _spacing(file, tiff)


def _check_directories(file: Path) -> None:
    """Refuse directories of pages that overlap or lead back to each other: tifffile follows them for ever.

    A directory is a count, that many entries, and the offset of the next (TIFF 6.0, section 2; BigTIFF).
    """
    size = file.stat().st_size
    with wrapped(file, "TIFF stack"), file.open("rb") as stream:
        head = stream.read(16)
        order = {b"II": "<", b"MM": ">"}.get(head[:2])
        version = struct.unpack(order + "H", head[2:4])[0] if order and len(head) == 16 else 0
        if order is None or version not in DIRECTORY:
            message = f"{file.name} must be a readable TIFF stack, got other bytes at its start; "
            raise FormatError(message + "check its suffix")
        at, count, entry, link = DIRECTORY[version]
        place, taken = struct.unpack_from(order + link, head, at)[0], 0
        while place:
            stream.seek(place)
            found = stream.read(struct.calcsize(count))
            entries = struct.unpack(order + count, found)[0] if len(found) == struct.calcsize(count) else size
            taken += len(found) + entries * entry + struct.calcsize(link)
            if taken > size:
                message = (
                    f"{file.name} must have a directory for each page, got some that overlap or are cut; "
                )
                raise FormatError(message + "write the file again")
            stream.seek(place + len(found) + entries * entry)
            following = stream.read(struct.calcsize(link))
            place = (
                struct.unpack(order + link, following)[0] if len(following) == struct.calcsize(link) else 0
            )


def _only_stack(file: Path, tiff: Foreign) -> Foreign:
    text = tiff.pages[0].description
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        message = f"{file.name} must have OME text without entities, got some; write the file again"
        raise FormatError(message)
    if len(tiff.series) != 1:
        message = f"{file.name} must hold one stack, got {len(tiff.series)}; save one of them"
        raise FormatError(message)
    series = tiff.series[0]
    sizes = dict(zip(series.axes, series.shape, strict=True))
    axes = "".join(axis for axis in series.axes if axis in "YX" or sizes[axis] > 1)
    grey = series.keyframe.photometric.name in GREY
    if series.kind not in KINDS or axes not in STACKS or not grey:
        got = f"axes {series.axes} of {' x '.join(str(n) for n in series.shape)} ({series.kind}, "
        got += f"{series.keyframe.photometric.name})"
        message = f"{file.name} must hold one grey stack of slices, axes Z, Y and X, got {one_line(got)}; "
        raise FormatError(message + "save one channel at one time as a stack")
    if any(page is None for page in series.pages):
        message = f"{file.name} must hold all of its slices, got some that are missing or in other files; "
        raise FormatError(message + "save the stack as one file")
    return series


def _samples(tifffile: ModuleType, file: Path, tiff: Foreign, series: Foreign, max_bytes: int) -> Numbers:
    shape = tuple(int(n) for n, axis in zip(series.shape, series.axes, strict=True) if n > 1 or axis in "YX")
    shape = (1, *shape) if len(shape) == 2 else shape
    dtype = np.dtype(series.dtype)
    needed = math.prod(shape) * dtype.itemsize
    what = f"{' x '.join(str(n) for n in shape[::-1])} {dtype}"
    check_memory(file, needed, max_bytes, what)
    held = file.stat().st_size
    if series.dataoffset is not None:
        end = int(series.dataoffset) + needed
        check_held(file, end, min(held, end), what)
        return np.memmap(file, dtype.newbyteorder(tiff.byteorder), "r", int(series.dataoffset), shape)
    _check_pages(tifffile, file, series, needed, what)
    samples: Numbers = series.asarray()
    return samples.reshape(shape)


def _check_pages(tifffile: ModuleType, file: Path, series: Foreign, needed: int, what: str) -> None:
    """Refuse pages whose strips lie beyond the file, are missing, or unpack to more than their samples."""
    held, stored = file.stat().st_size, 0
    packing = tifffile.COMPRESSION(series.keyframe.compression).name
    chunk = math.prod(series.keyframe.chunks) * np.dtype(series.dtype).itemsize
    check_chunk(file, chunk, needed)
    with file.open("rb") as stream:
        for page in series.pages:
            for start, count in zip(page.dataoffsets, page.databytecounts, strict=True):
                check_held(file, start + count, min(held, start + count), f"{what}, a strip at byte {start}")
                stored += count
                if packing in DEFLATES:
                    stream.seek(start)
                    check_inflated(file, stream.read(count), chunk, "a strip")
    if packing == "NONE":
        check_held(file, needed, min(stored, needed), what)
    else:
        check_deflated(file, needed, stored, what)


def _spacing(file: Path, tiff: Foreign) -> dict[str, Any]:
    """Return the spacing (x, y, z) that OME or ImageJ text states, nothing if it leaves one out."""
    found = _ome_spacing(file, tiff.ome_metadata) if tiff.is_ome else _imagej_spacing(tiff)
    return {} if None in found else {"spacing": found}


def _ome_spacing(file: Path, text: str) -> list[float | None]:
    pixels = Xml.fromstring(text).find(".//{*}Pixels")
    if pixels is None:
        return [None]
    texts = [pixels.get(f"PhysicalSize{axis}") for axis in "XYZ"]
    # The schema's default unit is the micrometre.
    units = {pixels.get(f"PhysicalSize{axis}Unit", "µm") for axis in "XYZ"}
    if len(units) > 1:
        message = f"{file.name} must have one unit for PhysicalSizeX, Y and Z, got "
        raise FormatError(message + f"{one_line(', '.join(sorted(units)))}; pass the file on in one unit")
    return [None if text is None else float(text) for text in texts]


def _imagej_spacing(tiff: Foreign) -> list[float | None]:
    """Return ImageJ's spacing: z is a number in its text, x and y are the resolution, pixels per unit."""
    said = tiff.imagej_metadata or {}
    if "spacing" not in said:
        return [None]
    tags = tiff.pages[0].tags
    per_unit = [tags[name].value if name in tags else None for name in ("XResolution", "YResolution")]
    across = [None if found is None or found[0] == 0 else found[1] / found[0] for found in per_unit]
    return [*across, float(said["spacing"])]
