"""Modes that reduce a ray to one value, against the same at 60 digits and against scalar loops.

Rays are given in index space: the volumes lie so that it is the world.
"""

import numpy as np
import pytest
from mpmath import mp

from tests.oracles.scalar import table_value
from tests.scenes import camera_towards, colorful_transfer, rough_volume
from volref import Camera, Scene
from volref.records import Rays
from volref.scene.transform import transform_directions, transform_points
from volref.stages.rays import pixel_rays
from volref.truth import reductions
from volref.truth.digits.reduced import first_meeting, layer, reduced_value
from volref.truth.reductions import prepare_reduction, reduce_pixels

EXTREMES = ("mip", "minip")
MODES = (*EXTREMES, "average")
CAMERA = Camera.look_at((0, 0, -9), (0, 0, 0), (0, 1, 0), 30.0, 0.1, 100.0)
BEHIND = (0.1, 0.2, 0.3, 0.5)
DIGITS = 60


def drawn(scene, begin=0.0, distance=np.inf, tolerance=1e-12):
    """All rays of a scene, reduced."""
    count = scene.width * scene.height
    behind = np.tile(np.array(scene.background), (count, 1))
    end = np.full(count, float(distance))
    return reduce_pixels(scene, prepare_reduction(scene), np.arange(count), begin, end, behind, tolerance)


def shot(volume, transfer, mode, origins, directions, *, begin=0.0, distance=np.inf, **words):
    """Rays (R, 3) of index space, reduced."""
    origins, directions = (np.array(x, float).reshape(-1, 3) for x in (origins, directions))
    scene = Scene(volume, transfer, CAMERA, len(origins), 1, mode=mode, background=BEHIND, **words)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(reductions, "pixel_rays", lambda *words: Rays(origins[words[3]], directions[words[3]]))
        return drawn(scene, begin, distance)


def index_rays(scene):
    rays = pixel_rays(scene.camera, scene.width, scene.height, np.arange(scene.width * scene.height))
    matrix = scene.volume.index_from_world
    origins = transform_points(matrix, rays.origins).tolist()
    return zip(origins, transform_directions(matrix, rays.directions).tolist(), strict=True)


def assert_certified(out, volume, transfer, mode, rays, *, begin=0.0, distance=np.inf, isovalue=None):
    """Every ray is within its bound of the same ray at 60 digits."""
    with mp.workdps(DIGITS):
        for k, (origin, direction) in enumerate(rays):
            ray = volume, origin, direction, begin, distance
            if mode == "isosurface":
                t = first_meeting(mp, isovalue, *ray)
                color = [table_value(transfer.values, c, isovalue) for c in transfer.colors.T]
                truth = BEHIND if t is None else (*color, 1.0)
                hit = np.inf if t is None else t
                off = 0.0 if hit == out.hit[k] else abs(hit - out.hit[k])
                assert off <= out.off[k], (k, float(off), out.off[k])
            else:
                value = reduced_value(mp, mode, *ray)
                truth = BEHIND if value is None else layer(mp, transfer, value, BEHIND)
            error = max(abs(a - b) for a, b in zip(truth, out.rgba[k].tolist(), strict=True))
            assert error <= out.bound[k], (k, float(error), out.bound[k])


@pytest.mark.parametrize("mode", [*MODES, "isosurface"])
def test_every_ray_through_noise_is_within_its_bound_which_is_near_rounding(mode):
    volume, transfer = rough_volume(1, spacing=(1.0, 1.3, 0.7)), colorful_transfer()
    words = {"isovalue": 0.5} if mode == "isosurface" else {}
    scene = Scene(volume, transfer, camera_towards(volume), 12, 9, mode=mode, background=BEHIND, **words)
    out = drawn(scene)
    assert_certified(out, volume, transfer, mode, index_rays(scene), **words)
    # The values are off by some 100 roundings of 1e-16, and the table's steepest slope is 2.5.
    assert out.bound.max() < 1e-12
