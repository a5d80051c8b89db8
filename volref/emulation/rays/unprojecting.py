"""Rays of a slab test between the near and the far plane, unprojected by the inverse of the matrices: VPT.

A triangle covers the screen, its corners a, b and c at (-1, -1), (3, -1) and (-1, 3).  There, in the vertex
shader, clip positions (x, y, -1, 1) and (x, y, 1, 1) are turned into texture space and divided by w; between
them they are linear on the screen:

    near(x, y) = a + (b - a) (x + 1) / 4 + (c - a) (y + 1) / 4      and far(x, y) likewise

The matrix is a float32 uniform whose rows cancel for far planes: so all is computed in the control type,
operation by operation as the shaders do.  R rays, of all pixels.
"""

import numpy as np

from volref.arrays import Floats
from volref.emulation.device import Device
from volref.emulation.rays.box import Box
from volref.emulation.rays.paths import Ends
from volref.emulation.textures.lookup import mix
from volref.scene.scene import Scene
from volref.stages.rays import pixel_ndc

SCREEN = ((-1.0, -1.0), (3.0, -1.0), (-1.0, 3.0))


def unprojected_ends(scene: Scene, box: Box, device: Device, surface: Floats | None = None) -> Ends:
    """Return where the rays of all pixels enter and leave the box behind the near plane, those that meet it.

    A ray ends at the latest at the world distance `surface` (H * W, 1) from where distances are measured.
    """
    near, far = (_on_plane(scene, box, device, z) for z in (-1.0, 1.0))
    begin, end = _slab(near, far - near)
    if surface is not None:
        end = np.minimum(end, _at_distance(scene, box, near, far, surface[:, 0]))
    hit = np.flatnonzero(~(begin >= end))
    entry, leave = (mix(device, near[:, hit], far[:, hit], t[hit]) for t in (begin, end))
    return Ends(hit, entry, leave)


def _on_plane(scene: Scene, box: Box, device: Device, z: float) -> Floats:
    """Return the points (3, R) in texture space of pixel centres on the near plane, z = -1, or the far, 1."""
    kind = device.control_type
    a, b, c = (corner_on_plane(scene, box, device, (x, y, z)) for x, y in SCREEN)
    across, up = (pixel_ndc(scene.width, scene.height, np.arange(scene.width * scene.height)).T + 1) / 4
    return np.asarray(a[:, None] + (b - a)[:, None] * across + (c - a)[:, None] * up).astype(kind)


def corner_on_plane(scene: Scene, box: Box, device: Device, place: tuple[float, float, float]) -> Floats:
    """Return where (3,) the vertex shader puts a corner of the triangle, x, y and z of clip space."""
    kind = device.control_type
    matrix = texture_from_clip(scene, box).astype(kind)
    clip = (*(kind(number) for number in place), kind(1))
    point = [row[0] * clip[0] + row[1] * clip[1] + row[2] * clip[2] + row[3] * clip[3] for row in matrix]
    return np.array([point[axis] / point[3] for axis in range(3)], np.float64)


def texture_from_clip(scene: Scene, box: Box) -> Floats:
    """Return the 4x4 matrix from clip positions with a z of -1 to 1 to texture space."""
    clip = box.clip_from_texture
    if scene.camera.clip_z == "0..1":
        clip = np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 2, -1], [0, 0, 0, 1]]) @ clip
    return np.asarray(np.linalg.inv(clip))


def _slab(near: Floats, along: Floats) -> tuple[Floats, Floats]:
    """Return the t (R,) at which rays enter and leave the unit cube, 0 at `near` and not before it."""
    kind = near.dtype.type
    with np.errstate(divide="ignore", invalid="ignore"):
        low, high = (kind(0) - near) / along, (kind(1) - near) / along
    begin = np.fmin(low, high).max(axis=0)
    end = np.fmax(low, high).min(axis=0)
    return np.fmax(begin, kind(0)), np.fmax(end, kind(0))


def _at_distance(scene: Scene, box: Box, near: Floats, far: Floats, distance: Floats) -> Floats:
    """Return the t (R,) between near and far plane at world distances from where they are measured."""
    begin, end = (
        points.T.astype(np.float64) @ box.world_from_texture[:3, :3].T + box.world_from_texture[:3, 3]
        for points in (near, far)
    )
    start = begin if scene.camera.is_parallel else scene.camera.world_from_view[:3, 3]
    before = np.linalg.norm(begin - start, axis=1)
    t = (distance - before) / np.linalg.norm(end - begin, axis=1)
    return np.asarray(t, near.dtype)
