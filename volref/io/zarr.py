"""Zarr arrays (v2, v3) and OME-Zarr images, in a folder or in a .zarr.zip file.

An OME-Zarr image is a pyramid of arrays; `level` says which.  Its axes are named, and the place of a sample
is what its coordinateTransformations say, first those of the level, then those of the whole image (OME-NGFF
0.4 and 0.5, "multiscales"):

    x_world = scale * index + translation        on each axis; units are kept as they are
"""

from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np

from volref.arrays import Floats, Numbers, whole_number
from volref.errors import FormatError
from volref.io.guard import Foreign, extra, nearest, one_line, wrapped
from volref.io.placement import placement_of_attributes
from volref.io.zarr_guard import check_array, check_files

SPACE = ("z", "y", "x")


class _Axes(NamedTuple):
    """Names of the axes; on each an index is worth scale * index + translation (scale 0: not stated)."""

    names: tuple[str, ...]
    scale: Floats
    translation: Floats


def read_zarr(
    path: Path, key: object, level: object, index: object, max_bytes: int
) -> tuple[Numbers, dict[str, Any]]:
    """Return the samples (nz, ny, nx) of a Zarr array or OME-Zarr image, and what it says of its place.

    Parameters
    ----------
    key
        Path of the array, or of the image, in its group; needed unless the group is one image or holds one
        array with three axes.
    level
        Which array of an OME-Zarr pyramid; None is 0, the finest.
    index
        Which of each axis that is not of space (t, c), in their order; needed unless each has length 1.

    Raises
    ------
    FormatError
        If there is no such array, it is damaged, or it needs too much memory.
    """
    zarr = extra("zarr", "Zarr", "zarr")
    check_files(path)
    with wrapped(path, "Zarr array"):
        packed = path.is_file()
        store = (
            zarr.storage.ZipStore(path, mode="r") if packed else zarr.storage.LocalStore(path, read_only=True)
        )
        try:
            node = zarr.open(store=store, mode="r")
            node = node if key is None or isinstance(node, zarr.Array) else _member(path, node, key)
            array, axes = _array_and_axes(zarr, path, node, level)
            chosen = _selection(path, axes.names, array.shape, index)
            check_array(path, array, chosen, max_bytes)
            samples: Numbers = np.asarray(array[chosen])
        finally:
            store.close()
        names = [name for name in axes.names if name in SPACE]
        samples = samples.transpose([names.index(name) for name in SPACE])
        return samples, _placement(axes) or placement_of_attributes(path, array.attrs.asdict())


def _member(path: Path, group: Foreign, key: object) -> Foreign:
    wanted = str(key).strip("/")
    if wanted in group:
        return group[wanted]
    message = f"{path.name} must hold the array or image that key names, got key={one_line(repr(key))}; "
    raise FormatError(message + nearest(wanted, [one_line(name) for name in group]))


def _array_and_axes(zarr: ModuleType, path: Path, node: Foreign, level: object) -> tuple[Foreign, _Axes]:
    if isinstance(node, zarr.Array):
        return node, _plain_axes(node)
    said = node.attrs.asdict()
    said = said.get("ome", said)
    if isinstance(said, dict) and "multiscales" in said:
        return _image(zarr, path, node, said["multiscales"], level)
    fitting = [name for name, array in node.arrays() if array.ndim == 3]
    if len(fitting) == 1:
        return node[fitting[0]], _plain_axes(node[fitting[0]])
    got = one_line(", ".join(sorted(fitting))) if fitting else "none"
    message = f"{path.name} must hold one OME-Zarr image or one array with 3 axes, got {got}; "
    raise FormatError(message + ("pass key=NAME" if fitting else "save the volume as one"))


def _plain_axes(array: Foreign) -> _Axes:
    """Return the axes of an array that is no image: by name if it names x, y and z, else z first."""
    stated = getattr(array.metadata, "dimension_names", None) or array.attrs.get("_ARRAY_DIMENSIONS")
    names = tuple(str(name).lower() for name in stated or ())
    if not set(SPACE) <= set(names) or len(names) != array.ndim:
        others = [f"axis {i}" for i in range(array.ndim - 3)]
        names = (*others, *SPACE) if array.ndim >= 3 else ()
    return _Axes(names, np.zeros(len(names)), np.zeros(len(names)))


def _image(
    zarr: ModuleType, path: Path, group: Foreign, multiscales: Foreign, level: object
) -> tuple[Foreign, _Axes]:
    if len(multiscales) != 1:
        message = f"{path.name} must hold one multiscale image, got {len(multiscales)}; pass key= of an array"
        raise FormatError(message)
    image = multiscales[0]
    datasets, axes = image["datasets"], image.get("axes", [])
    number = whole_number("volume.level", 0 if level is None else level, low=0, high=len(datasets) - 1)
    array = group[str(datasets[number]["path"])]
    names = tuple(str(axis["name"] if isinstance(axis, dict) else axis).lower() for axis in axes)
    if not isinstance(array, zarr.Array) or len(names) != array.ndim or not set(SPACE) <= set(names):
        message = f"{path.name} must have the axes x, y and z and one name for each, got "
        raise FormatError(message + f"{one_line(', '.join(names)) or 'none'}; pass key= of an array in it")
    units = {
        str(axis.get("unit")) for axis in axes if isinstance(axis, dict) and axis["name"].lower() in SPACE
    }
    if len(units) > 1:
        message = f"{path.name} must have one unit for x, y and z, got {one_line(', '.join(sorted(units)))}; "
        raise FormatError(message + "scale it to one unit")
    place = _Axes(names, np.zeros(len(names)), np.zeros(len(names)))
    for said in (datasets[number], image):
        place = _transformed(path, place, said.get("coordinateTransformations") or [])
    return array, place


def _transformed(path: Path, axes: _Axes, transforms: Foreign) -> _Axes:
    """Return the axes after transformations; a scale of 0 stands for none yet."""
    scale, translation = axes.scale, axes.translation
    for one in transforms:
        kind, numbers = one["type"], one.get(one["type"])
        if kind == "identity":
            continue
        found = np.array(numbers, dtype=np.float64) if kind in ("scale", "translation") else np.zeros(0)
        if found.shape != scale.shape or not np.isfinite(found).all():
            message = (
                f"{path.name} must be placed by a scale and a translation of {len(scale)} finite numbers, "
            )
            raise FormatError(message + f"got {one_line(str(one))}; pass spacing= and key= of an array")
        if kind == "scale":
            scale, translation = np.where(scale == 0, 1.0, scale) * found, translation * found
        else:
            translation = translation + found
    return _Axes(axes.names, scale, translation)


def _placement(axes: _Axes) -> dict[str, Any]:
    places = [axes.names.index(name) for name in ("x", "y", "z")] if axes.names else []
    if not places or not axes.scale[places].any():
        return {}
    return {"spacing": axes.scale[places].tolist(), "origin": axes.translation[places].tolist()}


def _selection(
    path: Path, names: tuple[str, ...], shape: tuple[int, ...], index: object
) -> tuple[int | slice, ...]:
    """Return what to read: all of x, y and z, and one of every other axis."""
    if not names:
        message = (
            f"{path.name} must hold an array with at least 3 axes, got shape {shape}; choose one by key="
        )
        raise FormatError(message)
    others = [i for i, name in enumerate(names) if name not in SPACE]
    long = [f"{names[i]} of {shape[i]}" for i in others if shape[i] > 1]
    if index is None and long:
        message = (
            f"{path.name} must hold one scalar field, got the axes {one_line(', '.join(long))} as well; "
        )
        raise FormatError(message + f"pass index= with {len(others)} numbers")
    given = [0] * len(others) if index is None else index if isinstance(index, list | tuple) else [index]
    if len(given) != len(others):
        message = (
            f"volume.index must have {len(others)} numbers, got {len(given)}; give one for each axis of "
        )
        raise FormatError(message + f"{one_line(', '.join(names[i] for i in others)) or path.name}")
    chosen: list[int | slice] = [slice(None)] * len(names)
    for number, (i, value) in enumerate(zip(others, given, strict=True)):
        chosen[i] = whole_number(f"volume.index[{number}]", value, low=0, high=shape[i] - 1)
    return tuple(chosen)
