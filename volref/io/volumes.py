"""Volumes from files: one door, by suffix.

Every reader returns the samples (nz, ny, nx) and what the file says about their place; what the user states
beside it (keyword arguments, then a JSON file called `<name>.json`, as in `head.raw.json`) comes first.
"""

from pathlib import Path
from typing import NamedTuple
from weakref import WeakKeyDictionary

from volref.arrays import whole_number
from volref.errors import FormatError
from volref.io.block_cache import keep_beside
from volref.io.documents import whole_numbers
from volref.io.guard import DEFAULT_MAX_BYTES, existing_file, existing_path, nearest, one_line, read_json
from volref.io.placement import GEOMETRY
from volref.io.readers import Statement, reader_of
from volref.scene.volume import Volume


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
    .mha .mhd               MetaImage
    .dcm, a folder          DICOM series (extra `dicom`): a folder of slices, or one of them; of several
                            series the one whose SeriesInstanceUID is `key`
    .tif .tiff              TIFF stack (extra `tiff`); spacing from ImageJ's or OME's text, else stated
    .h5 .hdf5               HDF5 (extra `hdf5`): the dataset `key` or the only one with 3 axes; attributes
                            "spacing", "origin", "direction", "centering", "spacing_zyx" or "element_size_um"
    .zarr .zarr.zip         Zarr (extra `zarr`): the array `key` of a group, or its only one with 3 axes; of
                            an OME-Zarr image the array `level` (0), `index` of its axes t and c
    .bvp                    the volumes of VPT: its only modality, or `key`; the unit cube, as VPT shows it
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
        spacing, origin, direction, centering: in place of what the file says.  `key`: the name of the array
        or of the series.  For RAW and atlases what the table names.  The same names may stand in a JSON file
        beside the volume, called like it with `.json` added.

    Raises
    ------
    FormatError
        If the file is not what its suffix says, or the statement does not suit it.
    SceneError
        If the volume breaks a rule of `Volume`.
    """
    file = existing_path(path)
    reader = reader_of(file)
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
    if not reader.placed and "spacing" not in placed:
        message = f"{file.name} must state its spacing (sx, sy, sz), got none; pass spacing= or write it to "
        raise FormatError(message + f"{file.name}.json")
    volume = Volume(values, nan=nan, **placed)
    keep_beside(volume, file)
    if reader.alone(file):
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
    values, _ = reader_of(path).read(existing_file(path), own, 2**62)
    volume = Volume(values, nan=nan, **placement)
    keep_beside(volume, path)
    return volume


def file_state(path: Path) -> tuple[int, ...]:
    """Return what changes when a file is written to: device, number, size and time."""
    found = path.stat()
    return found.st_dev, found.st_ino, found.st_size, found.st_mtime_ns


def _sidecar(file: Path) -> Statement:
    beside = file.parent / (file.name + ".json")
    if not beside.is_file():
        return {}
    stated = read_json(beside)
    if isinstance(stated, dict):
        # "size": [4.0, 3, 2] means the same as [4, 3, 2] in JSON.
        whole: Statement = whole_numbers(stated, "volume")
        return whole
    message = f"{beside.name} must hold a JSON object, got {type(stated).__name__}; write {{name: value}}"
    raise FormatError(message)
