"""Cameras that hang in a tree of nodes: glTF's and three.js's.

Both place a camera by the product of the transforms on the way to it, both look along -z with y upwards.
"""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from volref.arrays import LARGEST_LENGTH, Floats, float_array, number
from volref.errors import FormatError
from volref.io.guard import Foreign, nearest, one_line
from volref.scene.camera import Camera
from volref.scene.transform import affine, check_regular, invert_affine

MOST_NODES = 1_000_000

# How far the axes of a node may be from right angles and unit lengths: float32, a few products deep.
RIGID = 1e-5


@dataclass(frozen=True, eq=False)
class Placed:
    """A camera of a tree: its names, and what builds it with the given clipping planes for its own."""

    names: tuple[str, ...]
    build: Callable[[dict[str, float]], Camera]


def chosen(file: Path, cameras: list[Placed], key: str | int | None, planes: dict[str, float]) -> Camera:
    """Return the camera that `key` names, or the only one.

    Raises
    ------
    FormatError
        If there is none, or several and no key.
    """
    known = [name for placed in cameras for name in placed.names]
    if not cameras:
        message = f"{file.name} must hold a camera, got none; export it with its cameras"
        raise FormatError(message)
    if isinstance(key, int) and not isinstance(key, bool) and 0 <= key < len(cameras):
        fitting = [cameras[key]]
    else:
        fitting = [placed for placed in cameras if key is None or key in placed.names]
    if len(fitting) == 1:
        return fitting[0].build(planes)
    if fitting:
        message = f"{file.name} must hold one camera, got {len(fitting)}; pass key=, a number from 0 to "
        raise FormatError(
            message + f"{len(cameras) - 1}, or a name: {one_line(', '.join(known[:6]) or 'none')}"
        )
    message = f"{file.name} must hold the camera that key names, got key={one_line(repr(key))}; "
    raise FormatError(message + one_line(nearest(str(key), known)))


def cameras_of_gltf(file: Path, document: Mapping[str, Foreign]) -> list[Placed]:
    """Return the cameras of a glTF 2.0 document, in the order of the nodes that bear them.

    Scales on the way are ignored, as section 3.10 of the specification asks.
    """
    nodes, cameras = (_objects(file, document, name) for name in ("nodes", "cameras"))
    parents: dict[int, int] = {}
    for i, node in enumerate(nodes):
        for child in _list(file, node, "children"):
            parents[_index(file, child, len(nodes))] = i
    placed = []
    for i, node in enumerate(nodes):
        if "camera" not in node:
            continue
        camera = cameras[_index(file, node["camera"], len(cameras))]
        matrix = np.eye(4)
        for ancestor in _upwards(file, parents, i):
            matrix = _gltf_transform(file, nodes[ancestor]) @ matrix
        names = tuple(dict.fromkeys(str(part["name"]) for part in (node, camera) if "name" in part))
        frame = _rigid(file, matrix, scaled=True)
        placed.append(Placed(names, partial(_gltf_camera, file, camera, frame)))
    return placed


def cameras_of_three(file: Path, root: Mapping[str, Foreign]) -> list[Placed]:
    """Return the cameras below an object of three.js's JSON format, in the order of the tree."""
    placed = []
    left: list[tuple[Mapping[str, Foreign], Floats]] = [(root, np.eye(4))]
    while left:
        node, above = left.pop()
        matrix = above @ _columns(file, "matrix", node.get("matrix"))
        if node.get("type") in ("PerspectiveCamera", "OrthographicCamera"):
            names = tuple(str(node[word]) for word in ("name", "uuid") if node.get(word))
            frame = _rigid(file, matrix, scaled=False)
            placed.append(Placed(names, partial(_three_camera, file, node, frame)))
        left.extend((child, matrix) for child in reversed(_objects(file, node, "children")))
    return placed


def _gltf_camera(
    file: Path, camera: Mapping[str, Foreign], frame: Floats, planes: dict[str, float]
) -> Camera:
    kind = camera.get("type")
    if kind not in ("perspective", "orthographic") or not isinstance(camera.get(kind), dict):
        message = f"{file.name}: camera.type must be 'perspective' or 'orthographic' with its numbers, got "
        raise FormatError(message + f"{one_line(repr(kind))}; export it again")
    words: Mapping[str, Foreign] = camera[kind]
    view = invert_affine("camera.node", frame)
    far = None if kind == "orthographic" else LARGEST_LENGTH  # perspective without zfar has no far plane
    given = {"near": _number(file, words, "znear"), "far": _number(file, words, "zfar", far)} | planes
    if kind == "perspective":
        angle = math.degrees(_number(file, words, "yfov"))
        return Camera(view, "perspective", fov_y=angle, near=given["near"], far=given["far"])
    height = 2 * _number(file, words, "ymag")
    return Camera(view, "orthographic", height=height, near=given["near"], far=given["far"])


def _three_camera(file: Path, node: Mapping[str, Foreign], frame: Floats, planes: dict[str, float]) -> Camera:
    """Return a camera by the rules of three.js's own updateProjectionMatrix, which zoom divides.

    Raises
    ------
    FormatError
        If it shows a part of a larger image, or its film is shifted.
    """
    part = node.get("view")
    if isinstance(part, dict) and part.get("enabled", True):
        message = f"{file.name}: camera.view must be off, got part of a larger image; call clearViewOffset()"
        raise FormatError(message)
    shift = _number(file, node, "filmOffset", 0.0)
    if shift != 0:
        message = f"{file.name}: camera.filmOffset must be 0, got {shift:g}; give the two matrices instead"
        raise FormatError(message)
    zoom = number(f"{file.name}: camera.zoom", node.get("zoom", 1.0), above=0)
    given = {name: _number(file, node, name) for name in ("near", "far")} | planes
    if node["type"] == "PerspectiveCamera":
        half = math.tan(math.radians(_number(file, node, "fov")) / 2)
        angle = math.degrees(2 * math.atan(half / zoom))
        view = invert_affine("camera.matrix", frame)
        return Camera(view, "perspective", fov_y=angle, near=given["near"], far=given["far"])
    left, right, top, bottom = (_number(file, node, side) for side in ("left", "right", "top", "bottom"))
    middle = affine(np.eye(3), np.array([(left + right) / 2, (top + bottom) / 2, 0.0]))
    view = invert_affine("camera.matrix", frame @ middle)
    height = (top - bottom) / zoom
    return Camera(view, "orthographic", height=height, near=given["near"], far=given["far"])


def _gltf_transform(file: Path, node: Mapping[str, Foreign]) -> Floats:
    """Return the transform of a node: its matrix by columns, or T R S (glTF 2.0, section 3.5)."""
    if "matrix" in node:
        return _columns(file, "matrix", node["matrix"])
    from scipy.spatial.transform import Rotation

    quaternion = float_array(f"{file.name}: rotation", node.get("rotation", (0, 0, 0, 1)), (4,))
    scale = float_array(f"{file.name}: scale", node.get("scale", (1, 1, 1)), (3,), limit=LARGEST_LENGTH)
    shift = float_array(
        f"{file.name}: translation", node.get("translation", (0, 0, 0)), (3,), limit=LARGEST_LENGTH
    )
    return affine(np.asarray(Rotation.from_quat(quaternion).as_matrix() * scale), shift)


def _rigid(file: Path, matrix: Floats, *, scaled: bool) -> Floats:
    """Return a node's matrix without its scale, which may stand there only if `scaled`.

    Raises
    ------
    FormatError
        If it shears, mirrors, flattens, or scales where it may not.
    """
    check_regular(f"{file.name}: the node's matrix", matrix[:3, :3])
    lengths = np.linalg.norm(matrix[:3, :3], axis=0)
    axes = matrix[:3, :3] / lengths
    right = np.allclose(axes.T @ axes, np.eye(3), rtol=0, atol=RIGID) and np.linalg.det(axes) > 0
    if right and (scaled or np.allclose(lengths, 1, rtol=0, atol=RIGID)):
        return affine(axes, matrix[:3, 3])
    rule = "turn and move it only" if not scaled else "not shear or mirror it"
    message = f"{file.name}: the nodes above a camera must {rule}, got {matrix[:3, :3].round(6).tolist()}; "
    raise FormatError(message + "apply the transforms before exporting")


def _columns(file: Path, name: str, numbers: Foreign) -> Floats:
    matrix = float_array(f"{file.name}: {name}", numbers, (16,), limit=LARGEST_LENGTH).reshape(4, 4).T
    if np.array_equal(matrix[3], (0, 0, 0, 1)):
        return matrix
    message = f"{file.name}: {name} must have the last row (0, 0, 0, 1), got {matrix[3].tolist()}; "
    raise FormatError(message + "write it by columns")


def _upwards(file: Path, parents: Mapping[int, int], node: int) -> Iterator[int]:
    """Yield a node and its ancestors, refusing a circle."""
    seen = set()
    at: int | None = node
    while at is not None:
        if at in seen:
            message = f"{file.name} must hold nodes in a tree, got node {at} above itself; export it again"
            raise FormatError(message)
        seen.add(at)
        yield at
        at = parents.get(at)


def _list(file: Path, part: Mapping[str, Foreign], name: str) -> list[Foreign]:
    found = part.get(name, [])
    if isinstance(found, list) and len(found) <= MOST_NODES:
        return found
    message = (
        f"{file.name}: {name} must be a list of at most {MOST_NODES}, got {one_line(repr(found))[:60]}; "
    )
    raise FormatError(message + "export it again")


def _objects(file: Path, part: Mapping[str, Foreign], name: str) -> list[Mapping[str, Foreign]]:
    entries = _list(file, part, name)
    if all(isinstance(entry, dict) for entry in entries):
        return entries
    message = f"{file.name}: {name} must be objects, got something else among them; export it again"
    raise FormatError(message)


def _index(file: Path, value: Foreign, count: int) -> int:
    if isinstance(value, int) and not isinstance(value, bool) and 0 <= value < count:
        return value
    message = f"{file.name} must refer to one of its {count} entries, got {one_line(repr(value))}; "
    raise FormatError(message + "export it again")


def _number(file: Path, words: Mapping[str, Foreign], name: str, usual: float | None = None) -> float:
    return number(f"{file.name}: camera.{name}", words.get(name, usual))
