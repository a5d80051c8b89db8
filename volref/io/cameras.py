"""Cameras from files: glTF, three.js, vtk.js and ParaView, or two matrices.

What a file says in its own words is kept in brackets:

    glTF 2.0     .gltf, .glb    yfov in radians, xmag and ymag half the width and height, node transforms
    three.js     .json          fov in degrees, zoom, object.matrix by columns: what camera.toJSON() returns
    vtk.js       .json          position, focalPoint, viewUp, viewAngle, parallelScale half the height
    ParaView     .json          the same in its property names: CameraPosition, CameraFocalPoint ...
    matrices     .json          view, projection, and order, "column-major" (WebGL) or "row-major"

All of them open vertically, as `Camera` does.  The aspect is that of the image, not of the file: pixels are
square here.
"""

import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from volref.arrays import LARGEST_LENGTH, Floats, float_array, number, one_of
from volref.errors import FormatError
from volref.io.atomic import write_text
from volref.io.camera_nodes import cameras_of_gltf, cameras_of_three, chosen
from volref.io.guard import (
    LARGEST_JSON_BYTES,
    Foreign,
    check_memory,
    existing_file,
    one_line,
    parse_json,
    read_json,
    wrapped,
)
from volref.scene.camera import Camera

SUFFIXES = (".json", ".gltf", ".glb")
ORDERS = ("column-major", "row-major")

# Names that mean the same after `_plain_names`.
ALIASES = {"view_angle_deg": "view_angle", "parallel": "parallel_projection"}

# What a vtkCamera may say that `Camera` has no word for, and the value that says nothing.
PLAIN_VTK = {"use_horizontal_view_angle": 0, "use_off_axis_projection": 0, "window_center": 0}

# float32 matrices, inverted by a library, have a last row that is off by a few ulp.
ROW_TOLERANCE = 1e-6


def load_camera(
    path: str | Path,
    key: str | int | None = None,
    *,
    near: float | None = None,
    far: float | None = None,
) -> Camera:
    """Return the camera in a file (.gltf, .glb, or a .json of three.js, vtk.js, ParaView or two matrices).

    Parameters
    ----------
    key
        Which one, if there are several: the name of its node or itself, or its number from 0.  In a vtk.js,
        ParaView or matrix file the key under which it stands.
    near, far
        Clipping planes in place of the file's; ParaView's files have none.  A glTF camera without zfar gets
        the largest length of a scene, 1e60.

    Raises
    ------
    FormatError
        If the file holds no such camera, or one that cannot be said here: off-centre in words, a horizontal
        opening, a sheared or mirrored node.
    SceneError
        If the camera breaks a rule of `Camera`.
    """
    file = existing_file(path)
    suffix = file.suffix.lower()
    if suffix not in SUFFIXES:
        message = f"{one_line(file.name)} must end in {', '.join(SUFFIXES)}, got {suffix!r}; export it as one"
        raise FormatError(message)
    document = _json_of_glb(file) if suffix == ".glb" else read_json(file)
    planes = {"near": near, "far": far}
    given = {name: number(f"camera.{name}", value) for name, value in planes.items() if value is not None}
    with wrapped(file, "camera file"):
        if not isinstance(document, dict):
            raise FormatError(_unknown(file, "no JSON object"))
        if suffix != ".json":
            return chosen(file, cameras_of_gltf(file, document), key, given)
        if isinstance(document.get("object"), dict):
            return chosen(file, cameras_of_three(file, document["object"]), key, given)
        return _camera_in_words(file, _member(file, document, key), given)


def save_camera(
    camera: Camera, path: str | Path, *, focal_distance: float = 1.0, overwrite: bool = False
) -> None:
    """Write a camera as JSON: as vtk.js has it, or one given by matrices as those, by columns.

    A vtk.js camera states the point that it turns about, which is put `focal_distance` in front of the eye.
    `load_camera` returns the same view to rounding; `volref.save_scene` keeps every bit.

    Raises
    ------
    FormatError
        If the name does not end in .json, or the file exists and `overwrite` is False.
    """
    if Path(path).suffix.lower() != ".json":
        message = f"{one_line(Path(path).name)} must end in .json, got {Path(path).suffix!r}; rename it"
        raise FormatError(message)
    ahead = number("focal_distance", focal_distance, above=0)
    document = _document_of_matrices(camera) if camera.kind == "matrix" else _vtk_document(camera, ahead)
    document |= {"clip_z": camera.clip_z} if camera.clip_z != "-1..1" else {}
    write_text(path, json.dumps(document, indent=1, allow_nan=False) + "\n", overwrite=overwrite)


def _camera_in_words(file: Path, entry: Mapping[str, Foreign], planes: dict[str, float]) -> Camera:
    """Return the camera of a JSON object that states it in words or by matrices."""
    if entry.get("format") == "volref-scene":
        message = f"{file.name} must hold a camera alone, got a scene; use load_scene(path).camera"
        raise FormatError(message)
    if "view" in entry and "projection" in entry:
        return _camera_of_matrices(file, entry)
    words = _plain_names(file, entry)
    if "position" in words:
        return _camera_of_vtk(file, words, planes)
    raise FormatError(_unknown(file, f"the keys {', '.join(sorted(map(str, entry))[:6])}"))


def _camera_of_vtk(file: Path, words: Mapping[str, Foreign], planes: dict[str, float]) -> Camera:
    for name, nothing in PLAIN_VTK.items():
        if np.any(np.asarray(words.get(name, nothing)) != nothing):
            message = f"{file.name}: {name} must be {nothing}, got {one_line(repr(words[name]))}; "
            raise FormatError(message + "state the camera by its view and projection matrices")
    eye, target, up = (_word(file, words, name) for name in ("position", "focal_point", "view_up"))
    clipping = words.get("clipping_range")
    if clipping is not None:
        both = float_array(f"{file.name}: clipping_range", clipping, (2,)).tolist()
        planes = dict(zip(("near", "far"), both, strict=True)) | planes
    if len(planes) < 2:
        message = f"{file.name} must have a clipping_range, got none; pass near= and far="
        raise FormatError(message)
    clip_z = str(words.get("clip_z", "-1..1"))
    if words.get("parallel_projection", False):
        height = 2 * number(f"{file.name}: parallel_scale", _word(file, words, "parallel_scale"))
        return Camera.orthographic(eye, target, up, height, planes["near"], planes["far"], clip_z=clip_z)
    angle = number(f"{file.name}: view_angle", _word(file, words, "view_angle"))
    return Camera.look_at(eye, target, up, angle, planes["near"], planes["far"], clip_z=clip_z)


def _camera_of_matrices(file: Path, entry: Mapping[str, Foreign]) -> Camera:
    order = one_of(f"{file.name}: order", entry.get("order"), ORDERS)
    view, projection = (
        _matrix(f"{file.name}: {name}", entry[name], order) for name in ("view", "projection")
    )
    if view[3, 3] != 0 and np.allclose(view[3] / view[3, 3], (0, 0, 0, 1), rtol=0, atol=ROW_TOLERANCE):
        view = view / view[3, 3]
        view[3] = 0, 0, 0, 1
    return Camera.from_matrices(view, projection, clip_z=str(entry.get("clip_z", "-1..1")))


def _matrix(name: str, numbers: Foreign, order: str) -> Floats:
    """Return a 4x4 matrix, rows first, of 16 numbers or four lists of four in the stated order."""
    nested = isinstance(numbers, list) and len(numbers) == 4
    matrix = float_array(name, numbers, (4, 4) if nested else (16,), limit=LARGEST_LENGTH).reshape(4, 4)
    return np.array(matrix.T if order == "column-major" else matrix)


def _vtk_document(camera: Camera, ahead: float) -> dict[str, Any]:
    world_from_view = camera.world_from_view
    position, forward = world_from_view[:3, 3], -world_from_view[:3, 2]
    opening: dict[str, Any] = {"viewAngle": camera.fov_y}
    if camera.height is not None:
        opening = {"parallelScale": camera.height / 2}
    return {
        "position": position.tolist(),
        "focalPoint": (position + ahead * forward).tolist(),
        "viewUp": world_from_view[:3, 1].tolist(),
        **opening,
        "parallelProjection": camera.is_parallel,
        "clippingRange": [camera.near, camera.far],
    }


def _document_of_matrices(camera: Camera) -> dict[str, Any]:
    assert camera.clip_matrix is not None
    return {
        "view": camera.view_from_world.T.ravel().tolist(),
        "projection": camera.clip_matrix.T.ravel().tolist(),
        "order": "column-major",
    }


def _plain_names(file: Path, entry: Mapping[str, Foreign]) -> dict[str, Foreign]:
    """Return an object with its keys in one spelling: "CameraFocalPoint" and "focalPoint" as focal_point."""
    plain: dict[str, Foreign] = {}
    for key, value in entry.items():
        name = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", key).lower().removeprefix("camera_")
        name = ALIASES.get(name, name)
        if name in plain:
            message = f"{file.name} must state {name} once, got two spellings of it; remove one"
            raise FormatError(message)
        plain[name] = value
    return plain


def _word(file: Path, words: Mapping[str, Foreign], name: str) -> Foreign:
    if name in words:
        return words[name]
    message = f"{file.name} must state {name}, got only {', '.join(sorted(words)[:6])}; add it"
    raise FormatError(message)


def _member(file: Path, document: Mapping[str, Foreign], key: str | int | None) -> Mapping[str, Foreign]:
    """Return the object under `key`, or the document itself."""
    if key is None:
        return document
    entry = document.get(key) if isinstance(key, str) else None
    if isinstance(entry, dict):
        return entry
    known = ", ".join(sorted(name for name, value in document.items() if isinstance(value, dict))[:6])
    message = f"{file.name} must hold the camera that key names, got key={one_line(repr(key))}; "
    raise FormatError(message + (f"use one of {known}" if known else "pass none, it holds one camera only"))


def _json_of_glb(file: Path) -> object:
    """Return the JSON chunk of a binary glTF file, its first (glTF 2.0, section 4.4)."""
    with wrapped(file, "GLB file"), file.open("rb") as stream:
        head = stream.read(20)
        words = np.frombuffer(head[: len(head) // 4 * 4], "<u4").tolist()
        if len(words) < 5 or head[:4] != b"glTF" or words[1] != 2 or head[16:20] != b"JSON":
            message = f"{file.name} must be a GLB file of version 2, got other bytes at its start; "
            raise FormatError(message + "export it again, or as .gltf")
        check_memory(file, words[3], LARGEST_JSON_BYTES, "JSON text")
        if words[3] > file.stat().st_size - 20:
            message = f"{file.name} must hold {words[3]} bytes of JSON, got {file.stat().st_size - 20}; "
            raise FormatError(message + "the file is cut short, so export it again")
        return parse_json(stream.read(words[3]).decode("utf-8"))


def _unknown(file: Path, got: str) -> str:
    message = f"{file.name} must hold a camera of glTF, three.js, vtk.js or ParaView, or two matrices, got "
    return message + f"{one_line(got)}; see the page on cameras for the keys"
