"""Radars for the tests: the KNMI storms, and small ones of random shape."""

import functools
from pathlib import Path

import numpy as np

from volref.scene.radar import RadarVolume
from volref.scene.sweep import Sweep

KNMI = Path(__file__).parent / "data" / "radar_knmi_denhelder_20110610.npz"


@functools.cache
def knmi():
    """Den Helder, 2011-06-10 11:40 UTC, read with NumPy alone."""
    with np.load(KNMI) as file:
        sweeps = [
            Sweep.from_codes(
                file[f"codes_{i:02d}"],
                file["gain"][i],
                file["offset"][i],
                np.arange(360) + 0.5,
                file["elangle"][i],
                file["rstart_m"][i] + 0.5 * file["rscale_m"][i],
                file["rscale_m"][i],
                undetect=file["undetect"][i],
                nodata=file["nodata"][i],
            )
            for i in range(int(file["n_sweeps"]))
        ]
        return RadarVolume(sweeps, no_echo=-31.5, site=file["site_lat_lon_height"])


def uneven(seed, *, sweeps=4, beam="straight", nodata=0.02, no_echo=0.2, level=False):
    """Radials, gates and elevations of each sweep are different, and some of the gates are without data."""
    rng = np.random.default_rng(seed)
    made = []
    for s in range(sweeps):
        radials, gates = int(rng.integers(5, 12)), int(rng.integers(3, 9))
        step = 360 / radials
        azimuths = rng.uniform(0, 360) + step * (np.arange(radials) + rng.uniform(-0.2, 0.2, radials))
        tilts = 1.0 + 4.0 * s**1.3 + (0.0 if level else rng.uniform(-0.6, 0.6, radials))
        values = rng.uniform(-20, 60, (radials, gates))
        values[rng.uniform(size=values.shape) < no_echo] = -np.inf
        values[rng.uniform(size=values.shape) < nodata] = np.nan
        made.append(Sweep(azimuths, tilts, values, rng.uniform(-50, 800), rng.uniform(200, 900)))
    return RadarVolume(made, beam=beam, origin=rng.uniform(-100, 100, 3))
