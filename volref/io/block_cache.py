"""The ranges of blocks of a large volume, kept in a file beside it.

`scan.npy.volref-blocks` holds what `volref.scene.blocks` made of the voxels of `scan.npy`, so that the next
process need not read all of them.  It is a .npz archive that is not compressed: an array "key", the
"value_bounds", and for each pass its "least" and "greatest".  It may be deleted at any time.

It is trusted no further than any other file, and used only if its key is that of the volume: size and time of
the file, type, shape and place of the voxels in it, and a digest of some of them.  In doubt it is ignored and
written anew; where it cannot be written, nothing is.
"""

import hashlib
import json
import math
import os
import shutil
from dataclasses import dataclass
from pathlib import Path
from zipfile import ZIP_STORED, ZipFile

import numpy as np

from volref.arrays import Numbers, set_fields
from volref.errors import FormatError
from volref.io.atomic import atomic_path
from volref.io.guard import wrapped
from volref.io.npy import npz_headers, read_npz
from volref.scene.blocks import MOST_KEPT, Pass, Ranges, keep_ranges
from volref.scene.volume import Volume, in_memory_order, mapped_file

# The environment variable that switches it off, and the words for that.
SWITCH, OFF = "VOLREF_BLOCK_CACHE", ("0", "off", "no", "false")

# Volumes up to this many bytes get no file: a pass over them takes a few hundredths of a second.
MOST_WITHOUT = 1 << 26

# Pieces of the voxels that the key holds a digest of, and the bytes of each.
PIECES, PIECE_BYTES = 64, 1 << 12

LARGEST_KEY = 1 << 12


def cache_path(file: Path) -> Path:
    """Return where the ranges of the volume in `file` are kept.

    Examples
    --------
    >>> cache_path(Path("scan.npy")).name
    'scan.npy.volref-blocks'
    """
    return file.with_name(file.name + ".volref-blocks")


def keep_beside(volume: Volume, file: Path) -> None:
    """Keep the ranges of a volume that was read from `file` beside it, if it is large and memory-mapped.

    What was kept before is taken from there, the value bounds at once.
    """
    if volume.values.nbytes <= MOST_WITHOUT or os.environ.get(SWITCH, "").strip().lower() in OFF:
        return
    values = volume.values
    data = mapped_file(values)
    if data is None:
        return
    try:
        keeper = _FileKeeper(cache_path(file.resolve()), data, values, _key(data, values))
    except OSError:
        return
    keep_ranges(volume, keeper)
    bounds = keeper.value_bounds()
    if bounds is not None:
        set_fields(volume, value_bounds=bounds)


@dataclass(frozen=True, eq=False)
class _FileKeeper:
    """Keeps the ranges of `values`, mapped from the file `data`, in a file of its own."""

    path: Path
    data: Path
    values: Numbers
    key: str

    def read(self, made: Pass) -> Ranges | None:
        """Return what a pass made, as `volref.scene.blocks.Keeper` says."""
        shape = tuple(-(-n // made.block) for n in self.values.shape)
        names = _names(made)
        arrays = self._arrays(names, math.prod(shape) * self.values.itemsize)
        least, greatest = (arrays.get(name) for name in names)
        if least is None or greatest is None:
            return None
        if any(found.shape != shape or found.dtype != self.values.dtype for found in (least, greatest)):
            return None
        return (least, greatest) if (least <= greatest).all() else None

    def write(self, made: Pass, ranges: Ranges) -> None:
        """Keep what a pass made, beside what other passes made before."""
        try:
            unchanged = _key(self.data, self.values) == self.key
        except OSError:
            return
        # Twice: what is there already may be broken where nobody looked yet.
        for copied in dict.fromkeys((self._others(made), ())) if unchanged else ():
            try:
                self._write(made, ranges, copied)
            except FormatError:
                continue
            return

    def value_bounds(self) -> tuple[float, float] | None:
        """Return the least and greatest value, if the file holds them."""
        bounds = self._arrays(("value_bounds",), 16).get("value_bounds")
        if bounds is None or bounds.shape != (2,) or bounds.dtype != np.float64:
            return None
        low, high = bounds.tolist()
        return (low, high) if -math.inf < low <= high < math.inf else None

    def _arrays(self, names: tuple[str, ...], max_bytes: int) -> dict[str, Numbers]:
        """Return arrays that the file holds: none if it is not there, or not whole, or of other voxels."""
        try:
            key = read_npz(self.path, ("key",), LARGEST_KEY).get("key")
            if key is None or key.shape != () or key.dtype.kind != "U" or str(key) != self.key:
                return {}
            return read_npz(self.path, names, max_bytes)
        except FormatError:
            return {}

    def _others(self, made: Pass) -> tuple[str, ...]:
        """Return the names of the arrays of the last passes before, but for this one."""
        if not self._arrays(("key",), LARGEST_KEY):
            return ()
        try:
            names = list(npz_headers(self.path))
        except FormatError:
            return ()
        others = [name for name in names if name.startswith(("least ", "greatest "))]
        return tuple(name for name in others if name not in _names(made))[: 2 * (MOST_KEPT - 1)]

    def _write(self, made: Pass, ranges: Ranges, copied: tuple[str, ...]) -> None:
        least, greatest = ranges
        bounds = np.array([least.min(), greatest.max()], np.float64)
        arrays = dict(zip(_names(made), ranges, strict=True))
        with (
            wrapped(self.path, "file of block ranges"),
            atomic_path(self.path, overwrite=True) as temporary,
            ZipFile(temporary, "w", ZIP_STORED) as archive,
        ):
            for name, array in {"key": np.array(self.key), "value_bounds": bounds, **arrays}.items():
                with archive.open(f"{name}.npy", "w", force_zip64=True) as stream:
                    np.lib.format.write_array(stream, array, allow_pickle=False)
            if copied:
                _copy(self.path, copied, archive)


def _copy(path: Path, names: tuple[str, ...], archive: ZipFile) -> None:
    with ZipFile(path) as old:
        for member in (f"{name}.npy" for name in names):
            # What is compressed is not from here, and may be of any length.
            if old.getinfo(member).compress_type == ZIP_STORED:
                with old.open(member) as source, archive.open(member, "w", force_zip64=True) as target:
                    shutil.copyfileobj(source, target)


def _names(made: Pass) -> tuple[str, str]:
    """Return the names of the two arrays of a pass.

    Examples
    --------
    >>> _names(Pass(4, (2, 1, 0)))
    ('least 4 2 1 0', 'greatest 4 2 1 0')
    """
    numbers = " ".join(map(str, (made.block, *made.reach)))
    return f"least {numbers}", f"greatest {numbers}"


def _key(data: Path, values: Numbers) -> str:
    """Return what must be the same for ranges to be those of `values`, mapped from the file `data`."""
    state = data.stat()
    ordered = values.transpose(in_memory_order(values))
    voxels = ordered.reshape(-1).view(np.uint8)
    digest = hashlib.blake2b(digest_size=16)
    for start in np.linspace(0, max(0, len(voxels) - PIECE_BYTES), PIECES).astype(np.int64).tolist():
        digest.update(voxels[start : start + PIECE_BYTES].tobytes())
    key = {
        "format": "volref-blocks",
        "format_version": 1,
        "file_bytes": state.st_size,
        "modified_ns": state.st_mtime_ns,
        "type": values.dtype.str,
        "shape": values.shape,
        "strides": values.strides,
        "digest": digest.hexdigest(),
    }
    return json.dumps(key)
