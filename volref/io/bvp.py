"""BVP files, the volumes of VPT: a ZIP archive of blocks, and a manifest.json that says where each belongs.

    {"meta": {"version": 1},
     "modalities": [{"name": "default", "dimensions": {"width": 4, "height": 3, "depth": 2},
                     "transform": {"matrix": [16 numbers]}, "format": 6403, "type": 5121, ...,
                     "placements": [{"index": 0, "position": {"x": 0, "y": 0, "z": 0}}, ...]}],
     "blocks": [{"url": "blocks/0", "format": "raw", "dimensions": {...}}, ...]}

`format` and `type` are numbers of WebGL 2 (6403 is RED, 5121 is UNSIGNED_BYTE), as VPT hands them on; older
files have `components` and `bits` instead.  x runs fastest in a block.  VPT shows a volume as the unit cube
and never reads the matrix, so voxel (i, j, k) lies at ((i + 1/2) / width, (j + 1/2) / height, ...) where the
matrix is the identity or is not there, and the spacing must be stated where it is another.
"""

import json
import math
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from volref.arrays import Numbers, whole_number
from volref.errors import FormatError
from volref.io.guard import (
    Foreign,
    check_deflated,
    check_held,
    check_memory,
    existing_file,
    nearest,
    one_line,
    wrapped,
)

MANIFEST = "manifest.json"
LARGEST_MANIFEST = 2**26
FORMATS = {6403: "RED", 36244: "RED_INTEGER"}
TYPES = {
    5120: "<i1",
    5121: "<u1",
    5122: "<i2",
    5123: "<u2",
    5124: "<i4",
    5125: "<u4",
    5126: "<f4",
    5131: "<f2",
}
OLD_TYPES = {8: "<u1", 16: "<u2"}


def read_bvp(path: str | Path, key: object, max_bytes: int) -> tuple[Numbers, dict[str, Any]]:
    """Return the samples (nz, ny, nx) of a modality of a BVP file, and its place if that is VPT's unit cube.

    Parameters
    ----------
    key
        Name of the modality, needed where there are several.

    Raises
    ------
    FormatError
        If the file is damaged, its blocks do not fill the volume once, or it needs too much memory.
    """
    file = existing_file(path)
    with wrapped(file, "BVP file"), zipfile.ZipFile(file) as archive:
        manifest = _manifest(file, archive)
        modality = _chosen(file, manifest["modalities"], key)
        size, dtype = _size(modality["dimensions"]), _sample_type(file, modality)
        what = f"{' x '.join(str(n) for n in size)} {dtype.name}"
        # One byte more per voxel, which tells whether a block has filled it.
        check_memory(file, math.prod(size) * (dtype.itemsize + 1), max_bytes, what)
        samples = _filled(file, archive, manifest["blocks"], modality["placements"], size, dtype)
    matrix = modality.get("transform", {}).get("matrix", np.eye(4).ravel().tolist())
    if matrix != np.eye(4).ravel().tolist():
        return samples, {}
    return samples, {"spacing": [1 / n for n in size], "origin": [0.5 / n for n in size]}


def _manifest(file: Path, archive: zipfile.ZipFile) -> Foreign:
    if MANIFEST not in archive.namelist():
        message = f"{file.name} must hold {MANIFEST}, got none; check its suffix"
        raise FormatError(message)
    held = archive.getinfo(MANIFEST).file_size
    check_memory(file, held, LARGEST_MANIFEST, MANIFEST)
    manifest = json.loads(archive.read(MANIFEST))
    version = manifest.get("meta", {}).get("version", 1)
    if version != 1:
        message = f"{file.name} must have meta.version 1, got {one_line(str(version))}; write it as version 1"
        raise FormatError(message)
    return manifest


def _chosen(file: Path, modalities: Foreign, key: object) -> Foreign:
    named = {str(modality["name"]): modality for modality in modalities}
    if key is None and len(named) == 1:
        return next(iter(named.values()))
    if isinstance(key, str) and key in named:
        return named[key]
    got = f"the modalities {one_line(', '.join(named))}" if key is None else f"key={one_line(repr(key))}"
    message = f"{file.name} must hold one modality, or the one that key names, got {got}; "
    raise FormatError(message + nearest(str(key), [one_line(name) for name in named]))


def _size(dimensions: Foreign) -> tuple[int, int, int]:
    width, height, depth = (
        whole_number(f"dimensions.{name}", dimensions[name], low=1, high=2**40)
        for name in ("width", "height", "depth")
    )
    return width, height, depth


def _sample_type(file: Path, modality: Foreign) -> np.dtype[Any]:
    kind, bits, components = modality.get("type"), modality.get("bits"), modality.get("components", 1)
    if kind is not None:
        name = TYPES.get(kind) if modality.get("format") in FORMATS else None
    else:
        name = OLD_TYPES.get(bits) if components == 1 else None
    if name is not None:
        return np.dtype(name)
    message = f"{file.name} must hold one number per voxel (format RED, 6403, or RED_INTEGER, 36244), got "
    got = f"format {modality.get('format')}, type {kind}, {components} components of {bits} bits"
    raise FormatError(message + f"{one_line(got)}; save one channel of it")


def _filled(
    file: Path,
    archive: zipfile.ZipFile,
    blocks: Foreign,
    placements: Foreign,
    size: tuple[int, int, int],
    dtype: np.dtype[Any],
) -> Numbers:
    """Return the volume that the placed blocks make up, after checking that each voxel is filled once."""
    placed = [_placed(file, blocks, placement, size) for placement in placements]
    covered = sum(math.prod(extent) for _, _, extent in placed)
    stored = sum(info.compress_size for info in archive.infolist())
    check_deflated(file, math.prod(size) * dtype.itemsize, stored, "all blocks")
    samples: Numbers = np.empty(size[::-1], dtype)
    filled = np.zeros(size[::-1], np.bool_)
    for block, (x, y, z), (width, height, depth) in placed:
        part = (slice(z, z + depth), slice(y, y + height), slice(x, x + width))
        samples[part] = _block(file, archive, block, dtype).reshape(depth, height, width)
        filled[part] = True
    if covered != math.prod(size) or not filled.all():
        message = f"{file.name} must fill each of its {math.prod(size)} voxels with one block, got blocks of "
        raise FormatError(message + f"{covered} voxels that leave {int((~filled).sum())} out; write it again")
    return samples


def _placed(
    file: Path, blocks: Foreign, placement: Foreign, size: tuple[int, int, int]
) -> tuple[Foreign, tuple[int, ...], tuple[int, int, int]]:
    """Return a block, where it begins and its extent, (x, y, z) each, after checking that it lies inside."""
    block = blocks[whole_number("placement.index", placement["index"], low=0, high=len(blocks) - 1)]
    position = tuple(
        whole_number(f"placement.position.{axis}", placement["position"][axis], low=0, high=2**40)
        for axis in "xyz"
    )
    extent = _size(block["dimensions"])
    if any(first + count > whole for first, count, whole in zip(position, extent, size, strict=True)):
        message = f"{file.name} must have its blocks inside the volume of {size}, got a block of {extent} at "
        raise FormatError(message + f"{position}; write it again")
    return block, position, extent


def _block(file: Path, archive: zipfile.ZipFile, block: Foreign, dtype: np.dtype[Any]) -> Numbers:
    """Return the numbers of a block; its url is the name of a member of the archive, never a path."""
    if block.get("format", "raw") != "raw":
        message = f"{file.name} must hold raw blocks, got format {one_line(repr(block['format']))}; "
        raise FormatError(message + "write it again")
    info = archive.getinfo(str(block["url"]))
    needed = math.prod(_size(block["dimensions"])) * dtype.itemsize
    check_held(file, needed, info.file_size, f"block {one_line(info.filename)}")
    return np.frombuffer(archive.read(info), dtype)
