"""Stage: where viewing rays meet their triangles, and the colour and the normal there.

R rays, each with one triangle; weights (R, 3) are the barycentric coordinates in the world, at least 0 and
with sum 1.  A vertex attribute at the hit is weights . attribute, with no division by depth: barycentric
coordinates in the world are what "perspective-correct" interpolation on a GPU restores.

Texels have centres.  A texture 2 wide, coordinate u from the left; column = u 2 - 1/2:

    u         0    0.25   0.5   0.75    1
              |--- o ------|----- o ----|        u = 0.25 is column 0 itself, u = 0.5 is halfway,
    column  -0.5   0      0.5     1    1.5       u = 0 is halfway between 0 and 1 again if it repeats

v runs upwards and row 0 is the top: row = (1 - v) height - 1/2.
"""

import numpy as np

from volref.arrays import Booleans, Floats, Indices, Integers
from volref.records import Rays
from volref.scene.mesh import Mesh


def meet_triangles(rays: Rays, triangles: Floats) -> tuple[Floats, Floats]:
    """Return the distance (R,) at which each ray meets its triangle (R, 3, 3), and the weights (R, 3).

    The ray o + t d passes the corners a, b, c on the sides given by three volumes (Plucker 1865, as in
    Kensler and Shirley 2006), here with the corners taken relative to o:

        U = d . (c x b)    V = d . (a x c)    W = d . (b x a)

    Of one sign it goes through the triangle, and (U, V, W) / (U + V + W) are the weights.  Otherwise it
    misses, by as little as the z-buffer's grid of 2^-16 pixel, and the point of the triangle that is
    nearest to the ray stands for the hit.  The distance is the one along the ray to that point.

    Examples
    --------
    >>> rays = Rays(np.array([[0.25, 0.25, 2.0]]), np.array([[0.0, 0.0, -1.0]]))
    >>> distance, weights = meet_triangles(rays, np.array([[[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]]))
    >>> distance.tolist(), weights.tolist()
    ([2.0], [[0.5, 0.25, 0.25]])
    """
    directions = np.ascontiguousarray(rays.directions.T)
    corners = np.ascontiguousarray((triangles - rays.origins[:, None, :]).transpose(1, 2, 0))
    a, b, c = corners
    volumes = np.stack([_volume(directions, *pair) for pair in ((c, b), (a, c), (b, a))])
    total = volumes.sum(axis=0)
    through = (total != 0) & (volumes * np.sign(total) >= 0).all(axis=0)
    weights = volumes / np.where(through, total, 1.0)
    missed = np.flatnonzero(~through)
    weights[:, missed] = _nearest_weights(corners[:, :, missed], directions[:, missed])
    point = (weights[:, None] * corners).sum(axis=0)
    return (point * directions).sum(axis=0), weights.T


def surface_colors(mesh: Mesh, faces: Integers, weights: Floats) -> Floats:
    """Return the colours at `weights` in the triangles `faces` (R,) of `mesh`.

    (R, 3), or (R, 4) if they have an alpha; colour and alpha are interpolated each by itself.
    """
    if mesh.coloring == "uniform":
        return np.broadcast_to(mesh.colors, (len(faces), len(mesh.colors)))
    if mesh.coloring == "face":
        return mesh.colors[faces]
    if mesh.coloring == "vertex":
        return _interpolated(mesh.colors, mesh.faces[faces], weights)
    assert mesh.uv is not None
    assert mesh.texture is not None
    return texture_colors(mesh.texture, _interpolated(mesh.uv, mesh.faces[faces], weights), mesh.wrap)


def surface_normals(mesh: Mesh, faces: Integers, weights: Floats) -> Floats:
    """Return the unit normals (R, 3) at `weights` in the triangles `faces` (R,) of `mesh`.

    Unit vertex normals are interpolated and brought to length 1 again (Phong 1975); 0 where they cancel.
    Without them the normal is that of the triangle, out of its front.

    Examples
    --------
    >>> mesh = Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)])
    >>> surface_normals(mesh, np.array([0]), np.array([[0.5, 0.25, 0.25]])).tolist()
    [[0.0, 0.0, 1.0]]
    """
    if mesh.normals is None:
        a, b, c = (mesh.vertices[mesh.faces[faces, k]] for k in range(3))
        return _unit(np.cross(_unit(b - a), _unit(c - a)))
    corners = _unit(mesh.normals[mesh.faces[faces]])
    first, second, third = (weights[:, k, None] * corners[:, k] for k in range(3))
    return _unit(first + second + third)


def back_sides(triangles: Floats, directions: Floats) -> Booleans:
    """Say of each triangle (T, 3, 3) whether its back is seen in the direction (T, 3) that leads to it.

    One that is seen exactly edge-on counts as seen from the front.
    """
    a, b, c = triangles.transpose(1, 0, 2)
    return np.asarray((np.cross(b - a, c - a) * directions).sum(axis=1) > 0)


def texture_colors(texture: Floats, uv: Floats, wrap: str) -> Floats:
    """Return a texture (height, width, 3 or 4) interpolated bilinearly at `uv` (R, 2), see the head.

    Beyond the outer texel centres "repeat" goes on with the opposite side, "clamp" stays at the outer one.

    Examples
    --------
    >>> texture = np.array([[[0.0, 0, 0], [1, 1, 1]]])
    >>> uv = np.array([[0.25, 0.5], [0.5, 0.5], [0.0, 0.5]])
    >>> [texture_colors(texture, uv, wrap)[:, 0].tolist() for wrap in ("repeat", "clamp")]
    [[0.0, 0.5, 0.5], [0.0, 0.5, 0.0]]
    """
    height, width = texture.shape[:2]
    left, right, across = _neighbours(uv[:, 0], width, wrap)
    upper, lower, down = _neighbours(1 - uv[:, 1], height, wrap)
    across, down = across[:, None], down[:, None]
    top = (1 - across) * texture[upper, left] + across * texture[upper, right]
    bottom = (1 - across) * texture[lower, left] + across * texture[lower, right]
    return np.asarray((1 - down) * top + down * bottom)


def _volume(a: Floats, b: Floats, c: Floats) -> Floats:
    """Return a . (b x c) of vectors (3, R)."""
    return np.asarray(
        a[0] * (b[1] * c[2] - b[2] * c[1])
        + a[1] * (b[2] * c[0] - b[0] * c[2])
        + a[2] * (b[0] * c[1] - b[1] * c[0])
    )


def _nearest_weights(corners: Floats, directions: Floats) -> Floats:
    """Return the weights (3, R) of the point on the border of each triangle that is nearest to its ray.

    Corners (3 corners, 3 coordinates, R) are relative to the ray's origin, directions (3, R).  Looking
    along the ray, each edge is a segment in a plane and the ray is the origin of that plane.
    """
    along = (corners * directions).sum(axis=1)
    flat = corners - along[:, None] * directions
    nearest = np.full(corners.shape[2], np.inf)
    weights = np.zeros((3, corners.shape[2]))
    for i, j in ((0, 1), (1, 2), (2, 0)):
        edge = flat[j] - flat[i]
        length = (edge**2).sum(axis=0)
        # An edge seen end-on is a point; its first end stands for it.
        part = np.clip(-(flat[i] * edge).sum(axis=0) / np.where(length > 0, length, np.inf), 0, 1)
        gap = ((flat[i] + part * edge) ** 2).sum(axis=0)
        better = np.flatnonzero(gap < nearest)
        nearest[better] = gap[better]
        weights[:, better] = 0.0
        weights[i, better], weights[j, better] = 1 - part[better], part[better]
    return weights


def _interpolated(attribute: Floats, corners: Integers, weights: Floats) -> Floats:
    """Return an attribute (V, A) of the vertices `corners` (R, 3) at `weights` (R, 3)."""
    return np.asarray(np.einsum("rk,rka->ra", weights, attribute[corners]))


def _unit(vectors: Floats) -> Floats:
    """Return vectors (..., 3) at length 1; 0 stays 0."""
    # Scaled first: the squares of numbers below 1e-162 are zero.
    largest = np.abs(vectors).max(axis=-1, keepdims=True)
    scaled = vectors / np.where(largest > 0, largest, 1.0)
    x, y, z = np.moveaxis(scaled, -1, 0)
    length = np.sqrt(x * x + y * y + z * z)[..., None]
    return np.asarray(scaled / np.where(length > 0, length, 1.0))


def _neighbours(place: Floats, count: int, wrap: str) -> tuple[Indices, Indices, Floats]:
    """Return the texels on both sides of `place` (0 to 1 edge to edge) and the way from one to the other."""
    index = place * count - 0.5
    if wrap == "repeat":
        index = index % count
        low = np.floor(index)
        first = low.astype(np.intp) % count
        return first, (first + 1) % count, index - low
    index = np.clip(index, 0, count - 1)
    low = np.floor(index)
    first = low.astype(np.intp)
    return first, np.minimum(first + 1, count - 1), index - low
