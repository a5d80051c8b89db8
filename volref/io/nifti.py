"""NIfTI files: the header through nibabel, the samples by a reader that stops where the header says."""

import gzip
import math
import struct
from pathlib import Path
from types import ModuleType
from typing import IO, Any

import numpy as np

from volref.arrays import Numbers
from volref.errors import FormatError
from volref.io.atomic import atomic_path
from volref.io.guard import Foreign, check_deflated, check_held, check_memory, existing_file, extra, wrapped
from volref.io.placement import placement_of_affine
from volref.scene.volume import Volume

HEADER_BYTES = (348, 540)
# Intents whose voxels are not one scalar each, or are names and not amounts.
REFUSED_INTENTS = (
    "label",
    "vector",
    "symmetric matrix",
    "generic matrix",
    "displacement vector",
    "quaternion",
)
WRITTEN_TYPES = (
    *("uint8", "int8", "uint16", "int16", "uint32", "int32", "uint64", "int64"),
    *("float32", "float64"),
)


def read_nifti(path: str | Path, max_bytes: int) -> tuple[Numbers, dict[str, Any]]:
    """Return the voxels (nz, ny, nx) of a NIfTI-1 or -2 file (.nii, .nii.gz) and where they lie, in RAS.

    Stored codes where the header has no scaling (memory-mapped from .nii), else code * slope + intercept
    in float64, as nibabel computes it.  The matrix is the sform, else the qform, as nibabel chooses.

    Raises
    ------
    FormatError
        If the file is damaged, needs too much memory, or holds more than one scalar field.
    """
    nibabel = extra("nibabel", "NIfTI", "nibabel")
    file = existing_file(path)
    with wrapped(file, "NIfTI file"), file.open("rb") as stream:
        packed = stream.read(2) == b"\x1f\x8b"
        stream.seek(0)
        if packed:
            with gzip.GzipFile(fileobj=stream) as unpacked:
                return _read(nibabel, file, unpacked, packed=True, max_bytes=max_bytes)
        return _read(nibabel, file, stream, packed=False, max_bytes=max_bytes)


def write_nifti(path: str | Path, volume: Volume, *, overwrite: bool = False) -> None:
    """Write a volume as NIfTI-1 with its matrix as sform (float32 there: positions to 6e-8 of their size).

    Raises
    ------
    FormatError
        If the volume has "node" centering or a type that the format cannot state.
    """
    nibabel = extra("nibabel", "NIfTI", "nibabel")
    name = Path(path).name
    if volume.centering != "cell":
        message = (
            f"{name} must hold a volume of centering 'cell', got {volume.centering!r}; use .nrrd or .npz"
        )
        raise FormatError(message)
    if volume.values.dtype.name not in WRITTEN_TYPES:
        message = f"{name} must hold a type that NIfTI has, got {volume.values.dtype}; use .nrrd or .npz"
        raise FormatError(message)
    with atomic_path(path, overwrite=overwrite) as temporary, wrapped(Path(path), "NIfTI volume", "use .npz"):
        values = np.asarray(volume.values).T
        image = nibabel.Nifti1Image(values, volume.world_from_index, dtype=values.dtype)
        image.set_sform(volume.world_from_index, code="scanner")
        nibabel.save(image, str(temporary))


def _read(
    nibabel: ModuleType, file: Path, stream: IO[bytes] | gzip.GzipFile, *, packed: bool, max_bytes: int
) -> tuple[Numbers, dict[str, Any]]:
    header = _header(nibabel, file, stream.read(HEADER_BYTES[1]))
    shape = _scalar_shape(file, header)
    dtype = header.get_data_dtype()
    if dtype.kind not in "iuf" or dtype.itemsize > 8:
        message = f"{file.name} must hold one integer or real number per voxel, got {dtype}; "
        raise FormatError(message + "save one channel of it as a scalar volume")
    start, count = int(header.get_data_offset()), math.prod(shape)
    slope, intercept = header.get_slope_inter()
    scaled = slope is not None and (slope, intercept) != (1.0, 0.0)
    needed = count * dtype.itemsize
    what = f"{' x '.join(str(n) for n in shape)} {dtype.name} from byte {start}"
    check_memory(file, count * (8 if scaled else dtype.itemsize), max_bytes, what)
    if packed:
        check_deflated(file, start + needed, file.stat().st_size, what)
        stream.seek(start)
        data = stream.read(needed)
        check_held(file, needed, len(data), what)
        values = np.frombuffer(data, dtype).reshape(shape[::-1])
    else:
        # Some writers pad the end of the file, so more than enough is enough.
        check_held(file, start + needed, min(file.stat().st_size, start + needed), what)
        values = np.memmap(file, dtype, "r", start, shape[::-1])
    if scaled:
        values = nibabel.volumeutils.apply_read_scaling(np.asarray(values), slope, intercept)
    return values, placement_of_affine(header.get_best_affine())


def _header(nibabel: ModuleType, file: Path, head: bytes) -> Foreign:
    sizes = {struct.unpack(order + "i", head[:4])[0] for order in "<>"} if len(head) >= 348 else set()
    kinds = {348: nibabel.Nifti1Header, 540: nibabel.Nifti2Header}
    found = [size for size in kinds if size in sizes and size <= len(head)]
    if not found:
        message = f"{file.name} must start with a NIfTI header, got other bytes; check its suffix"
        raise FormatError(message)
    header = kinds[found[0]](head[: found[0]])
    if bytes(header["magic"])[:3] not in (b"n+1", b"n+2"):
        message = f"{file.name} must be a NIfTI file in one piece (.nii), got a header of an .hdr/.img pair; "
        raise FormatError(message + "join them with nibabel.save")
    # Four bytes of extension flags follow the header; nibabel lets an offset of 0 pass.
    first, start = found[0] + 4, int(header.get_data_offset())
    if start < first:
        message = f"{file.name} must have its voxels at byte {first} or later (vox_offset), got {start}; "
        raise FormatError(message + "write the file again")
    return header


def _scalar_shape(file: Path, header: Foreign) -> tuple[int, int, int]:
    shape = tuple(int(n) for n in header.get_data_shape())
    while len(shape) > 3 and shape[-1] == 1:
        shape = shape[:-1]
    intent = str(header.get_intent()[0]).lower()
    if len(shape) != 3 or min(shape) < 1 or any(word in intent for word in REFUSED_INTENTS):
        message = (
            f"{file.name} must hold one scalar field on 3 axes, got shape {shape} with intent {intent!r}; "
        )
        raise FormatError(message + "save one channel of it (label, vector and time volumes are not read)")
    return shape[0], shape[1], shape[2]
