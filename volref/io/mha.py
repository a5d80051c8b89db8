"""MetaImage files (.mha, .mhd): a header of `Key = value` lines, then the samples, here or in a file beside.

Both are read here: the library's own reader unpacks a stream of any length, and follows a header to any file
on the disk.  Its writer is used.  The world of a MetaImage is that of ITK, LPS.
"""

import math
import zlib
from pathlib import Path
from typing import Any

import numpy as np

from volref.arrays import Floats, Numbers
from volref.errors import FormatError
from volref.io.atomic import atomic_path
from volref.io.guard import (
    check_deflated,
    check_held,
    check_memory,
    existing_file,
    extra,
    one_line,
    path_inside,
    wrapped,
)
from volref.io.placement import SIGNS, placement_of_affine
from volref.scene.volume import Volume

TYPES = {
    "MET_CHAR": "i1",
    "MET_UCHAR": "u1",
    "MET_SHORT": "i2",
    "MET_USHORT": "u2",
    "MET_INT": "i4",
    "MET_UINT": "u4",
    "MET_LONG_LONG": "i8",
    "MET_ULONG_LONG": "u8",
    "MET_FLOAT": "f4",
    "MET_DOUBLE": "f8",
}
WRITTEN_TYPES = ("uint8", "int8", "uint16", "int16", "uint32", "int32", "float32", "float64")
LARGEST_HEADER = 2**16
DATA_KEY = "elementdatafile"
POSITIONS = ("offset", "position", "origin")
ORIENTATIONS = ("transformmatrix", "orientation", "rotation")

Header = dict[str, str]


def read_mha(path: str | Path, max_bytes: int) -> tuple[Numbers, dict[str, Any]]:
    """Return the samples (nz, ny, nx) of a MetaImage and where they lie, in RAS.

    Raw data (memory-mapped) or compressed by zlib.  A data file of its own must lie in the header's folder.

    Raises
    ------
    FormatError
        If the file is damaged, needs too much memory, or holds more than one scalar field.
    """
    file = existing_file(path)
    with wrapped(file, "MetaImage"):
        header, start = _header(file)
        _check_scalar(file, header)
        place = _placement(file, header)
        data_file, start = (file, start) if _is_local(header) else (_data_file(file, header), 0)
        return _samples(data_file, header, start, max_bytes), place


def is_detached(path: Path) -> bool:
    """Tell whether a MetaImage names another file that holds its samples."""
    return not _is_local(_header(path)[0])


def write_mha(path: str | Path, volume: Volume, *, overwrite: bool = False) -> None:
    """Write a volume as .mha, compressed, in LPS; positions to the last of 17 digits.

    Raises
    ------
    FormatError
        If the volume has centering "node" or a type that the format cannot state.
    """
    metaimageio = extra("metaimageio", "MHA", "metaimageio")
    name = Path(path).name
    if volume.centering != "cell":
        message = (
            f"{name} must hold a volume of centering 'cell', got {volume.centering!r}; use .nrrd or .npz"
        )
        raise FormatError(message)
    if volume.values.dtype.name not in WRITTEN_TYPES:
        message = f"{name} must hold a type that MetaImage has, got {volume.values.dtype}; use .nrrd or .npz"
        raise FormatError(message)
    signs = np.array(SIGNS["lps"], dtype=np.float64)
    place = {
        "Offset": signs * np.array(volume.origin),
        "TransformMatrix": signs[:, None] * volume.direction,
        "ElementSpacing": np.array(volume.spacing),
    }
    with atomic_path(path, overwrite=overwrite) as temporary, wrapped(Path(path), "MetaImage", "use .npz"):
        metaimageio.write(temporary, np.asarray(volume.values), CompressedData=True, **place)


def _header(file: Path) -> tuple[Header, int]:
    """Return the keys in lower case with their texts, and the byte after the header."""
    header: Header = {}
    with file.open("rb") as stream:
        while DATA_KEY not in header:
            line = stream.readline(LARGEST_HEADER)
            key, equals, value = line.decode("utf-8", "replace").partition("=")
            if not line or stream.tell() > LARGEST_HEADER or (line.strip() and not equals):
                message = f"{file.name} must start with 'Key = value' lines up to ElementDataFile, got "
                raise FormatError(message + "other bytes; check its suffix")
            header[key.strip().lower()] = value.strip()
        return header, stream.tell()


def _is_local(header: Header) -> bool:
    return header[DATA_KEY].upper() == "LOCAL"


def _data_file(file: Path, header: Header) -> Path:
    named = header[DATA_KEY]
    if named.upper().startswith("LIST") or "%" in named:
        message = f"{file.name} must name one data file, got {one_line(named)!r}; join its slices first"
        raise FormatError(message)
    return existing_file(path_inside(file, named))


def _check_scalar(file: Path, header: Header) -> None:
    channels, axes = header.get("elementnumberofchannels", "1"), header.get("ndims", "3")
    if (channels, axes) != ("1", "3"):
        message = f"{file.name} must hold one scalar field on 3 axes, got {one_line(axes)} axes of "
        raise FormatError(message + f"{one_line(channels)} channels; save one channel of it")
    if not _yes(header, "binarydata", default=True):
        message = f"{file.name} must hold binary data, got BinaryData = False; write the file again"
        raise FormatError(message)


def _placement(file: Path, header: Header) -> dict[str, Any]:
    """Return where a MetaImage lies: a point is Offset + TransformMatrix (ElementSpacing * index).

    The matrix is written one axis after the other, so its rows in the file are its columns.
    """
    matrix = _numbers(file, header, ORIENTATIONS, np.eye(3).ravel()).reshape(3, 3).T
    center = _numbers(file, header, ("centerofrotation",), np.zeros(3))
    if center.any() and not np.array_equal(matrix, np.eye(3)):
        message = f"{file.name} must be rotated about 0, got CenterOfRotation {center.tolist()}, which ITK "
        raise FormatError(message + "ignores and other programs do not; write it into Offset")
    spacing = _numbers(file, header, ("elementspacing",), np.zeros(3))
    if not spacing.any():
        spacing = _numbers(file, header, ("elementsize",), np.zeros(3))
    affine = np.eye(4)
    affine[:3, :3] = matrix * (spacing if spacing.any() else 1.0)
    affine[:3, 3] = _numbers(file, header, POSITIONS, np.zeros(3))
    place = placement_of_affine(affine, SIGNS["lps"])
    if not spacing.any():
        del place["spacing"]
    return place


def _numbers(file: Path, header: Header, names: tuple[str, ...], default: Floats) -> Floats:
    """Return the numbers of whichever of several keys of one meaning is there."""
    found = {header[name] for name in names if name in header}
    if not found:
        return default
    array = np.array(next(iter(found)).split(), dtype=np.float64)
    if len(found) > 1 or array.shape != default.shape:
        message = f"{file.name} must have one {names[0]} of {len(default)} numbers, got "
        raise FormatError(message + f"{one_line(' and '.join(sorted(found)))!r}; write the file again")
    return array


def _samples(file: Path, header: Header, start: int, max_bytes: int) -> Numbers:
    dtype, size = _sample_type(file, header), _size(file, header)
    needed = math.prod(size) * dtype.itemsize
    what = f"{' x '.join(str(n) for n in size)} {dtype.name}"
    check_memory(file, needed, max_bytes, what)
    held, skip = file.stat().st_size - start, int(header.get("headersize", "0"))
    if skip < -1:
        message = (
            f"{file.name} must have a HeaderSize of at least -1 (the samples end the file), got {skip}; "
        )
        raise FormatError(message + "write the file again")
    if not _yes(header, "compresseddata"):
        skip = max(held - needed, 0) if skip == -1 else skip
        check_held(file, needed + skip, held, f"{what} after {skip}")
        return np.memmap(file, dtype, "r", start + skip, size[::-1])
    check_deflated(file, needed, held, what)
    with file.open("rb") as stream:
        stream.seek(start + max(skip, 0))
        # 47: a zlib or a gzip stream, as MetaIO takes it.
        data = zlib.decompressobj(47).decompress(stream.read(held), needed + 1)
    check_held(file, needed, len(data), what)
    return np.frombuffer(data, dtype).reshape(size[::-1])


def _size(file: Path, header: Header) -> tuple[int, ...]:
    text = header.get("dimsize", "")
    # 18 digits hold any size that a file can have; Python is slow with thousands of them.
    if all(word.isdecimal() and len(word) <= 18 for word in text.split()):
        size = tuple(int(word) for word in text.split())
        if len(size) == 3 and min(size) > 0:
            return size
    message = f"{file.name} must have a DimSize of 3 whole numbers of at least 1, got {one_line(text)!r}; "
    raise FormatError(message + "write the file again")


def _sample_type(file: Path, header: Header) -> np.dtype[Any]:
    name = header.get("elementtype", "").upper()
    if name not in TYPES:
        message = f"{file.name} must have an ElementType of {', '.join(TYPES)}, got {one_line(name)!r}; "
        cure = "MET_LONG has 4 bytes in some programs and 8 in others" if "LONG" in name else "convert it"
        raise FormatError(message + cure)
    big = _yes(header, "binarydatabyteordermsb") or _yes(header, "elementbyteordermsb")
    return np.dtype(TYPES[name]).newbyteorder(">" if big else "<")


def _yes(header: Header, name: str, *, default: bool = False) -> bool:
    return header[name].lower() in ("true", "t", "1") if name in header else default
