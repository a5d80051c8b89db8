"""`emulate`: the conductor of an emulation, pass by pass.

uploads --> coordinate targets --> ends of rays --> paths --> the loop --> fragment colours --> canvas
                                        ^                         ^                               ^
            mesh targets ---------------+-------------------------+-------------------------------+
"""

import dataclasses
import time
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from volref.arrays import Floats, Indices, float_array, whole_number
from volref.emulation.agreement import check_agreement, check_kinds, check_steps
from volref.emulation.box import Box, box_of
from volref.emulation.canvas import (
    cleared,
    draw,
    fragment_colors,
    mean_of_frames,
    missed,
    over_environment,
    store,
    tone_mapped,
)
from volref.emulation.catalogue import named
from volref.emulation.composition import behind_all, distance_shown, met_in_loop
from volref.emulation.depths import cut_rays, mesh_targets, surface_colors
from volref.emulation.device import Device
from volref.emulation.entering import ends_of_rays
from volref.emulation.gradient_volume import has_gradient_volume
from volref.emulation.lookup import Textures, textures_of
from volref.emulation.marching import Cut, Marched, Observer, Program, Shader, march
from volref.emulation.meshes import Surfaces, check_meshes, distances, surfaces_of
from volref.emulation.mipmaps import LANES
from volref.emulation.opacity import OpacityRule, opacity_rule
from volref.emulation.paths import Ends, Paths, paths_of
from volref.emulation.pipeline import Pipeline
from volref.emulation.quads import rays_in_quads
from volref.emulation.radar_image import check_spherical, is_spherical
from volref.emulation.result import Emulation
from volref.emulation.shading import check_gradients, shader_of
from volref.emulation.uploads import Uploads, decoded_or, uploads_of
from volref.errors import SceneError
from volref.scene.radar import RadarVolume
from volref.scene.scene import Scene
from volref.scene.volume import Volume


def emulate(
    scene: Scene,
    pipeline: str | Pipeline,
    device: str | Device | None = None,
    jitter: ArrayLike | None = None,
    frames: int = 1,
) -> Emulation:
    """Return what a GPU program draws of a scene, with every target on the way.

    Parameters
    ----------
    pipeline
        The name of a system in the catalogue, or a `Pipeline`.
    device
        The machine; the default is ideal arithmetic, but for the float32 that decides how many samples a ray
        takes.  A name is a preset, see `Device.named`.
    jitter
        For programs with a start offset: numbers 0..1 of a step, (frames, H, W).  None is 0.
    frames
        Frames of which the running mean is shown.

    Raises
    ------
    SceneError
        If the scene holds what the program cannot draw, or an argument breaks a rule.

    Examples
    --------
    >>> import volref as vr
    >>> volume = vr.Volume(np.full((4, 4, 4), 255, np.uint8))
    >>> transfer = vr.TransferFunction.from_opacity([0, 255], [(1, 1, 1)] * 2, [0, 0.5])
    >>> camera = vr.Camera.look_at((1.5, 1.5, 9), (1.5, 1.5, 1.5), (0, 1, 0), 30, 1, 20)
    >>> out = emulate(vr.Scene(volume, transfer, camera, 3, 3), "texture3d")
    >>> out.rgba8[1, 1].tolist(), int(out.samples[1, 1])
    ([239, 239, 239, 239], 8)
    """
    began = time.perf_counter()
    program = named(pipeline) if isinstance(pipeline, str) else pipeline
    machine = Device.named(device) if isinstance(device, str) else Device() if device is None else device
    check_kinds(scene, program, machine)
    count = whole_number("frames", frames, low=1, high=1 << 20)
    offsets = start_offsets(scene, program, jitter, count)
    drawing = prepare(scene, program, machine)
    passes = dict(drawing.targets)
    mean = cleared(scene, program.output, machine)
    for number, offset in enumerate(offsets, start=1):
        marched = march_frame(drawing, offset)
        last, mean = last_targets(drawing, marched, number, mean)
    passes |= last
    size = scene.height, scene.width
    samples = np.zeros(size, np.int64)
    samples.reshape(-1)[drawing.ends.pixel] = marched.samples
    images = {name: _image(target, size) for name, target in passes.items()}
    distance = distance_shown(drawing.distance, drawing.ends.pixel, marched.alpha)
    seconds = time.perf_counter() - began
    return Emulation(images["canvas"], distance, images, samples, seconds, program, machine)


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
    surfaces, cut = surfaces_of(scene, device), None
    targets = mesh_targets(scene, pipeline, box, device, surfaces)
    ends, coordinates = ends_of_rays(scene, pipeline, box, device, targets.get("mesh_distance"))
    if pipeline.meshes.kind == "depth":
        ends, cut = cut_rays(scene, pipeline, box, device, surfaces, targets, ends)
    targets |= coordinates
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


def march_frame(
    drawing: Drawing, offset: Floats, observe: Observer | None = None, rays: Indices | None = None
) -> Marched:
    """Return what the loop accumulates along the rays of a drawing, whose start offsets are (H * W,).

    Where the table has mip levels, rays are walked with their neighbours in lanes, which an observer sees.
    Of `rays` alone, what the others accumulate is of no use.
    """
    if not drawing.textures.levels:
        return march(drawing.program(offset), observe, rays)
    lanes, lane = lanes_of_rays(drawing)
    walked = None if rays is None else (lane[rays, None] // LANES * LANES + np.arange(LANES)).reshape(-1)
    marched = march(lanes.program(offset), observe, walked)
    color, alpha, weighted, samples, hit = marched
    return Marched(color[:, lane], alpha[lane], weighted[lane], samples[lane], hit[lane])


def lanes_of_rays(drawing: Drawing) -> tuple[Drawing, Indices]:
    """Return the drawing of all lanes of its quads, and which lane each of its rays is."""
    scene, pipeline, box, device = drawing.scene, drawing.pipeline, drawing.box, drawing.device
    ends, drawn_too = rays_in_quads(scene, pipeline, box, device, drawing.targets)
    paths = paths_of(ends, scene, pipeline, box, device)
    rule = opacity_rule(scene, pipeline, box, paths, device)
    lane_of = np.zeros(scene.height * scene.width, np.intp)
    lane_of[ends.pixel[drawn_too]] = np.flatnonzero(drawn_too)
    lanes = dataclasses.replace(drawing, ends=ends, paths=paths, rule=rule)
    return lanes, lane_of[drawing.ends.pixel]


def last_targets(
    drawing: Drawing, marched: Marched, number: int, mean: Floats
) -> tuple[dict[str, Floats], Floats]:
    """Return the targets that end with the canvas after frame `number`, from 1, and the running mean."""
    output, device = drawing.pipeline.output, drawing.device
    frame = drawn(drawing, marched)
    if output.mean_format is None:
        return {"canvas": frame}, mean
    mean = mean_of_frames(mean, frame, number, output, device)
    canvas = store(tone_mapped(mean, output, drawing.scene.background), output.format, device)
    return {"frame": frame, "running_mean": mean, "canvas": canvas}, mean


def drawn(drawing: Drawing, marched: Marched) -> Floats:
    """Return the target (H * W, 4) of the last pass: the frame, or the canvas."""
    output, device = drawing.pipeline.output, drawing.device
    canvas = cleared(drawing.scene, output, device)
    fragments, pixel = fragment_colors(marched, drawing.pipeline.accumulation), drawing.ends.pixel
    surfaces = drawing.surfaces
    if drawing.cut is not None:
        canvas[surfaces.pixel] = store(surface_colors(surfaces, device), output.format, device)
        objects = drawing.targets["mesh_color"][pixel]
        fragments = met_in_loop(fragments, marched.hit, objects, drawing.pipeline.meshes.composition)
    elif len(surfaces.pixel):
        fragments, pixel = behind_all(fragments, pixel, drawing.targets["mesh_color"], surfaces.pixel)
    if output.blend == "environment":
        fragments = over_environment(fragments, marched.alpha, canvas[pixel], drawing.pipeline.accumulation)
    if output.mean_format is None:
        fragments = tone_mapped(fragments, output, drawing.scene.background)
    draw(canvas, pixel, fragments, output, device)
    blank = drawing.ends.blank
    draw(canvas, blank, np.zeros((len(blank), 4), fragments.dtype), output, device)
    missed(canvas, np.concatenate([pixel, blank]), output)
    return canvas


def start_offsets(scene: Scene, pipeline: Pipeline, jitter: ArrayLike | None, frames: int) -> Floats:
    """Return where in its first step each ray takes its first sample (frames, H * W)."""
    size = frames, scene.height, scene.width
    offsets = np.full(size, pipeline.stepping.offset)
    if frames > 1 and pipeline.output.mean_format is None:
        message = f"frames must be 1 for a pipeline that keeps no mean of frames, got {frames}; "
        raise SceneError(message + "set pipeline.output.mean_format, or draw one frame")
    if jitter is not None:
        if not pipeline.stepping.jitter:
            message = "jitter must be None for a pipeline that has none, got numbers; "
            raise SceneError(message + "set pipeline.stepping.jitter, or leave it out")
        offsets = offsets + checked_jitter(jitter, size)
    return offsets.reshape(frames, -1)


def checked_jitter(jitter: ArrayLike, size: tuple[int, int, int]) -> Floats:
    """Return start offsets of this size, all of 0..1."""
    offsets = float_array("jitter", jitter, size)
    for worst in (offsets.min(), offsets.max()):
        if not 0 <= worst <= 1:
            message = f"jitter must lie in 0..1, got {worst:g}; give shares of a step"
            raise SceneError(message)
    return offsets


def check_drawable(scene: Scene, pipeline: Pipeline) -> None:
    """Refuse scenes that hold what no program here draws."""
    wanted = RadarVolume if is_spherical(pipeline.volume) else Volume
    if not isinstance(scene.volume, wanted):
        message = f"scene.volume must be a {wanted.__name__} for pipeline {pipeline.name!r}, got "
        message += f"{'none' if scene.volume is None else type(scene.volume).__name__}; "
        cure = (
            "choose a pipeline for grids" if wanted is RadarVolume else "choose one for radars, or resample"
        )
        raise SceneError(message + f"give one, or {cure}")
    if wanted is RadarVolume:
        check_spherical(pipeline)
    if scene.mode != "composite" or scene.clip:
        got = "clipping planes" if scene.clip else f"mode {scene.mode!r}"
        message = f"scene must be a composite without clipping planes to be emulated, got {got}; "
        raise SceneError(message + "leave it out")


def _image(target: Floats, size: tuple[int, int]) -> Floats:
    """Return a target as (H, W, channels)."""
    return target if target.ndim > 2 else target.reshape(*size, -1)
