"""Scenes as JSON: scene.json with the arrays in files beside it.

The schema (`scene_schema()`) says which keys there are.  Paths are relative to the scene's file and stay
inside its folder; numbers in the JSON and arrays beside it come back bit for bit.
"""

import json
from pathlib import Path
from typing import Any

from volref.errors import FormatError
from volref.io.atomic import check_free, write_text
from volref.io.documents import FORMAT_VERSION, check_document, check_format, whole_numbers
from volref.io.guard import DEFAULT_MAX_BYTES, one_line, path_inside, read_json
from volref.io.meshes import load_meshes, save_mesh
from volref.io.npy import write_npy
from volref.io.transfer import load_transfer
from volref.io.transfer_json import document_of_transfer, transfer_of_document
from volref.io.volumes import load_volume
from volref.scene.camera import Camera
from volref.scene.mesh import Mesh
from volref.scene.scene import Scene
from volref.scene.transfer2d import AnyTransfer
from volref.scene.volume import Volume

FORMAT = "volref-scene"


def load_scene(path: str | Path, *, allow_outside: bool = False, max_bytes: int = DEFAULT_MAX_BYTES) -> Scene:
    """Scene in a JSON file, with the volume and the meshes that it names.

    Parameters
    ----------
    allow_outside
        True lets the file name others outside its folder (absolute paths, `..`, links).
    max_bytes
        The most memory the volume and each mesh may take.

    Raises
    ------
    FormatError
        If the document breaks the schema (unknown keys included), a path leads outside, or a file that it
        names cannot be read.
    SceneError
        If the scene breaks a rule of the scene model.
    """
    file = Path(path)
    document: Any = read_json(file)
    check_format(file, document, FORMAT)
    check_document(file, document)
    document = whole_numbers(document)

    def beside(reference: dict[str, Any]) -> Path:
        return path_inside(file, reference["path"], allow_outside=allow_outside)

    meshes: list[Mesh] = []
    for entry in document.get("meshes", []):
        meshes.extend(load_meshes(beside(entry), max_bytes=max_bytes) if "path" in entry else [Mesh(**entry)])
    volume = None
    if "volume" in document:
        statement = {key: value for key, value in document["volume"].items() if key != "path"}
        volume = load_volume(beside(document["volume"]), max_bytes=max_bytes, **statement)
    transfer: AnyTransfer | None = None
    if "transfer" in document:
        entry = document["transfer"]
        options = {key: value for key, value in entry.items() if key != "path"}
        transfer = (
            load_transfer(beside(entry), **options)
            if "path" in entry
            else transfer_of_document(entry, file, allow_outside=allow_outside)
        )
    return Scene(
        volume,
        transfer,
        camera_of_document(document["camera"]),
        document["width"],
        document["height"],
        meshes,
        background=document.get("background", (0.0, 0.0, 0.0, 0.0)),
    )


def save_scene(scene: Scene, path: str | Path, *, overwrite: bool = False) -> None:
    """Write a scene as JSON, its arrays beside it; `load_scene` returns the same numbers, bit for bit.

    For `shot.json` the arrays are `shot.volume.npy`, `shot.mesh_0.npz` and so on.  The JSON is written
    last, so an interrupted run leaves no scene that names a missing file.

    Raises
    ------
    FormatError
        If the name does not end in .json, or one of the files exists and `overwrite` is False.
    """
    file = Path(path)
    if file.suffix.lower() != ".json":
        message = f"{one_line(file.name)} must end in .json, got {file.suffix!r}; rename it"
        raise FormatError(message)
    names = {f"{file.stem}.mesh_{i}.npz": mesh for i, mesh in enumerate(scene.meshes)}
    volume_name = f"{file.stem}.volume.npy"
    for name in (file.name, *names, *([volume_name] if scene.volume is not None else [])):
        check_free(file.with_name(name), overwrite=overwrite)
    document: dict[str, Any] = {
        "format": FORMAT,
        "format_version": FORMAT_VERSION,
        "width": scene.width,
        "height": scene.height,
        "camera": document_of_camera(scene.camera),
        "background": list(scene.background),
    }
    if scene.volume is not None:
        volume, transfer = scene.gridded
        write_npy(file.with_name(volume_name), volume.values, overwrite=overwrite)
        document["volume"] = {"path": volume_name, **document_of_placement(volume)}
        document["transfer"] = document_of_transfer(transfer)
    for name, mesh in names.items():
        save_mesh(mesh, file.with_name(name), overwrite=overwrite)
    document["meshes"] = [{"path": name} for name in names]
    write_text(file, json.dumps(document, indent=1, allow_nan=False) + "\n", overwrite=overwrite)


def camera_of_document(document: dict[str, Any]) -> Camera:
    """Return the camera in a checked JSON object."""
    fields = {key: value for key, value in document.items() if key != "kind"}
    if document["kind"] == "matrix":
        return Camera.from_matrices(**fields)
    if "view_from_world" in fields:
        return Camera(fields.pop("view_from_world"), document["kind"], **fields)
    build = Camera.look_at if document["kind"] == "perspective" else Camera.orthographic
    return build(**fields)


def document_of_camera(camera: Camera) -> dict[str, Any]:
    """Return the JSON object that `camera_of_document` reads."""
    document: dict[str, Any] = {"kind": camera.kind, "view_from_world": camera.view_from_world.tolist()}
    if camera.clip_matrix is not None:
        document["clip_from_view"] = camera.clip_matrix.tolist()
    else:
        opening = {"fov_y": camera.fov_y, "height": camera.height}
        document |= {key: value for key, value in opening.items() if value is not None}
        document |= {"near": camera.near, "far": camera.far}
    return document | {"clip_z": camera.clip_z}


def document_of_placement(volume: Volume) -> dict[str, Any]:
    """Return where a volume lies, as JSON: spacing, origin, direction, centering."""
    return {
        "spacing": list(volume.spacing),
        "origin": list(volume.origin),
        "direction": volume.direction.tolist(),
        "centering": volume.centering,
    }
