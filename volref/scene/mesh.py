"""Triangle meshes in world coordinates.

The front of a triangle is the side from which its corners run counter-clockwise, as in OpenGL and glTF, and
its flat normal points out of it.

Texture coordinates run like OBJ's and glTF's as trimesh hands them on: u to the right, v UPWARDS, so
v = 1 is the top row of the image.  Texels have centres; a texture 2 wide has them at u = 0.25 and 0.75.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from volref.arrays import (
    LARGEST_LENGTH,
    Booleans,
    Floats,
    Integers,
    Numbers,
    float_array,
    number,
    one_of,
    plain_array,
    set_fields,
)
from volref.errors import SceneError

SIDES = ("both", "front", "back")


@dataclass(frozen=True, eq=False, init=False)
class Mesh:
    """A surface of triangles, opaque or transparent, lit or not.

    The field `transparent` says whether any of the mesh lets light through.  `dataclasses.replace` gives a
    mesh another look, as to one from a file.

    Parameters
    ----------
    vertices
        World positions (V, 3).
    faces
        Vertex indices (F, 3).  Degenerate triangles (no area to rounding) are dropped and counted in
        `dropped`; colours of faces follow.
    colors
        Working-space colours: one (3,), one per vertex (V, 3), or one per face (F, 3).  With a fourth number
        it is an alpha in 0..1: the colour is straight, not multiplied by it.
    uv, texture
        Texture coordinates (V, 2) and an image (height, width, 3 or 4), row 0 at the top; they take the
        place of `colors`.  Integer images are divided by their type's largest value.
    wrap
        "repeat" or "clamp": how texture coordinates outside 0..1 are read.
    coloring
        "uniform", "vertex", "face" or "texture"; needed only where the shapes leave it open.
    opacity
        Above 0 and at most 1, of each surface layer, however obliquely it is seen.  Alphas multiply it.
    lit
        Whether the colours answer the scene's lights; otherwise they are seen as they are.
    normals
        Vertex normals (V, 3) of any length but 0, for lit meshes; without them each triangle is flat.
    sides
        "both", "front" or "back": the sides of the triangles that are seen.
    back_color
        Colour (3,) of the back sides in place of their own.

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
    opacity: float
    lit: bool
    normals: Floats | None
    sides: str
    back_color: Floats | None
    transparent: bool = field(init=False)
    dropped: int = field(init=False)

    def __init__(
        self,
        vertices: ArrayLike,
        faces: ArrayLike,
        colors: ArrayLike = (0.8, 0.8, 0.8),
        uv: ArrayLike | None = None,
        texture: Numbers | None = None,
        wrap: str = "repeat",
        coloring: str | None = None,
        *,
        opacity: float = 1.0,
        lit: bool = False,
        normals: ArrayLike | None = None,
        sides: str = "both",
        back_color: ArrayLike | None = None,
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
        image = None if texture is None else _checked_texture(texture)
        if texture is not None:
            coloring = one_of("mesh.coloring", coloring or "texture", ("texture",))
        else:
            coloring = _resolved_coloring(coloring, paint, len(points), len(corners))
        faces = _frozen(corners[keep])
        thickness = number("mesh.opacity", opacity, above=0, high=1)
        set_fields(
            self,
            vertices=points,
            faces=faces,
            colors=_frozen(paint[keep]) if coloring == "face" else paint,
            uv=None if uv is None else float_array("mesh.uv", uv, (len(points), 2)),
            texture=image,
            wrap=one_of("mesh.wrap", wrap, ("repeat", "clamp")),
            coloring=coloring,
            opacity=thickness,
            lit=bool(lit),
            normals=None if normals is None else _checked_normals(normals, len(points), faces),
            sides=one_of("mesh.sides", sides, SIDES),
            back_color=None if back_color is None else _checked_back(back_color),
            transparent=thickness < 1 or _has_alpha(paint if image is None else image),
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
    columns = 4 if given.shape[-1:] == (4,) else 3
    array = float_array("mesh.colors", given, (columns,) if given.ndim == 1 else ("N", columns))
    return _checked_range("mesh.colors", array)


def _checked_back(color: ArrayLike) -> Floats:
    return _checked_range("mesh.back_color", float_array("mesh.back_color", color, (3,)))


def _checked_range(name: str, colors: Floats) -> Floats:
    """Refuse colours (..., 3 or 4) below 0 and alphas outside 0..1."""
    if (colors < 0).any():
        message = f"{name} must be at least 0, got {colors.min():g}; raise them to 0"
        raise SceneError(message)
    if (colors[..., 3:] > 1).any():
        message = f"{name} must have alphas of at most 1, got {colors[..., 3].max():g}; divide them by 255"
        raise SceneError(message)
    return colors


def _has_alpha(colors: Floats) -> bool:
    return bool((colors[..., 3:] < 1).any())


def _checked_normals(normals: ArrayLike, vertices: int, faces: Integers) -> Floats:
    array = float_array("mesh.normals", normals, (vertices, 3), limit=LARGEST_LENGTH)
    used = np.unique(faces)
    none = used[~array[used].any(axis=1)]
    if len(none):
        message = f"mesh.normals must not be 0, got {array[none[0]].tolist()} at vertex {none[0]}; "
        raise SceneError(message + "leave them out to shade each triangle flat")
    return array


def _resolved_coloring(coloring: str | None, colors: Floats, vertices: int, faces: int) -> str:
    """Say what `colors` belong to, from their shape where it is clear."""
    fits = {
        "uniform": colors.ndim == 1,
        "vertex": colors.ndim == 2 and len(colors) == vertices,
        "face": colors.ndim == 2 and len(colors) == faces,
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
    columns = 4 if image.shape[2:] == (4,) else 3
    array = float_array("mesh.texture", image, ("height", "width", columns))
    if array.size == 0:
        message = f"mesh.texture must hold colours, got shape {array.shape}; "
        raise SceneError(message + "give an image with at least one texel")
    return _checked_range("mesh.texture", array)


def _frozen(array: Numbers) -> Numbers:
    array.flags.writeable = False
    return array
