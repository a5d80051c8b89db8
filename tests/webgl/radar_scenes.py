"""Small scenes with radars: storms, and waves in polar coordinates that show every seam and border."""

import numpy as np

from volref import Camera, RadarVolume, Scene, Sweep, TransferFunction
from volref.phantoms.storms import make_storm, radar_of_scan, sample_polar

WIDTH, HEIGHT = 96, 72

# Far from the radar's cube, whose half side is 100 km.
FAR = 330e3


def look(opacity=0.4, unit_distance=20e3):
    """Transparent without echo, then denser; dBZ."""
    colors = [(0.0, 0.0, 0.4), (0.1, 0.4, 0.9), (0.2, 0.9, 0.3), (1.0, 0.6, 0.1), (1.0, 0.9, 1.0)]
    opacities = np.array([0.0, 0.1, 0.4, 1.0, 1.0]) * opacity
    return TransferFunction.from_opacity([-32, 0, 25, 55, 95.5], colors, opacities, unit_distance)


def waves(tilts, *, radials=72, gates=50, first=0.0, turned=0.0, level=25.0):
    """Radar with echoes everywhere: waves along range, azimuth and elevation, 100 km far."""
    spacing = (100e3 - first) / gates
    azimuth = turned + 360 * np.arange(radials) / radials
    along, around = np.linspace(0, 1, gates), np.radians(azimuth)[:, None]
    sweeps = []
    for tilt in tilts:
        dbz = level + 14 * np.sin(2 * around + 5 * along) + 12 * np.cos(7 * along + np.radians(6 * tilt))
        sweeps.append(Sweep(azimuth, tilt, dbz, first + spacing / 2, spacing))
    return RadarVolume(sweeps)


def scene(radar, direction, transfer=None, *, distance=FAR, fov_y=38.0, up=(0.0, 0.0, 1.0), **more):
    """Radar in the middle, seen from a direction."""
    eye = np.array(direction) / np.linalg.norm(direction) * distance
    camera = Camera.look_at(eye, (0, 0, 0), up, fov_y, 1e3, 1e6)
    return Scene(radar, transfer or look(), camera, WIDTH, HEIGHT, **more)


def storm():
    """Thunderstorms from an oblique direction, as a weather service scans: 14 sweeps, 0.3 to 25 degrees."""
    scan = sample_polar(make_storm(), azimuths=90, gates=80, gate_length=1250.0)
    return scene(radar_of_scan(scan), (0.5, -1.0, 0.4), look(0.9, 5e3), fov_y=24.0)


def from_above():
    """Straight down on the antenna, over a background: the middle rays run along the axis of all cones."""
    radar = waves((2, 10, 25, 50, 70, 88))
    return scene(radar, (0.0, 0.0, 1.0), up=(0.0, 1.0, 0.0), background=(0.2, 0.2, 0.4, 0.6))


def near_the_pole():
    """Level, past the antenna: rays cross the pole, where azimuths meet."""
    radar = waves((5, 20, 45, 80, 90), radials=36, turned=3.0)
    return scene(radar, (0.3, 1.0, 0.05), look(0.8, 10e3))


def around_the_horizon():
    """Sweeps on both sides of the horizon, gates that begin 8 km away, seen from below."""
    radar = waves((-6, -1, 1, 4, 15), first=8e3, gates=40, turned=1.5)
    return scene(radar, (-1.0, 0.4, -0.3), look(0.2, 30e3))


def uneven():
    """Sweeps with gates and radials of their own, gates without echo and without data; nearly opaque."""
    rng = np.random.default_rng(3)
    sweeps = []
    for tilt, radials, gates in ((1.0, 60, 40), (3.0, 48, 40), (9.0, 60, 25), (30.0, 30, 20)):
        dbz = (
            20
            + 15 * np.sin(np.arange(radials) / radials * 2 * np.pi)[:, None]
            + 5 * np.cos(np.arange(gates) / 4)
        )
        dbz[rng.random(dbz.shape) < 0.1] = -np.inf
        dbz[rng.random(dbz.shape) < 0.1] = np.nan
        azimuth = (np.arange(radials) + 0.4) * 360 / radials
        sweeps.append(Sweep(azimuth, tilt, dbz, 1250.0, 2500.0))
    return scene(RadarVolume(sweeps, no_echo=-32.0), (1.0, 0.7, 0.5), look(1.0, 6e3))


def inside():
    """An eye within the cube, where seed 001 draws nothing."""
    return scene(waves((1, 5, 20, 60)), (0.4, -1.0, 0.3), distance=60e3, fov_y=70.0)


def parallel():
    """Parallel rays, oblique."""
    radar = waves((0, 3, 12, 40), radials=60)
    camera = Camera.orthographic((150e3, -120e3, 160e3), (0, 0, 0), (0, 0, 1), 230e3, 1e3, 6e5)
    return Scene(radar, look(), camera, WIDTH, HEIGHT)
