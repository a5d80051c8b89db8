"""A radar on a regular grid: for what needs cells, as gradients, light and isosurfaces do."""

import math

import numpy as np
from numpy.typing import ArrayLike

from volref.arrays import LARGEST_LENGTH, Floats, float_array, number
from volref.errors import SceneError
from volref.scene.radar import RadarVolume
from volref.scene.volume import Volume
from volref.stages.polar import polar_lookup, radar_table

# 2 GiB of float64.
MOST_VOXELS = 2**28

# Points that are looked up together.
POINTS = 1 << 18


def resample_radar(
    radar: RadarVolume,
    spacing: ArrayLike,
    box: tuple[ArrayLike, ArrayLike] | None = None,
    *,
    empty: float | None = None,
) -> Volume:
    """Volume on a regular grid with the radar's values at its voxels' centres.

    Parameters
    ----------
    radar
        The radar volume.
    spacing
        Distance of voxels in metres, one number or one for x, y and z.  Near the antenna a coarse grid skips
        gates, far away a fine one repeats them.
    box
        Lowest and highest corner of the volume in the world; by default all that can be seen.  It is filled
        from the lowest corner on with whole voxels, at least to the highest.
    empty
        What a voxel is worth where nothing is seen: by default what no echo is worth, or the least value.

    Raises
    ------
    SceneError
        If a number is not finite, or the grid has more than 2^28 voxels.

    Examples
    --------
    >>> from volref.scene import Sweep
    >>> sweeps = [Sweep([0], e, np.array([[1.0, 3.0]]), 500, 1000) for e in (-60, 60)]
    >>> resample_radar(RadarVolume(sweeps), 1000, ((0, 0, -500), (2000, 1000, 500))).values.round(2).tolist()
    [[[1.41, 3.0]]]
    """
    steps = float_array("spacing", np.full(3, spacing) if np.ndim(spacing) == 0 else spacing, (3,))
    low, high = radar.box if box is None else box
    start = float_array("box low", low, (3,), limit=LARGEST_LENGTH)
    end = float_array("box high", high, (3,), limit=LARGEST_LENGTH)
    if not (steps > 0).all() or not (end > start).all():
        message = f"box and spacing must be above 0 along each axis, got {(end - start).tolist()} and "
        raise SceneError(message + f"{steps.tolist()}; give the lower corner first")
    # A billionth of a voxel less: a box of whole voxels may be rounded past them.
    counts = [max(math.ceil(length - 1e-9), 1) for length in ((end - start) / steps).tolist()]
    if math.prod(counts) > MOST_VOXELS:
        message = f"spacing must give at most {MOST_VOXELS} voxels, got {' x '.join(map(str, counts))}; "
        raise SceneError(message + "make it or the box coarser")
    floor = radar.value_bounds[0] if radar.no_echo is None else radar.no_echo
    fill = floor if empty is None else number("empty", empty)
    centres = [s + (np.arange(n) + 0.5) * d for s, n, d in zip(start, counts, steps, strict=True)]
    return Volume(_values(radar, centres, fill), spacing=steps, origin=[axis[0] for axis in centres])


def _values(radar: RadarVolume, centres: list[Floats], fill: float) -> Floats:
    x, y, z = centres
    table = radar_table(radar)
    values = np.empty((len(z), len(y), len(x)))
    rows = max(1, POINTS // len(x))
    for k, height in enumerate(z):
        for j in range(0, len(y), rows):
            part = y[j : j + rows]
            points = np.stack(
                (np.tile(x, len(part)), np.repeat(part, len(x)), np.full(len(part) * len(x), height))
            )
            found, seen = polar_lookup(table, points)
            values[k, j : j + rows] = np.where(seen, found, fill).reshape(len(part), len(x))
    return values
