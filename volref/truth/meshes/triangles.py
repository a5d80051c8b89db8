"""Triangles of several meshes drawn together, and what is seen of them.

V vertices and T triangles of the meshes chosen, counted through in the scene's order; F fragments.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from volref.arrays import Booleans, Floats, Indices, Integers
from volref.records import Rays
from volref.scene.camera import Camera
from volref.scene.lights import Material
from volref.scene.scene import Scene
from volref.stages.clipping import clip_triangles, project
from volref.stages.lighting import lit_colors
from volref.stages.rays import pixel_rays
from volref.stages.surface import back_sides, meet_triangles, surface_colors, surface_normals
from volref.stages.zbuffer import all_fragments, guard_band, nearest_triangles


@dataclass(frozen=True, eq=False)
class Triangles:
    """Vertices (V, 3), corners (3, T), and per mesh its number in the scene and its first triangle."""

    vertices: Floats
    corners: Indices
    meshes: Indices
    starts: Integers

    def owners(self, source: Integers) -> tuple[Integers, Integers]:
        """Return the mesh and the face in it of each triangle."""
        place = np.searchsorted(self.starts, source, side="right") - 1
        return self.meshes[place], source - self.starts[place]

    def places(self, source: Integers) -> Floats:
        """Return the corners (F, 3, 3) of triangles in the world."""
        return self.vertices[self.corners[:, source].T]


class Elsewhere(NamedTuple):
    """Where a ray is painted if not where it meets a triangle.

    The distance (F,), unit normals `facing` (F, 3), and whether the back is seen (F,).
    """

    distance: Floats
    facing: Floats
    back: Booleans


def triangles_of(scene: Scene, meshes: Sequence[int]) -> Triangles:
    """Return the triangles of the scene's `meshes`."""
    chosen = [scene.meshes[i] for i in meshes]
    counts = np.array([len(mesh.faces) for mesh in chosen], dtype=np.int64)
    starts = np.cumsum(counts) - counts
    corners = np.empty((3, counts.sum()), np.int64)
    first_vertex = 0
    for mesh, start, count in zip(chosen, starts, counts, strict=True):
        np.add(mesh.faces.T, first_vertex, out=corners[:, start : start + count])
        first_vertex += len(mesh.vertices)
    vertices = np.concatenate([np.empty((0, 3)), *(mesh.vertices for mesh in chosen)])
    return Triangles(vertices, corners, np.array(meshes, dtype=np.intp), starts)


def nearest_faces(scene: Scene, triangles: Triangles) -> Integers:
    """Return the visible triangle at each pixel (H * W,), -1 where none is."""
    seen = _on_screen(scene, triangles, _seen(scene, triangles), scene.camera.far)
    return nearest_triangles(*seen, scene.camera, scene.width, scene.height)


def fragments(scene: Scene, triangles: Triangles) -> Iterator[tuple[Integers, Integers]]:
    """Yield (pixel (F,), triangle (F,)) of all that the camera sees, hidden or not, in parts."""
    seen = _on_screen(scene, triangles, _seen(scene, triangles), scene.camera.far)
    return all_fragments(*seen, scene.camera, scene.width, scene.height)


def crossings(scene: Scene, triangles: Triangles) -> Iterator[tuple[Integers, Integers]]:
    """Yield what `fragments` does, but of both sides, and beyond the far plane."""
    every = np.arange(triangles.corners.shape[1])
    seen = _on_screen(scene, triangles, every, np.inf)
    return all_fragments(*seen, scene.camera, scene.width, scene.height, far=np.inf)


def distances_of(scene: Scene, triangles: Triangles, pixel: Indices, source: Integers) -> Floats:
    """Return the distance (F,) at which the ray of each pixel meets a triangle."""
    rays = pixel_rays(scene.camera, scene.width, scene.height, pixel)
    return meet_triangles(rays, triangles.places(source))[0]


def paint(
    scene: Scene,
    triangles: Triangles,
    pixel: Indices,
    source: Integers,
    elsewhere: Elsewhere | None = None,
) -> tuple[Floats, Floats, Floats]:
    """Return distance (F,), straight colour (F, 3) and opacity (F,) where rays meet triangles.

    The colour of the triangles may be painted `elsewhere` on the rays.
    """
    rays = pixel_rays(scene.camera, scene.width, scene.height, pixel)
    places = triangles.places(source)
    distance, weights = meet_triangles(rays, places)
    distance = distance if elsewhere is None else elsewhere.distance
    color, opacity = np.empty((len(pixel), 3)), np.empty(len(pixel))
    owner, face = triangles.owners(source)
    for index in np.unique(owner):
        mesh, its = scene.meshes[index], np.flatnonzero(owner == index)
        shown = surface_colors(mesh, face[its], weights[its])
        opacity[its] = mesh.opacity * (shown[:, 3] if shown.shape[1] == 4 else 1.0)
        straight = shown[:, :3]
        if mesh.back_color is not None:
            ways = _ways(scene.camera, rays.origins[its], rays.directions[its], places[its])
            back = back_sides(places[its], ways) if elsewhere is None else elsewhere.back[its]
            straight = np.where(back[:, None], mesh.back_color, straight)
        if mesh.lit and scene.lights:
            facing = (
                surface_normals(mesh, face[its], weights[its]) if elsewhere is None else elsewhere.facing[its]
            )
            straight = _lit(scene, rays, its, distance[its], facing, straight)
        color[its] = straight
    return distance, color, opacity


def _lit(
    scene: Scene, rays: Rays, its: Indices, distance: Floats, normals: Floats, straight: Floats
) -> Floats:
    """Return the lit colours (n, 3) of the rays `its`."""
    directions = rays.directions[its]
    points = rays.origins[its] + distance[:, None] * directions
    material = scene.material
    if material is None or material.model == "unlit":
        material = Material()
    return lit_colors(scene.lights, material, points.T, normals.T, -directions.T, straight.T).T


def _seen(scene: Scene, triangles: Triangles) -> Indices:
    """Return the triangles whose mesh shows the side that the camera sees."""
    seen = [np.empty(0, np.intp)]
    for index, start in zip(triangles.meshes, triangles.starts, strict=True):
        mesh = scene.meshes[index]
        those = np.arange(start, start + len(mesh.faces))
        if mesh.sides != "both":
            places = mesh.vertices[mesh.faces]
            ray = pixel_rays(scene.camera, scene.width, scene.height, np.array([0]))
            ways = _ways(scene.camera, ray.origins, ray.directions, places)
            back = back_sides(places, np.broadcast_to(ways, (len(places), 3)))
            those = those[back == (mesh.sides == "back")]
        seen.append(those)
    return np.concatenate(seen)


def _ways(camera: Camera, origins: Floats, directions: Floats, places: Floats) -> Floats:
    """Return the directions in which triangles (T, 3, 3) are seen: the same for all rays that meet one."""
    return directions if camera.is_parallel else places[:, 0] - origins


def _on_screen(
    scene: Scene, triangles: Triangles, chosen: Indices, far: float
) -> tuple[Floats, Indices, Integers]:
    """Return vertices on the screen, corners and sources of the `chosen` triangles within the view."""
    camera, width, height = scene.camera, scene.width, scene.height
    vertices = project(triangles.vertices, camera, width, height)
    corners = triangles.corners[:, chosen]
    placed, kept, source = clip_triangles(vertices, corners, camera, guard_band(width, height), far)
    return placed, kept, chosen[source]
