"""The harness: a scene, a rival and its setting in; the image and what it cost out.

R rays.  Rays, spans, surfaces and what lies behind are the marcher's; only the quadrature differs.
"""

import time
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from volref.arrays import Floats, Indices
from volref.errors import SceneError
from volref.planning import more_than_values
from volref.records import Surface
from volref.scene.scene import Scene
from volref.scene.transform import transform_directions, transform_points
from volref.stages.composite import over
from volref.stages.rays import pixel_rays
from volref.stages.sampling import PAD
from volref.stages.spans import box_spans, cut_spans
from volref.studies.rivals.medium import Bundle, Integrator, Medium, medium_of
from volref.studies.rivals.table import Rival
from volref.truth.canvas import light_behind
from volref.truth.meshes.surfaces import visible_surface
from volref.workspace import Workspace

# Rays that are integrated together, by knob: a march takes 8 samples of each at a time, the others all of
# them, and either should stay in the cache.
RAYS_PER_CHUNK = {"step": 4096, "parts": 256, "tolerance": 256}


class Outcome(NamedTuple):
    """What a rival made of a scene.

    rgba: premultiplied image (H, W, 4), or (P, 4) where pixels were chosen.
    samples: values of the field that its rule takes.
    seconds: wall time on one thread of everything, of which `preparation` went into the grid and tables.
    """

    rgba: Floats
    samples: int
    seconds: float
    preparation: float


def integrate(scene: Scene, rival: Rival, setting: float, *, pixels: Indices | None = None) -> Outcome:
    """Return the image of `scene` as `rival` computes it.

    `setting` is that of the rival's knob.  `pixels` (P,) are flat indices
    y width + x of the pixels wanted; default all.

    Raises
    ------
    SceneError
        If the setting is none for this rival, or the scene holds no volume.

    Examples
    --------
    >>> from volref.phantoms.scenes import homogeneous_scene
    >>> from volref.studies.rivals.table import RIVALS
    >>> scene, truth = homogeneous_scene(4, 3)
    >>> out = integrate(scene, RIVALS["left-exponential"], 0.5)
    >>> bool(abs(out.rgba - truth).max() < 1e-14), out.rgba.shape
    (True, (3, 4, 4))
    """
    rival.check(setting)
    return image_by(
        scene,
        lambda medium: rival.prepare(medium, setting),
        pixels=pixels,
        rays_per_chunk=RAYS_PER_CHUNK[rival.knob],
    )


def image_by(
    scene: Scene,
    prepare: Callable[[Medium], Integrator],
    *,
    pixels: Indices | None = None,
    rays_per_chunk: int = 256,
) -> Outcome:
    """Return the image of `scene` by the integrator that `prepare` makes for its field.

    Raises
    ------
    SceneError
        If the scene holds no volume.
    """
    if scene.volume is None:
        message = "scene.volume must be given for a rival, got None; only a volume has something to integrate"
        raise SceneError(message)
    if more := more_than_values(scene):
        message = f"scene must be one volume of values up to an opaque surface for a study, got {more}; "
        raise SceneError(message + "leave it out")
    started = time.perf_counter()
    medium = medium_of(scene)
    integrator = prepare(medium)
    surface = visible_surface(scene) if scene.meshes else None
    preparation = time.perf_counter() - started
    chosen = np.arange(scene.width * scene.height) if pixels is None else pixels
    rgba, samples, work = np.empty((len(chosen), 4)), 0, Workspace()
    for first in range(0, len(chosen), rays_per_chunk):
        part = slice(first, first + rays_per_chunk)
        rgba[part], count = _chunk(scene, medium, integrator, surface, chosen[part], work)
        samples += count
    image = rgba.reshape(scene.height, scene.width, 4) if pixels is None else rgba
    return Outcome(image, samples, time.perf_counter() - started, preparation)


def _chunk(
    scene: Scene,
    medium: Medium,
    integrator: Integrator,
    surface: Surface | None,
    pixels: Indices,
    work: Workspace,
) -> tuple[Floats, int]:
    """Return rgba (R, 4) of `pixels` (R,), and the values taken."""
    behind = light_behind(scene, surface, pixels)
    field = medium.field
    rays = pixel_rays(scene.camera, scene.width, scene.height, pixels)
    origins = transform_points(field.space_from_world, rays.origins).T
    directions = transform_directions(field.space_from_world, rays.directions).T
    spans = box_spans(origins, directions, field.low, field.high)
    if surface is not None:
        spans = cut_spans(spans, 0.0, surface.distance.reshape(-1)[pixels])
    length = spans.t_far - spans.t_near
    hit = np.flatnonzero(length > 0)
    order = hit[np.argsort(-length[hit], kind="stable")]
    if len(order) == 0:
        return behind, 0
    start = origins[:, order] + PAD + directions[:, order] * spans.t_near[order]
    light = integrator(Bundle(start, directions[:, order], length[order]), work)
    rgba = behind
    rgba[order] = over(light.color, light.transmittance, behind[order])
    return rgba, light.samples
