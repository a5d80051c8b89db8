"""The modes that reduce a ray to one value, for a volume that is no grid of cells: by samples.

R rays, S samples of each, at the middles of equal segments of its span.  What every third sample says instead
is the estimate of the error, as for a march.
"""

from dataclasses import dataclass

import numpy as np

from volref.arrays import Booleans, Floats, Indices
from volref.planning import Plan
from volref.records import Rays, Spans
from volref.scene.scene import Scene
from volref.stages.polar import polar_lookup
from volref.stages.rays import pixel_rays
from volref.stages.spans import box_spans, cut_spans
from volref.stages.unit_layers import straight_colors, unit_layers
from volref.truth.fields.polar import PolarField

# The estimate compares with every third sample.
EVERY = 3


@dataclass(eq=False)
class _Found:
    """What has been found along rays: value (R,), whether anything was measured (R,), and where (R,)."""

    value: Floats
    measured: Booleans
    at: Floats


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
    its = Rays(rays.origins[inside], rays.directions[inside])
    stride, start = length[inside] / count, spans.t_near[inside]
    fine, coarse = _along(scene, field, its, start, stride, count)
    shown = [_shown(scene, found, behind[inside]) for found in (fine, coarse)]
    rgba[inside] = shown[0]
    bound[inside] = np.abs(shown[0] - shown[1]).max(axis=1)
    if scene.mode == "isosurface":
        hit[inside] = np.where(fine.measured, fine.at, np.inf)
    return Sampled(rgba, bound, hit, count * len(inside))


def _along(
    scene: Scene, field: PolarField, rays: Rays, start: Floats, stride: Floats, count: int
) -> tuple[_Found, _Found]:
    """Return what all samples say, and what every third one, the middle one of three, says."""
    rays_count = len(start)
    initial = {"mip": -np.inf, "minip": np.inf}.get(scene.mode, 0.0)
    both = [
        _Found(np.full(rays_count, initial), np.zeros(rays_count, np.bool_), np.full(rays_count, np.inf))
        for _ in range(2)
    ]
    seen = [np.zeros(rays_count), np.zeros(rays_count)]
    before = [np.full(rays_count, np.nan), np.full(rays_count, np.nan)]
    for k in range(count):
        t = start + (k + 0.5) * stride
        values, measured = polar_lookup(field.gates, (rays.origins + t[:, None] * rays.directions).T)
        for which, apart in ((0, 1), (1, EVERY)):
            if which and k % EVERY != EVERY // 2:
                continue
            found = both[which]
            if scene.mode == "isosurface":
                assert scene.isovalue is not None
                last, before[which] = before[which], np.where(measured, values, np.nan)
                _cross(found, scene.isovalue, last, before[which], t, apart * stride)
                continue
            seen[which] += measured
            found.measured |= measured
            _gather(scene.mode, found.value, values, measured)
    if scene.mode == "average":
        for found, many in zip(both, seen, strict=True):
            found.value /= np.maximum(many, 1.0)
    return both[0], both[1]


def _gather(mode: str, value: Floats, values: Floats, measured: Booleans) -> None:
    """Take a sample of each ray into `value` (R,), in place."""
    if mode == "average":
        value += np.where(measured, values, 0.0)
    elif mode == "mip":
        np.maximum(value, values, out=value, where=measured)
    else:
        np.minimum(value, values, out=value, where=measured)


def _cross(found: _Found, isovalue: float, last: Floats, values: Floats, t: Floats, apart: Floats) -> None:
    """Take the first crossing of the isovalue between neighbouring samples, linear between them."""
    with np.errstate(invalid="ignore"):
        crosses = ((last < isovalue) != (values < isovalue)) & ~np.isnan(last) & ~np.isnan(values)
    new = np.flatnonzero(crosses & ~found.measured)
    share = (isovalue - last[new]) / (values[new] - last[new])
    found.at[new] = t[new] - (1.0 - share) * apart[new]
    found.measured[new] = True


def _shown(scene: Scene, found: _Found, behind: Floats) -> Floats:
    """Return the rgba (R, 4) of what was found, and what lies behind where nothing was."""
    _, transfer = scene.volume, scene.envelope
    if scene.mode == "isosurface":
        assert scene.isovalue is not None
        color, _ = straight_colors(transfer, np.array([scene.isovalue]))
        return np.where(found.measured[:, None], np.append(color, 1.0), behind)
    value = np.where(found.measured, found.value, 0.0)
    rgba, _ = unit_layers(transfer, value, value, value, behind)
    return np.where(found.measured[:, None], rgba, behind)


def _sliced(scene: Scene, field: PolarField, rays: Rays, spans: Spans, behind: Floats) -> Sampled:
    """Show the value where rays meet the plane, within their spans."""
    plane = scene.slice_plane
    assert plane is not None
    x, y, z = (rays.directions * plane.normal).T
    rise = x + y + z
    with np.errstate(divide="ignore", invalid="ignore"):
        t = -plane.height(rays.origins) / rise
    meets = np.flatnonzero((rise != 0) & (t >= spans.t_near) & (t <= spans.t_far))
    points = rays.origins[meets] + t[meets, None] * rays.directions[meets]
    values, measured = polar_lookup(field.gates, points.T)
    rgba = behind.copy()
    found = _Found(np.where(measured, values, 0.0), measured, t[meets])
    rgba[meets] = _shown(scene, found, behind[meets])
    none = np.zeros(len(behind))
    return Sampled(rgba, none, np.full(len(behind), np.inf), len(meets))
