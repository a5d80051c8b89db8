"""Scenes as JSON: scene.json with the arrays in files beside it.

The schema (`scene_schema()`) says which keys there are.  Paths are relative to the scene's file and stay
inside its folder; numbers in the JSON and arrays beside it come back bit for bit.
"""

import dataclasses
import json
from pathlib import Path
from typing import Any

from volref.errors import FormatError
from volref.io.atomic import check_free, write_text
from volref.io.documents import FORMAT_VERSION, check_document, check_format, whole_numbers
from volref.io.guard import DEFAULT_MAX_BYTES, one_line, path_inside, read_json
from volref.io.meshes import load_meshes, save_mesh
from volref.io.npy import write_npy
from volref.io.radar.door import load_radar, save_radar
from volref.io.scene_parts import (
    camera_of_document,
    document_of_camera,
    document_of_look,
    document_of_placement,
    look_of_document,
)
from volref.io.transfer import load_transfer, save_transfer
from volref.io.transfer_json import document_of_transfer, transfer_of_document
from volref.io.volumes import load_volume
from volref.scene.mesh import Mesh
from volref.scene.radar import RadarVolume
from volref.scene.scene import Scene
from volref.scene.transfer2d import AnyTransfer, TransferFunction2D
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
        if "path" in entry:
            style = {name: value for name, value in entry.items() if name != "path"}
            loaded = load_meshes(beside(entry), max_bytes=max_bytes)
            meshes.extend(dataclasses.replace(mesh, **style) for mesh in loaded)
        else:
            meshes.append(Mesh(**entry))
    if "volume" in document and "radar" in document:
        message = f"{file.name} must have a volume or a radar, got both; remove one"
        raise FormatError(message)
    volume: Volume | RadarVolume | None = None
    for key, load in (("volume", load_volume), ("radar", load_radar)):
        if key in document:
            statement = {name: value for name, value in document[key].items() if name != "path"}
            volume = load(beside(document[key]), max_bytes=max_bytes, **statement)
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
        **look_of_document(document),
    )


def save_scene(scene: Scene, path: str | Path, *, overwrite: bool = False) -> None:
    """Write a scene as JSON, its arrays beside it; `load_scene` returns the same numbers, bit for bit.

    For `shot.json` the arrays are `shot.volume.npy`, `shot.mesh_0.npz` and so on, and of a radar and a table
    of value and gradient `shot.radar.npz` and `shot.transfer.json`.  The JSON is written last, so an
    interrupted run leaves no scene that names a missing file.

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
    radar = isinstance(scene.volume, RadarVolume)
    volume_name = f"{file.stem}.radar.npz" if radar else f"{file.stem}.volume.npy"
    table_name = f"{file.stem}.transfer.json"
    written = [volume_name] if scene.volume is not None else []
    written += [table_name] if isinstance(scene.transfer, TransferFunction2D) else []
    for name in (file.name, *names, *written):
        check_free(file.with_name(name), overwrite=overwrite)
    document: dict[str, Any] = {
        "format": FORMAT,
        "format_version": FORMAT_VERSION,
        "width": scene.width,
        "height": scene.height,
        "camera": document_of_camera(scene.camera),
    }
    if isinstance(scene.volume, Volume):
        write_npy(file.with_name(volume_name), scene.volume.values, overwrite=overwrite)
        document["volume"] = {"path": volume_name, **document_of_placement(scene.volume)}
    elif isinstance(scene.volume, RadarVolume):
        save_radar(scene.volume, file.with_name(volume_name), overwrite=overwrite)
        document["radar"] = {"path": volume_name, "quantity": scene.volume.quantity}
    if isinstance(scene.transfer, TransferFunction2D):
        save_transfer(scene.transfer, file.with_name(table_name), overwrite=overwrite)
        document["transfer"] = {"path": table_name}
    elif scene.transfer is not None:
        document["transfer"] = document_of_transfer(scene.transfer)
    for name, mesh in names.items():
        save_mesh(mesh, file.with_name(name), overwrite=overwrite)
    document["meshes"] = [{"path": name} for name in names]
    document |= document_of_look(scene)
    write_text(file, json.dumps(document, indent=1, allow_nan=False) + "\n", overwrite=overwrite)
