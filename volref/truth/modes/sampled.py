"""The modes that reduce a ray to one value, for a volume that is no grid of cells: by samples.

R rays, S samples of each, at the middles of equal segments of its span; NaN where nothing was measured.  What
every third sample says instead is the estimate of the error, as for a march.
"""

from dataclasses import dataclass

import numpy as np

from volref.arrays import Floats, Indices
from volref.planning import Plan
from volref.records import Rays, Spans
from volref.scene.scene import Scene
from volref.stages.isosurface import crossing_of_samples
from volref.stages.polar import polar_lookup
from volref.stages.rays import pixel_rays
from volref.stages.reductions import reduced_samples
from volref.stages.spans import box_spans, cut_spans
from volref.stages.unit_layers import straight_colors, unit_layers
from volref.truth.fields.polar import PolarField

# The estimate compares with every third sample.
EVERY = 3

# Samples that are held at a time.
SAMPLES = 1 << 20


@dataclass(frozen=True, eq=False)
class Sampled:
    """Of R rays: premultiplied rgba (R, 4), an estimate of its error (R,), hit distances (R,), samples."""

    rgba: Floats
    bound: Floats
    hit: Floats
    samples: int


def sample_pixels(
    scene: Scene,
    plan: Plan,
    field: PolarField,
    pixels: Indices,
    begin: Floats | float,
    end: Floats,
    behind: Floats,
) -> Sampled:
    """Reduce the rays of `pixels` (R,) from `begin` (R,) to `end` (R,) over `behind` (R, 4)."""
    rays = pixel_rays(scene.camera, scene.width, scene.height, pixels)
    box = box_spans(rays.origins.T, rays.directions.T, field.low, field.high)
    spans = cut_spans(box, begin, end)
    if scene.mode == "slice":
        return _sliced(scene, field, rays, spans, behind)
    length = np.maximum(spans.t_far - spans.t_near, 0.0)
    inside = np.flatnonzero(length > 0)
    count = EVERY * max(int(np.ceil(length.max(initial=0.0) / (EVERY * plan.step))), 1)
    rgba, bound, hit = behind.copy(), np.zeros(len(pixels)), np.full(len(pixels), np.inf)
    for part in np.array_split(inside, 1 + len(inside) * count // SAMPLES):
        t = spans.t_near[part] + (np.arange(count) + 0.5)[:, None] * (length[part] / count)
        its = Rays(rays.origins[part], rays.directions[part])
        values = _values(field, its, t)
        middle = slice(EVERY // 2, None, EVERY)
        rgba[part], hit[part] = _shown(scene, values, t, behind[part])
        coarse, _ = _shown(scene, values[middle], t[middle], behind[part])
        bound[part] = np.abs(rgba[part] - coarse).max(axis=1)
    return Sampled(rgba, bound, hit, count * len(inside))


def _values(field: PolarField, rays: Rays, t: Floats) -> Floats:
    """Return the values (S, R) at t (S, R) along rays, NaN where nothing was measured."""
    points = rays.origins + t[..., None] * rays.directions
    values, measured = polar_lookup(field.gates, points.reshape(-1, 3).T)
    return np.where(measured, values, np.nan).reshape(t.shape)


def _shown(scene: Scene, values: Floats, t: Floats, behind: Floats) -> tuple[Floats, Floats]:
    """Return the rgba (R, 4) of what samples (S, R) say, what lies behind if nothing, and hits (R,)."""
    if scene.mode == "isosurface":
        assert scene.isovalue is not None
        hit = crossing_of_samples(values, t, scene.isovalue)
        color, _ = straight_colors(scene.envelope, np.array([scene.isovalue]))
        return np.where(np.isfinite(hit)[:, None], np.append(color, 1.0), behind), hit
    measured = ~np.isnan(values)
    found = reduced_samples(scene.mode, np.where(measured, values, 0.0), measured.astype(np.float64))
    return _layered(scene, found, behind), np.full(len(found), np.inf)


def _layered(scene: Scene, found: Floats, behind: Floats) -> Floats:
    """Return the layers (R, 4) of values (R,) over what lies behind, and that where a value is NaN."""
    value = np.nan_to_num(found)
    rgba, _ = unit_layers(scene.envelope, value, value, value, behind)
    return np.where(np.isnan(found)[:, None], behind, rgba)


def _sliced(scene: Scene, field: PolarField, rays: Rays, spans: Spans, behind: Floats) -> Sampled:
    """Show the value where rays meet the plane, within their spans."""
    plane = scene.slice_plane
    assert plane is not None
    x, y, z = (rays.directions * plane.normal).T
    rise = x + y + z
    with np.errstate(divide="ignore", invalid="ignore"):
        t = -plane.height(rays.origins) / rise
    meets = np.flatnonzero((rise != 0) & (t >= spans.t_near) & (t <= spans.t_far))
    values = _values(field, Rays(rays.origins[meets], rays.directions[meets]), t[None, meets])
    rgba = behind.copy()
    rgba[meets] = _layered(scene, values[0], behind[meets])
    none = np.zeros(len(behind))
    return Sampled(rgba, none, np.full(len(behind), np.inf), len(meets))
