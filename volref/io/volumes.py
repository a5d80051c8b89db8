"""Volumes from files: one door, by suffix.

Every reader returns the samples (nz, ny, nx) and what the file says about their place; what the user states
beside it (keyword arguments, then a JSON file called `<name>.json`, as in `head.raw.json`) comes first.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias
from weakref import WeakKeyDictionary

import numpy as np

from volref.arrays import Numbers, whole_number
from volref.errors import FormatError
from volref.io.atlas import AtlasLayout, read_atlas
from volref.io.block_cache import keep_beside
from volref.io.documents import whole_numbers
from volref.io.guard import DEFAULT_MAX_BYTES, existing_file, nearest, one_line, read_json, wrapped
from volref.io.nifti import read_nifti
from volref.io.npy import chosen_array, npz_headers, read_npy, read_npz
from volref.io.nrrd import is_detached, read_nrrd
from volref.io.placement import GEOMETRY, SIGNS, placement_of_affine
from volref.io.raw import read_raw
from volref.scene.volume import Volume

Statement: TypeAlias = dict[str, Any]
Found: TypeAlias = tuple[Numbers, Statement]

RAW_KEYS = ("size", "dtype", "byte_order", "skip", "spacing")
ATLAS_NEEDED = ("tiles_across", "tiles_down", "slices")
ATLAS_KEYS = (*ATLAS_NEEDED, "first_tile", "rows", "channel", "padding")
# Names of matrices from (i, j, k) to the world in .npz files, with the space they lead to.
AFFINES = {"affine_ijk_to_ras_mm": "ras", "affine_ijk_to_lps_mm": "lps"}


def load_volume(
    path: str | Path,
    *,
    nan: str | float = "refuse",
    max_bytes: int = DEFAULT_MAX_BYTES,
    **statement: object,
) -> Volume:
    """Volume in a file, by its suffix.

    The world is that of NIfTI, x to the right, y to the front, z up (RAS+), in the file's own unit of
    length; files in LPS or LAS are turned into it.

    ======================  ==============================================================================
    .npy                    an array (nz, ny, nx), memory-mapped
    .npz                    array "volume" or the only one with 3 axes; "spacing" or "spacing_zyx",
                            "origin", "direction", "centering", or "affine_ijk_to_ras_mm" / "..._lps_mm";
                            arrays that say the same twice must agree to 5 digits, and a matrix is taken
    .nrrd .nhdr             NRRD (extra `nrrd`)
    .nii .nii.gz            NIfTI (extra `nifti`)
    .raw .bin               needs size, dtype, byte_order, skip and spacing, see `load_raw`
    .png                    slice atlas, needs tiles_across, tiles_down and slices, see `volref.io.atlas`
    ======================  ==============================================================================

    Parameters
    ----------
    nan
        "refuse", or the finite value that replaces NaN and infinity.
    max_bytes
        The most memory the samples may take; a file that would take more is refused before it is read.
    statement
        spacing, origin, direction, centering: in place of what the file says.  For .npz also `key`, the
        name of the array; for RAW and atlases what the table names.  The same names may stand in a JSON
        file beside the volume, called like it with `.json` added.

    Raises
    ------
    FormatError
        If the file is not what its suffix says, or the statement does not suit it.
    SceneError
        If the volume breaks a rule of `Volume`.
    """
    file = existing_file(path)
    reader = _reader_of(file)
    stated = {**_sidecar(file), **statement}
    for name in stated:
        if name not in (*GEOMETRY, *reader.keys):
            message = f"{one_line(name)} must be a key that a {reader.kind} volume takes, got "
            message += f"{one_line(repr(stated[name]))} for {file.name}; "
            raise FormatError(message + nearest(name, (*GEOMETRY, *reader.keys)))
    missing = [name for name in reader.needed if name not in stated]
    if missing:
        message = (
            f"{file.name} must be described by {', '.join(reader.needed)}, got no {', '.join(missing)}; "
        )
        raise FormatError(message + f"pass them or write them to {file.name}.json")
    own = {name: stated[name] for name in reader.keys if name in stated}
    limit = whole_number("max_bytes", max_bytes, low=1, high=2**62)
    origin = Origin(file.resolve(), file_state(file), nan, own)
    values, said = reader.read(file, own, limit)
    placed = {**said, **{name: stated[name] for name in GEOMETRY if name in stated}}
    volume = Volume(values, nan=nan, **placed)
    keep_beside(volume, file)
    if reader.kind != "NRRD" or not is_detached(file):
        _ORIGINS[volume] = origin
    return volume


class Origin(NamedTuple):
    """The one file that a volume was loaded from, its state then, and how its samples were read."""

    path: Path
    state: tuple[int, ...]
    nan: str | float
    own: Statement


# Where volumes that live were loaded from.
_ORIGINS: WeakKeyDictionary[Volume, Origin] = WeakKeyDictionary()


def origin_of(volume: Volume) -> Origin | None:
    """Return where a volume was loaded from, None if it was not, or from several files."""
    return _ORIGINS.get(volume)


def read_again(path: Path, nan: str | float, own: Statement, placement: Statement) -> Volume:
    """Return the volume that `load_volume` returned before, whatever the file and those beside it say now.

    Raises
    ------
    FormatError, SceneError
        If the file cannot be read.
    """
    values, _ = _reader_of(path).read(existing_file(path), own, 2**62)
    volume = Volume(values, nan=nan, **placement)
    keep_beside(volume, path)
    return volume


def file_state(path: Path) -> tuple[int, ...]:
    """Return what changes when a file is written to: device, number, size and time."""
    found = path.stat()
    return found.st_dev, found.st_ino, found.st_size, found.st_mtime_ns


def is_volume_path(path: Path) -> bool:
    """Say whether `load_volume` knows the suffix."""
    return _suffix(path) in READERS


def _sidecar(file: Path) -> Statement:
    beside = file.with_name(file.name + ".json")
    if not beside.is_file():
        return {}
    stated = read_json(beside)
    if isinstance(stated, dict):
        # "size": [4.0, 3, 2] means the same as [4, 3, 2] in JSON.
        whole: Statement = whole_numbers(stated, "volume")
        return whole
    message = f"{beside.name} must hold a JSON object, got {type(stated).__name__}; write {{name: value}}"
    raise FormatError(message)


def _read_npy(file: Path, _: Statement, max_bytes: int) -> Found:
    return read_npy(file, max_bytes), {}


def _read_npz(file: Path, own: Statement, max_bytes: int) -> Found:
    name = chosen_array(file, npz_headers(file), own.get("key"), "volume", 3)
    values = read_npz(file, (name,), max_bytes)[name]
    said = read_npz(file, (*GEOMETRY, "spacing_zyx", *AFFINES), 2**20)
    places: dict[str, Statement] = {key: {key: said[key].tolist()} for key in GEOMETRY if key in said}
    if "spacing_zyx" in said:
        places["spacing_zyx"] = {"spacing": np.ravel(said["spacing_zyx"])[::-1].tolist()}
    for key, space in AFFINES.items():
        if key in said:
            affine = np.asarray(said[key])
            if affine.shape != (4, 4) or affine.dtype.kind not in "iuf":
                message = f"{file.name} must hold {key} as 4 x 4 numbers, got {affine.dtype} of shape "
                raise FormatError(message + f"{affine.shape}; save a matrix from (i, j, k) to the world")
            places[key] = placement_of_affine(affine, SIGNS[space])
    return values, _joined(file, places)


def _joined(file: Path, places: dict[str, Statement]) -> Statement:
    """Return what several arrays say of one place, the last (a matrix) as it is, if they do not differ."""
    joined: Statement = {}
    for name, said in places.items():
        for key in joined.keys() & said.keys():
            with wrapped(file, ".npz file"):
                first, second = (np.asarray(value, dtype=np.float64) for value in (joined[key], said[key]))
                # 1e-4: a number beside a matrix may be rounded to 5 digits.
                same = first.shape == second.shape and bool(
                    (np.abs(first - second) <= 1e-4 * np.abs(second).max()).all()
                )
            if not same:
                message = f"{file.name} must state its {key} once, got {one_line(str(joined[key]))} and, by "
                message += f"{name}, {one_line(str(said[key]))}; "
                raise FormatError(message + "remove the array that is wrong")
        joined |= said
    return joined


def _read_nrrd(file: Path, _: Statement, max_bytes: int) -> Found:
    return read_nrrd(file, max_bytes)


def _read_nifti(file: Path, _: Statement, max_bytes: int) -> Found:
    return read_nifti(file, max_bytes)


def _read_raw(file: Path, own: Statement, max_bytes: int) -> Found:
    return read_raw(file, own["size"], own["dtype"], own["byte_order"], own["skip"], max_bytes), {}


def _read_atlas(file: Path, own: Statement, max_bytes: int) -> Found:
    return read_atlas(file, AtlasLayout(**own), max_bytes), {}


class _Reader(NamedTuple):
    """A format: what to call it, what reads it, which statements it takes, and which it needs."""

    kind: str
    read: Callable[[Path, Statement, int], Found]
    keys: tuple[str, ...] = ()
    needed: tuple[str, ...] = ()


_NRRD = _Reader("NRRD", _read_nrrd)
_NIFTI = _Reader("NIfTI", _read_nifti)
_RAW = _Reader("RAW", _read_raw, RAW_KEYS[:4], RAW_KEYS)

READERS = {
    ".npy": _Reader(".npy", _read_npy),
    ".npz": _Reader(".npz", _read_npz, ("key",)),
    ".nrrd": _NRRD,
    ".nhdr": _NRRD,
    ".nii": _NIFTI,
    ".nii.gz": _NIFTI,
    ".raw": _RAW,
    ".bin": _RAW,
    ".png": _Reader("PNG atlas", _read_atlas, ATLAS_KEYS, ATLAS_NEEDED),
}


def _suffix(path: Path) -> str:
    return ".nii.gz" if path.name.lower().endswith(".nii.gz") else path.suffix.lower()


def _reader_of(file: Path) -> _Reader:
    reader = READERS.get(_suffix(file))
    if reader is not None:
        return reader
    message = f"{one_line(file.name)} must end in {', '.join(READERS)}, got {file.suffix!r}; "
    raise FormatError(message + "convert it to NRRD or NIfTI")
