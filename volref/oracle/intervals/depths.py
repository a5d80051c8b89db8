"""How far the depths may be off that a program compares: of its rays, of its surfaces, of its box's back.

R rays.  Depths go through four bytes.  What comes out of them is a staircase of what goes in: it is taken at
both ends of what may go in, between which at most one digit carries over.
"""

import numpy as np

from volref.arrays import Floats, Indices
from volref.emulation.drawing import Approach, Drawing
from volref.emulation.loop.marching import Cut
from volref.emulation.rays.entering import faces
from volref.emulation.surfaces.depths import face_nearness, nearness_of
from volref.emulation.surfaces.packing import packed, unpacked
from volref.emulation.targets.canvas import store
from volref.oracle.intervals.slack import Slack

# Operations between a vertex and the nearness of a fragment.
OPERATIONS = 16

# The last digit of a packed number, twice.
LAST_DIGIT = 2.0**-23


def cut_error(drawing: Drawing, one: Approach, off: Floats, slack: Slack) -> Cut:
    """Return how far the numbers of rays' cuts may be off, for coordinates that are off by `off` (R,)."""
    assert one.cut is not None
    scene, pipeline, device = drawing.scene, drawing.pipeline, drawing.device
    pixel = one.ends.pixel
    error = _error(drawing, slack)
    entry = error * _scale(drawing, 1 - one.cut.depth) + off * _reach(drawing)
    back = faces(scene, drawing.box, device, "front")
    nearness = face_nearness(scene, pipeline, drawing.box, device, back)
    behind = _stored_error(drawing, pixel, back.pixel, nearness, error)
    meshes = one.surfaces
    nearness = nearness_of(scene, pipeline, device, meshes.window_z, meshes.inverse_w, meshes.view)
    surface = _stored_error(drawing, pixel, meshes.pixel, nearness, error)
    step = (entry + behind) / pipeline.stepping.steps + 4 * slack.control * np.abs(one.cut.step)
    return Cut(entry, step, surface, one.cut.early)


def _error(drawing: Drawing, slack: Slack) -> float:
    """Return how far a nearness may be off: absolutely where it is linear, else in parts of itself."""
    if drawing.pipeline.meshes.depth != "linear":
        return OPERATIONS * slack.control
    near, far = drawing.scene.camera.near, drawing.scene.camera.far
    return OPERATIONS * slack.control * (1 + 2 * far / (far - near))


def _scale(drawing: Drawing, nearness: Floats) -> Floats | float:
    return 1.0 if drawing.pipeline.meshes.depth == "linear" else np.abs(nearness)


def _reach(drawing: Drawing) -> float:
    """Return what a linear nearness changes by along the box; window z over w is a varying's own."""
    if drawing.pipeline.meshes.depth != "linear":
        return 0.0
    near, far = drawing.scene.camera.near, drawing.scene.camera.far
    return float(np.linalg.norm(drawing.box.sides)) / (far - near)


def _stored_error(drawing: Drawing, pixel: Indices, drawn: Indices, nearness: Floats, error: float) -> Floats:
    """Return how far (R,) what is read of a target of depths may be off, at pixels (R,); 0 where none is."""
    packing, device = drawing.pipeline.meshes.packing, drawing.device
    off = error * _scale(drawing, nearness) * np.ones(len(nearness))
    read = []
    for way in (-1.0, 0.0, 1.0):
        colors = packed((nearness + way * off).astype(nearness.dtype), packing)
        if packing != "exact":
            colors = store(colors, "unorm8", device)
        read.append(unpacked(colors, packing).astype(np.float64))
    apart = np.maximum(np.abs(read[0] - read[1]), np.abs(read[2] - read[1]))
    found = np.zeros(drawing.scene.width * drawing.scene.height)
    found[drawn] = apart + off + (LAST_DIGIT if error else 0.0)
    return found[pixel]
