"""The last pass of a program: the loop along its rays, the canvas, and the mean of frames.

F fragments, R rays; targets are (H * W, channels) until `emulate` gives them their shape.
"""

import dataclasses

import numpy as np

from volref.arrays import Floats, Indices
from volref.emulation.drawing import Drawing
from volref.emulation.loop.marching import Marched, Observer, march
from volref.emulation.loop.opacity import opacity_rule
from volref.emulation.rays.paths import paths_of
from volref.emulation.rays.quads import rays_in_quads
from volref.emulation.surfaces.composition import behind_all, met_in_loop
from volref.emulation.surfaces.depths import surface_colors
from volref.emulation.targets.canvas import (
    cleared,
    draw,
    fragment_colors,
    mean_of_frames,
    missed,
    over_environment,
    store,
    tone_mapped,
)
from volref.emulation.textures.mipmaps import LANES


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
    drawing: Drawing, marched: Marched, number: int, mean: Floats, *, rounds: bool = True
) -> tuple[dict[str, Floats], Floats]:
    """Return the targets that end with the canvas after frame `number`, from 1, and the running mean.

    The canvas alone is not rounded to its format if so asked.
    """
    output, device = drawing.pipeline.output, drawing.device
    frame = drawn(drawing, marched, rounds=rounds or output.mean_format is not None)
    if output.mean_format is None:
        return {"canvas": frame}, mean
    mean = mean_of_frames(mean, frame, number, output, device)
    canvas = tone_mapped(mean, output, drawing.scene.background)
    if rounds:
        canvas = store(canvas, output.format, device)
    return {"frame": frame, "running_mean": mean, "canvas": canvas}, mean


def drawn(drawing: Drawing, marched: Marched, *, rounds: bool = True) -> Floats:
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
    draw(canvas, pixel, fragments, output, device, rounds=rounds)
    blank = drawing.ends.blank
    draw(canvas, blank, np.zeros((len(blank), 4), fragments.dtype), output, device)
    missed(canvas, np.concatenate([pixel, blank]), output)
    return canvas
