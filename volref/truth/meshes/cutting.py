"""What clipping planes leave of the meshes: which fragments stay, and the faces where a body is cut open.

H, W the image; C pixels that show a cut face.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from volref.arrays import Booleans, Floats, Indices, Integers
from volref.io.info import is_watertight
from volref.records import Spans
from volref.scene.scene import Scene
from volref.stages.rays import pixel_rays
from volref.stages.spans import clip_spans
from volref.stages.zbuffer import NOTHING, keep_nearest
from volref.truth.meshes.triangles import Elsewhere, Triangles, crossings, distances_of, paint, triangles_of
from volref.truth.parts import runs

PIXELS_AT_ONCE = 1 << 16


class Cap(NamedTuple):
    """Where a plane cuts a mesh open: pixel, distance, color (C, 3), opacity; all else (C,)."""

    pixel: Indices
    distance: Floats
    color: Floats
    opacity: Floats


def kept_spans(scene: Scene) -> Spans:
    """Return the part of the ray of every pixel that the clipping planes keep, (H * W,)."""
    pixels = scene.width * scene.height
    near, far = np.empty(pixels), np.empty(pixels)
    parts = runs(pixels, PIXELS_AT_ONCE)
    for some in map(parts.pixels, range(parts.count)):
        spans = clip_spans(pixel_rays(scene.camera, scene.width, scene.height, some), scene.clip)
        near[some], far[some] = spans.t_near, spans.t_far
    return Spans(near, far)


def is_kept(kept: Spans, pixel: Indices, distance: Floats) -> Booleans:
    """Say of fragments (F,) whether no clipping plane cuts them away."""
    return np.asarray((distance >= kept.t_near[pixel]) & (distance <= kept.t_far[pixel]))


def caps(scene: Scene, index: int, kept: Spans) -> Iterator[Cap]:
    """Yield the faces where the clipping planes cut the mesh `index` open.

    A ray that enters what is kept, or leaves it, inside the mesh meets a cut face there, with the plane's
    normal turned away from what is kept; the first shows its front, the second its back.  Inside is where an
    odd number of crossings lies ahead, which says something only of a watertight mesh: others get no caps.
    A cap has the mesh's colour, or that of the nearest crossing on the ray that was cut away there; where
    none was, since the camera is inside, that of the nearest left.
    """
    mesh = scene.meshes[index]
    sides = (True, False) if mesh.sides == "both" else (mesh.sides == "front",)
    if not is_watertight(mesh):
        return
    triangles = triangles_of(scene, [index])
    for entering in sides:
        at = kept.t_near if entering else kept.t_far
        cut = (kept.t_near < kept.t_far) & (at > 0) & (at < np.inf)
        pixel, source = _cut_open(scene, triangles, at, cut, entering=entering)
        pixel, source = _within_view(scene, pixel, source, at)
        if len(pixel) > 0:
            facing = _facing(scene, pixel, entering=entering)
            place = Elsewhere(at[pixel], facing, np.full(len(pixel), not entering))
            yield Cap(pixel, *paint(scene, triangles, pixel, source, place))


def _cut_open(
    scene: Scene, triangles: Triangles, at: Floats, cut: Booleans, *, entering: bool
) -> tuple[Indices, Integers]:
    """Return the pixels whose ray is inside the mesh at the distance `at`, and the triangles for the colour.

    A crossing exactly at `at` is kept, so it lies ahead of a ray that enters and behind one that leaves.
    """
    ahead_count = np.zeros(len(at), np.uint8)  # an overflow keeps it even or odd
    gaps = [np.full(len(at), np.inf) for _ in range(2)]
    sources = [np.full(len(at), NOTHING) for _ in range(2)]
    if cut.any():
        for pixels, candidates in crossings(scene, triangles):
            some = np.flatnonzero(cut[pixels])
            pixel, source = pixels[some], candidates[some]
            distance = distances_of(scene, triangles, pixel, source)
            ahead = distance >= at[pixel] if entering else distance > at[pixel]
            np.add.at(ahead_count, pixel[ahead], np.uint8(1))
            gap = np.abs(distance - at[pixel])
            for which, gap_of, source_of in zip(
                (ahead != entering, ahead == entering), gaps, sources, strict=True
            ):
                keep_nearest(pixel[which], gap[which], source[which], gap_of, source_of)
    pixel = np.flatnonzero(ahead_count & 1)
    cut_away, left = (source[pixel] for source in sources)
    return pixel, np.where(cut_away != NOTHING, cut_away, left)


def _within_view(scene: Scene, pixel: Indices, source: Integers, at: Floats) -> tuple[Indices, Integers]:
    """Leave out what lies before the near or beyond the far plane."""
    rays = pixel_rays(scene.camera, scene.width, scene.height, pixel)
    x, y, z = (rays.origins + at[pixel, None] * rays.directions).T
    row = scene.camera.view_from_world[2]
    depth = -(row[0] * x + row[1] * y + row[2] * z + row[3])
    seen = (depth >= scene.camera.near) & (depth <= scene.camera.far)
    return pixel[seen], source[seen]


def _facing(scene: Scene, pixel: Indices, *, entering: bool) -> Floats:
    """Return the outward normals (C, 3) of the cut faces through which rays enter or leave what is kept."""
    rays = pixel_rays(scene.camera, scene.width, scene.height, pixel)
    deciding = np.full(len(pixel), -np.inf if entering else np.inf)
    facing = np.zeros((len(pixel), 3))
    for plane in scene.clip:
        x, y, z = (rays.directions * plane.normal).T
        rise = x + y + z
        through = rise > 0 if entering else rise < 0
        t = np.where(through, -plane.height(rays.origins) / np.where(through, rise, 1.0), deciding)
        decides = t > deciding if entering else t < deciding
        deciding[decides], facing[decides] = t[decides], -plane.normal
    return facing
