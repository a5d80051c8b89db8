"""Meshes from files: trimesh reads them, volref takes positions, triangles and colours, never cameras.

8-bit colours are divided by 255 and not decoded.  volref's own .npz holds the fields of `Mesh` exactly.
"""

import math
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np

from volref.arrays import Floats, Numbers
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
from volref.io.npy import read_npz, write_npz
from volref.scene.mesh import Mesh
from volref.scene.transform import transform_points

# The formats that trimesh reads without a further package.
SUFFIXES = (".obj", ".ply", ".stl", ".off", ".glb", ".gltf")
ARRAYS = ("vertices", "faces", "colors", "uv", "texture")
# How many numbers a line of an MTL file has (Wavefront; "Kd r" for r, r, r is not read by trimesh).
MTL_COUNTS = {"kd": 3, "ka": 3, "ks": 3, "ns": 1}
WORDS = ("wrap", "coloring")


def load_mesh(path: str | Path, *, process: bool = False, max_bytes: int = DEFAULT_MAX_BYTES) -> Mesh:
    """Return the one mesh in a file (.obj .ply .stl .off .glb .gltf, or volref's .npz), in world coordinates.

    Vertex colours, face colours, a texture with its coordinates, or the colour of a material are carried
    over; a file without colours gives the grey of `Mesh`.  An OBJ material's Kd is taken as written, its
    d, Tr and map_d must leave it opaque; trimesh rounds glTF's baseColorFactor to 8 bits.  The scene graph's
    transforms are applied.  All meshes are opaque: transparency is refused, not dropped.

    Parameters
    ----------
    process
        True lets trimesh merge equal vertices; False keeps the file's.
    max_bytes
        The largest file to read.

    Raises
    ------
    FormatError
        If the file cannot be read, holds several meshes (see `load_meshes`) or none, or is transparent.
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
    arrays: dict[str, Numbers] = {"vertices": mesh.vertices, "faces": mesh.faces}
    if mesh.uv is not None and mesh.texture is not None:
        arrays |= {"uv": mesh.uv, "texture": mesh.texture}
    arrays["colors"] = mesh.colors
    words = {name: np.array(getattr(mesh, name)) for name in WORDS}
    write_npz(path, {**arrays, **words}, overwrite=overwrite)


def _read_npz(file: Path, max_bytes: int) -> Mesh:
    fields: dict[str, Any] = dict(read_npz(file, (*ARRAYS, *WORDS), max_bytes))
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
                    wrong.extend(_problems_of_mtl(spelling, data))
                return data
            missing.append(name)
            raise FileNotFoundError(name)

    return Beside(str(file))


def _problems_of_mtl(name: str, data: bytes) -> list[str]:
    """Return a sentence for each line for which trimesh would drop a colour, or all materials of the file."""
    problems = []
    for line in data.decode("utf-8", "replace").splitlines():
        key, *words = line.split() or [""]
        count = MTL_COUNTS.get(key.lower())
        if count is not None and (len(words) != count or None in map(_number_in, words)):
            message = f"{one_line(name)} must have {count} number{'s' * (count > 1)} for {key}, got "
            problems.append(message + f"{one_line(line.strip())!r}; mend it")
    return problems


def _mesh_of(file: Path, part: Foreign, matrix: Floats) -> Mesh:
    faces = getattr(part, "faces", None)
    if faces is None or len(faces) == 0:
        message = f"{file.name} must hold triangles, got {type(part).__name__} without; "
        raise FormatError(message + "remove it or triangulate it")
    vertices = transform_points(matrix, np.asarray(part.vertices, dtype=np.float64))
    return Mesh(vertices, np.asarray(faces), **_appearance(file, part.visual))


def _appearance(file: Path, visual: Foreign) -> dict[str, Any]:
    """Return the arguments of `Mesh` that say what colour it has."""
    kind = visual.kind if visual.defined else None
    if kind in ("vertex", "face"):
        codes = np.asarray(visual.vertex_colors if kind == "vertex" else visual.face_colors)
        return {"colors": _opaque(file, codes), "coloring": kind}
    if kind != "texture":
        return {}
    material = visual.material
    image = getattr(material, "baseColorTexture", None) or getattr(material, "image", None)
    _check_material(file, material)
    if _is_made_up(material):
        return {}
    tint = _tint(file, material)
    if image is None:
        return {} if tint is None else {"colors": tint}
    if visual.uv is None:
        message = f"{file.name} must have texture coordinates for its texture, got none; export them"
        raise FormatError(message)
    if tint is not None and (tint != 1).any():
        message = f"{file.name} must not tint its texture, got the factor {tint.tolist()}; "
        raise FormatError(message + "set it (Kd, baseColorFactor) to 1 or multiply it into the texture")
    codes = np.asarray(image.convert("RGBA"))
    return {"uv": np.asarray(visual.uv, dtype=np.float64), "texture": _opaque(file, codes)}


def _tint(file: Path, material: Foreign) -> Floats | None:
    """Return the colour (3,) that a material states, None if it states none."""
    factor = getattr(material, "baseColorFactor", None)
    if factor is not None:
        return _opaque(file, np.asarray(factor))
    # Not `material.diffuse`: trimesh fills in a grey there where an OBJ material has no Kd.
    stated = getattr(material, "kwargs", {}).get("kd")
    if stated is None:
        return None
    color = np.asarray(stated, dtype=np.float64)
    if ((color >= 0) & (color <= 1)).all():
        return color
    message = f"{file.name} must have a Kd of 3 numbers in 0..1, got {color.tolist()}; mend its .mtl file"
    raise FormatError(message)


def _check_material(file: Path, material: Foreign) -> None:
    """Refuse the transparency of an OBJ material, which trimesh does not read: d, Tr = 1 - d, and map_d."""
    stated: dict[str, list[str]] = getattr(material, "kwargs", {})
    for key, spelling, opaque in (("d", "d", 1.0), ("tr", "Tr", 0.0), ("map_d", "map_d", math.nan)):
        # The last word: "d -halo 0.5" has an option before the number.
        if key in stated and _number_in(stated[key][-1]) != opaque:
            message = f"{file.name} must be opaque, got a material with {spelling} "
            message += f"{one_line(' '.join(stated[key]))}; "
            cure = f"remove {spelling}" if math.isnan(opaque) else f"set it to {opaque:g}"
            raise FormatError(message + cure + " (meshes are opaque in this version)")


def _number_in(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None


def _is_made_up(material: Foreign) -> bool:
    """Say whether trimesh made the material up, for texture coordinates without one: it is a 2 x 2 image."""
    from trimesh.visual.material import empty_material

    usual = empty_material()
    image = getattr(material, "image", None)
    return image is not None and image.size == usual.image.size and hash(material) == hash(usual)


def _opaque(file: Path, codes: Numbers) -> Floats:
    """Return colours in 0..1 of 8-bit RGBA codes (..., 4)."""
    if (codes[..., 3] < 255).any():
        message = f"{file.name} must be opaque, got an alpha of {int(codes[..., 3].min())} of 255; "
        raise FormatError(message + "set its alpha to 1 (meshes are opaque in this version)")
    return np.asarray(codes[..., :3] / 255.0)
