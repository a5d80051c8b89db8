"""`trace`: every number of one ray.

The same stages as the marcher's, run on a single ray with nothing left out, so that a table row says what
the marcher saw.  Sums are taken one by one, so the colour differs from the marcher's by rounding only.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from volref.arrays import Floats, Numbers
from volref.errors import SceneError
from volref.planning import Plan
from volref.records import Rays, Surface
from volref.scene.scene import Scene
from volref.scene.transform import transform_directions, transform_points
from volref.stages.classify import segment_opacity
from volref.stages.rays import pixel_rays
from volref.stages.sampling import PAD, trilinear
from volref.stages.spans import box_spans, cut_spans
from volref.traces import Column, Trace, checked_pixel
from volref.truth.canvas import light_behind
from volref.truth.fields import Field, PlainField, Samples
from volref.truth.integration import Integration
from volref.truth.march import segments_of
from volref.truth.meshes.surfaces import visible_surface
from volref.truth.rendering import decide
from volref.workspace import Workspace

# What a row of the table holds.
COLUMNS = {
    "segment": Column(1, "number of the segment, from 0"),
    "t_start": Column(1, "world distance at which it starts"),
    "t_end": Column(1, "world distance at which it ends"),
    "t": Column(1, "world distance of the sample, its middle"),
    "position": Column(3, "world position of the sample", shown=False),
    "index": Column(3, "the same in index space (integer = voxel centre)"),
    "cell": Column(3, "lowest corner of the cell, in index space", shown=False),
    "fraction": Column(3, "place within the cell, 0..1", shown=False),
    "corners": Column(8, "samples at the cell's corners, x fastest", shown=False),
    "value": Column(1, "interpolated value"),
    "color": Column(3, "straight colour of the transfer function"),
    "strength": Column(1, "extinction or opacity of the transfer function, whichever it interpolates"),
    "opacity": Column(1, "opacity of the segment"),
    "transmittance": Column(1, "transmittance in front of the segment"),
    "weight": Column(1, "opacity times transmittance"),
    "accumulated": Column(4, "premultiplied RGBA up to and with the segment"),
}


def trace(
    scene: Scene, pixel: Sequence[int], *, step: float | None = None, plan: Plan | None = None
) -> Trace:
    """Return every number of the ray through `pixel` (x, y), row 0 at the top.

    `step` and `plan` are as for `render`; early termination and empty space play no part.  Where the look of
    the volume takes more than its value (lights, gradients, radars), the colour and the strength are those
    after all of it, and the columns of the interpolation are left out.

    Raises
    ------
    SceneError
        If the pixel lies outside the image, an argument breaks a rule of `volref.plan`, or the scene has
        transparent meshes or another mode than "composite".
    """
    _refuse_others(scene, plan)
    decided = decide(scene, plan, "march" if plan is None else "auto", step)
    if decided.method != "march":
        message = f"plan must be a march's, got method {decided.method!r}; make one with method='march'"
        raise SceneError(message)
    x, y = checked_pixel(pixel, scene.width, scene.height)
    flat = np.array([y * scene.width + x])
    rays = pixel_rays(scene.camera, scene.width, scene.height, flat)
    surface = visible_surface(scene) if scene.meshes else None
    head: dict[str, Any] = {
        "pixel": [x, y],
        "origin": rays.origins[0].tolist(),
        "direction": rays.directions[0].tolist(),
        "step": decided.step,
        "surface": _surface_words(surface, x, y),
        "behind": light_behind(scene, surface, flat)[0].tolist(),
    }
    if scene.volume is None:
        return Trace({**head, "span": None, "ended": "no volume", "rgba": head["behind"]}, {}, COLUMNS)
    distance = np.inf if head["surface"] is None else head["surface"]["distance"]
    return _trace_volume(scene, decided, rays, distance, head)


def _surface_words(surface: Surface | None, x: int, y: int) -> dict[str, Any] | None:
    if surface is None or surface.mesh[y, x] < 0:
        return None
    return {
        "distance": float(surface.distance[y, x]),
        "mesh": int(surface.mesh[y, x]),
        "face": int(surface.face[y, x]),
        "color": surface.color[y, x].tolist(),
    }


def _refuse_others(scene: Scene, plan: Plan | None) -> None:
    """Refuse scenes of which one row of segments is not the whole ray, and plans of other segments."""
    other = "" if scene.mode == "composite" else f"mode {scene.mode!r}"
    other = "transparent meshes" if any(mesh.transparent for mesh in scene.meshes) else other
    other = "a plan with start offsets" if plan is not None and plan.offsets is not None else other
    if other:
        message = f"scene must be one volume up to a surface to be traced, got {other}; trace it without"
        raise SceneError(message)


def _trace_volume(scene: Scene, plan: Plan, rays: Rays, distance: float, head: dict[str, Any]) -> Trace:
    """Trace one ray through the volume of `scene` up to a surface `distance` away, +inf without one."""
    integration = Integration(scene, plan.everything())
    field = integration.field
    origin = transform_points(field.space_from_world, rays.origins).T
    direction = transform_directions(field.space_from_world, rays.directions).T
    box = box_spans(origin, direction, field.low, field.high)
    pixel = np.array([head["pixel"][1] * scene.width + head["pixel"][0]])
    begin, end = integration.limits(pixel, np.array([distance]))
    spans = cut_spans(box, begin, end)
    t_near, t_far = float(spans.t_near[0]), float(spans.t_far[0])
    if t_near >= t_far:
        missed, cut = box.t_near[0] >= box.t_far[0], distance >= box.t_far[0]
        ended = "a clipping plane cuts it off" if cut else "a surface lies in front of the volume"
        ended = "the ray misses the volume" if missed else ended
        return Trace({**head, "span": None, "ended": ended, "rgba": head["behind"]}, {}, COLUMNS)
    counts, steps = segments_of(spans, plan.step)
    number = np.arange(counts[0])
    start, length = t_near + number * steps[0], np.full(counts[0], steps[0])
    index = origin + direction * t_near + (number + 0.5) * (direction * steps[0])
    table = _table(field, start, length, index, -rays.directions[0])
    if isinstance(field, PlainField):
        table |= _interpolated(scene, field, index)
    table["t_end"] = np.append(start[1:], t_far)
    table["position"] = rays.origins[0] + table["t"][:, None] * rays.directions[0]
    transmittance = table["transmittance"][-1] - table["weight"][-1]
    rgba = table["accumulated"][-1] + transmittance * np.array(head["behind"])
    met = "leaves the volume" if t_far == box.t_far[0] else "is cut off by a clipping plane"
    met = "meets an opaque surface" if t_far == distance else met
    head = {
        **head,
        "step": float(steps[0]),
        "span": [t_near, t_far],
        "ended": f"the ray {met}",
        "rgba": rgba.tolist(),
    }
    return Trace(head, {name: table[name] for name in COLUMNS if name in table}, COLUMNS)


def _table(field: Field, start: Floats, length: Floats, index: Floats, viewer: Floats) -> dict[str, Numbers]:
    """Return the columns of the segments that begin at `start` (S,), but for `position` and `t_end`.

    `index` (3, S) are their samples in the space of the field, `viewer` (3,) is the way back.
    """
    t = start + length / 2
    towards = np.repeat(viewer[:, None], len(t), axis=1)
    samples = Samples(index + PAD, np.zeros(index.shape, np.int32), towards)
    color, strength = (found.copy() for found in field.look(samples, Workspace()))
    opacity = segment_opacity(field, strength.copy(), length)
    transmittance = np.ones(len(t) + 1)
    accumulated = np.zeros((len(t), 4))
    for k in range(len(t)):
        weight = transmittance[k] * opacity[k]
        transmittance[k + 1] = transmittance[k] - weight
        accumulated[k] = accumulated[k - 1] if k else 0.0
        accumulated[k, :3] += weight * color[:, k]
        accumulated[k, 3] = 1.0 - transmittance[k + 1]
    return {
        "segment": np.arange(len(t)),
        "t_start": start,
        "t": t,
        "color": color.T,
        "strength": strength,
        "opacity": opacity,
        "transmittance": transmittance[:-1],
        "weight": transmittance[:-1] * opacity,
        "accumulated": accumulated,
    }


def _interpolated(scene: Scene, field: PlainField, index: Floats) -> dict[str, Numbers]:
    """Return the columns that say how the values at `index` (3, S) came about."""
    volume, _ = scene.gridded
    cell = np.floor(index)
    return {
        "index": index.T,
        "cell": cell.T.astype(np.int64),
        "fraction": (index - cell).T,
        "corners": _corner_samples(volume.values, cell.T.astype(np.int64)),
        "value": trilinear(field.grid, index + PAD, Workspace()),
    }


def _corner_samples(values: Numbers, cell: Numbers) -> Floats:
    """Return the samples (S, 8) at the corners of the cells (S, 3), clamped to the volume, x fastest."""
    corner = np.array([(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)])
    limit = np.array(values.shape[::-1]) - 1
    x, y, z = np.moveaxis(np.clip(cell[:, None] + corner, 0, limit), -1, 0)
    return np.asarray(values[z, y, x], dtype=np.float64)
