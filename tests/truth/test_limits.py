"""Where rays begin and end: clipping planes, and parts of a ray one after the other."""

import dataclasses

import numpy as np
import pytest

import volref as vr
from tests.scenes import rough_scene
from volref.stages.rays import pixel_rays
from volref.truth.digits.integral import ray_integral
from volref.truth.integration import Integration

TOLERANCE = 1e-11
CLEAR = (0.0, 0.0, 0.0, 0.0)


def between(scene, begin, end, behind):
    pixels = np.arange(scene.width * scene.height)
    plan = vr.plan(scene, method="exact")
    return Integration(scene, plan).between(pixels, begin, end, behind, TOLERANCE)


def test_two_parts_of_a_ray_are_the_whole_ray():
    scene = rough_scene()
    count = scene.width * scene.height
    behind = np.tile([0.1, 0.2, 0.3, 0.4], (count, 1))
    whole = between(scene, 0.0, np.full(count, np.inf), behind)
    # Somewhere inside the volume, and for some rays before or behind it.
    middle = np.random.default_rng(0).uniform(0, 2, count) * np.linalg.norm(
        scene.volume.corners.mean(axis=0) - scene.camera.world_from_view[:3, 3]
    )
    far = between(scene, middle, np.full(count, np.inf), behind)
    both = between(scene, 0.0, middle, far.rgba)
    # The bound of what lies behind is seen through what lies before: at most as it is.
    off = np.abs(both.rgba - whole.rgba).max(axis=1)
    assert (off <= both.bound + far.bound + whole.bound + 1e-15).all()
    assert both.bound.max() <= TOLERANCE
    assert np.abs(both.rgba - far.rgba).max() > 0.05
    assert np.abs(far.rgba - behind).max() > 0.05


@pytest.mark.parametrize("method", ["exact", "march"])
def test_a_clipped_volume_is_the_integral_between_the_planes(method):
    scene = rough_scene(width=6, height=5)
    middle = scene.volume.corners.mean(axis=0)
    planes = [vr.Plane(middle - 0.9, (1, 0.2, 0.1)), vr.Plane(middle + 0.8, (-0.1, -1, 0.3))]
    clipped = dataclasses.replace(scene, clip=planes)
    out = vr.render(clipped, method=method, tolerance=1e-10, **({"step": 0.002} if method == "march" else {}))
    rays = pixel_rays(scene.camera, 6, 5, np.arange(30))
    index = scene.volume.index_from_world
    assert out.bound.max() < (1e-10 if method == "exact" else 1e-4)
    for k, rgba in enumerate(out.rgba.reshape(-1, 4)):
        origin, direction = rays.origins[k], rays.directions[k]
        near, far = 0.0, np.inf
        for plane in planes:
            t = -plane.height(origin) / (plane.normal @ direction)
            near, far = (max(near, t), far) if plane.normal @ direction > 0 else (near, min(far, t))
        if near >= far:
            assert (rgba == 0).all()
            continue
        # The oracle's rays begin at their origin: it is moved to where the ray is let in.
        start = index[:3, :3] @ (origin + near * direction) + index[:3, 3]
        along = index[:3, :3] @ direction
        truth = ray_integral(scene.volume, scene.transfer, start.tolist(), along.tolist(), far - near, CLEAR)
        allowed = out.bound.reshape(-1)[k] + 1e-12  # moving the origin rounds
        assert np.abs(rgba - np.array(truth.rgba, float)).max() <= allowed
    assert (out.rgba[..., 3] > 0.01).sum() > 5
