"""Closed meshes with a formula, wound outwards: seen from outside, each triangle runs counter-clockwise.

A faceted body lies inside the smooth one (vertices on the surface), and its volume falls short with the
square of the edge length.
"""

import math

import numpy as np
from numpy.typing import ArrayLike

from volref.arrays import Floats, Indices, Integers, Vector, float_array, number, whole_number
from volref.errors import SceneError
from volref.scene import Mesh

GREY: Vector = (0.8, 0.8, 0.8)
CENTER: Vector = (0.0, 0.0, 0.0)


def box_mesh(size: ArrayLike = (1.0, 1.0, 1.0), center: ArrayLike = CENTER, colors: ArrayLike = GREY) -> Mesh:
    """Return a box of edge lengths `size` (x, y, z): 8 vertices, 12 triangles, exact volume.

    Vertex number 4 k + 2 j + i lies at the low (0) or high (1) end of z, y, x for the bits k, j, i.

    Examples
    --------
    >>> len(box_mesh().faces)
    12
    """
    k, j, i = np.indices((2, 2, 2)).reshape(3, 8)
    edges = float_array("size", size, (3,))
    vertices = (np.stack([i, j, k], axis=1) - 0.5) * edges + float_array("center", center, (3,))
    sides = [(0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6)]
    return Mesh(vertices, _triangles(np.array(sides)), colors)


def sphere_mesh(
    radius: float = 1.0, center: ArrayLike = CENTER, colors: ArrayLike = GREY, *, subdivisions: int = 3
) -> Mesh:
    """Return an icosphere: an icosahedron whose edges were halved `subdivisions` times, pushed to the sphere.

    10 * 4^k + 2 vertices and 20 * 4^k triangles for k subdivisions.

    Examples
    --------
    >>> mesh = sphere_mesh(subdivisions=1)
    >>> len(mesh.vertices), len(mesh.faces)
    (42, 80)
    """
    points, faces = _icosahedron()
    for _ in range(whole_number("subdivisions", subdivisions, low=0, high=9)):
        points, faces = _halve_edges(points, faces)
    vertices = points * number("radius", radius, above=0) + float_array("center", center, (3,))
    return Mesh(vertices, faces, colors)


def torus_mesh(
    radius: float = 1.0,
    tube_radius: float = 0.3,
    center: ArrayLike = CENTER,
    colors: ArrayLike = GREY,
    *,
    segments: int = 48,
    sides: int = 24,
) -> Mesh:
    """Return a torus about the z axis: `segments` rings of `sides` vertices.

    The smooth torus has the volume 2 pi^2 radius tube_radius^2.

    Raises
    ------
    SceneError
        If the tube is not thinner than the ring.
    """
    ring = number("radius", radius, above=0)
    tube = number("tube_radius", tube_radius, above=0)
    if tube >= ring:
        message = f"tube_radius must be below radius, got {tube:g} and {ring:g}; make the tube thinner"
        raise SceneError(message)
    around = _angles(segments, "segments")[:, None]
    across = _angles(sides, "sides")[None, :]
    outwards = ring + tube * np.cos(across)
    height = np.broadcast_to(tube * np.sin(across), (segments, sides))
    points = np.stack([outwards * np.cos(around), outwards * np.sin(around), height], axis=-1)
    vertices = points.reshape(-1, 3) + float_array("center", center, (3,))
    return Mesh(vertices, _triangles(_ring_quads(segments, sides, closed=True)), colors)


def tube_mesh(
    path: ArrayLike = ((0.0, 0.0, -1.0), (0.0, 0.0, 1.0)),
    radius: float = 0.3,
    colors: ArrayLike = GREY,
    *,
    sides: int = 24,
) -> Mesh:
    """Return a tube with flat ends along the corners `path` (N, 3).

    Each ring of `sides` vertices stands across the mean of the directions before and after it; the frame
    is carried from ring to ring without twist (parallel transport).  A straight tube has the exact volume
    length x (sides / 2) radius^2 sin(2 pi / sides).

    Raises
    ------
    SceneError
        If the path has fewer than two corners, or two neighbours at one place.
    """
    corners = float_array("path", path, ("N", 3))
    steps = np.diff(corners, axis=0)
    if len(steps) == 0 or (np.linalg.norm(steps, axis=1) == 0).any():
        message = f"path must have at least two corners, neighbours apart, got {corners.tolist()}; "
        raise SceneError(message + "drop repeated corners")
    angle = _angles(sides, "sides")[:, None]
    rings = []
    for middle, right, up in zip(corners, *_frames(steps), strict=True):
        rings.append(
            middle + number("radius", radius, above=0) * (np.cos(angle) * right + np.sin(angle) * up)
        )
    count = len(corners)
    vertices = np.concatenate([*rings, corners[:1], corners[-1:]])
    first, last = np.arange(sides), np.arange(sides) + (count - 1) * sides
    low_cap = np.stack([np.full(sides, count * sides), np.roll(first, -1), first], axis=1)
    high_cap = np.stack([np.full(sides, count * sides + 1), last, np.roll(last, -1)], axis=1)
    walls = _triangles(_ring_quads(count, sides, closed=False))
    return Mesh(vertices, np.concatenate([walls, low_cap, high_cap]), colors)


def plane_mesh(
    width: float = 2.0,
    height: float = 2.0,
    center: ArrayLike = CENTER,
    *,
    texture: Floats | None = None,
    repeats: float = 1.0,
) -> Mesh:
    """Return a rectangle across z, facing +z, with texture coordinates 0 to `repeats` (u right, v up).

    `texture` (h, w, 3) defaults to `checkerboard()`.  Two triangles; a surface, not a closed body.
    """
    corner = np.array([(-0.5, -0.5, 0), (0.5, -0.5, 0), (0.5, 0.5, 0), (-0.5, 0.5, 0)])
    scale = (number("width", width, above=0), number("height", height, above=0), 1.0)
    vertices = corner * scale + float_array("center", center, (3,))
    image = checkerboard() if texture is None else texture
    uv = (corner[:, :2] + 0.5) * number("repeats", repeats, above=0)
    return Mesh(vertices, [(0, 1, 2), (0, 2, 3)], uv=uv, texture=image)


def checkerboard(
    tiles: int = 8,
    texels: int = 4,
    first: ArrayLike = (0.9, 0.9, 0.9),
    second: ArrayLike = (0.15, 0.2, 0.35),
) -> Floats:
    """Return a texture (tiles * texels, same, 3) of `tiles` x `tiles` squares, `first` at the top left.

    Examples
    --------
    >>> checkerboard(2, 1, (1, 1, 1), (0, 0, 0))[..., 0].tolist()
    [[1.0, 0.0], [0.0, 1.0]]
    """
    count = whole_number("tiles", tiles, low=1, high=4096)
    tile = np.arange(count * whole_number("texels", texels, low=1, high=4096)) // texels
    odd = (tile[:, None] + tile[None, :]) % 2
    paints = np.stack([float_array("first", first, (3,)), float_array("second", second, (3,))])
    return np.asarray(paints[odd])


def _angles(count: int, name: str) -> Floats:
    turns = whole_number(name, count, low=3, high=65536)
    return np.asarray(np.arange(turns) * (2 * math.pi / turns), dtype=np.float64)


def _triangles(quads: Indices) -> Indices:
    """Cut quadrilaterals (Q, 4) into triangles (2 Q, 3) of the same winding."""
    return np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def _ring_quads(rings: int, sides: int, *, closed: bool) -> Indices:
    """Return quadrilaterals between neighbouring rings, the last joined to the first if `closed`."""
    ring, side = np.indices((rings if closed else rings - 1, sides)).reshape(2, -1)
    after, beside = (ring + 1) % rings, (side + 1) % sides
    corners = [ring * sides + side, after * sides + side, after * sides + beside, ring * sides + beside]
    order = corners if closed else corners[::-1]
    return np.stack(order, axis=1)


def _frames(steps: Floats) -> tuple[Floats, Floats]:
    """Return unit vectors right and up (N, 3) across a path with N - 1 `steps`, right x up along it."""
    forward = steps / np.linalg.norm(steps, axis=1, keepdims=True)
    tangents = np.concatenate([forward[:1], forward[:-1] + forward[1:], forward[-1:]])
    tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
    right = np.eye(3)[np.argmin(np.abs(tangents[0]))]
    rights = []
    for tangent in tangents:
        right = right - tangent * (right @ tangent)
        right = right / np.linalg.norm(right)
        rights.append(right)
    across = np.array(rights)
    return across, np.cross(tangents, across)


def _icosahedron() -> tuple[Floats, Integers]:
    """Return the 12 unit vertices and 20 outward faces of an icosahedron with a vertex at either pole."""
    height, ring = 1 / math.sqrt(5), 2 / math.sqrt(5)
    turn = np.arange(5) * (2 * math.pi / 5)
    upper = np.stack([ring * np.cos(turn), ring * np.sin(turn), np.full(5, height)], axis=1)
    half = turn + math.pi / 5
    lower = np.stack([ring * np.cos(half), ring * np.sin(half), np.full(5, -height)], axis=1)
    points = np.concatenate([[(0.0, 0.0, 1.0)], upper, lower, [(0.0, 0.0, -1.0)]])
    a = np.arange(5)
    up, up_next, low, low_next = 1 + a, 1 + (a + 1) % 5, 6 + a, 6 + (a + 1) % 5
    top = np.stack([np.zeros(5, int), up, up_next], axis=1)
    band = np.concatenate([np.stack([up, low, up_next], axis=1), np.stack([up_next, low, low_next], axis=1)])
    bottom = np.stack([np.full(5, 11), low_next, low], axis=1)
    return points, np.concatenate([top, band, bottom]).astype(np.int64)


def _halve_edges(points: Floats, faces: Integers) -> tuple[Floats, Integers]:
    """Cut each triangle of a unit sphere into four, the new vertices on the sphere."""
    a, b, c = faces.T
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    ends, place = np.unique(edges, axis=0, return_inverse=True)
    middles = points[ends[:, 0]] + points[ends[:, 1]]
    middles /= np.linalg.norm(middles, axis=1, keepdims=True)
    ab, bc, ca = (len(points) + place.reshape(3, -1)).astype(np.int64)
    corners = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    finer = np.concatenate([np.stack(corner, axis=1) for corner in corners])
    return np.concatenate([points, middles]), finer
