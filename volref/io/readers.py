"""The formats of volumes: which reader takes a path, and what it may be told beside it.

Every reader returns the samples (nz, ny, nx) and what the file says about their place.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from volref.arrays import Numbers
from volref.errors import FormatError
from volref.io.atlas import AtlasLayout, read_atlas
from volref.io.bvp import read_bvp
from volref.io.dicom import read_dicom
from volref.io.guard import one_line
from volref.io.hdf5 import read_hdf5
from volref.io.mha import is_detached as is_detached_mha
from volref.io.mha import read_mha
from volref.io.nifti import read_nifti
from volref.io.npy import chosen_array, npz_headers, read_npy, read_npz
from volref.io.nrrd import is_detached as is_detached_nrrd
from volref.io.nrrd import read_nrrd
from volref.io.placement import GEOMETRY, SIGNS, joined_places, placement_of_affine
from volref.io.raw import read_raw
from volref.io.tiff import read_tiff
from volref.io.zarr import read_zarr
from volref.io.zarr_guard import METADATA as ZARR_METADATA

Statement: TypeAlias = dict[str, Any]
Found: TypeAlias = tuple[Numbers, Statement]

RAW_KEYS = ("size", "dtype", "byte_order", "skip", "spacing")
ATLAS_NEEDED = ("tiles_across", "tiles_down", "slices")
ATLAS_KEYS = (*ATLAS_NEEDED, "first_tile", "rows", "channel", "padding")
# Names of matrices from (i, j, k) to the world in .npz files, with the space they lead to.
AFFINES = {"affine_ijk_to_ras_mm": "ras", "affine_ijk_to_lps_mm": "lps"}


# Suffixes of two parts.
DOUBLE_SUFFIXES = (".nii.gz", ".zarr.zip")


class Reader(NamedTuple):
    """A format: what to call it, what reads it, which statements it takes and needs.

    `placed` is False if a file of it may leave its spacing out, which must then be stated.  `alone` tells
    whether a path of it names the one file that holds everything.
    """

    kind: str
    read: Callable[[Path, Statement, int], Found]
    keys: tuple[str, ...] = ()
    needed: tuple[str, ...] = ()
    placed: bool = True
    alone: Callable[[Path], bool] = Path.is_file


def reader_of(path: Path) -> Reader:
    """Return the reader of a path, by its suffix, or of a folder by what lies in it.

    Raises
    ------
    FormatError
        If there is none.
    """
    if path.is_dir():
        return _ZARR if any((path / name).is_file() for name in ZARR_METADATA) else _DICOM
    reader = READERS.get(suffix_of(path))
    if reader is not None:
        return reader
    message = f"{one_line(path.name)} must end in {', '.join(READERS)}, got {path.suffix!r}; "
    raise FormatError(message + "convert it to NRRD or NIfTI")


def is_volume_path(path: Path) -> bool:
    """Say whether `load_volume` knows the suffix, or it is a folder."""
    return path.is_dir() or suffix_of(path) in READERS


def suffix_of(path: Path) -> str:
    """Return the suffix that says the format, in lower case.

    Examples
    --------
    >>> suffix_of(Path("head.NII.gz")), suffix_of(Path("scan.1.nrrd"))
    ('.nii.gz', '.nrrd')
    """
    name = path.name.lower()
    return next((double for double in DOUBLE_SUFFIXES if name.endswith(double)), path.suffix.lower())


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
    return values, joined_places(file, places)


def _read_nrrd(file: Path, _: Statement, max_bytes: int) -> Found:
    return read_nrrd(file, max_bytes)


def _read_nifti(file: Path, _: Statement, max_bytes: int) -> Found:
    return read_nifti(file, max_bytes)


def _read_raw(file: Path, own: Statement, max_bytes: int) -> Found:
    return read_raw(file, own["size"], own["dtype"], own["byte_order"], own["skip"], max_bytes), {}


def _read_atlas(file: Path, own: Statement, max_bytes: int) -> Found:
    return read_atlas(file, AtlasLayout(**own), max_bytes), {}


def _read_mha(file: Path, _: Statement, max_bytes: int) -> Found:
    return read_mha(file, max_bytes)


def _read_dicom(file: Path, own: Statement, max_bytes: int) -> Found:
    return read_dicom(file, own.get("key"), max_bytes)


def _read_tiff(file: Path, _: Statement, max_bytes: int) -> Found:
    return read_tiff(file, max_bytes)


def _read_hdf5(file: Path, own: Statement, max_bytes: int) -> Found:
    return read_hdf5(file, own.get("key"), max_bytes)


def _read_zarr(file: Path, own: Statement, max_bytes: int) -> Found:
    return read_zarr(file, own.get("key"), own.get("level"), own.get("index"), max_bytes)


def _read_bvp(file: Path, own: Statement, max_bytes: int) -> Found:
    return read_bvp(file, own.get("key"), max_bytes)


def _never(_: Path) -> bool:
    return False


_NRRD = Reader("NRRD", _read_nrrd, alone=lambda file: not is_detached_nrrd(file))
_NIFTI = Reader("NIfTI", _read_nifti)
_RAW = Reader("RAW", _read_raw, RAW_KEYS[:4], RAW_KEYS)
_MHA = Reader("MetaImage", _read_mha, placed=False, alone=lambda file: not is_detached_mha(file))
_DICOM = Reader("DICOM", _read_dicom, ("key",), alone=_never)
_TIFF = Reader("TIFF", _read_tiff, placed=False)
_HDF5 = Reader("HDF5", _read_hdf5, ("key",), placed=False)
_ZARR = Reader("Zarr", _read_zarr, ("key", "level", "index"), placed=False)

READERS = {
    ".npy": Reader(".npy", _read_npy),
    ".npz": Reader(".npz", _read_npz, ("key",)),
    ".nrrd": _NRRD,
    ".nhdr": _NRRD,
    ".nii": _NIFTI,
    ".nii.gz": _NIFTI,
    ".mha": _MHA,
    ".mhd": _MHA,
    ".dcm": _DICOM,
    ".tif": _TIFF,
    ".tiff": _TIFF,
    ".h5": _HDF5,
    ".hdf5": _HDF5,
    ".zarr": _ZARR,
    ".zarr.zip": _ZARR,
    ".bvp": Reader("BVP", _read_bvp, ("key",), placed=False),
    ".raw": _RAW,
    ".bin": _RAW,
    ".png": Reader("PNG atlas", _read_atlas, ATLAS_KEYS, ATLAS_NEEDED),
}
