"""What a file holds, as numbers that can be printed or written as JSON."""

from pathlib import Path
from typing import Any

import numpy as np

from volref.errors import FormatError
from volref.io.block_cache import cache_path
from volref.io.documents import check_format
from volref.io.guard import DEFAULT_MAX_BYTES, existing_path, one_line, read_json
from volref.io.images import read_image
from volref.io.meshes import SUFFIXES, load_meshes
from volref.io.npy import npz_headers, read_npy
from volref.io.png import read_png_header
from volref.io.radar.door import holds_radar, load_radar
from volref.io.readers import is_volume_path
from volref.io.scene_parts import document_of_look, document_of_placement
from volref.io.scenes import FORMAT as SCENE_FORMAT
from volref.io.scenes import load_scene
from volref.io.transfer import FORMAT as TRANSFER_FORMAT
from volref.io.transfer import load_transfer, names_of_others
from volref.io.volumes import load_volume
from volref.scene.mesh import Mesh
from volref.scene.radar import RadarVolume
from volref.scene.scene import Scene
from volref.scene.transfer import TransferFunction
from volref.scene.transfer2d import TransferFunction2D
from volref.scene.volume import Volume


def describe_file(
    path: str | Path, *, max_bytes: int = DEFAULT_MAX_BYTES, **statement: object
) -> dict[str, Any]:
    """Return what a file holds.

    Its "kind" is "volume", "radar", "mesh", "scene", "transfer", "transfers" (another program's, by name),
    "image" or "table" (a lookup table).  `statement` is what `load_volume` needs to be told of the file.  A
    .npy or .png with such a statement, in the call or in `<name>.json`, is a volume; a .npy (a, b, 4) without
    is an image.  Everything in the result is JSON.

    Raises
    ------
    FormatError, SceneError
        If the file cannot be read as what its suffix and contents say it is.
    """
    file = existing_path(path)
    told: dict[str, Any] = dict(statement)
    kind = "volume" if statement else _kind_of(file, max_bytes)
    about: dict[str, Any] = {"kind": kind, "file": file.name, "file_bytes": _bytes_of(file)}
    if kind == "volume":
        beside = cache_path(file.resolve())
        kept = {"block_ranges": beside.name} if beside.is_file() else {}
        return about | describe_volume(load_volume(file, max_bytes=max_bytes, **told)) | kept
    if kind == "mesh":
        return about | {"meshes": [describe_mesh(mesh) for mesh in load_meshes(file, max_bytes=max_bytes)]}
    if kind == "radar":
        return about | describe_volume(load_radar(file, max_bytes=max_bytes))
    if kind == "transfers":
        program, names = names_of_others(read_json(file)) or ("", [])
        return about | {"program": program, "names": names}
    if kind == "scene":
        return about | describe_scene(load_scene(file, max_bytes=max_bytes))
    if kind == "transfer":
        return about | describe_transfer(load_transfer(file))
    if kind == "table":
        return about | {
            "entries": len(read_npy(file, max_bytes)),
            "dtype": str(read_npy(file, max_bytes).dtype),
        }
    return about | _describe_image(file, max_bytes)


def describe_volume(volume: Volume | RadarVolume) -> dict[str, Any]:
    """Return size, type, place, range and memory of a volume, or sweeps, box and range of a radar's."""
    low, high = volume.value_bounds
    if isinstance(volume, RadarVolume):
        box = [end.tolist() for end in volume.box]
        return {"sweeps": len(volume.sweeps), "bounds": box, "value_range": [low, high]}
    return {
        "size": list(volume.size),
        "dtype": volume.values.dtype.name,
        **document_of_placement(volume),
        "bounds": _bounds(volume.corners),
        "value_range": [low, high],
        "memory_bytes": int(volume.values.nbytes),
    }


def describe_mesh(mesh: Mesh) -> dict[str, Any]:
    """Return counts, bounds, colouring of a mesh, and whether its surface is closed."""
    return {
        "vertices": len(mesh.vertices),
        "faces": len(mesh.faces),
        "dropped": mesh.dropped,
        "bounds": _bounds(mesh.vertices),
        "watertight": is_watertight(mesh),
        "coloring": mesh.coloring,
        "texture": None if mesh.texture is None else list(mesh.texture.shape[1::-1]),
    }


def is_watertight(mesh: Mesh) -> bool:
    """Say whether every edge has exactly two triangles, vertices at one place counting as one.

    Examples
    --------
    >>> corners = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
    >>> faces = [(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)]
    >>> is_watertight(Mesh(corners, faces)), is_watertight(Mesh(corners, faces[:3]))
    (True, False)
    """
    places = np.unique(mesh.vertices, axis=0, return_inverse=True)[1].reshape(-1)
    corners = places[mesh.faces]
    edges = np.sort(corners[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    return bool((np.unique(edges, axis=0, return_counts=True)[1] == 2).all())


def describe_transfer(transfer: TransferFunction | TransferFunction2D) -> dict[str, Any]:
    """Return knots, range, interpolation and unit distance of a transfer function."""
    if isinstance(transfer, TransferFunction2D):
        return {
            "entries": list(transfer.rgba.shape[:2]),
            "value_range": list(transfer.value_domain),
            "magnitude_range": list(transfer.magnitude_domain),
            "unit_distance": transfer.unit_distance,
        }
    return {
        "knots": len(transfer.values),
        "value_range": [float(transfer.values[0]), float(transfer.values[-1])],
        "interpolation": transfer.interpolation,
        "unit_distance": transfer.unit_distance,
    }


def describe_scene(scene: Scene) -> dict[str, Any]:
    """Return what a scene shows and on how many pixels."""
    return {
        "width": scene.width,
        "height": scene.height,
        "camera": scene.camera.kind,
        **{key: value for key, value in document_of_look(scene).items() if value},
        "volume": None if scene.volume is None else describe_volume(scene.volume),
        "transfer": None if scene.transfer is None else describe_transfer(scene.transfer),
        "meshes": [describe_mesh(mesh) for mesh in scene.meshes],
    }


def _kind_of(file: Path, max_bytes: int) -> str:
    if file.is_dir():
        return "volume"
    suffix = file.suffix.lower()
    if suffix in (".npy", ".png") and file.with_name(file.name + ".json").is_file():
        return "volume"
    if suffix == ".json":
        return _kind_of_json(file)
    if suffix in SUFFIXES:
        return "mesh"
    if suffix not in (".npy", ".png", ".exr", ".raw", ".bin") and holds_radar(file):
        return "radar"
    if suffix == ".npy":
        return _kind_of_shape(read_npy(file, max_bytes).shape)
    if suffix == ".npz":
        names = npz_headers(file)
        return "mesh" if {"vertices", "faces"} <= set(names) else "image" if "rgba" in names else "volume"
    if suffix in (".png", ".exr"):
        return "image"
    if is_volume_path(file):
        return "volume"
    message = (
        f"{one_line(file.name)} must be a volume, mesh, scene, transfer function or image, got {suffix!r}; "
    )
    raise FormatError(message + "convert it to a format that volref reads")


def _kind_of_json(file: Path) -> str:
    document = read_json(file)
    if isinstance(document, dict) and document.get("format") == TRANSFER_FORMAT:
        return "transfer"
    if names_of_others(document) is not None:
        return "transfers"
    check_format(file, document, SCENE_FORMAT)
    return "scene"


def _kind_of_shape(shape: tuple[int, ...]) -> str:
    """Tell a lookup table (n, 4) and an image (height, width[, 4]) from a volume (nz, ny, nx)."""
    if len(shape) == 3:
        return "image" if shape[2] == 4 else "volume"
    return "table" if len(shape) == 2 and shape[1] == 4 else "image"


def _describe_image(file: Path, max_bytes: int) -> dict[str, Any]:
    image = read_image(file, max_bytes=max_bytes)
    about: dict[str, Any] = {"width": image.shape[1], "height": image.shape[0]}
    if file.suffix.lower() == ".png":
        about["stored"] = read_png_header(file).description
    alpha = image[..., 3]
    return about | {
        "color_range": [float(image[..., :3].min()), float(image[..., :3].max())],
        "alpha_range": [float(alpha.min()), float(alpha.max())],
    }


def _bytes_of(path: Path) -> int:
    """Return the size of a file, or of all files in a folder."""
    if path.is_file():
        return path.stat().st_size
    return sum(file.stat().st_size for file in path.rglob("*") if file.is_file())


def _bounds(points: np.ndarray[Any, np.dtype[np.float64]]) -> list[list[float]]:
    return [points.min(axis=0).tolist(), points.max(axis=0).tolist()]
