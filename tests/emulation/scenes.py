"""Small scenes for emulations, and what the catalogue's pipelines need of one."""

import numpy as np

import volref as vr
from volref.emulation.catalogue import pipelines
from volref.phantoms.meshes import sphere_mesh

WIDTH, HEIGHT = 16, 12
JITTERED = [name for name, pipeline in pipelines().items() if pipeline.stepping.jitter]


def example(*, opacity=0.6, unit_distance=4.0, eye=(18.0, 12.0, 15.0), mesh=False, lit=False, **more):
    """Return a scene of 11 slices, voxels of three lengths, a bent table; with what is asked for."""
    x, y, z = np.meshgrid(
        np.linspace(-1, 1, 12), np.linspace(-1, 1, 10), np.linspace(-1, 1, 11), indexing="ij"
    )
    ball = np.sqrt(x * x + 0.8 * y * y + 1.2 * z * z + 0.3 * x * z)
    values = np.clip(255 * (1.1 - ball + 0.15 * np.sin(5 * x + 3 * y - 4 * z)), 0, 255).astype(np.uint8)
    volume = vr.Volume(values.transpose(2, 1, 0), spacing=(1.0, 1.2, 0.9))
    colors = [(0.1, 0.2, 0.9), (0.9, 0.5, 0.1), (1.0, 0.9, 0.7)]
    transfer = vr.TransferFunction.from_opacity(
        [20, 120, 255], colors, [0.0, 0.4 * opacity, opacity], unit_distance
    )
    middle = volume.corners.mean(axis=0)
    camera = vr.Camera.look_at(middle + np.array(eye), middle, (0, 1, 0), 32.0, 4.0, 60.0)
    if mesh:
        more["meshes"] = (
            sphere_mesh(2.5, middle + np.array((0.5, 0.0, 0.8)), (0.8, 0.2, 0.3), subdivisions=1),
        )
    if lit:
        more["lights"] = (vr.Light.point((30, 20, 25), (1.0, 0.9, 0.8)), vr.Light.ambient((0.2, 0.2, 0.3)))
        more["material"] = vr.Material("phong", ambient=0.3, diffuse=0.6, specular=0.3, shininess=12.0)
    return vr.Scene(volume, transfer, camera, WIDTH, HEIGHT, **more)


def radar_example():
    """Return a scene of a radar with echoes everywhere, four sweeps of 24 radials and 12 gates."""
    sweeps = []
    for tilt in (2.0, 15.0, 35.0, 60.0):
        around, along = np.meshgrid(np.arange(24) * np.pi / 12, np.linspace(0, 1, 12), indexing="ij")
        dbz = 25 + 14 * np.sin(2 * around + 5 * along) + 12 * np.cos(7 * along + tilt)
        sweeps.append(vr.Sweep(np.arange(24) * 15.0, tilt, dbz, 4e3, 8e3))
    colors = [(0.1, 0.4, 0.9), (0.2, 0.9, 0.3), (1.0, 0.9, 1.0)]
    transfer = vr.TransferFunction.from_opacity([-32, 25, 60], colors, [0.0, 0.2, 0.7], 2e4)
    camera = vr.Camera.look_at((1.8e5, -2.6e5, 1.3e5), (0, 0, 0), (0, 0, 1), 38.0, 1e3, 1e6)
    return vr.Scene(vr.RadarVolume(sweeps), transfer, camera, WIDTH, HEIGHT)


def scene_for(name, **more):
    """Return the example that suits a pipeline of the catalogue, lit and with meshes where it draws them."""
    pipeline = pipelines()[name]
    if pipeline.volume.geometry != "box":
        return radar_example()
    lit = pipeline.lighting.model != "none"
    return example(mesh=pipeline.meshes.kind != "none", lit=lit, **more)


def jitter_of(name, frames=1):
    """Return start offsets for a pipeline of the catalogue, None where it has none."""
    if name not in JITTERED:
        return None
    return np.random.default_rng(3).random((frames, HEIGHT, WIDTH))
