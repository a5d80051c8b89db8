"""The conductor of the opaque meshes: scene in, nearest opaque surface out.

H, W the image.
"""

import numpy as np

from volref.arrays import Integers
from volref.records import Spans, Surface
from volref.scene.scene import Scene
from volref.stages.zbuffer import NOTHING, keep_nearest
from volref.truth.meshes.cutting import caps, is_kept, kept_spans
from volref.truth.meshes.triangles import (
    Triangles,
    distances_of,
    fragments,
    nearest_faces,
    paint,
    triangles_of,
)

# Hits are shaded in parts: 2^15 of them with their triangles take 2.4 MB.
HITS_PER_PART = 2**15


def visible_surface(scene: Scene) -> Surface:
    """Return the nearest opaque surface of all meshes at each pixel centre.

    All opaque meshes go through one z-buffer.  Coverage follows the top-left rule on a grid of 2^-16 pixel;
    the distance is that of the float64 ray to the plane of the visible triangle.  Of coincident triangles the
    one with the lowest (mesh, face) is visible.

    Where the scene has clipping planes, what counts is the distance of each fragment; a watertight mesh that
    is cut open shows a face there, see `volref.truth.meshes.cutting.caps`.

    Examples
    --------
    >>> from volref.scene.camera import Camera
    >>> from volref.scene.mesh import Mesh
    >>> camera = Camera.look_at((0, 0, 5), (0, 0, 0), (0, 1, 0), 90.0, 0.1, 10.0)
    >>> mesh = Mesh([(-1, -1, 0), (1, -1, 0), (0, 1, 0)], [(0, 1, 2)], colors=(1, 0, 0))
    >>> surface = visible_surface(Scene(None, None, camera, 3, 3, meshes=[mesh]))
    >>> surface.distance[1].tolist(), surface.color[1, 1].tolist()
    ([inf, 5.0, inf], [1.0, 0.0, 0.0])
    """
    opaque = [i for i, mesh in enumerate(scene.meshes) if not mesh.transparent]
    triangles = triangles_of(scene, opaque)
    kept = kept_spans(scene) if scene.clip else None
    nearest = nearest_faces(scene, triangles) if kept is None else _nearest_kept(scene, triangles, kept)
    surface = _painted(scene, triangles, nearest)
    if kept is not None:
        for index in opaque:
            _add_caps(scene, index, kept, surface)
    return surface


def _painted(scene: Scene, triangles: Triangles, nearest: Integers) -> Surface:
    """Return the surface of which the triangles `nearest` (H * W,) are seen."""
    shape = scene.height, scene.width
    distance, color = np.full(shape, np.inf), np.zeros((*shape, 3))
    mesh, face = np.full(shape, -1), np.full(shape, -1)
    flat_mesh, flat_face, flat_color = mesh.reshape(-1), face.reshape(-1), color.reshape(-1, 3)
    hits = np.flatnonzero(nearest >= 0)
    for part in np.array_split(hits, 1 + len(hits) // HITS_PER_PART):
        distance.reshape(-1)[part], flat_color[part], _ = paint(scene, triangles, part, nearest[part])
        flat_mesh[part], flat_face[part] = triangles.owners(nearest[part])
    return Surface(distance, color, mesh, face)


def _nearest_kept(scene: Scene, triangles: Triangles, kept: Spans) -> Integers:
    """Return the nearest triangle (H * W,) of what no clipping plane cuts away, -1 where there is none."""
    nearest_distance = np.full(len(kept.t_near), np.inf)
    nearest = np.full(len(kept.t_near), NOTHING)
    for pixel, source in fragments(scene, triangles):
        distance = distances_of(scene, triangles, pixel, source)
        stays = is_kept(kept, pixel, distance)
        keep_nearest(pixel[stays], distance[stays], source[stays], nearest_distance, nearest)
    nearest[nearest == NOTHING] = -1
    return nearest


def _add_caps(scene: Scene, index: int, kept: Spans, surface: Surface) -> None:
    """Put the cut faces of a mesh into the surface where they are nearer, in place."""
    distance, color = surface.distance.reshape(-1), surface.color.reshape(-1, 3)
    mesh, face = surface.mesh.reshape(-1), surface.face.reshape(-1)
    for cap in caps(scene, index, kept):
        there = distance[cap.pixel]
        nearer = (cap.distance < there) | ((cap.distance == there) & (index <= mesh[cap.pixel]))
        pixel = cap.pixel[nearer]
        distance[pixel], color[pixel] = cap.distance[nearer], cap.color[nearer]
        mesh[pixel], face[pixel] = index, -1
