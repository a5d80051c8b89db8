"""The targets that tell a volume's pass where meshes are, and the rays that they cut.

Arbelaz et al. 2016 stores in passes 1 and 3 what its last pass takes from 1: the nearness 1 - depth, so that
a target cleared to 0 means the greatest depth.  At the pixel of a front face, S steps:

    back = 1 - unpack(back_depth)    front = 1 - nearness    surface = 1 - unpack(mesh_depth)
    step = (back - front) / S        ray depth of sample i: front + step + step ... (i times), in float32

F fragments, R rays; targets are (H * W, C).
"""

import dataclasses

import numpy as np

from volref.arrays import Floats, Integers
from volref.emulation.device import Device
from volref.emulation.loop.marching import Cut
from volref.emulation.pipeline import Pipeline
from volref.emulation.rays.box import Box
from volref.emulation.rays.entering import faces
from volref.emulation.rays.paths import Ends
from volref.emulation.surfaces.meshes import NOWHERE, Surfaces, distances
from volref.emulation.surfaces.packing import packed, unpacked
from volref.emulation.targets.canvas import store
from volref.scene.scene import Scene
from volref.scene.transform import transform_points
from volref.stages.raster import Fragments


def mesh_targets(
    scene: Scene, pipeline: Pipeline, box: Box, device: Device, surfaces: Surfaces
) -> dict[str, Floats]:
    """Return the targets that a program draws of meshes, and of the box's far side for their sake."""
    kind = pipeline.meshes.kind
    if kind == "depth":
        back = faces(scene, box, device, "front")
        mesh_nearness = nearness_of(
            scene, pipeline, device, surfaces.window_z, surfaces.inverse_w, surfaces.view
        )
        targets = {
            "mesh_depth": _depth_target(scene, pipeline, device, surfaces.pixel, mesh_nearness),
            "mesh_color": _color_target(scene, pipeline, device, surfaces),
            "back_depth": _depth_target(
                scene, pipeline, device, back.pixel, face_nearness(scene, pipeline, box, device, back)
            ),
        }
    elif kind == "distance" and len(scene.meshes):
        far = _measured(scene, pipeline, surfaces).astype(device.control_type)
        targets = {
            "mesh_distance": _target(scene, surfaces.pixel, far[:, None], clear=NOWHERE),
            "mesh_color": _color_target(scene, pipeline, device, surfaces),
        }
    else:
        targets = {}
    return targets


def cut_rays(
    scene: Scene,
    pipeline: Pipeline,
    box: Box,
    device: Device,
    surfaces: Surfaces,
    targets: dict[str, Floats],
    ends: Ends,
) -> tuple[Ends, Cut]:
    """Return the rays whose front faces no mesh hides, and the depths that they compare at each step."""
    front = faces(scene, box, device, "back")
    pixels = scene.width * scene.height
    window_z = np.ones((2, pixels), np.float32)
    window_z[0, front.pixel], window_z[1, surfaces.pixel] = front.window_z, surfaces.window_z
    kept = np.flatnonzero(window_z[0, ends.pixel] < window_z[1, ends.pixel])
    ends = dataclasses.replace(
        ends, pixel=ends.pixel[kept], entry=ends.entry[:, kept], exit=ends.exit[:, kept]
    )
    kind, switches = device.control_type, pipeline.meshes
    near = np.zeros(pixels, kind)
    near[front.pixel] = face_nearness(scene, pipeline, box, device, front)
    surface, back = (
        kind(1) - unpacked(targets[name][ends.pixel], switches.packing)
        for name in ("mesh_depth", "back_depth")
    )
    if switches.scale != 1.0:
        surface = np.where(surface < 1, surface * kind(switches.scale), surface)
    depth = kind(1) - near[ends.pixel]
    step = (back - depth) / kind(pipeline.stepping.steps)
    return ends, Cut(depth, step, surface, switches.comparison == "one-step-early")


def _measured(scene: Scene, pipeline: Pipeline, surfaces: Surfaces) -> Floats:
    """Return what (F,) a program takes for the world distance of fragments."""
    camera, measure = scene.camera, pipeline.meshes.measure
    if measure == "view":
        found = -surfaces.view[2]
    elif measure == "window":
        found = camera.near + surfaces.window_z.astype(np.float64) * (camera.far - camera.near)
    else:
        found = distances(surfaces, camera)
    return np.asarray(found * pipeline.meshes.scale)


def face_nearness(scene: Scene, pipeline: Pipeline, box: Box, device: Device, face: Fragments) -> Floats:
    """Return the nearness (F,) of fragments of the box's faces."""
    view = transform_points(scene.camera.view_from_world @ box.world_from_texture, face.varyings.T).T
    return nearness_of(scene, pipeline, device, face.window_z, face.inverse_w, view)


def nearness_of(
    scene: Scene, pipeline: Pipeline, device: Device, window_z: Floats, inverse_w: Floats, view: Floats
) -> Floats:
    """Return 1 - depth (F,) in the control type: gl_FragCoord.z gl_FragCoord.w, or linear in the distance."""
    kind = device.control_type
    if pipeline.meshes.depth == "window-over-w":
        return np.asarray(window_z.astype(kind) * inverse_w.astype(kind))
    if pipeline.meshes.depth == "window":
        return np.asarray(kind(1) - window_z.astype(kind))
    near, far = kind(scene.camera.near), kind(scene.camera.far)
    return np.asarray((far + view[2].astype(kind)) / (far - near))


def _depth_target(
    scene: Scene, pipeline: Pipeline, device: Device, pixel: Integers, nearness: Floats
) -> Floats:
    """Return a target of depths, packed into bytes or a number as it is, cleared to 0."""
    colors = packed(nearness, pipeline.meshes.packing)
    if pipeline.meshes.packing != "exact":
        colors = store(colors, "unorm8", device)
    return _target(scene, pixel, colors)


def _color_target(scene: Scene, pipeline: Pipeline, device: Device, surfaces: Surfaces) -> Floats:
    """Return the target (H * W, 4) of the meshes' colours, alpha 1, cleared to 0."""
    return _target(
        scene, surfaces.pixel, store(surface_colors(surfaces, device), pipeline.meshes.format, device)
    )


def surface_colors(surfaces: Surfaces, device: Device) -> Floats:
    """Return the colours (F, 4) that a mesh's shader writes."""
    opaque = np.ones((len(surfaces.pixel), 1))
    return np.concatenate([surfaces.color, opaque], axis=1).astype(device.values_type)


def _target(scene: Scene, pixel: Integers, colors: Floats, *, clear: float = 0.0) -> Floats:
    target = np.full((scene.width * scene.height, colors.shape[1]), clear, colors.dtype)
    target[pixel] = colors
    return target
