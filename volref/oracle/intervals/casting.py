"""The rays that a correct machine may cast: where each starts and ends, and how far it may be off.

A pixel has one ray, or several where something decides between them: a byte of a coordinate target that is
near the middle between two, an edge so near to the pixel's centre that it may be covered or not, a vertex
near the middle between two places of the grid.  It is `shaky` if the number of those is not one, or if none
of them may be cast at all.
"""

from dataclasses import dataclass

import numpy as np

from volref.arrays import Booleans, Floats, Indices
from volref.emulation.drawing import Approach, Drawing, approach
from volref.emulation.rays.box import box_of
from volref.emulation.rays.paths import Ends
from volref.emulation.surfaces.meshes import NOWHERE
from volref.oracle.intervals.depths import cut_error
from volref.oracle.intervals.faces import byte_variants, shifted, varying_error, window_error
from volref.oracle.intervals.rays import Rays, merged
from volref.oracle.intervals.slabs import Lines, cuts_of, lines_of
from volref.oracle.intervals.slack import Slack
from volref.scene.transform import transform_points

# Corners of the square within which window positions may lie.
CORNERS = ((-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0))


@dataclass(frozen=True, eq=False)
class Cast:
    """All rays that may be cast, pixels (P,) that may go without one, and those that are shaky.

    surfaces: the pixels of meshes and their colours in each way that window positions may lie.
    """

    rays: Rays
    missing: Booleans
    shaky: Booleans
    approaches: tuple[Approach, ...]


def cast(drawing: Drawing, slack: Slack) -> Cast:
    """Return the rays that a correct machine may cast for a drawing."""
    scene, device = drawing.scene, drawing.device
    pixels = scene.width * scene.height
    nominal = Approach(drawing.surfaces, drawing.ends, drawing.cut, dict(drawing.targets))
    approaches = [nominal, *_shifted_approaches(drawing, slack)]
    slab = drawing.pipeline.rays.kind == "slab"
    lines = (
        lines_of(scene, drawing.pipeline.rays.direction, drawing.box, device, slack.control) if slab else None
    )
    kept, present, shaky = None, np.zeros((len(approaches), pixels), np.bool_), np.zeros(pixels, np.bool_)
    missing = np.zeros(pixels, np.bool_)
    for number, one in enumerate(approaches):
        if lines is not None:
            rays, unsure = _slab_rays(drawing, one, lines, slack)
            missing[unsure] = True
        else:
            rays = _face_rays(drawing, one, slack, bytes_too=number == 0)
        present[number, rays.pixel] = True
        kept = rays if kept is None else merged(kept, rays, shaky)
    assert kept is not None
    missing |= present.any(axis=0) & ~present.all(axis=0)
    counts = np.bincount(kept.pixel, minlength=pixels)
    shaky |= (counts > 1) | (missing & (counts > 0))
    return Cast(kept, missing, shaky, tuple(approaches))


def _shifted_approaches(drawing: Drawing, slack: Slack) -> list[Approach]:
    """Return the way to the loop with the window shifted to the corners of how far it may be off."""
    scene, pipeline, device = drawing.scene, drawing.pipeline, drawing.device
    if slack.control == 0 or (pipeline.rays.kind == "slab" and not scene.meshes):
        return []
    error = window_error(drawing, slack) + device.snap_slack
    found = []
    for across, up in CORNERS:
        moved = shifted(scene, across * error, up * error)
        found.append(approach(moved, pipeline, box_of(moved), device))
    return found


def _slab_rays(drawing: Drawing, one: Approach, lines: Lines, slack: Slack) -> tuple[Rays, Indices]:
    """Return rays of a slab test, and the pixels of those that may not be there."""
    kind, unit = drawing.device.control_type, slack.control
    until = None
    pixels = lines.origin.shape[1]
    behind, covered = np.zeros((pixels, 4)), np.zeros(pixels, np.bool_)
    if "mesh_distance" in one.targets:
        distance = one.targets["mesh_distance"].reshape(pixels).astype(np.float64)
        before = _before(drawing, lines)
        t = (distance - before) / lines.unit
        # Interpolated positions are off by some ten operations of their size, their length by as many.
        size = np.abs(t) + (drawing.scene.camera.near + before) / lines.unit
        until = (t, np.where(distance < NOWHERE / 2, 24 * unit * size, 0))
        behind = one.targets["mesh_color"].reshape(pixels, 4).astype(np.float64)
        covered = behind[:, 3] > 0
    cuts = cuts_of(lines, slack, until)
    at = np.flatnonzero(cuts.maybe)
    ends = Ends(at, cuts.entry[:, at].astype(kind), cuts.exit[:, at].astype(kind))
    none = np.zeros(len(at))
    entry_off, exit_off, path_off = none, none, none
    if unit:
        entry_off, exit_off = cuts.entry_off[at] + unit, cuts.exit_off[at] + unit
        path_off = cuts.beside[at] + cuts.entry_along[at] + unit
    rays = Rays(ends, entry_off, exit_off, none, path_off, behind[at], covered[at])
    return rays, at[~cuts.sure[at]]


def _before(drawing: Drawing, lines: Lines) -> Floats:
    """Return how far (P,) in the world lines begin behind where distances of meshes are measured from."""
    scene = drawing.scene
    if drawing.pipeline.rays.direction != "unproject" or scene.camera.is_parallel:
        return np.zeros(lines.origin.shape[1])
    begin = transform_points(drawing.box.world_from_texture, lines.origin.T)
    return np.asarray(np.linalg.norm(begin - scene.camera.world_from_view[:3, 3], axis=1))


def _face_rays(drawing: Drawing, one: Approach, slack: Slack, *, bytes_too: bool) -> Rays:
    """Return rays from the fragments of the box's faces."""
    ends, unit = one.ends, slack.control
    count = len(ends.pixel)
    off = varying_error(drawing, ends.pixel, slack) if unit else np.zeros(count)
    entry_off, exit_off, along_off = off, off, np.zeros(count)
    exact = np.zeros(count)
    setup = drawing.pipeline.rays
    if setup.kind == "coordinates" and setup.format == "unorm8":
        entry_off = exact if setup.front == "target" else off
        exit_off = exact
    if ends.along is not None:
        away = np.linalg.norm(ends.exit - ends.entry, axis=0)
        eye = _distance_to_eye(drawing, ends)
        along_off = (2 * off + 4 * unit * (1 + eye)) / np.maximum(eye, 1e-6) + (
            5 * unit + slack.division
        ) * away
    covered = np.zeros(count, np.bool_)
    behind = np.zeros((count, 4))
    cut_off = None
    if one.cut is not None:
        behind = one.targets["mesh_color"].reshape(-1, 4)[ends.pixel].astype(np.float64)
        covered = behind[:, 3] > 0
        cut_off = cut_error(drawing, one, off, slack)
    path_off = np.maximum(entry_off, exit_off) if ends.along is None else entry_off
    rays = Rays(ends, entry_off, exit_off, along_off, path_off, behind, covered, one.cut, cut_off)
    if setup.kind == "coordinates" and setup.format == "unorm8" and unit and bytes_too:
        rays = byte_variants(drawing, rays, off)
    return rays


def _distance_to_eye(drawing: Drawing, ends: Ends) -> Floats:
    """Return how far (R,) the fragments are from the eye, whose difference is the direction of rays."""
    camera = drawing.scene.camera
    if camera.is_parallel:
        return np.ones(len(ends.pixel))
    eye = (drawing.box.texture_from_world @ camera.world_from_view[:, 3])[:3, None]
    if not ((eye > 0) & (eye < 1)).all():
        return np.asarray(np.linalg.norm(ends.entry - eye, axis=0))
    # From within, rays start at the eye, and the fragments are those of the far faces.
    assert ends.along is not None
    with np.errstate(divide="ignore"):
        return np.asarray((np.where(ends.along > 0, 1 - eye, eye) / np.abs(ends.along)).min(axis=0))
