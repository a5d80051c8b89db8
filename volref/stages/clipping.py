"""Stage: vertices on the screen, and the cutting of the few triangles that reach behind the camera.

V vertices, T triangles, S triangles that are cut.  Vertices are (3, V), corners (3, T) index them.
A vertex is (x w, y w, depth): x to the right and y downwards in pixels from the upper left corner of the
image, depth = -view_z along the viewing axis, and w = depth in perspective, 1 in a parallel projection.
So x = 0.5, y = 0.5 is the centre of pixel (0, 0).  These numbers are affine in the world, before any
division, hence a cut point lies on the straight edge.

Depth here is never clip_z: a reversed range, 0..1 or -1..1, or a far plane at infinity all look the same.
"""

from typing import TypeAlias

import numpy as np

from volref.arrays import Floats, Indices, Integers
from volref.scene.camera import Camera

# Bits of the outcode of a vertex, in the order of `_inside_distances`.
NEAR, FAR, RIGHT, LEFT, BOTTOM, TOP = range(6)
# Fragments beyond the far plane are left out one by one, so nothing is cut there.
CUTTING_PLANES = (NEAR, RIGHT, LEFT, BOTTOM, TOP)

Corner: TypeAlias = tuple[Floats, Floats]


def project(points: Floats, camera: Camera, width: int, height: int) -> Floats:
    """Return the vertices (3, V), see the head of this file, of world points (V, 3).

    x w = (clip_x + w) width / 2 and y w = (w - clip_y) height / 2.  Every vertex is computed by itself,
    element by element: equal points give bit-equal vertices wherever they stand in the array, which a
    matrix product does not promise.

    Examples
    --------
    >>> camera = Camera.look_at((0, 0, 5), (0, 0, 0), (0, 1, 0), 90.0, 0.1, 10.0)
    >>> x_w, y_w, depth = project(np.array([[0.0, 0.0, 0.0]]), camera, 4, 2)[:, 0].tolist()
    >>> x_w / depth, y_w / depth, depth
    (2.0, 1.0, 5.0)
    """
    world = np.ascontiguousarray(points.T)
    view_x, view_y, view_z = (_affine_row(row, world) for row in camera.view_from_world[:3])
    clip = camera.clip_from_view(width, height)
    clip_x, clip_y = (_affine_row(row, (view_x, view_y, view_z)) for row in clip[:2])
    depth = -view_z
    w = 1.0 if camera.is_parallel else depth
    return np.stack([(clip_x + w) * (width / 2), (w - clip_y) * (height / 2), depth])


def clip_triangles(
    vertices: Floats, corners: Indices, camera: Camera, band: float, far: float | None = None
) -> tuple[Floats, Indices, Integers]:
    """Cut triangles at the near plane and at |x|, |y| <= `band` pixels; drop those outside.

    Returns the vertices with the cut points appended, the corners of what is left, and for each of these
    triangles the index of the one it comes from.  A quadrilateral becomes two triangles.  Triangles wholly
    beyond the far plane, or the depth `far` in its place, are dropped, those that cross it are kept whole.

    A cut point is always computed from the inner to the outer end of its edge.  Two triangles with a common
    edge therefore get bit-equal points, and no crack between them (Blinn and Newell 1978 clip in the same
    homogeneous coordinates).  Vertices that no triangle uses any more are moved to where dividing by their
    depth is harmless.

    Examples
    --------
    One corner of a triangle lies behind the camera, so a quadrilateral is left:

    >>> camera = Camera.look_at((0, 0, 0), (0, 0, -1), (0, 1, 0), 90.0, 1.0, 10.0)
    >>> vertices = np.array([[0.0, 2.0, 0.0], [0.0, 0.0, 2.0], [3.0, 3.0, -1.0]])
    >>> cut, corners, source = clip_triangles(vertices, np.array([[0], [1], [2]]), camera, 100.0)
    >>> corners.shape, source.tolist(), float(cut[2, corners].min())
    ((3, 2), [0, 0], 1.0)
    """
    codes = _outcodes(vertices, camera, band, camera.far if far is None else far)
    if not codes.any():
        return vertices, corners, np.arange(corners.shape[1])
    first, second, third = codes[corners]
    crossed = first | second | third
    kept = (first & second & third) == 0
    cutting = np.uint8(sum(1 << plane for plane in CUTTING_PLANES))
    whole = np.flatnonzero(kept & (crossed & cutting == 0))
    source = np.flatnonzero(kept & (crossed & cutting != 0))
    triangles = vertices[:, corners[:, source]]
    for plane in CUTTING_PLANES:
        triangles, source = _cut(triangles, source, plane, camera, band)
    harmless = np.array([[0.0], [0.0], [1.0]])
    quiet = np.where(codes & cutting == 0, vertices, harmless)
    new_corners = vertices.shape[1] + np.arange(3 * len(source)).reshape(3, -1)
    return (
        np.concatenate([quiet, triangles.reshape(3, -1)], axis=1),
        np.concatenate([corners[:, whole], new_corners], axis=1),
        np.concatenate([whole, source]),
    )


def _affine_row(row: Floats, point: Floats | tuple[Floats, Floats, Floats]) -> Floats:
    x, y, z = point
    return np.asarray(row[0] * x + row[1] * y + row[2] * z + row[3])


def _inside_distances(vertices: Floats, camera: Camera, band: float, far: float) -> tuple[Floats, ...]:
    """Return one array per plane, in the order of the outcode bits, at least 0 inside."""
    x_w, y_w, depth = vertices
    reach = np.full_like(depth, band) if camera.is_parallel else band * depth
    return depth - camera.near, far - depth, reach - x_w, reach + x_w, reach - y_w, reach + y_w


def _outcodes(
    vertices: Floats, camera: Camera, band: float, far: float
) -> np.ndarray[tuple[int, ...], np.dtype[np.uint8]]:
    codes = np.zeros(vertices.shape[1], np.uint8)
    for plane, distance in enumerate(_inside_distances(vertices, camera, band, far)):
        codes |= (distance < 0).astype(np.uint8) << np.uint8(plane)
    return codes


def _cut(
    triangles: Floats, source: Integers, plane: int, camera: Camera, band: float
) -> tuple[Floats, Integers]:
    """Cut triangles (3 coordinates, 3 corners, S) at one plane."""
    distances = _inside_distances(triangles, camera, band, camera.far)[plane]
    inside = distances >= 0
    count = inside.sum(axis=0)
    parts, sources = [triangles[:, :, count == 3]], [source[count == 3]]

    one = np.flatnonzero(count == 1)
    a, b, c = _corners_from(triangles, distances, one, inside[:, one].argmax(axis=0))
    tip = [a[0], _cut_point(a, b, plane, camera), _cut_point(a, c, plane, camera)]
    parts.append(np.stack(tip, axis=1))
    sources.append(source[one])

    two = np.flatnonzero(count == 2)
    a, b, c = _corners_from(triangles, distances, two, inside[:, two].argmin(axis=0))
    on_ab, on_ac = _cut_point(b, a, plane, camera), _cut_point(c, a, plane, camera)
    parts += [np.stack([on_ab, b[0], c[0]], axis=1), np.stack([on_ab, c[0], on_ac], axis=1)]
    sources += [source[two], source[two]]
    return np.concatenate(parts, axis=2), np.concatenate(sources)


def _corners_from(triangles: Floats, distances: Floats, which: Indices, first: Indices) -> list[Corner]:
    """Return three (vertex, distance) pairs of the triangles `which`, turned so that corner `first` leads."""
    return [
        (triangles[:, corner, which], distances[corner, which])
        for corner in ((first + turn) % 3 for turn in range(3))
    ]


def _cut_point(inner: Corner, outer: Corner, plane: int, camera: Camera) -> Floats:
    start, start_distance = inner
    end, end_distance = outer
    point = start + start_distance / (start_distance - end_distance) * (end - start)
    if plane == NEAR:
        # Rounding grows with the length of the edge and could otherwise leave a depth below 0.
        point[2] = camera.near
    return np.asarray(point)
