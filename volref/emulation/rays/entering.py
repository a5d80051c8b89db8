"""Where rays enter and leave the box: two passes over its faces, one pass, or a slab test.

F fragments, R rays.  The coordinate targets of two passes are (H, W, 3), in the number format of the target.
"""

import numpy as np

from volref.arrays import Floats
from volref.emulation.device import Device
from volref.emulation.pipeline import Pipeline
from volref.emulation.rays.box import CORNERS, Box
from volref.emulation.rays.focal import focal_ends
from volref.emulation.rays.paths import Ends, vector_length
from volref.emulation.rays.unprojecting import unprojected_ends
from volref.formats import stored
from volref.scene.camera import Camera
from volref.scene.scene import Scene
from volref.scene.transform import transform_directions, transform_points
from volref.stages.raster import Fragments, depth_test, rasterize
from volref.stages.rays import pixel_rays
from volref.stages.spans import box_spans
from volref.stages.textures import Texture, fetch
from volref.workspace import Workspace


def ends_of_rays(
    scene: Scene, pipeline: Pipeline, box: Box, device: Device, surface: Floats | None = None
) -> tuple[Ends, dict[str, Floats]]:
    """Return the ends of the rays of all pixels that the program draws, and its coordinate targets.

    A slab's ray ends at the latest at the world distance `surface` (H * W, 1).
    """
    if pipeline.rays.kind == "coordinates":
        return _two_passes(scene, pipeline, box, device)
    if pipeline.rays.kind == "front-face":
        return _from_faces(scene, box, device), {}
    if pipeline.rays.direction in ("focal", "focal-square"):
        return focal_ends(scene, pipeline.rays.direction, box, device, surface), {}
    if pipeline.rays.direction == "unproject":
        return unprojected_ends(scene, box, device, surface), {}
    return _slab(scene, box, device, surface), {}


def faces(scene: Scene, box: Box, device: Device, cull: str) -> Fragments:
    """Return the nearest fragments of the box's faces, their varyings the texture coordinates."""
    fragments = rasterize(
        box.clip_corners,
        box.triangles,
        CORNERS,
        scene.width,
        scene.height,
        subpixel_bits=device.subpixel_bits,
        planes=device.planes,
        cull=cull,
        clip_z=scene.camera.clip_z,
    )
    seen = depth_test(fragments, scene.width * scene.height, depth_bits=device.depth_bits)
    return Fragments(
        fragments.pixel[seen],
        fragments.triangle[seen],
        fragments.window_z[seen],
        fragments.inverse_w[seen],
        fragments.varyings[:, seen],
        fragments.front[seen],
    )


def _two_passes(scene: Scene, pipeline: Pipeline, box: Box, device: Device) -> tuple[Ends, dict[str, Floats]]:
    front = faces(scene, box, device, "back")
    targets = {"back_coordinates": _target(faces(scene, box, device, "front"), scene, pipeline, device)}
    exits = read_target(targets["back_coordinates"], front, pipeline, box, device)
    entries = front.varyings.astype(device.control_type)
    if pipeline.rays.front == "target":
        targets = {"front_coordinates": _target(front, scene, pipeline, device)} | targets
        entries = read_target(targets["front_coordinates"], front, pipeline, box, device)
    else:
        # No target of the program's own: what a frame capture shows when the varying is drawn.
        shown = pipeline.with_switches(rays={"format": "float"})
        targets = {"front_coordinates": _target(front, scene, shown, device)} | targets
    return _walked(Ends(front.pixel, entries, exits), pipeline), targets


def _walked(ends: Ends, pipeline: Pipeline) -> Ends:
    """Return the rays that the shader walks, and which fragments it leaves before that."""
    if pipeline.rays.no_exit == "walked":
        return ends
    none = (ends.exit[0] == 0) & (ends.exit[1] == 0)
    kept = np.flatnonzero(~none)
    return Ends(ends.pixel[kept], ends.entry[:, kept], ends.exit[:, kept], ends.pixel[none])


def _target(fragments: Fragments, scene: Scene, pipeline: Pipeline, device: Device) -> Floats:
    """Return a coordinate target (H, W, 3), cleared to 0."""
    target = np.zeros((scene.height * scene.width, 3), device.control_type)
    nan = 1.0 if device.nan_stored == "one" else 0.0
    colors = fragments.varyings.T.astype(device.control_type)
    target[fragments.pixel] = stored(colors, pipeline.rays.format, nan=nan)
    return target.reshape(scene.height, scene.width, 3)


def read_target(target: Floats, fragments: Fragments, pipeline: Pipeline, box: Box, device: Device) -> Floats:
    """Return what fragments read of a target at their own place, (clip xy / clip w + 1) / 2.

    That place is a varying of the snapped triangle, which the clip positions of its corners are not: it lies
    up to half a step of the grid beside the pixel's centre, and a linear filter mixes in the neighbours.
    """
    if pipeline.rays.filter == "nearest":
        return np.ascontiguousarray(target.reshape(-1, 3)[fragments.pixel].T)
    clip = box.clip_from_texture[:, :3] @ fragments.varyings + box.clip_from_texture[:, 3:]
    u, v = ((clip[:2] / clip[3] + 1) / 2).astype(device.control_type)
    return fetch(Texture(target), (u, 1 - v), Workspace())


def _from_faces(scene: Scene, box: Box, device: Device) -> Ends:
    """Return rays away from the eye, from the front faces on, or from the eye if that is inside."""
    eye = _eye(scene, box)
    inside = eye is not None and bool(((eye > 0) & (eye < 1)).all())
    fragments = faces(scene, box, device, "front" if inside else "back")
    kind = device.control_type
    at_face = fragments.varyings.astype(kind)
    if eye is None:
        along = transform_directions(box.texture_from_world, _forward(scene.camera)[None]).T
        away = np.broadcast_to(along.astype(kind), at_face.shape)
    else:
        away = at_face - eye.astype(kind)[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        direction = away / vector_length(away)
    start = (
        np.broadcast_to(eye.astype(kind)[:, None], at_face.shape) if inside and eye is not None else at_face
    )
    return Ends(fragments.pixel, start, start + direction, along=direction)


def _eye(scene: Scene, box: Box) -> Floats | None:
    """Return the eye (3,) in texture space, None for parallel rays."""
    if scene.camera.is_parallel:
        return None
    return np.asarray(transform_points(box.texture_from_world, scene.camera.world_from_view[:3, 3]))


def _forward(camera: Camera) -> Floats:
    return np.asarray(-camera.world_from_view[:3, 2])


def _slab(scene: Scene, box: Box, device: Device, surface: Floats | None) -> Ends:
    pixels = np.arange(scene.width * scene.height)
    rays = pixel_rays(scene.camera, scene.width, scene.height, pixels)
    starts = transform_points(box.texture_from_world, rays.origins).T
    along = transform_directions(box.texture_from_world, rays.directions).T
    spans = box_spans(starts, along, np.zeros(3), np.ones(3))
    t_near, t_far = spans.t_near, spans.t_far
    if surface is not None:
        t_far = np.minimum(t_far, surface[:, 0])
    hit = np.flatnonzero(t_near < t_far)
    kind = device.control_type
    near, far = ((starts[:, hit] + t[hit] * along[:, hit]).astype(kind) for t in (t_near, t_far))
    return Ends(hit, near, far)
