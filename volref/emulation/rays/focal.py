"""Rays of a slab test whose direction is made of the focal length: seed 003, eq. 1 and 2, and its base.

    p = o + t v     v = R (x_ndc aspect, y_ndc, -f)     f = 1 / tan(fov / 2)

o and R, the eye and the turn from view to texture space, are uniforms of the shader; v is not normalised.
All is computed in the control type, operation by operation as a shader does.  R rays.
"""

import numpy as np

from volref.arrays import Floats
from volref.emulation.device import Device
from volref.emulation.rays.box import Box
from volref.emulation.rays.paths import Ends, vector_length
from volref.errors import SceneError
from volref.scene.scene import Scene
from volref.scene.transform import transform_points


def focal_ends(scene: Scene, rule: str, box: Box, device: Device, surface: Floats | None = None) -> Ends:
    """Return where the rays of all pixels enter and leave the box, those that meet it.

    `rule` is "focal", or "focal-square", which leaves the aspect out.  A ray ends at the latest at the world
    distance `surface` (H * W, 1).

    Raises
    ------
    SceneError
        If the camera has parallel rays, which have no eye.
    """
    camera, kind = scene.camera, device.control_type
    if camera.is_parallel:
        message = f"camera must be a perspective one for pipeline.rays.direction {rule!r}, got a parallel "
        raise SceneError(message + "one; use a pipeline with 'eye'")
    eye = transform_points(box.texture_from_world, camera.world_from_view[:3, 3]).astype(kind)
    turn = (box.texture_from_world @ camera.world_from_view)[:3, :3].astype(kind)
    view = _view_directions(scene, rule, device)
    along = np.stack([row[0] * view[0] + row[1] * view[1] + row[2] * view[2] for row in turn])
    begin, end = _slab(eye, along)
    if surface is not None:
        end = np.minimum(end, surface[:, 0].astype(kind) / vector_length(view))
    hit = np.flatnonzero(begin < end)
    near, far = (eye[:, None] + along[:, hit] * t[hit] for t in (begin, end))
    return Ends(hit, near, far)


def _view_directions(scene: Scene, rule: str, device: Device) -> Floats:
    """Return the directions (3, H * W) in view space, not normalised."""
    kind, width, height = device.control_type, scene.width, scene.height
    row, column = np.divmod(np.arange(width * height), width)
    x = kind(2) * (column + 0.5).astype(kind) / kind(width) - kind(1)
    y = kind(2) * (height - row - 0.5).astype(kind) / kind(height) - kind(1)
    if rule == "focal":
        x = x * kind(width / height)
    focal_length = kind(scene.camera.clip_from_view(width, height)[1, 1])
    return np.stack([x, y, np.full_like(x, -focal_length)])


def _slab(eye: Floats, along: Floats) -> tuple[Floats, Floats]:
    """Return the t (R,) >= 0 at which rays along (3, R) from the eye (3,) enter and leave the unit cube."""
    kind = along.dtype.type
    with np.errstate(divide="ignore", invalid="ignore"):
        inverse = kind(1) / along
        low, high = (inverse * (kind(face) - eye)[:, None] for face in (0, 1))
    begin = np.maximum(np.minimum(low, high).max(axis=0), kind(0))
    return begin, np.maximum(low, high).min(axis=0)
