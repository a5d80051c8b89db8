"""Small real scans for the golden suite: every so-manieth sample of the scans that the tests have.

No value is changed or averaged.  The files are written to volref/golden/suite/scans, from where recipes
take them by digest; what they are and whose is in NOTICE.txt there.
"""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from volref import Camera, RadarVolume, Scene, Sweep, TransferFunction, Volume
from volref.io import load_radar, load_volume, save_scene
from volref.io.npy import write_npz

DATA = Path(__file__).parents[2] / "tests" / "data"

WIDTH, HEIGHT = 64, 48

# Steps along x, y and z.
CT_STEP, HEAD_STEP = (7, 7, 2), (5, 5, 5)

# Sweeps, and steps along azimuth and range.
RADAR_SWEEPS, RADAR_STEP = (0, 3, 6, 9, 12), (6, 6)


def every(volume: Volume, step: tuple[int, int, int]) -> Volume:
    """Return every so-manieth sample of a volume along x, y and z, each where it was."""
    along_x, along_y, along_z = step
    values = np.ascontiguousarray(volume.values[::along_z, ::along_y, ::along_x])
    spacing = [length * n for length, n in zip(volume.spacing, step, strict=True)]
    return Volume(values, spacing, volume.origin, volume.direction, volume.centering)


def chest() -> Scene:
    """Chest CT (HU) with 3D Slicer's preset CT-Chest-Contrast-Enhanced, colours by hand."""
    volume = every(load_volume(DATA / "ct_chest_lung1_256x256x48.npz"), CT_STEP)
    table = TransferFunction.from_opacity(
        [-1100, 67, 251, 439, 3071],
        [(0, 0, 0), (0.55, 0.25, 0.15), (0.88, 0.6, 0.29), (1, 0.94, 0.95), (0.83, 0.66, 1)],
        [0, 0, 0.45, 0.62, 0.62],
        unit_distance=6.0,
    )
    return _seen(volume, table, (0.5, -1.0, 0.4), 1.25)


def head() -> Scene:
    """Average of 152 heads, T1-weighted: grey over white matter."""
    volume = every(load_volume(DATA / "mri_mni152_t1_1mm.nii.gz"), HEAD_STEP)
    table = TransferFunction.from_opacity(
        [0, 40, 110, 160, 255],
        [(0.1, 0.3, 0.9), (0.1, 0.4, 0.9), (0.9, 0.5, 0.3), (1, 0.9, 0.8), (1, 1, 1)],
        [0, 0.05, 0.3, 0.6, 0.8],
        unit_distance=6.0,
    )
    return _seen(volume, table, (1.0, 0.8, 0.5), 0.95)


def thunderstorm() -> Scene:
    """Thunderstorms over the Netherlands (dBZ), five sweeps of KNMI's radar in Den Helder."""
    radar = load_radar(DATA / "radar_knmi_denhelder_20110610.npz")
    around, along = RADAR_STEP
    sweeps = [
        Sweep(
            sweep.azimuths[::around],
            float(np.mean(sweep.elevations)),
            np.ascontiguousarray(sweep.values[::around, along // 2 :: along]),
            sweep.first_gate + along // 2 * sweep.gate_spacing,
            along * sweep.gate_spacing,
        )
        for sweep in (radar.sweeps[number] for number in RADAR_SWEEPS)
    ]
    few = RadarVolume(sweeps, no_echo=radar.no_echo)
    table = TransferFunction.from_opacity(
        [-31.5, 4, 15, 30, 50],
        [(0, 0, 0.4), (0.1, 0.4, 0.9), (0.2, 0.9, 0.3), (1, 0.6, 0.1), (1, 0.9, 1)],
        [0, 0.1, 0.6, 0.95, 1],
        unit_distance=2_500.0,
    )
    eye = np.array([0.35, -1.0, 0.5]) * 360e3
    camera = Camera.look_at(eye, (3e3, 2e3, 1e3), (0, 0, 1), 33.0, 1e3, 1e6)
    return Scene(few, table, camera, WIDTH, HEIGHT)


SCANS: dict[str, Callable[[], Scene]] = {"chest": chest, "head": head, "thunderstorm": thunderstorm}


def write_scans(folder: Path) -> list[Path]:
    """Write the scenes in place of those that are there, volumes compressed; return their files."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, make in SCANS.items():
        scene, file = make(), folder / f"{name}.json"
        save_scene(scene, file, overwrite=True)
        if isinstance(scene.volume, Volume):
            document: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
            write_npz(folder / f"{name}.npz", {"volume": scene.volume.values}, overwrite=True)
            (folder / document["volume"]["path"]).unlink()
            document["volume"]["path"] = f"{name}.npz"
            file.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
    return [folder / f"{name}.json" for name in SCANS]


def _seen(
    volume: Volume, table: TransferFunction, direction: tuple[float, float, float], distance: float
) -> Scene:
    low, high = volume.corners.min(axis=0), volume.corners.max(axis=0)
    diagonal = float(np.linalg.norm(high - low))
    # Beside the middle, from where coordinates are no simple fractions.
    target = (low + high) / 2 + 0.013 * diagonal
    eye = target + np.array(direction) / np.linalg.norm(direction) * distance * diagonal
    camera = Camera.look_at(eye, target, (0.1, 0.2, 1.0), 35.0, 0.05 * diagonal, 4 * diagonal)
    return Scene(volume, table, camera, WIDTH, HEIGHT)
