"""HDF5 files: one plain dataset with three axes, and what its attributes say of its place.

Nothing outside the file is read: datasets that point to other files are refused.
"""

import math
from pathlib import Path
from types import ModuleType
from typing import Any

from volref.arrays import Numbers
from volref.errors import FormatError
from volref.io.atomic import atomic_path
from volref.io.guard import (
    Foreign,
    check_chunk,
    check_deflated,
    check_inflated,
    check_memory,
    existing_file,
    extra,
    nearest,
    one_line,
    wrapped,
)
from volref.io.placement import GEOMETRY, placement_of_attributes
from volref.scene.volume import Volume

SIGNATURE = b"\x89HDF\r\n\x1a\n"
MOST_NAMES = 10_000


def read_hdf5(path: str | Path, key: object, max_bytes: int) -> tuple[Numbers, dict[str, Any]]:
    """Return the samples (nz, ny, nx) of a dataset, and what its attributes say of its place.

    Attributes: `spacing`, `origin`, `direction`, `centering` as volref has them, x first; `spacing_zyx` and
    `element_size_um`, z first.

    Parameters
    ----------
    key
        Path of the dataset in the file; needed unless it is the only one with three axes.

    Raises
    ------
    FormatError
        If there is no such dataset, it is damaged, or it needs too much memory.
    """
    h5py = extra("h5py", "HDF5", "h5py")
    file = existing_file(path)
    with file.open("rb") as stream:
        if stream.read(len(SIGNATURE)) != SIGNATURE:
            message = f"{file.name} must be an HDF5 file, got other bytes at its start; check its suffix"
            raise FormatError(message)
    with wrapped(file, "HDF5 file"), h5py.File(str(file), "r") as archive:
        dataset = _chosen(h5py, file, archive, key)
        _check_dataset(file, dataset, max_bytes)
        place = placement_of_attributes(file, dict(dataset.attrs))
        samples: Numbers = dataset[()]
        return samples, place


def write_hdf5(path: str | Path, volume: Volume, *, overwrite: bool = False) -> None:
    """Write a volume as the dataset "volume", gzip, with its place as attributes, bit for bit."""
    h5py = extra("h5py", "HDF5", "h5py")
    with (
        atomic_path(path, overwrite=overwrite) as temporary,
        wrapped(Path(path), "HDF5 volume", "use .npz"),
        h5py.File(str(temporary), "w") as archive,
    ):
        dataset = archive.create_dataset("volume", data=volume.values, compression="gzip")
        for name in GEOMETRY:
            dataset.attrs[name] = getattr(volume, name)


def _chosen(h5py: ModuleType, file: Path, archive: Foreign, key: object) -> Foreign:
    """Return the dataset meant: `key`, else the only one with three axes."""
    names = _dataset_names(h5py, file, archive)
    if key is not None:
        wanted = str(key).strip("/")
        if wanted in names:
            return archive[wanted]
        message = f"{file.name} must hold the dataset that key names, got key={one_line(repr(key))}; "
        raise FormatError(message + nearest(wanted, [one_line(name) for name in names]))
    fitting = [name for name, axes in names.items() if axes == 3]
    if len(fitting) == 1:
        return archive[fitting[0]]
    got = one_line(", ".join(fitting)) if fitting else "none"
    message = f"{file.name} must hold just one dataset with 3 axes, got {got}; "
    raise FormatError(message + ("pass key=NAME" if fitting else "save the volume as one"))


def _dataset_names(h5py: ModuleType, file: Path, archive: Foreign) -> dict[str, int]:
    """Return the datasets of a file by path, with their axes; links to elsewhere are not followed."""
    names: dict[str, int] = {}

    def note(name: str, found: object) -> bool | None:
        if isinstance(found, h5py.Dataset):
            names[name] = len(found.shape or ())
        return True if len(names) > MOST_NAMES else None

    if archive.visititems(note):
        message = f"{file.name} must hold at most {MOST_NAMES} datasets, got more; split it"
        raise FormatError(message)
    return names


def _check_dataset(file: Path, dataset: Foreign, max_bytes: int) -> None:
    """Refuse a dataset that is not a field on three axes, lies elsewhere, or promises more than it holds."""
    shape, dtype = dataset.shape, dataset.dtype
    if shape is None or len(shape) != 3 or dtype.kind not in "iuf":
        message = f"{file.name} must hold numbers on 3 axes, got {dtype} of shape {shape} in "
        raise FormatError(message + f"{one_line(dataset.name)!r}; choose another dataset with key=NAME")
    if dataset.is_virtual or dataset.external:
        message = f"{file.name} must hold its samples, got {one_line(dataset.name)!r} in other files; copy it"
        raise FormatError(message)
    needed = math.prod(shape) * dtype.itemsize
    what = f"{' x '.join(str(n) for n in shape[::-1])} {dtype.name}"
    check_memory(file, needed, max_bytes, what)
    # Parts that were never written take no room; the fill value is not worth more than zeros deflated.
    check_deflated(file, needed, dataset.id.get_storage_size(), what)
    if dataset.chunks is not None:
        chunk = math.prod(dataset.chunks) * dtype.itemsize
        check_chunk(file, chunk, needed)
        if dataset.compression == "gzip":
            _check_gzip(file, dataset, chunk)


def _check_gzip(file: Path, dataset: Foreign, chunk: int) -> None:
    """Refuse deflated chunks that unpack to more than a chunk holds: HDF5 unpacks before it looks."""
    places: list[Foreign] = []
    dataset.id.chunk_iter(places.append)
    with file.open("rb") as stream:
        for place in places:
            if place.filter_mask == 0:
                stream.seek(place.byte_offset)
                data = stream.read(place.size)
                # 4 bytes: the check sum that the filter after it adds.
                check_inflated(file, data[:-4] if dataset.fletcher32 else data, chunk + 4, "a chunk")
