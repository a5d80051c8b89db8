"""Meshes from files: trimesh reads them, volref takes positions, triangles and colours, never cameras.

8-bit colours are divided by 255 and not decoded.  volref's own .npz holds the fields of `Mesh` exactly.
"""

from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np

from volref.arrays import Floats
from volref.errors import FormatError
from volref.io.guard import (
    DEFAULT_MAX_BYTES,
    Foreign,
    check_memory,
    existing_file,
    one_line,
    path_inside,
    wrapped,
)
from volref.io.materials import appearance, problems_of_mtl
from volref.io.npy import read_npz, write_npz
from volref.scene.mesh import Mesh
from volref.scene.transform import transform_points

# The formats that trimesh reads without a further package.
SUFFIXES = (".obj", ".ply", ".stl", ".off", ".glb", ".gltf")
ARRAYS = ("vertices", "faces", "colors", "uv", "texture", "normals", "back_color")
NUMBERS = ("opacity", "lit")
WORDS = ("wrap", "coloring", "sides")


def load_mesh(path: str | Path, *, process: bool = False, max_bytes: int = DEFAULT_MAX_BYTES) -> Mesh:
    """Return the one mesh in a file (.obj .ply .stl .off .glb .gltf, or volref's .npz), in world coordinates.

    Vertex colours, face colours, a texture with its coordinates, or the colour of a material are carried
    over with their alphas, see `volref.io.materials`; a file without colours gives the grey of `Mesh`.
    Vertex normals are kept, but no file says that its mesh is lit.  The scene graph's transforms are applied.

    Parameters
    ----------
    process
        True lets trimesh merge equal vertices; False keeps the file's.
    max_bytes
        The largest file to read.

    Raises
    ------
    FormatError
        If the file cannot be read, holds several meshes (see `load_meshes`) or none.
    SceneError
        If the mesh breaks a rule of `Mesh`.
    """
    meshes = load_meshes(path, process=process, max_bytes=max_bytes)
    if len(meshes) == 1:
        return meshes[0]
    message = (
        f"{Path(path).name} must hold one mesh, got {len(meshes)}; use load_meshes, which returns them all"
    )
    raise FormatError(message)


def load_meshes(
    path: str | Path, *, process: bool = False, max_bytes: int = DEFAULT_MAX_BYTES
) -> tuple[Mesh, ...]:
    """Return all meshes in a file, one for each place in its scene graph; see `load_mesh`."""
    file = existing_file(path)
    if file.suffix.lower() == ".npz":
        return (_read_npz(file, max_bytes),)
    if file.suffix.lower() not in SUFFIXES:
        message = f"{one_line(file.name)} must end in {', '.join((*SUFFIXES, '.npz'))}, got {file.suffix!r}; "
        raise FormatError(message + "convert it to PLY or GLB")
    check_memory(file, file.stat().st_size, max_bytes, "mesh file")
    import trimesh

    missing: list[str] = []
    wrong: list[str] = []
    with wrapped(file, "mesh file"), file.open("rb") as stream:
        # allow_remote: a mesh must not make anyone fetch a texture from the network.
        scene = trimesh.load_scene(
            stream,
            file_type=file.suffix[1:].lower(),
            resolver=_resolver(file, missing, wrong),
            process=process,
            allow_remote=False,
        )
        if wrong:
            raise FormatError(wrong[0])
        placed = [(scene.graph.get(node)) for node in sorted(scene.graph.nodes_geometry)]
        parts = [(scene.geometry[name], np.asarray(matrix)) for matrix, name in placed]
        meshes = tuple(_mesh_of(file, part, matrix) for part, matrix in parts)
    if missing:
        message = f"{file.name} must name files that lie in its folder, got {one_line(missing[0])!r}, which "
        raise FormatError(message + "cannot be read; copy it there or remove the reference")
    if meshes:
        return meshes
    message = f"{file.name} must hold a mesh of triangles, got none; export the surface again"
    raise FormatError(message)


def save_mesh(mesh: Mesh, path: str | Path, *, overwrite: bool = False) -> None:
    """Write a mesh as .npz; reading it back gives the same arrays, bit for bit.

    Triangles that `Mesh` dropped are not written, so the copy counts none.

    Raises
    ------
    FormatError
        If the name does not end in .npz, or the file exists and `overwrite` is False.
    """
    if Path(path).suffix.lower() != ".npz":
        message = f"{Path(path).name} must end in .npz, got {Path(path).suffix!r}; rename it"
        raise FormatError(message)
    fields: dict[str, Any] = {name: getattr(mesh, name) for name in (*ARRAYS, *NUMBERS, *WORDS)}
    arrays = {name: np.asarray(value) for name, value in fields.items() if value is not None}
    write_npz(path, arrays, overwrite=overwrite)


def _read_npz(file: Path, max_bytes: int) -> Mesh:
    fields: dict[str, Any] = dict(read_npz(file, (*ARRAYS, *NUMBERS, *WORDS), max_bytes))
    missing = [name for name in ("vertices", "faces") if name not in fields]
    if missing:
        message = f"{file.name} must hold the arrays vertices and faces, got no {' and '.join(missing)}; "
        raise FormatError(message + "save it with save_mesh")
    fields |= {name: str(fields[name]) for name in WORDS if name in fields}
    with wrapped(file, "mesh file"):
        return Mesh(**fields)


def _resolver(file: Path, missing: list[str], wrong: list[str]) -> Foreign:
    """Return trimesh's reader of the files that `file` names: inside its folder only, notes what is amiss.

    trimesh itself logs a texture or a material file that it cannot read and goes on without.
    """
    from trimesh.resolvers import FilePathResolver

    class Beside(FilePathResolver):  # type: ignore[misc]  # trimesh states no types
        def get(self, name: str) -> bytes:
            for spelling in (name.strip(), unquote(name.strip())):
                try:
                    data = path_inside(file, spelling).read_bytes()
                except (OSError, FormatError):
                    continue
                if spelling.lower().endswith(".mtl"):
                    wrong.extend(problems_of_mtl(spelling, data))
                return data
            missing.append(name)
            raise FileNotFoundError(name)

    return Beside(str(file))


def _mesh_of(file: Path, part: Foreign, matrix: Floats) -> Mesh:
    faces = getattr(part, "faces", None)
    if faces is None or len(faces) == 0:
        message = f"{file.name} must hold triangles, got {type(part).__name__} without; "
        raise FormatError(message + "remove it or triangulate it")
    vertices = transform_points(matrix, np.asarray(part.vertices, dtype=np.float64))
    mirrored = float(np.linalg.det(matrix[:3, :3])) < 0
    # A mirrored body would be inside out.
    corners = np.asarray(faces)[:, ::-1] if mirrored else np.asarray(faces)
    return Mesh(vertices, corners, normals=_normals(part, matrix), **appearance(file, part.visual))


def _normals(part: Foreign, matrix: Floats) -> Floats | None:
    """Return the vertex normals of the file in the world, None where it has none."""
    # trimesh makes up normals when asked for them, and keeps those of the file where it would keep these.
    if "vertex_normals" not in part._cache:
        return None
    normals = np.asarray(part.vertex_normals, dtype=np.float64)
    # Normals stay across their surface if it is stretched: n . (M^-1 M t) = (M^-T n) . (M t).
    return np.asarray(normals @ np.linalg.inv(matrix[:3, :3]))
