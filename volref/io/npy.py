"""NumPy's .npy and .npz files, with the header checked before anything is allocated."""

import math
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import IO

import numpy as np

from volref.arrays import Numbers
from volref.errors import FormatError
from volref.io.atomic import atomic_path
from volref.io.guard import check_deflated, check_held, check_memory, existing_file, nearest, wrapped

LARGEST_HEADER = 10_000
MOST_MEMBERS = 10_000


@dataclass(frozen=True)
class ArrayHeader:
    """What the head of a .npy file says: its array's shape and type, and where the numbers start."""

    shape: tuple[int, ...]
    fortran_order: bool
    dtype: np.dtype[np.generic]
    offset: int

    @property
    def data_bytes(self) -> int:
        """Bytes of the numbers alone."""
        return math.prod(self.shape) * self.dtype.itemsize

    @property
    def description(self) -> str:
        """Shape and type for a message."""
        return f"{' x '.join(str(n) for n in self.shape) or 'one number'} {self.dtype}"


def read_header(stream: IO[bytes], file: Path) -> ArrayHeader:
    """Return the header of the .npy data at the start of `stream`.

    Raises
    ------
    FormatError
        If it is not one, or asks for pickled objects (which can run code when loaded).
    """
    version = np.lib.format.read_magic(stream)
    readers = {
        (1, 0): np.lib.format.read_array_header_1_0,
        (2, 0): np.lib.format.read_array_header_2_0,
    }
    if version not in readers:
        message = f"{file.name} must have .npy version 1.0 or 2.0, got {version[0]}.{version[1]}; "
        raise FormatError(message + "save a plain array with numpy.save")
    shape, fortran_order, dtype = readers[version](stream, max_header_size=LARGEST_HEADER)
    header = ArrayHeader(tuple(int(n) for n in shape), bool(fortran_order), dtype, stream.tell())
    if dtype.hasobject:
        message = f"{file.name} must hold plain numbers, got pickled Python objects ({dtype}); "
        raise FormatError(message + "save it with a number type and allow_pickle=False")
    if min(header.shape, default=1) < 1:
        message = f"{file.name} must hold at least one number, got shape {header.shape}; write it again"
        raise FormatError(message)
    return header


def read_npy(path: str | Path, max_bytes: int) -> Numbers:
    """Return the array in a .npy file, memory-mapped and read-only.

    Raises
    ------
    FormatError
        If it is not one, would take more than `max_bytes`, or is longer or shorter than its header says.
    """
    file = existing_file(path)
    with wrapped(file, ".npy file"), file.open("rb") as stream:
        header = read_header(stream, file)
        check_memory(file, header.data_bytes, max_bytes, header.description)
        held = file.stat().st_size - header.offset
        check_held(file, header.data_bytes, held, header.description)
        if header.shape == ():
            return np.fromfile(stream, header.dtype, 1).reshape(())
        shape = header.shape[::-1] if header.fortran_order else header.shape
        samples: Numbers = np.memmap(file, header.dtype, "r", header.offset, shape)
        return samples.T if header.fortran_order else samples


def npz_headers(path: str | Path) -> dict[str, ArrayHeader]:
    """Return the header of each array in a .npz file, by name, without reading the arrays.

    Raises
    ------
    FormatError
        If it is not such a file, or one of its arrays is pickled.
    """
    file = existing_file(path)
    headers = {}
    with wrapped(file, ".npz file"), zipfile.ZipFile(file) as archive:
        members = archive.namelist()
        if len(members) > MOST_MEMBERS:
            message = f"{file.name} must hold at most {MOST_MEMBERS} arrays, got {len(members)}; split it"
            raise FormatError(message)
        for member in members:
            with archive.open(member) as stream:
                headers[member.removesuffix(".npy")] = read_header(stream, file)
    return headers


def read_npz(path: str | Path, names: tuple[str, ...], max_bytes: int) -> dict[str, Numbers]:
    """Return the named arrays of a .npz file that it holds (others are not read).

    Raises
    ------
    FormatError
        If the file is damaged, or an array would take more than `max_bytes`.
    """
    file = existing_file(path)
    arrays = {}
    with wrapped(file, ".npz file"), zipfile.ZipFile(file) as archive:
        for name in names:
            if f"{name}.npy" in archive.namelist():
                arrays[name] = _read_member(archive, archive.getinfo(f"{name}.npy"), file, max_bytes)
    return arrays


def write_npy(path: str | Path, array: Numbers, *, overwrite: bool = False) -> None:
    """Write one array as a .npy file, whole or not at all."""
    with atomic_path(path, overwrite=overwrite) as temporary, temporary.open("wb") as stream:
        np.save(stream, array, allow_pickle=False)


def write_npz(path: str | Path, arrays: Mapping[str, Numbers], *, overwrite: bool = False) -> None:
    """Write named arrays as a compressed .npz file, whole or not at all; equal arrays give equal bytes."""
    with (
        atomic_path(path, overwrite=overwrite) as temporary,
        zipfile.ZipFile(temporary, "w", zipfile.ZIP_DEFLATED, compresslevel=6) as archive,
    ):
        for name, array in arrays.items():
            # A fixed date: numpy.savez_compressed does the same, but takes names as keyword arguments.
            info = zipfile.ZipInfo(f"{name}.npy", (1980, 1, 1, 0, 0, 0))
            info.compress_type = zipfile.ZIP_DEFLATED
            with archive.open(info, "w", force_zip64=True) as stream:
                np.lib.format.write_array(stream, np.asarray(array), allow_pickle=False)


def chosen_array(file: Path, headers: Mapping[str, ArrayHeader], key: object, usual: str, axes: int) -> str:
    """Return the name of the array meant: `key`, else `usual`, else the only one with `axes` axes.

    Raises
    ------
    FormatError
        If none or several qualify.
    """
    if key is not None:
        if isinstance(key, str) and key in headers:
            return key
        message = f"{file.name} must hold the array key names, got key={key!r}; "
        raise FormatError(message + nearest(str(key), headers))
    if usual in headers:
        return usual
    fitting = [name for name, header in headers.items() if len(header.shape) == axes]
    if len(fitting) == 1:
        return fitting[0]
    got = ", ".join(fitting) if fitting else "none"
    message = f"{file.name} must hold an array {usual!r} or just one with {axes} axes, got {got}; "
    raise FormatError(message + ("pass key=NAME" if fitting else f"save the array as {usual!r}"))


def _read_member(archive: zipfile.ZipFile, info: zipfile.ZipInfo, file: Path, max_bytes: int) -> Numbers:
    with archive.open(info) as stream:
        header = read_header(stream, file)
    check_memory(file, header.data_bytes, max_bytes, header.description)
    check_held(file, header.data_bytes, info.file_size - header.offset, header.description)
    if info.compress_type == zipfile.ZIP_DEFLATED:
        check_deflated(file, info.file_size, info.compress_size, header.description)
    with archive.open(info) as stream:
        array: Numbers = np.lib.format.read_array(stream, allow_pickle=False)
    return array
