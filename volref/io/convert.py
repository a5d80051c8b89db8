"""Volumes from one file format to another."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from volref.errors import FormatError
from volref.io.atlas import AtlasLayout, square_layout, write_atlas
from volref.io.atomic import check_free, write_text
from volref.io.guard import DEFAULT_MAX_BYTES, nearest, one_line
from volref.io.hdf5 import write_hdf5
from volref.io.mha import write_mha
from volref.io.nifti import write_nifti
from volref.io.npy import write_npy, write_npz
from volref.io.nrrd import write_nrrd
from volref.io.raw import write_raw
from volref.io.readers import ATLAS_KEYS
from volref.io.scene_parts import document_of_placement
from volref.io.volumes import load_volume
from volref.scene.volume import Volume


def convert_volume(
    source: str | Path,
    target: str | Path,
    *,
    overwrite: bool = False,
    nan: str | float = "refuse",
    max_bytes: int = DEFAULT_MAX_BYTES,
    layout: AtlasLayout | None = None,
    **statement: object,
) -> None:
    """Write the volume in one file to another, whose suffix says the format.

    See `load_volume` for `nan`, `max_bytes` and `statement`, and `save_volume` for the rest.

    Raises
    ------
    FormatError
        If `source` cannot be read, or `target` cannot hold it or exists and `overwrite` is False.
    """
    volume = load_volume(source, nan=nan, max_bytes=max_bytes, **statement)
    save_volume(volume, target, overwrite=overwrite, layout=layout)


def save_volume(
    volume: Volume, path: str | Path, *, overwrite: bool = False, layout: AtlasLayout | None = None
) -> None:
    """Write a volume as .npy, .npz, .nrrd, .nii, .nii.gz, .mha, .h5, .raw or a .png atlas.

    Values are never changed.  Where the format has no place for the geometry (.npy, .raw, .png) it stands in
    a JSON file beside the data, `<name>.json`, which `load_volume` reads; the other formats leave none, and
    with `overwrite` an old one is removed.  Geometry comes back bit for bit from .npy, .npz, .h5, .raw and
    .png, to rounding from .nrrd and .mha, and to float32 from NIfTI.

    Parameters
    ----------
    layout
        How the slices lie in a .png atlas; by default in a square, top left first, rows down, in grey.

    Raises
    ------
    FormatError
        If the format cannot hold the volume, or the file or `<name>.json` exists and `overwrite` is False.
    """
    file = Path(path)
    suffix = ".nii.gz" if file.name.lower().endswith(".nii.gz") else file.suffix.lower()
    writer = _WRITERS.get(suffix)
    if writer is None:
        message = f"{one_line(file.name)} must end in {', '.join(_WRITERS)}, got {file.suffix!r}; "
        raise FormatError(message + nearest(file.suffix, _WRITERS))
    beside = file.with_name(file.name + ".json")
    # In every format: `load_volume` would read an old one in place of what the file says.
    check_free(beside, overwrite=overwrite)
    statement = writer(file, volume, _Options(overwrite, layout))
    if statement is not None:
        text = json.dumps({**statement, **document_of_placement(volume)}, indent=1, allow_nan=False)
        write_text(beside, text + "\n", overwrite=overwrite)
    elif beside.is_file():
        beside.unlink()


_Statement: TypeAlias = dict[str, Any] | None


class _Options(NamedTuple):
    overwrite: bool
    layout: AtlasLayout | None


def _write_npy(file: Path, volume: Volume, options: _Options) -> _Statement:
    write_npy(file, volume.values, overwrite=options.overwrite)
    return {}


def _write_npz(file: Path, volume: Volume, options: _Options) -> _Statement:
    place = {name: np.array(value) for name, value in document_of_placement(volume).items()}
    write_npz(file, {"volume": volume.values, **place}, overwrite=options.overwrite)
    return None


def _write_nrrd(file: Path, volume: Volume, options: _Options) -> _Statement:
    write_nrrd(file, volume, overwrite=options.overwrite)
    return None


def _write_nifti(file: Path, volume: Volume, options: _Options) -> _Statement:
    write_nifti(file, volume, overwrite=options.overwrite)
    return None


def _write_mha(file: Path, volume: Volume, options: _Options) -> _Statement:
    write_mha(file, volume, overwrite=options.overwrite)
    return None


def _write_hdf5(file: Path, volume: Volume, options: _Options) -> _Statement:
    write_hdf5(file, volume, overwrite=options.overwrite)
    return None


def _write_raw(file: Path, volume: Volume, options: _Options) -> _Statement:
    return write_raw(file, volume.values, overwrite=options.overwrite)


def _write_atlas(file: Path, volume: Volume, options: _Options) -> _Statement:
    chosen = square_layout(len(volume.values)) if options.layout is None else options.layout
    write_atlas(file, np.asarray(volume.values), chosen, overwrite=options.overwrite)
    return {name: getattr(chosen, name) for name in ATLAS_KEYS}


_WRITERS: dict[str, Callable[[Path, Volume, _Options], _Statement]] = {
    ".npy": _write_npy,
    ".npz": _write_npz,
    ".nrrd": _write_nrrd,
    ".nii": _write_nifti,
    ".nii.gz": _write_nifti,
    ".mha": _write_mha,
    ".h5": _write_hdf5,
    ".hdf5": _write_hdf5,
    ".raw": _write_raw,
    ".png": _write_atlas,
}
