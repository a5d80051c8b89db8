"""Rays of a slab test, with how far float32 may put their ends from where exact arithmetic does.

P pixels; a ray is o + t d in texture space.  o, d and their errors are (3, P).  A face at f is met at
t = (f - o) / d, which is off by

    dt = (do + c (|f - o|) + |t| dd) / (|d| - dd) + c' |t|

with the relative errors c of a sum and c' of a division; the entry is the greatest of three such t, the exit
the least.
"""

from typing import NamedTuple

import numpy as np

from volref.arrays import Booleans, Floats
from volref.emulation.device import Device
from volref.emulation.rays.box import Box
from volref.emulation.rays.unprojecting import SCREEN, corner_on_plane, texture_from_clip
from volref.oracle.intervals.slack import Slack
from volref.scene.scene import Scene
from volref.scene.transform import transform_directions, transform_points
from volref.stages.rays import pixel_ndc, pixel_rays


class Lines(NamedTuple):
    """Lines o + t d (3, P), errors of o and d (3, P), and world length of a unit of t (P,)."""

    origin: Floats
    along: Floats
    origin_error: Floats
    along_error: Floats
    unit: Floats


class Cuts(NamedTuple):
    """Ends (3, P) of lines in the box, how far off they are (P,), which are surely and which maybe there.

    A machine's end lies off its own line's foot by `along`, which lies off this line by `beside`.
    """

    entry: Floats
    exit: Floats
    entry_off: Floats
    exit_off: Floats
    beside: Floats
    entry_along: Floats
    sure: Booleans
    maybe: Booleans


def lines_of(scene: Scene, direction: str, box: Box, device: Device, unit: float) -> Lines:
    """Return the lines of all pixels; `unit` is the relative error of an operation."""
    if direction in ("focal", "focal-square"):
        return _focal(scene, direction, box, unit)
    if direction == "unproject":
        return _unprojected(scene, box, device, unit)
    pixels = np.arange(scene.width * scene.height)
    rays = pixel_rays(scene.camera, scene.width, scene.height, pixels)
    origin = transform_points(box.texture_from_world, rays.origins).T
    along = transform_directions(box.texture_from_world, rays.directions).T
    # A point of the image (3 operations) and the matrix of floats and its product (5).  What all of a
    # direction is too long by, for it was normalised, moves nothing beside the line.
    matrix = np.abs(box.texture_from_world @ scene.camera.world_from_view)
    view = np.abs(transform_directions(scene.camera.view_from_world, rays.directions)).T
    far = matrix[:3, :3].sum(axis=1)[:, None] * _view_reach(scene) + matrix[:3, 3:]
    products = 5 if _view_reach(scene) else 1
    errors = products * unit * far + np.zeros_like(origin), 8 * unit * (matrix[:3, :3] @ view)
    return Lines(origin, along, *errors, np.ones(len(pixels)))


def _view_reach(scene: Scene) -> float:
    """Return how far in view space origins lie: 0 for an eye, near and half the image for parallel rays."""
    camera = scene.camera
    if not camera.is_parallel:
        return 0.0
    clip = camera.clip_from_view(scene.width, scene.height)
    return float(abs(camera.near) + 1 / abs(clip[0, 0]) + 1 / abs(clip[1, 1]))


def _focal(scene: Scene, rule: str, box: Box, unit: float) -> Lines:
    camera, width, height = scene.camera, scene.width, scene.height
    pixels = np.arange(width * height)
    ndc = pixel_ndc(width, height, pixels).T
    x = ndc[0] * (width / height if rule == "focal" else 1.0)
    focal = camera.clip_from_view(width, height)[1, 1]
    view = np.stack([x, ndc[1], np.full(len(pixels), -focal)])
    matrix = box.texture_from_world @ camera.world_from_view
    along = matrix[:3, :3] @ view
    eye = np.broadcast_to(matrix[:3, 3:], along.shape)
    along_error = 9 * unit * (np.abs(matrix[:3, :3]) @ (np.abs(view) + 1))
    return Lines(eye, along, 2 * unit * np.abs(eye), along_error, np.linalg.norm(view, axis=0))


def _unprojected(scene: Scene, box: Box, device: Device, unit: float) -> Lines:
    matrix = texture_from_clip(scene, box).astype(device.control_type).astype(np.float64)
    across, up = (pixel_ndc(scene.width, scene.height, np.arange(scene.width * scene.height)).T + 1) / 4
    planes = []
    for z in (-1.0, 1.0):
        corners, errors = [], []
        for x, y in SCREEN:
            clip = np.array([x, y, z, 1.0])
            point, size = matrix @ clip, np.abs(matrix) @ np.abs(clip)
            place = point[:3] / point[3]
            if device.freedom == "rounded":
                place = corner_on_plane(scene, box, device, (x, y, z))
                errors.append(2 * unit * np.abs(place))
            else:
                error = 4 * unit * (size[:3] + np.abs(place) * size[3]) / abs(point[3])
                errors.append(error + 6 * unit * np.abs(place))
            corners.append(place)
        a, b, c = (corner[:, None] for corner in corners)
        worst = np.max(errors, axis=0)[:, None]
        place = a + (b - a) * across + (c - a) * up
        size = np.abs(a) + np.abs(b - a) * across + np.abs(c - a) * up
        # Corners are weighted by up to 1 in sum 2 beyond the screen; interpolation takes six operations.
        planes.append((place, 3 * worst + 6 * unit * size))
    (near, near_error), (far, far_error) = planes
    along_error = near_error + far_error + unit * np.abs(far - near)
    lengths = np.linalg.norm(box.world_from_texture[:3, :3] @ (far - near), axis=0)
    return Lines(near, far - near, near_error, along_error, lengths)


def cuts_of(lines: Lines, slack: Slack, until: tuple[Floats, Floats] | None = None) -> Cuts:
    """Return where lines are in the unit cube from t = 0 on, and up to `until`: t (P,) and its error."""
    o, d, do, dd, _ = lines
    unit = slack.control
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        faces = []
        # A line that may be along a face may meet it anywhere.
        least = np.maximum(np.abs(d) - dd, 0.0)
        for face in (0.0, 1.0):
            t = (face - o) / d
            off = (do + unit * np.abs(face - o) + np.abs(t) * dd) / least + slack.division * np.abs(t)
            faces.append((t, np.nan_to_num(off, nan=0.0, posinf=1e30)))
        # A line in a face lies inside or outside, which a rounding decides: 1 / 0 has no other answer.
        in_face = (d == 0) & (np.minimum(np.abs(o), np.abs(1 - o)) <= do) & (unit > 0)
        if in_face.any():
            faces = [(np.where(in_face, np.nan, t), np.where(in_face, 0.0, off)) for t, off in faces]
        (low, low_off), (high, high_off) = faces
        swapped = high < low
        first, first_off = np.where(swapped, high, low), np.where(swapped, high_off, low_off)
        last, last_off = np.where(swapped, low, high), np.where(swapped, low_off, high_off)
        first, last = (
            np.nan_to_num(first, nan=-1e30, neginf=-1e30),
            np.nan_to_num(last, nan=1e30, posinf=1e30),
        )
        first_high, last_low = first + first_off, last - last_off
        # Between two faces a line meets neither nearer than this, also one all but along them.
        away = (np.minimum(o, 1 - o) - do - unit) / (np.abs(d) + dd) * (1 - slack.division)
        first_high = np.where(away > 0, np.minimum(first_high, -away), first_high)
        last_low = np.where(away > 0, np.maximum(last_low, away), last_low)
        begin, begin_low, begin_high = (
            np.maximum(bound.max(axis=0), 0.0) for bound in (first, first - first_off, first_high)
        )
        end, end_low, end_high = (bound.min(axis=0) for bound in (last, last_low, last + last_off))
        if until is not None:
            t, off = until
            end, end_low, end_high = (
                np.minimum(end, t),
                np.minimum(end_low, t - off),
                np.minimum(end_high, t + off),
            )
        sure, maybe = (begin_high < end_low) & ~in_face.any(axis=0), begin_low < end_high
        ends = []
        for t, t_low, t_high in ((begin, begin_low, begin_high), (end, end_low, end_high)):
            off = np.maximum(t_high - t, t - t_low)
            place = o + t * d
            beside = (do + np.abs(t) * dd + 3 * unit * (np.abs(o) + np.abs(t * d))).max(axis=0)
            along = (off * np.abs(d)).max(axis=0)
            ends.append((place, *(np.minimum(one, 1.0) for one in (beside + along, beside, along))))
    (entry, entry_off, beside, entry_along), (leave, exit_off, further, _) = ends
    return Cuts(entry, leave, entry_off, exit_off, np.maximum(beside, further), entry_along, sure, maybe)
