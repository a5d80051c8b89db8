"""The mode "slice": the value where a ray meets the plane, classified as a layer.

R rays.  A plane's distance along a ray is n . (p - o) / (n . d) in world space.
"""

from dataclasses import dataclass

import numpy as np

from volref.arrays import Booleans, Floats
from volref.records import Rays
from volref.scene.plane import Plane
from volref.scene.scene import Scene
from volref.scene.transfer import TransferFunction
from volref.scene.transform import transform_directions, transform_points
from volref.scene.volume import Volume
from volref.stages.sampling import PAD, Grid, trilinear
from volref.stages.unit_layers import unit_layers
from volref.workspace import Workspace

ROUNDOFF = 2.0**-53

# A point up to this many indices outside the volume's faces counts as inside: pixel centres often lie on
# them, where rounding would decide.
EDGE = 2.0**-40

# Positions that lie from a sample by this many times what rounding can do are taken to be it, so that its
# value is met exactly; the bound covers what that moves them.
SNAP = 4.0


@dataclass(frozen=True, eq=False)
class _Points:
    """Where rays meet the plane: t (R,) and index points (3, R), off by t_error (R,) and error (3, R)."""

    t: Floats
    t_error: Floats
    index: Floats
    error: Floats


def slice_pixels(
    scene: Scene,
    samples: Grid,
    place: tuple[Floats, Floats, Floats],
    rays: Rays,
    begin: Floats | float,
    distance: Floats,
    behind: Floats,
) -> tuple[Floats, Floats]:
    """Return rgba (R, 4) and bound (R,) of what the plane of `scene` shows over `behind` (R, 4).

    place: `index_from_world` of the volume and the low and high end of its index space.
    """
    assert isinstance(scene.volume, Volume)
    assert isinstance(scene.transfer, TransferFunction)
    assert scene.slice_plane is not None
    index_from_world, low, high = place
    points = _met(scene.slice_plane, rays, index_from_world)
    surely, perhaps = _inside(points, low - EDGE, high + EDGE, begin, distance)
    held = np.clip(np.nan_to_num(points.index), low[:, None], high[:, None])
    value = np.array(trilinear(samples, held + PAD, Workspace()))
    least, most = scene.volume.value_bounds
    # In the next cell, too, the value changes by at most the greatest difference per index along an axis.
    with np.errstate(invalid="ignore"):
        off = 2 * (most - least) * (points.error + 2 * ROUNDOFF * (np.abs(held) + PAD)).sum(axis=0)
    off = np.nan_to_num(off, nan=np.inf) + 16 * ROUNDOFF * max(abs(least), abs(most))
    ends = np.clip(value - off, least, most), np.clip(value + off, least, most)
    rgba, bound = unit_layers(scene.transfer, np.clip(value, least, most), *ends, behind)
    either = np.abs(rgba - behind).max(axis=1)
    bound = np.where(surely, bound, np.where(perhaps, bound + either, 0.0))
    return np.where((surely | perhaps)[:, None], rgba, behind), bound


def _met(plane: Plane, rays: Rays, index_from_world: Floats) -> _Points:
    """Return where rays meet the plane.

    With u the unit roundoff each product and difference is off by u of itself, and the two sums of three by
    2 u of the sum of sizes: the quotient by (6 u |n| . |p - o| + |t| 4 u |n| . |d|) / |n . d| + 2 u |t|.
    """
    away, normal = plane.point - rays.origins, plane.normal
    above, along = (away * normal).sum(axis=1), (rays.directions * normal).sum(axis=1)
    above_size, along_size = (np.abs(x * normal).sum(axis=1) for x in (away, rays.directions))
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        t = above / along
        t_error = ROUNDOFF * ((6 * above_size + 4 * np.abs(t) * along_size) / np.abs(along) + 2 * np.abs(t))
    t = np.where(along == 0, np.inf, t)
    # The rays are those of index space, as everywhere.
    origins = transform_points(index_from_world, rays.origins).T
    directions = transform_directions(index_from_world, rays.directions).T
    with np.errstate(invalid="ignore", over="ignore"):
        moved = t * directions
        index = origins + moved
        error = ROUNDOFF * (2 * np.abs(moved) + np.abs(index)) + t_error * np.abs(directions)
        near = np.rint(index)
        shift = np.abs(index - near)
        # The camera puts its rays where it is asked to but for some roundings of world coordinates.
        size = np.abs(index_from_world[:3, :3]) @ np.abs(rays.origins).T + np.abs(index_from_world[:3, 3:])
        snapped = shift <= SNAP * (error + 4 * ROUNDOFF * size)
        error = np.where(snapped, error + shift, error)
    return _Points(t, t_error, np.where(snapped, near, index), error)


def _inside(
    points: _Points, low: Floats, high: Floats, begin: Floats | float, distance: Floats
) -> tuple[Booleans, Booleans]:
    """Tell of each point whether it surely, or perhaps, lies in the box and on the ray."""
    with np.errstate(invalid="ignore"):
        room = np.minimum(points.index - low[:, None], high[:, None] - points.index)
        depth = np.minimum(points.t - begin, distance - points.t)
        surely = (room > points.error).all(axis=0) & (depth > points.t_error)
        perhaps = (room >= -points.error).all(axis=0) & (depth >= -points.t_error)
    met = np.isfinite(points.t)
    return surely & met, perhaps & met
