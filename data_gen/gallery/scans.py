"""The scans, and where they are seen from."""

from functools import cache
from pathlib import Path

import numpy as np

import volref as vr
from volref.arrays import Floats

CT, HEAD, STENT = (
    "ct_chest_lung1_256x256x48.npz",
    "mri_mni152_t1_1mm.nii.gz",
    "ct_stent_128x128x256_u8.npz",
)
PRESETS, MAPS = "tf_slicer_presets.json", "tf_paraview_colormaps.json"

FOV_Y = 20.0


@cache
def scan(path: Path) -> vr.Volume:
    """Return a volume, read once."""
    return vr.load_volume(path)


def middle(volume: vr.Volume) -> Floats:
    """Return the world point in the middle of the volume."""
    return np.asarray(volume.corners.mean(axis=0))


def towards(azimuth: float, elevation: float) -> Floats:
    """Return the unit vector (x, y, z) to a viewer: degrees from the front (+y) to the right (+x), and up.

    Examples
    --------
    >>> towards(0, 0).tolist(), towards(90, 0).round(12).tolist()
    ([0.0, 1.0, 0.0], [1.0, 0.0, 0.0])
    """
    turn, rise = np.radians(azimuth), np.radians(elevation)
    return np.array([np.sin(turn) * np.cos(rise), np.cos(turn) * np.cos(rise), np.sin(rise)])


def seen_from(
    volume: vr.Volume, azimuth: float = 0.0, elevation: float = 0.0, shown: float | None = None
) -> vr.Camera:
    """Return a camera that looks at the middle of the volume; heads are up.

    shown: how many world units the image is high there; by default the greatest side of the volume.
    """
    center = middle(volume)
    sides = np.ptp(volume.corners, axis=0)
    high = 1.05 * float(sides.max()) if shown is None else shown
    away = high / 2 / np.tan(np.radians(FOV_Y / 2)) + float(sides.max()) / 2
    return vr.Camera.look_at(
        center + away * towards(azimuth, elevation), center, (0, 0, 1), FOV_Y, away / 100, away * 3
    )
