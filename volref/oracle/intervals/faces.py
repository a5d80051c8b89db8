"""What a rasteriser may be off: window positions of corners, and what is interpolated between them."""

import dataclasses
from itertools import product

import numpy as np

from volref.arrays import Floats, Indices
from volref.emulation.drawing import Drawing
from volref.emulation.rays.box import CORNERS
from volref.emulation.rays.entering import faces
from volref.formats import decoded
from volref.oracle.intervals.rays import Rays, joined
from volref.oracle.intervals.slack import Slack
from volref.scene.camera import Camera
from volref.scene.scene import Scene
from volref.scene.transform import transform_points

# How far from the middle, in half viewports, an edge may be cut.
BAND = 2.0

# A byte's codes.
MOST = 255.0


def window_error(drawing: Drawing, slack: Slack) -> float:
    """Return by how many pixels float32 may move the window position of any corner of box and meshes.

    clip = M v takes 4 products and 3 sums, of the matrix and the vertex as floats; clip / w and the viewport
    take 4 more operations.
    """
    scene = drawing.scene
    matrix = scene.camera.clip_from_view(scene.width, scene.height) @ scene.camera.view_from_world
    box = transform_points(drawing.box.world_from_texture, CORNERS)
    points = np.concatenate([box, *(mesh.vertices for mesh in scene.meshes)])
    homogeneous = np.concatenate([points, np.ones((len(points), 1))], axis=1)
    clip, size = homogeneous @ matrix.T, np.abs(homogeneous) @ np.abs(matrix).T
    # Edges to corners beside the screen, or behind the eye, are cut before they are drawn: at the guard band,
    # and at the near plane.
    w = np.maximum(clip[:, 3:], scene.camera.near if not scene.camera.is_parallel else 1.0)
    ndc = np.abs(clip[:, :2]) / w
    share = np.minimum(1.0, BAND / np.maximum(ndc, BAND))
    error = 9 * slack.control * (share * size[:, :2] + np.minimum(ndc, BAND) * size[:, 3:]) / w
    pixels = (error + 4 * slack.control) * np.array([scene.width, scene.height]) / 2
    return float(pixels.max())


def shifted(scene: Scene, across: float, up: float) -> Scene:
    """Return a scene whose image is moved by pixels to the right and up."""
    move = np.eye(4)
    move[0, 3], move[1, 3] = 2 * across / scene.width, 2 * up / scene.height
    camera = scene.camera
    clip = move @ camera.clip_from_view(scene.width, scene.height)
    moved = Camera.from_matrices(camera.view_from_world, clip, clip_z=camera.clip_z)
    return dataclasses.replace(scene, camera=moved)


def varying_error(drawing: Drawing, pixel: Indices, slack: Slack) -> Floats:
    """Return how far texture coordinates (F,) of the box's faces may be off at pixels (F,).

    A varying is (A dx + B dy + C) / (a dx + b dy + c), both planes through three corners over w, dx and dy
    from one of them: four roundings each of what is added up, and a division.
    """
    scene = drawing.scene
    clip = drawing.box.clip_corners
    w = np.abs(clip[:, 3])
    x, y = (
        (clip[:, axis] / clip[:, 3] + 1) * size / 2 for axis, size in ((0, scene.width), (1, scene.height))
    )
    corners = drawing.box.triangles
    worst = np.zeros(scene.width * scene.height)
    for cull in ("back", "front"):
        found = faces(scene, drawing.box, drawing.device, cull)
        column = found.pixel % scene.width + 0.5
        row = scene.height - found.pixel // scene.width - 0.5
        which = corners[found.triangle]
        inverse = 1 / w[which]
        sides = np.stack([x[which] - x[which[:, :1]], y[which] - y[which[:, :1]]])
        area = np.abs(sides[0, :, 1] * sides[1, :, 2] - sides[1, :, 1] * sides[0, :, 2])
        away = np.abs(column - x[which[:, 0]]), np.abs(row - y[which[:, 0]])
        step = np.abs(inverse[:, 1:] - inverse[:, :1])
        # Attributes are 0 or 1: their planes are as steep as those of 1 / w and of a corner's share of it.
        slope = [
            (step + np.minimum(inverse[:, 1:], inverse[:, :1]))
            @ np.ones(2)
            * np.abs(sides[axis]).max(axis=1)
            / np.maximum(area, 1e-6)
            for axis in (1, 0)
        ]
        size = inverse.max(axis=1) + slope[0] * away[0] + slope[1] * away[1]
        with np.errstate(divide="ignore"):
            error = VARYING_ROUNDINGS * slack.control * size / found.inverse_w + 2 * slack.control
        np.maximum.at(worst, found.pixel, np.minimum(error, 1.0))
    return worst[pixel]


VARYING_ROUNDINGS = 1.0


def byte_variants(drawing: Drawing, rays: Rays, off: Floats) -> Rays:
    """Return rays with those that end at the other byte, where a coordinate lies near the middle of two."""
    scene, device = drawing.scene, drawing.device
    pixels = scene.width * scene.height
    names = {"exit": "front"} | ({"entry": "back"} if drawing.pipeline.rays.front == "target" else {})
    choices: list[tuple[str, int, Floats]] = []
    for name, cull in names.items():
        found = faces(scene, drawing.box, device, cull)
        exact = np.full((3, pixels), np.nan)
        exact[:, found.pixel] = found.varyings
        exact = exact[:, rays.pixel] * MOST
        for axis in range(3):
            other = np.floor(exact[axis]) + np.ceil(exact[axis]) - np.rint(exact[axis])
            near = np.abs(exact[axis] - np.floor(exact[axis]) - 0.5) <= off * MOST
            near &= (other >= 0) & (other <= MOST)
            codes = decoded(np.nan_to_num(other).astype(np.uint8), device.control_type)
            choices.append((name, axis, np.where(near, codes, np.nan)))
    found_rays = rays
    for taken in product((False, True), repeat=len(choices)):
        if not any(taken):
            continue
        used = [choice for choice, take in zip(choices, taken, strict=True) if take]
        at = np.flatnonzero(np.all([~np.isnan(values) for _, _, values in used], axis=0))
        if not len(at):
            continue
        more = rays.take(at)
        entry, leave = more.ends.entry.copy(), more.ends.exit.copy()
        for name, axis, values in used:
            (entry if name == "entry" else leave)[axis] = values[at]
        ends = dataclasses.replace(more.ends, entry=entry, exit=leave)
        found_rays = joined(found_rays, dataclasses.replace(more, ends=ends))
    return found_rays
