"""The opaque meshes of a scene as a program draws them: nearest fragments, colours, distances.

F fragments, at most one for each pixel and in the order of pixels.  Meshes are drawn one after the other,
unlit, with the depth test LESS.
"""

from dataclasses import dataclass

import numpy as np

from volref.arrays import Floats, Integers
from volref.emulation.device import Device
from volref.emulation.pipeline import Pipeline
from volref.errors import SceneError
from volref.scene.camera import Camera
from volref.scene.mesh import Mesh
from volref.scene.scene import Scene
from volref.scene.transform import transform_points
from volref.stages.raster import Fragments, depth_test, rasterize
from volref.stages.surface import texture_colors

# What a fragment's side is not to be for its mesh to show it.
CULLED = {"both": "none", "front": "back", "back": "front"}

# A distance that a target of distances is cleared to: nothing is there.
NOWHERE = 1e30


@dataclass(frozen=True, eq=False)
class Surfaces:
    """Nearest fragments of meshes: pixel, window z, 1 / clip w (F,), view position (3, F), colour (F, 3)."""

    pixel: Integers
    window_z: Floats
    inverse_w: Floats
    view: Floats
    color: Floats


def surfaces_of(scene: Scene, device: Device) -> Surfaces:
    """Return the nearest fragments of a scene's meshes."""
    drawn = [_fragments(mesh, scene, device) for mesh in scene.meshes]
    if not drawn:
        none = np.zeros(0)
        return Surfaces(np.zeros(0, np.int64), none, none, np.zeros((3, 0)), np.zeros((0, 3)))
    together = Fragments(*(np.concatenate(parts, axis=-1) for parts in zip(*drawn, strict=True)))
    seen = depth_test(together, scene.width * scene.height, depth_bits=device.depth_bits)
    view, color = np.split(together.varyings[:, seen], 2)
    return Surfaces(together.pixel[seen], together.window_z[seen], together.inverse_w[seen], view, color.T)


def distances(surfaces: Surfaces, camera: Camera) -> Floats:
    """Return the world distance (F,) from the origins of the rays: the eye, or the near plane."""
    if camera.is_parallel:
        return np.asarray(-surfaces.view[2] - camera.near)
    return np.asarray(np.sqrt(np.sum(surfaces.view**2, axis=0)))


def check_meshes(scene: Scene, pipeline: Pipeline) -> None:
    """Refuse meshes that the program cannot draw, and programs that do not go together with meshes.

    Raises
    ------
    SceneError
        With the mesh and what is wrong with it.
    """
    kind, name = pipeline.meshes.kind, f"pipeline {pipeline.name!r}"
    if kind == "depth" and (pipeline.rays.kind != "coordinates" or pipeline.stepping.rule != "count"):
        message = f"pipeline.meshes.kind must not be 'depth' for rays of kind {pipeline.rays.kind!r} with "
        message += f"stepping.rule {pipeline.stepping.rule!r}, got 'depth'; "
        raise SceneError(message + "take rays of kind 'coordinates' with rule 'count', or another kind")
    if kind == "depth" and pipeline.table.filter == "linear-mipmap":
        message = f"pipeline.table.filter must be 'linear' or 'nearest' where {name} compares depths, got "
        raise SceneError(message + "'linear-mipmap'; change it, or set pipeline.meshes.kind")
    if kind == "depth" and pipeline.meshes.depth == "linear" and not np.isfinite(scene.camera.far):
        message = f"camera.far must be finite for {name}, whose depth is a share of near to far, got inf; "
        raise SceneError(message + "move the plane to behind the scene")
    if not scene.meshes:
        return
    if kind == "none":
        message = f"scene.meshes must be empty for {name}, which draws none, got {len(scene.meshes)}; "
        raise SceneError(message + "leave them out, or take a pipeline that draws meshes")
    if kind == "distance" and pipeline.rays.kind != "slab":
        message = f"pipeline.meshes.kind must be 'depth' or 'none' for rays of kind {pipeline.rays.kind!r}, "
        raise SceneError(message + "got 'distance'; leave the meshes out, or change one of the two")
    for i, mesh in enumerate(scene.meshes):
        if mesh.transparent or mesh.lit:
            got, cure = ("lit", "lit=False") if mesh.lit else ("transparent", "opacity 1 and no alphas")
            message = f"scene.meshes[{i}] must be opaque and unlit for {name}, got a {got} one; "
            raise SceneError(message + f"give it {cure}")


def _fragments(mesh: Mesh, scene: Scene, device: Device) -> Fragments:
    """Return all fragments of a mesh; their varyings (6, F) are view position and colour."""
    camera = scene.camera
    view = transform_points(camera.view_from_world, mesh.vertices)
    project = camera.clip_from_view(scene.width, scene.height)
    clip = view @ project[:, :3].T + project[:, 3]
    varyings = np.concatenate([view, _attributes(mesh)], axis=1)
    fragments = rasterize(
        clip,
        mesh.faces,
        varyings,
        scene.width,
        scene.height,
        subpixel_bits=device.subpixel_bits,
        planes=device.planes,
        cull=CULLED[mesh.sides],
        clip_z=camera.clip_z,
    )
    colors = _colors(mesh, fragments)
    return fragments._replace(varyings=np.concatenate([fragments.varyings[:3], colors.T]))


def _attributes(mesh: Mesh) -> Floats:
    """Return what of a mesh's colours its vertices carry (V, 0, 2 or 3)."""
    if mesh.coloring == "vertex":
        return mesh.colors[:, :3]
    return np.zeros((len(mesh.vertices), 0)) if mesh.uv is None else mesh.uv


def _colors(mesh: Mesh, fragments: Fragments) -> Floats:
    """Return the colours (F, 3) of a mesh's fragments."""
    carried = fragments.varyings[3:].T
    if mesh.coloring == "vertex":
        colors = carried
    elif mesh.coloring == "face":
        colors = mesh.colors[fragments.triangle, :3]
    elif mesh.texture is not None:
        colors = texture_colors(mesh.texture, carried, mesh.wrap)[:, :3]
    else:
        colors = np.broadcast_to(mesh.colors[:3], (len(fragments.pixel), 3))
    if mesh.back_color is not None:
        colors = np.where(fragments.front[:, None], colors, mesh.back_color)
    return colors
