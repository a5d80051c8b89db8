"""RAW volumes: numbers without a header, so the user states everything and nothing is guessed."""

import math
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from volref.arrays import Numbers, one_of, whole_number
from volref.errors import FormatError
from volref.io.atomic import atomic_path
from volref.io.block_cache import keep_beside
from volref.io.guard import DEFAULT_MAX_BYTES, check_held, check_memory, existing_file, wrapped
from volref.scene.volume import IDENTITY, Volume

RAW_TYPES = (
    *("uint8", "int8", "uint16", "int16", "uint32", "int32", "uint64", "int64"),
    *("float16", "float32", "float64"),
)
BYTE_ORDERS = ("little", "big")


def load_raw(
    path: str | Path,
    size: tuple[int, int, int],
    dtype: str,
    byte_order: str,
    skip: int,
    spacing: ArrayLike,
    *,
    origin: ArrayLike = (0.0, 0.0, 0.0),
    direction: ArrayLike = IDENTITY,
    centering: str = "cell",
    nan: str | float = "refuse",
    max_bytes: int = DEFAULT_MAX_BYTES,
) -> Volume:
    """Volume of a file without a header, memory-mapped and read-only.

    Parameters
    ----------
    size
        Samples (nx, ny, nz); x runs fastest in the file.
    dtype
        "uint8", "int16", "float32" and so on; any of the NumPy integers and floats up to 8 bytes.
    byte_order
        "little" or "big"; stated for one-byte types too, where it has no effect.
    skip
        Bytes before the first sample.
    spacing, origin, direction, centering, nan
        As for `Volume`.
    max_bytes
        The most memory to use.

    Raises
    ------
    FormatError
        If the file does not hold exactly skip + nx ny nz samples; nothing is allocated before that is known.
    SceneError
        If a statement breaks a rule of the scene model.
    """
    values = read_raw(path, size, dtype, byte_order, skip, max_bytes)
    volume = Volume(values, spacing, origin, direction, centering, nan=nan)
    keep_beside(volume, Path(path))
    return volume


def read_raw(
    path: str | Path, size: object, dtype: object, byte_order: object, skip: object, max_bytes: int
) -> Numbers:
    """Return the samples (nz, ny, nx) of a RAW file as a read-only memory map; see `load_raw`."""
    file = existing_file(path)
    nx, ny, nz = checked_size(size)
    kind = np.dtype(one_of("volume.dtype", dtype, RAW_TYPES))
    kind = kind.newbyteorder("<" if one_of("volume.byte_order", byte_order, BYTE_ORDERS) == "little" else ">")
    start = whole_number("volume.skip", skip, low=0, high=2**62)
    what = f"{nx} x {ny} x {nz} {dtype} after {start} bytes"
    needed = math.prod((nx, ny, nz)) * kind.itemsize
    check_memory(file, needed, max_bytes, what)
    check_held(file, start + needed, file.stat().st_size, what)
    with wrapped(file, "RAW file"):
        return np.memmap(file, kind, "r", start, (nz, ny, nx))


def write_raw(path: str | Path, values: Numbers, *, overwrite: bool = False) -> dict[str, object]:
    """Write samples (nz, ny, nx), little-endian, and return the statement that reads them back."""
    little = values.astype(values.dtype.newbyteorder("<"), copy=False)
    with atomic_path(path, overwrite=overwrite) as temporary, temporary.open("wb") as stream:
        stream.writelines(np.ascontiguousarray(layer).data for layer in little)
    nz, ny, nx = values.shape
    return {"size": [nx, ny, nz], "dtype": values.dtype.name, "byte_order": "little", "skip": 0}


def checked_size(size: object) -> tuple[int, int, int]:
    """Return (nx, ny, nz) as whole numbers of at least 1.

    Raises
    ------
    FormatError
        If `size` is not three of them.
    """
    if not isinstance(size, list | tuple) or len(size) != 3:
        message = (
            f"volume.size must be (nx, ny, nz), got {size!r}; give the number of samples along each axis"
        )
        raise FormatError(message)
    nx, ny, nz = (whole_number(f"volume.size[{i}]", n, low=1, high=2**40) for i, n in enumerate(size))
    return nx, ny, nz
