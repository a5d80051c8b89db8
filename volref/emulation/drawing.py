"""What a program has in hand when its last pass begins: uploads, targets, rays, and the loop to walk them."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from volref.arrays import Floats
from volref.emulation.agreement import check_agreement, check_drawable, check_steps
from volref.emulation.device import Device
from volref.emulation.loop.marching import Cut, Program, Shader
from volref.emulation.loop.opacity import OpacityRule, opacity_rule
from volref.emulation.loop.shading import check_gradients, shader_of
from volref.emulation.pipeline import Pipeline
from volref.emulation.rays.box import Box, box_of
from volref.emulation.rays.entering import ends_of_rays
from volref.emulation.rays.paths import Ends, Paths, paths_of
from volref.emulation.surfaces.depths import cut_rays, mesh_targets
from volref.emulation.surfaces.meshes import Surfaces, check_meshes, distances, surfaces_of
from volref.emulation.textures.gradient_volume import has_gradient_volume
from volref.emulation.textures.lookup import Textures, textures_of
from volref.emulation.textures.uploads import Uploads, decoded_or, uploads_of
from volref.scene.scene import Scene


@dataclass(frozen=True, eq=False)
class Drawing:
    """All that a program has in hand when its last pass begins; what `trace` and `accept` look into too.

    targets: what it has drawn so far, by name.  surfaces: the nearest fragments of the meshes, at the world
    distance (H, W), +inf elsewhere.  cut: what the loop knows of them.
    """

    scene: Scene
    pipeline: Pipeline
    device: Device
    box: Box
    uploads: Uploads
    textures: Textures
    ends: Ends
    paths: Paths
    rule: OpacityRule
    targets: Mapping[str, Floats]
    surfaces: Surfaces
    distance: Floats
    cut: Cut | None
    shade: Shader | None

    def program(self, offset: Floats) -> Program:
        """Return the loop for start offsets (H * W,)."""
        start = offset[self.ends.pixel].astype(self.device.control_type)
        return Program(self.textures, self.rule, self.paths, start, self.cut, self.shade)


class Approach(NamedTuple):
    """The way to the loop: meshes as they are seen, the ends of rays, how meshes cut them, the targets."""

    surfaces: Surfaces
    ends: Ends
    cut: Cut | None
    targets: dict[str, Floats]


def approach(scene: Scene, pipeline: Pipeline, box: Box, device: Device) -> Approach:
    """Return what the passes before the last one make of a scene that the program can draw."""
    surfaces, cut = surfaces_of(scene, device), None
    targets = mesh_targets(scene, pipeline, box, device, surfaces)
    ends, coordinates = ends_of_rays(scene, pipeline, box, device, targets.get("mesh_distance"))
    if pipeline.meshes.kind == "depth":
        ends, cut = cut_rays(scene, pipeline, box, device, surfaces, targets, ends)
    return Approach(surfaces, ends, cut, targets | coordinates)


def prepare(scene: Scene, pipeline: Pipeline, device: Device) -> Drawing:
    """Return what the program has before its last pass.

    Raises
    ------
    SceneError
        If the scene holds what the program cannot draw.
    """
    check_drawable(scene, pipeline)
    check_steps(pipeline.stepping)
    check_meshes(scene, pipeline)
    check_gradients(scene, pipeline)
    check_agreement(scene, pipeline)
    box, uploads = box_of(scene), uploads_of(scene, pipeline)
    surfaces, ends, cut, targets = approach(scene, pipeline, box, device)
    if has_gradient_volume(pipeline.lighting):
        targets = {"gradient_volume": decoded_or(uploads.volume, device.values_type)} | targets
    paths = paths_of(ends, scene, pipeline, box, device)
    rule = opacity_rule(scene, pipeline, box, paths, device)
    distance = np.full((scene.height, scene.width), np.inf)
    distance.reshape(-1)[surfaces.pixel] = distances(surfaces, scene.camera)
    textures = textures_of(uploads, pipeline, device)
    shade = shader_of(scene, textures, box, ends)
    ready = textures, ends, paths, rule, targets, surfaces, distance, cut, shade
    return Drawing(scene, pipeline, device, box, uploads, *ready)
