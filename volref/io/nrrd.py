"""NRRD files: the header through pynrrd, the samples by a reader that stops where the header says.

pynrrd's own data reader would follow a header to any file on the disk and unpack a stream of any length.
"""

import bz2
import gzip
import math
from pathlib import Path
from typing import IO, Any

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

# Each NumPy type with the names the format gives it.
TYPE_NAMES = {
    "int8": ("signed char", "int8", "int8_t"),
    "uint8": ("uchar", "unsigned char", "uint8", "uint8_t"),
    "int16": ("short", "short int", "signed short", "signed short int", "int16", "int16_t"),
    "uint16": ("ushort", "unsigned short", "unsigned short int", "uint16", "uint16_t"),
    "int32": ("int", "signed int", "int32", "int32_t"),
    "uint32": ("uint", "unsigned int", "uint32", "uint32_t"),
    "int64": (
        *("longlong", "long long", "long long int", "signed long long", "signed long long int"),
        *("int64", "int64_t"),
    ),
    "uint64": ("ulonglong", "unsigned long long", "unsigned long long int", "uint64", "uint64_t"),
    "float32": ("float",),
    "float64": ("double",),
}
TYPES = {name: kind for kind, names in TYPE_NAMES.items() for name in names}
SPATIAL_KINDS = ("domain", "space", "none", "???")


def read_nrrd(path: str | Path, max_bytes: int) -> tuple[Numbers, dict[str, Any]]:
    """Return the samples (nz, ny, nx) of a NRRD or NHDR file and where they lie, in RAS.

    Encodings raw (memory-mapped), gzip and bzip2.  A detached data file must lie in the header's folder.

    Raises
    ------
    FormatError
        If the file is damaged, needs too much memory, or holds more than one scalar field.
    """
    nrrd = extra("nrrd", "NRRD", "pynrrd")
    file = existing_file(path)
    with wrapped(file, "NRRD file"):
        with file.open("rb") as stream:
            header = nrrd.read_header(stream)
            place = placement_of_header(file, header)
            size = tuple(int(n) for n in header["sizes"])
            detached = header.get("data file", header.get("datafile"))
            if detached is None:
                return _read_samples(file, stream, header, size, max_bytes), place
        data_file = existing_file(path_inside(file, _single_name(file, detached)))
        with data_file.open("rb") as stream:
            return _read_samples(data_file, stream, header, size, max_bytes), place


def is_detached(path: Path) -> bool:
    """Tell whether a NRRD file names another one that holds its samples."""
    with path.open("rb") as stream:
        for line in stream:
            if not line.strip():
                return False
            if line.lower().startswith((b"data file:", b"datafile:")):
                return True
    return False


def placement_of_header(file: Path, header: dict[str, Any]) -> dict[str, Any]:
    """Return spacing, origin, direction and centering of a NRRD header, after checking it holds one field."""
    _check_scalar(file, header)
    centering = _centering(file, header)
    space = str(header.get("space", "3d-right-handed")).lower()
    if space not in SIGNS:
        message = f"{file.name} must have a space of 3 right-handed axes (LPS, RAS, LAS ...), got "
        raise FormatError(message + f"{one_line(space)!r}; resave it in LPS or RAS")
    affine = np.eye(4)
    if "space directions" in header:
        affine[:3, :3] = _matrix(file, header["space directions"]).T
        affine[:3, 3] = header.get("space origin", np.zeros(3))
    else:
        spacings, first = _axes(file, header, centering)
        affine[:3, :3] = np.diag(spacings)
        affine[:3, 3] = first
    return {**placement_of_affine(affine, SIGNS[space]), "centering": centering}


def write_nrrd(path: str | Path, volume: Volume, *, overwrite: bool = False) -> None:
    """Write a volume as NRRD, gzip, space RAS; positions to the last of 17 digits."""
    nrrd = extra("nrrd", "NRRD", "pynrrd")
    header = {
        "space": "right-anterior-superior",
        "space directions": (volume.direction * np.array(volume.spacing)).T,
        "space origin": np.array(volume.origin),
        "kinds": ["domain"] * 3,
        "centerings": [volume.centering] * 3,
        "encoding": "gzip",
    }
    with atomic_path(path, overwrite=overwrite) as temporary, wrapped(Path(path), "NRRD volume", "use .npz"):
        nrrd.write(str(temporary), np.asarray(volume.values), header, index_order="C", compression_level=6)


def _check_scalar(file: Path, header: dict[str, Any]) -> None:
    sizes = [int(n) for n in header["sizes"]]
    kinds = [kind.lower() for kind in header.get("kinds", [])]
    if len(sizes) != 3 or int(header["dimension"]) != 3 or any(kind not in SPATIAL_KINDS for kind in kinds):
        got = f"sizes {sizes} of kinds {' '.join(kinds) or 'not stated'}"
        message = f"{file.name} must hold one scalar field on 3 axes, got {one_line(got)}; "
        raise FormatError(message + "save one channel of it (vector and time volumes are not read)")
    if any(str(key).startswith("Segment0_") for key in header):
        message = f"{file.name} must hold a scalar field, got a segmentation (a label map); "
        raise FormatError(message + "export the labels you want as a scalar volume")


def _centering(file: Path, header: dict[str, Any]) -> str:
    stated = header.get("centerings", header.get("centers", []))
    words = {word.lower() for word in (stated.split() if isinstance(stated, str) else stated)}
    if "node" not in words:
        return "cell"
    if words == {"node"}:
        return "node"
    message = f"{file.name} must have one centering for all axes, got {one_line(' '.join(sorted(words)))}; "
    raise FormatError(message + "resave it with 'cell' or 'node' on each axis")


def _matrix(file: Path, rows: object) -> Floats:
    matrix = np.array(rows, dtype=np.float64)
    if matrix.shape == (3, 3) and np.isfinite(matrix).all():
        return matrix
    message = f"{file.name} must have 3 space directions of 3 numbers, got {matrix.tolist()}; "
    raise FormatError(message + "save one scalar field with its 3 axes")


def _axes(file: Path, header: dict[str, Any], centering: str) -> tuple[Floats, Floats]:
    """Return the spacing and the place of the first sample on each axis of a header without directions.

    A cell's "axis min" and "axis max" are the outer borders of the first and the last sample, a node's are
    their places (Kindlmann, NRRD format, "axis mins").
    """
    stated = _axis_numbers(header, "spacings")
    low, high = _axis_numbers(header, "axis mins"), _axis_numbers(header, "axis maxs")
    steps = np.array(header["sizes"], dtype=np.float64) - (1.0 if centering == "node" else 0.0)
    spread = (high - low) / np.maximum(steps, 1.0)
    # 1e-5: people and programs write these numbers with 6 digits.
    differ = np.abs(spread - stated) > 1e-5 * np.abs(stated)
    if differ.any() or (np.isnan(low) & ~np.isnan(high)).any():
        message = f"{file.name} must have axis maxs that agree with axis mins and spacings ({centering} "
        message += f"centering), got {high.tolist()} for {low.tolist()} and {stated.tolist()}; "
        raise FormatError(message + "remove axis maxs, or state the right centerings")
    spacings = np.where(np.isnan(stated), spread, stated)
    spacings = np.where(np.isnan(spacings), 1.0, spacings)
    half = 0.5 * spacings if centering == "cell" else np.zeros(3)
    return spacings, np.where(np.isnan(low), 0.0, low + half)


def _axis_numbers(header: dict[str, Any], name: str) -> Floats:
    """Return a number for each axis, NaN where the field states none; "axismins" is "axis mins"."""
    return np.array(header.get(name, header.get(name.replace(" ", ""), [math.nan] * 3)), dtype=np.float64)


def _single_name(file: Path, detached: str) -> str:
    if detached.startswith("LIST") or "%" in detached:
        message = f"{file.name} must name one data file, got {one_line(detached)!r}; join its slices first"
        raise FormatError(message)
    return detached


def _read_samples(
    file: Path, stream: IO[bytes], header: dict[str, Any], size: tuple[int, ...], max_bytes: int
) -> Numbers:
    dtype = _sample_type(file, header)
    shape = size[::-1]
    needed = math.prod(size) * dtype.itemsize
    what = f"{' x '.join(str(n) for n in size)} {dtype.name}"
    check_memory(file, needed, max_bytes, what)
    start, held = stream.tell(), file.stat().st_size - stream.tell()
    skip = int(header.get("byte skip", header.get("byteskip", 0)))
    if int(header.get("line skip", header.get("lineskip", 0))) != 0:
        message = f"{file.name} must have no line skip, got one; resave it with encoding raw or gzip"
        raise FormatError(message)
    encoding = str(header["encoding"]).lower()
    if skip < -1:
        message = f"{file.name} must have a byte skip of at least -1 (the samples end the file), got {skip}; "
        raise FormatError(message + "resave it with encoding raw or gzip")
    if encoding == "raw":
        skip = max(held - needed, 0) if skip == -1 else skip
        check_held(file, needed + skip, held, f"{what} after {skip}")
        return np.memmap(file, dtype, "r", start + skip, shape)
    if encoding not in ("gzip", "gz", "bzip2", "bz2") or skip != 0:
        message = f"{file.name} must have the encoding raw, gzip or bzip2 (without skip), got "
        raise FormatError(message + f"{one_line(encoding)!r} with byte skip {skip}; resave it")
    if encoding in ("gzip", "gz"):
        check_deflated(file, needed, held, what)
        data = gzip.GzipFile(fileobj=stream).read(needed + 1)
    else:
        data = bz2.BZ2File(stream).read(needed + 1)
    check_held(file, needed, len(data), what)
    return np.frombuffer(data, dtype).reshape(shape)


def _sample_type(file: Path, header: dict[str, Any]) -> np.dtype[Any]:
    name = str(header["type"]).lower()
    if name not in TYPES:
        message = f"{file.name} must hold integers or real numbers, got type {one_line(name)!r}; convert it"
        raise FormatError(message)
    dtype = np.dtype(TYPES[name])
    endian = header.get("endian")
    if dtype.itemsize > 1 and endian not in ("little", "big"):
        message = (
            f"{file.name} must state endian little or big for {dtype.name}, got {endian!r}; add the field"
        )
        raise FormatError(message)
    return dtype.newbyteorder(">" if endian == "big" else "<")
