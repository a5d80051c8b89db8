"""The conductor of the transparent meshes: scene and opaque surface in, sorted layers out.

H, W the image; F fragments.
"""

from collections.abc import Iterator
from typing import TypeAlias

import numpy as np

from volref.arrays import Booleans, Floats, Indices, Integers
from volref.records import Layers, Surface
from volref.scene.scene import Scene
from volref.truth.meshes.cutting import caps, is_kept, kept_spans
from volref.truth.meshes.triangles import Triangles, distances_of, fragments, paint, triangles_of

# Pixel, mesh, face, distance, color and opacity.
_Part: TypeAlias = tuple[Indices, Integers, Integers, Floats, Floats, Floats]


def visible_layers(scene: Scene, surface: Surface) -> Layers:
    """Return every transparent surface before the opaque one, sorted, of the rays of all H * W pixels.

    This is what depth peeling (Everitt 2001) finds pass by pass.  Coverage and distances are those of
    `visible_surface`; of coincident surfaces the one with the lower (mesh, face) is in front, be they opaque
    or not.  Each fragment is a layer, however obliquely it is seen, so a ray through a closed body meets an
    even number of them.

    Examples
    --------
    >>> from volref.scene.camera import Camera
    >>> from volref.scene.mesh import Mesh
    >>> from volref.truth.meshes.surfaces import visible_surface
    >>> camera = Camera.look_at((0, 0, 5), (0, 0, 0), (0, 1, 0), 90.0, 0.1, 10.0)
    >>> corners = np.array([(-1, -1, 0), (1, -1, 0), (0, 1, 0)])
    >>> panes = [Mesh(corners + (0, 0, z), [(0, 1, 2)], opacity=0.5) for z in (0, 1)]
    >>> scene = Scene(None, None, camera, 3, 3, meshes=panes)
    >>> layers = visible_layers(scene, visible_surface(scene))
    >>> layers.counts.tolist(), layers.distance.tolist(), layers.mesh.tolist()
    ([0, 0, 0, 0, 2, 0, 0, 0, 0], [4.0, 5.0], [1, 0])
    """
    chosen = [i for i, mesh in enumerate(scene.meshes) if mesh.transparent]
    parts = list(_parts(scene, triangles_of(scene, chosen), surface)) if chosen else []
    pixel, mesh, face = (np.concatenate([np.empty(0, np.int64), *(p[k] for p in parts)]) for k in (0, 1, 2))
    distance, opacity = (np.concatenate([np.empty(0), *(p[k] for p in parts)]) for k in (3, 5))
    color = np.concatenate([np.empty((0, 3)), *(p[4] for p in parts)])
    order = np.lexsort((face, mesh, distance, pixel))
    counts = np.bincount(pixel, minlength=scene.width * scene.height)
    starts = np.append(0, np.cumsum(counts)).astype(np.intp)
    return Layers(starts, distance[order], color[order], opacity[order], mesh[order], face[order])


def _parts(scene: Scene, triangles: Triangles, surface: Surface) -> Iterator[_Part]:
    """Yield the layers in no order."""
    kept = kept_spans(scene) if scene.clip else None
    for pixels, sources in fragments(scene, triangles):
        distances = distances_of(scene, triangles, pixels, sources)
        mesh, face = triangles.owners(sources)
        seen = _before(surface, pixels, distances, mesh, face)
        if kept is not None:
            seen &= is_kept(kept, pixels, distances)
        if seen.any():
            pixel, source = pixels[seen], sources[seen]
            yield pixel, mesh[seen], face[seen], *paint(scene, triangles, pixel, source)
    if kept is not None:
        for index in triangles.meshes.tolist():
            for cap in caps(scene, index, kept):
                mesh, face = np.full(len(cap.pixel), index), np.full(len(cap.pixel), -1)
                seen = _before(surface, cap.pixel, cap.distance, mesh, face)
                some = cap.pixel[seen], mesh[seen], face[seen], cap.distance[seen]
                yield *some, cap.color[seen], cap.opacity[seen]


def _before(surface: Surface, pixel: Indices, distance: Floats, mesh: Integers, face: Integers) -> Booleans:
    """Say of fragments (F,) whether they lie before the opaque surface."""
    there, its_mesh, its_face = (
        field.reshape(-1)[pixel] for field in (surface.distance, surface.mesh, surface.face)
    )
    first = (mesh < its_mesh) | ((mesh == its_mesh) & (face < its_face))
    return np.asarray((distance < there) | ((distance == there) & first))
