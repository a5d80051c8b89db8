"""The voxels of DICOM slices: stored codes, and what they are worth.

A code is worth code * RescaleSlope + RescaleIntercept (PS3.3, C.11.1.1.2).
"""

from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from volref.arrays import Floats, Numbers
from volref.errors import FormatError
from volref.io.guard import Foreign, check_deflated, check_memory, one_line, wrapped

Slices: TypeAlias = list[tuple[Path, Foreign]]


class _Codes(NamedTuple):
    """The type of stored codes and the least and greatest that there may be (0 and 0 of floats).

    pydicom clears the bits above BitsStored.
    """

    dtype: np.dtype[Any]
    low: int
    high: int


class _Rescaled(NamedTuple):
    """What a slice is worth: code * slope + intercept."""

    slope: float
    intercept: float
    codes: _Codes


def voxels_of_slices(pydicom: ModuleType, series: Slices, max_bytes: int) -> Numbers:
    """Return the rescaled voxels, read slice by slice into one array."""
    file, header = series[0]
    ny, nx = int(header.Rows), int(header.Columns)
    slices = [_Rescaled(*_scale(*one), _code_range(*one)) for one in series]
    dtype = _result_type(slices)
    what = f"{nx} x {ny} x {len(series)} {dtype.name}"
    check_memory(file, nx * ny * len(series) * dtype.itemsize, max_bytes, what)
    for (one, _), how in zip(series, slices, strict=True):
        # Of compressed slices too: no codec of grey images is expected to do better than deflate can.
        check_deflated(one, nx * ny * how.codes.dtype.itemsize, one.stat().st_size, f"{nx} x {ny} codes")
    voxels: Numbers = np.empty((len(series), ny, nx), dtype)
    for layer, (one, _), how in zip(voxels, series, slices, strict=True):
        codes = _codes(pydicom, one, (ny, nx), how.codes.dtype)
        if how.slope == 1.0 and how.intercept == 0.0:
            layer[...] = codes
        elif dtype.kind == "f":
            layer[...] = codes * how.slope + how.intercept
        else:
            layer[...] = codes.astype(np.int64) * int(how.slope) + int(how.intercept)
    return voxels


def _codes(pydicom: ModuleType, file: Path, shape: tuple[int, int], dtype: np.dtype[Any]) -> Numbers:
    with wrapped(file, "DICOM slice"):
        codes: Numbers = pydicom.dcmread(str(file)).pixel_array
    if codes.shape != shape or codes.dtype.newbyteorder("=") != dtype:
        message = f"{file.name} must hold {shape[1]} x {shape[0]} {dtype} numbers, got {codes.dtype} "
        raise FormatError(message + f"of shape {codes.shape}; write the file again")
    return codes


def _scale(file: Path, header: Foreign) -> tuple[float, float]:
    slope, intercept = header.get("RescaleSlope"), header.get("RescaleIntercept")
    first = 1.0 if slope is None else float(numbers_of(file, header, "RescaleSlope")[0])
    second = 0.0 if intercept is None else float(numbers_of(file, header, "RescaleIntercept")[0])
    if first == 0.0:
        message = f"{file.name} must have a RescaleSlope that is not 0, got 0; export the series again"
        raise FormatError(message)
    return first, second


def _code_range(file: Path, header: Foreign) -> _Codes:
    """Return the type of the stored codes and the least and greatest of them that BitsStored allows."""
    with wrapped(file, "DICOM slice"):
        bits, signed = int(header.BitsAllocated), header.get("PixelRepresentation")
        stored = int(header.get("BitsStored") or bits)
        high_bit = int(header.get("HighBit") or stored - 1)
    # Floats (PS3.3, C.7.6.24) have no PixelRepresentation.
    if bits == 64 or (bits == 32 and signed is None):
        return _Codes(np.dtype(f"f{bits // 8}"), 0, 0)
    if not (0 < stored <= bits and high_bit == stored - 1):
        message = f"{file.name} must have its codes in the low bits of {bits}, got BitsStored {stored} up to "
        raise FormatError(message + f"HighBit {high_bit}; write the file again")
    if signed:
        return _Codes(np.dtype(f"i{bits // 8}"), -(2 ** (stored - 1)), 2 ** (stored - 1) - 1)
    return _Codes(np.dtype(f"u{bits // 8}"), 0, 2**stored - 1)


def _result_type(slices: list[_Rescaled]) -> np.dtype[Any]:
    """Return the least signed type that holds every code * slope + intercept exactly, else float64.

    Codes that stay as they are keep their type.  Of 12 bits in 16 the upper ones hold nothing, so that
    -1024 .. 3071 HU fit in int16.
    """
    if all(one.slope == 1.0 and one.intercept == 0.0 for one in slices):
        return np.result_type(*{one.codes.dtype for one in slices})
    whole = all(one.slope.is_integer() and one.intercept.is_integer() for one in slices)
    if whole and all(one.codes.dtype.kind != "f" for one in slices):
        ends = [
            code * int(one.slope) + int(one.intercept)
            for one in slices
            for code in (one.codes.low, one.codes.high)
        ]
        for name in ("int16", "int32", "int64"):
            if np.iinfo(name).min <= min(ends) and max(ends) <= np.iinfo(name).max:
                return np.dtype(name)
    return np.dtype(np.float64)


def numbers_of(file: Path, header: Foreign, name: str) -> Floats:
    """Return an element as numbers, and refuse those that are not finite or too many."""
    count = {"PixelSpacing": 2, "ImagePositionPatient": 3, "ImageOrientationPatient": 6}.get(name, 1)
    with wrapped(file, "DICOM slice"):
        found = np.atleast_1d(np.array(header.get(name), dtype=np.float64))
    if found.shape == (count,) and np.isfinite(found).all():
        return found
    message = f"{file.name} must have {count} finite numbers for {name}, got "
    raise FormatError(message + f"{one_line(str(header.get(name)))}; export the series again")
