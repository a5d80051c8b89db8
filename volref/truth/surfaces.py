"""The conductor of the meshes: scene in, nearest opaque surface out.

V vertices and F triangles of all meshes of the scene, in the scene's order; H, W the image.
"""

import numpy as np

from volref.arrays import Floats, Indices, Integers
from volref.records import Surface
from volref.scene.scene import Scene
from volref.stages.clipping import clip_triangles, project
from volref.stages.rays import pixel_rays
from volref.stages.surface import meet_triangles, surface_colors
from volref.stages.zbuffer import guard_band, nearest_triangles

# Hits are shaded in parts: 2^15 of them with their triangles take 2.4 MB.
HITS_PER_PART = 2**15


def visible_surface(scene: Scene) -> Surface:
    """Return the nearest opaque surface of all meshes at each pixel centre.

    All meshes go through one z-buffer.  Coverage follows the top-left rule on a grid of 2^-16 pixel; the
    distance is that of the float64 ray to the plane of the visible triangle.  Of coincident triangles the
    one with the lowest (mesh, face) is visible.

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
    vertices, corners, starts = _joined(scene)
    nearest = _nearest_faces(scene, vertices, corners)
    distance = np.full(len(nearest), np.inf)
    color = np.zeros((len(nearest), 3))
    mesh, face = np.full(len(nearest), -1), np.full(len(nearest), -1)
    hits = np.flatnonzero(nearest >= 0)
    for part in np.array_split(hits, 1 + len(hits) // HITS_PER_PART):
        rays = pixel_rays(scene.camera, scene.width, scene.height, part)
        distance[part], weights = meet_triangles(rays, vertices[corners[:, nearest[part]].T])
        mesh[part] = np.searchsorted(starts, nearest[part], side="right") - 1
        face[part] = nearest[part] - starts[mesh[part]]
        for index in np.unique(mesh[part]):
            its = mesh[part] == index
            color[part[its]] = surface_colors(scene.meshes[index], face[part[its]], weights[its])
    shape = scene.height, scene.width
    return Surface(
        distance.reshape(shape), color.reshape(*shape, 3), mesh.reshape(shape), face.reshape(shape)
    )


def nearest_faces(scene: Scene) -> Integers:
    """Return the visible triangle at each pixel (H * W,), counted through all meshes; -1 where none is."""
    vertices, corners, _ = _joined(scene)
    return _nearest_faces(scene, vertices, corners)


def _nearest_faces(scene: Scene, points: Floats, corners: Indices) -> Integers:
    camera, width, height = scene.camera, scene.width, scene.height
    vertices = project(points, camera, width, height)
    clipped = clip_triangles(vertices, corners, camera, guard_band(width, height))
    return nearest_triangles(*clipped, camera, width, height)


def _joined(scene: Scene) -> tuple[Floats, Indices, Integers]:
    """Return the vertices (V, 3) of all meshes, the corners (3, F) of all triangles, each mesh's first."""
    counts = np.array([len(mesh.faces) for mesh in scene.meshes], dtype=np.int64)
    starts = np.cumsum(counts) - counts
    corners = np.empty((3, counts.sum()), np.int64)
    first_vertex = 0
    for mesh, start, count in zip(scene.meshes, starts, counts, strict=True):
        np.add(mesh.faces.T, first_vertex, out=corners[:, start : start + count])
        first_vertex += len(mesh.vertices)
    vertices = np.concatenate([np.empty((0, 3)), *(mesh.vertices for mesh in scene.meshes)])
    return vertices, corners, starts
