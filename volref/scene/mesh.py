"""Opaque triangle meshes in world coordinates.

Texture coordinates run like OBJ's and glTF's as trimesh hands them on: u to the right, v UPWARDS, so
v = 1 is the top row of the image.  Texels have centres; a texture 2 wide has them at u = 0.25 and 0.75.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from volref.arrays import (
    LARGEST_LENGTH,
    Booleans,
    Floats,
    Integers,
    Numbers,
    float_array,
    one_of,
    plain_array,
    set_fields,
)
from volref.errors import SceneError


@dataclass(frozen=True, eq=False, init=False)
class Mesh:
    """An opaque, unlit, two-sided surface of triangles.

    Parameters
    ----------
    vertices
        World positions (V, 3).
    faces
        Vertex indices (F, 3).  Degenerate triangles (no area to rounding) are dropped and counted in
        `dropped`; colours of faces follow.
    colors
        Working-space colours: one (3,), one per vertex (V, 3), or one per face (F, 3).
    uv, texture
        Texture coordinates (V, 2) and an image (height, width, 3), row 0 at the top; they take the place
        of `colors`.  Integer images are divided by their type's largest value.
    wrap
        "repeat" or "clamp": how texture coordinates outside 0..1 are read.
    coloring
        "uniform", "vertex", "face" or "texture"; needed only where the shapes leave it open.

    Raises
    ------
    SceneError
        If a field breaks one of these rules.

    Examples
    --------
    >>> mesh = Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2), (0, 1, 1)], colors=(1, 0, 0))
    >>> len(mesh.faces), mesh.dropped, mesh.coloring
    (1, 1, 'uniform')
    """

    vertices: Floats
    faces: Integers
    colors: Floats
    uv: Floats | None
    texture: Floats | None
    wrap: str
    coloring: str
    dropped: int

    def __init__(
        self,
        vertices: ArrayLike,
        faces: ArrayLike,
        colors: ArrayLike = (0.8, 0.8, 0.8),
        uv: ArrayLike | None = None,
        texture: Numbers | None = None,
        wrap: str = "repeat",
        coloring: str | None = None,
    ) -> None:
        points = float_array("mesh.vertices", vertices, ("V", 3), limit=LARGEST_LENGTH)
        corners = _checked_faces(faces, len(points))
        keep = ~degenerate(points, corners)
        if not keep.any():
            message = f"mesh.faces must hold a triangle with an area, got {len(keep)} without; "
            raise SceneError(message + "give a mesh that is not empty")
        if (uv is None) != (texture is None):
            message = "mesh.uv and mesh.texture must be given together, got one of them; give both or none"
            raise SceneError(message)
        paint = _checked_colors(colors)
        if texture is not None:
            coloring = one_of("mesh.coloring", coloring or "texture", ("texture",))
        else:
            coloring = _resolved_coloring(coloring, paint, len(points), len(corners))
        set_fields(
            self,
            vertices=points,
            faces=_frozen(corners[keep]),
            colors=_frozen(paint[keep]) if coloring == "face" else paint,
            uv=None if uv is None else float_array("mesh.uv", uv, (len(points), 2)),
            texture=None if texture is None else _checked_texture(texture),
            wrap=one_of("mesh.wrap", wrap, ("repeat", "clamp")),
            coloring=coloring,
            dropped=int((~keep).sum()),
        )


def degenerate(vertices: Floats, faces: Integers) -> Booleans:
    """Mark the faces (F,) that have no area to rounding.

    With edges of length up to L the rounding error of their cross product is below 8 eps L^2 (three
    components, each a difference of two products of rounded differences).
    """
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    first, second = b - a, c - a
    longest = np.maximum((first**2).sum(axis=1), (second**2).sum(axis=1))
    area = np.linalg.norm(np.cross(first, second), axis=1)
    return np.asarray(area <= 8 * np.finfo(np.float64).eps * longest)


def _checked_faces(faces: ArrayLike, vertices: int) -> Integers:
    array = plain_array("mesh.faces", faces)
    if array.ndim != 2 or array.shape[1] != 3 or array.dtype.kind not in "iu" or len(array) == 0:
        message = f"mesh.faces must be at least one row of 3 whole numbers, got {array.dtype} of shape "
        raise SceneError(message + f"{array.shape}; triangulate the mesh and give vertex indices")
    array = array.astype(np.int64)
    if array.min() < 0 or array.max() >= vertices:
        worst = int(array.min() if array.min() < 0 else array.max())
        message = f"mesh.faces must index the {vertices} vertices from 0, got {worst}; "
        raise SceneError(message + "check for indices that start at 1")
    return array


def _checked_colors(colors: ArrayLike) -> Floats:
    given = plain_array("mesh.colors", colors)
    array = float_array("mesh.colors", given, (3,) if given.ndim == 1 else ("N", 3))
    if (array < 0).any():
        message = f"mesh.colors must be at least 0, got {array.min():g}; raise them to 0"
        raise SceneError(message)
    return array


def _resolved_coloring(coloring: str | None, colors: Floats, vertices: int, faces: int) -> str:
    """Say what `colors` belong to, from their shape where it is clear."""
    fits = {
        "uniform": colors.ndim == 1,
        "vertex": colors.shape == (vertices, 3),
        "face": colors.shape == (faces, 3),
    }
    possible = [name for name, fit in fits.items() if fit and coloring in (None, name)]
    if len(possible) == 1:
        return possible[0]
    got = f"shape {colors.shape} for {vertices} vertices and {faces} faces"
    if possible:
        message = f"mesh.colors could belong to vertices or faces, got {got}; "
        raise SceneError(message + "state coloring='vertex' or coloring='face'")
    message = f"mesh.colors must be one colour, one per vertex or one per face, got {got}"
    message += f" and coloring {coloring!r}; "
    raise SceneError(message + "reshape them or change mesh.coloring")


def _checked_texture(texture: Numbers) -> Floats:
    image = plain_array("mesh.texture", texture)
    if image.dtype.kind in "iu":
        image = image / np.iinfo(image.dtype).max
    array = float_array("mesh.texture", image, ("height", "width", 3))
    if array.size == 0 or (array < 0).any():
        message = f"mesh.texture must hold colours of at least 0, got shape {array.shape}; "
        raise SceneError(message + "give an image with at least one texel")
    return array


def _frozen(array: Numbers) -> Numbers:
    array.flags.writeable = False
    return array
