"""What is looked at before a Zarr store is read: how large it says it is, and what would unpack it.

Chunks are unpacked by libraries that trust them, so what they say of their size is looked at before.
"""

import math
import zipfile
from collections.abc import Iterator
from pathlib import Path

from volref.errors import FormatError
from volref.io.guard import Foreign, check_chunk, check_inflated, check_memory, one_line, wrapped

METADATA = ("zarr.json", ".zarray", ".zgroup", ".zattrs", ".zmetadata")
LARGEST_METADATA = 2**24
# Codecs that only pack numbers; others can run code or invent numbers.
CODECS = ("bytes", "transpose", "gzip", "zstd", "blosc", "crc32c", "sharding_indexed")
OLD_CODECS = ("zlib", "gzip", "bz2", "zstd", "blosc", "lz4", "shuffle")
# Reading a chunk takes a tenth of a millisecond even if it is not there.
MOST_SMALL_CHUNKS, SMALL_CHUNK = 10_000, 4096


def check_files(path: Path) -> None:
    """Refuse metadata too large to be any, and links that lead to other folders."""
    for name, size in _stored(path):
        if name.rpartition("/")[2] in METADATA and size > LARGEST_METADATA:
            message = f"{path.name} must have metadata of at most {LARGEST_METADATA} bytes, got {size} in "
            raise FormatError(message + f"{one_line(name)}; write it again")


def _stored(path: Path, under: str = "") -> Iterator[tuple[str, int]]:
    """Yield the name and the size of each file that belongs to a Zarr store."""
    with wrapped(path, "Zarr store"):
        if path.is_file():
            with zipfile.ZipFile(path) as archive:
                yield from (
                    (i.filename, i.file_size) for i in archive.infolist() if i.filename.startswith(under)
                )
            return
        for file in (path / under).rglob("*"):
            if file.is_symlink():
                message = (
                    f"{path.name} must hold its files itself, got the link {one_line(file.name)}; copy it"
                )
                raise FormatError(message)
            if file.is_file():
                yield file.relative_to(path).as_posix(), file.stat().st_size


def check_array(path: Path, array: Foreign, chosen: tuple[int | slice, ...], max_bytes: int) -> None:
    """Refuse what would take too much memory or time, or a codec that does more than pack numbers."""
    dtype = array.dtype
    if dtype.kind not in "iuf" or dtype.itemsize > 8 or 0 in array.shape:
        message = f"{path.name} must hold integers or real numbers, got {one_line(str(dtype))} of shape "
        raise FormatError(message + f"{array.shape}; convert it")
    shape = tuple(n for n, part in zip(array.shape, chosen, strict=True) if isinstance(part, slice))
    needed = math.prod(shape) * dtype.itemsize
    check_memory(path, needed, max_bytes, f"{' x '.join(str(n) for n in shape[::-1])} {dtype.name}")
    codecs = _codecs(array)
    strange = [name for name in codecs if name not in (*CODECS, *OLD_CODECS)]
    if strange:
        message = f"{path.name} must be packed by {', '.join(OLD_CODECS)} or none of them, got "
        raise FormatError(message + f"{one_line(', '.join(strange))}; write it again")
    stored_shape = array.shards or array.chunks
    check_chunk(path, math.prod(stored_shape) * dtype.itemsize, needed)
    sizes = [size for name, size in _stored(path, array.path) if name.rpartition("/")[2] not in METADATA]
    count = math.prod(-(-n // step) for n, step in zip(array.shape, array.chunks, strict=True))
    small = math.prod(array.chunks) * dtype.itemsize < SMALL_CHUNK
    if count > MOST_SMALL_CHUNKS and (small or (array.shards is None and count > 1000 * (1 + len(sizes)))):
        message = f"{path.name} must be stored in chunks of some size that are there, got {count} chunks of "
        message += f"{' x '.join(str(n) for n in array.chunks)} in {len(sizes)} files; "
        raise FormatError(message + "write it again")
    if array.shards is None:
        _check_chunks(path, array.path, codecs, math.prod(stored_shape) * dtype.itemsize)


def _codecs(array: Foreign) -> list[str]:
    if array.metadata.zarr_format == 2:
        found = [array.metadata.compressor, *(array.metadata.filters or ())]
        return [str(codec.codec_id) for codec in found if codec is not None]
    names, waiting = [], list(array.metadata.codecs)
    while waiting:
        codec = waiting.pop()
        names.append(str(codec.to_dict()["name"]))
        waiting += [*getattr(codec, "codecs", ()), *getattr(codec, "index_codecs", ())]
    return names


def _check_chunks(path: Path, under: str, codecs: list[str], most: int) -> None:
    """Refuse chunks that say, or for gzip turn out, to unpack to more than a chunk holds."""
    packed = [name for name in codecs if name in ("zlib", "gzip", "blosc", "zstd")]
    if len(packed) != 1:
        return
    # A codec before it may have added a check sum.
    most += 64
    for name, size in _stored(path, under):
        if name.rpartition("/")[2] in METADATA:
            continue
        if size > 2 * most + 2**16:
            message = (
                f"{path.name} must have chunks of at most {most} bytes, got {size} in {one_line(name)}; "
            )
            raise FormatError(message + "write it again")
        data = _read_stored(path, name, size if packed[0] in ("zlib", "gzip") else 32)
        if packed[0] in ("zlib", "gzip"):
            check_inflated(path, data, most, one_line(name))
        elif (says := _says(packed[0], data)) > most:
            message = (
                f"{path.name} must have chunks of at most {most} bytes, got {says} by {one_line(name)}; "
            )
            raise FormatError(message + "write it again")


def _read_stored(path: Path, name: str, count: int) -> bytes:
    if path.is_file():
        with zipfile.ZipFile(path) as archive, archive.open(name) as member:
            return member.read(count)
    with (path / name).open("rb") as stream:
        return stream.read(count)


def _says(codec: str, head: bytes) -> int:
    """Return the unpacked size that the head of a chunk states, 0 if none.

    Blosc 1 states it in bytes 4 to 8.  Zstandard (RFC 8878, 3.1.1.1): byte 4 tells in two bits how many bytes
    the size has, in one whether a window byte stands before it, in two how many bytes of a dictionary do.
    """
    if codec == "blosc":
        return int.from_bytes(head[4:8], "little")
    if len(head) < 5 or head[:4] != b"\x28\xb5\x2f\xfd":
        return 0
    flags = head[4]
    single = bool(flags & 32)
    length = (1 if single else 0, 2, 4, 8)[flags >> 6]
    start = 5 + (0 if single else 1) + (0, 1, 2, 4)[flags & 3]
    size = int.from_bytes(head[start : start + length], "little")
    return size + 256 if length == 2 else size
