"""Maps of a radar, as meteorologists draw them: seen from above, north up.

Pixel (column i, row j) of a map of n x n pixels and reach R shows the middle of its square, row 0 north:

    east  = -R + (i + 1/2) 2 R / n        n = 4, R = 100 km: columns at -75, -25, 25, 75 km
    north =  R - (j + 1/2) 2 R / n                           rows at     75, 25, -25, -75 km
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from volref.arrays import Booleans, Floats, float_array, number, one_of, whole_number
from volref.scene.beams import LARGEST_RANGE, slant_of_ground
from volref.scene.radar import RadarVolume
from volref.scene.scene import LARGEST_IMAGE_SIDE
from volref.scene.transfer import TransferFunction
from volref.stages.classify import classify, lookup_table
from volref.stages.polar import polar_lookup, radar_table, sweep_elevation, sweep_lookup
from volref.workspace import Workspace

# Points that are looked up together.
POINTS = 1 << 18


@dataclass(frozen=True, eq=False)
class RadarMap:
    """Values (n, n) around a radar, NaN where nothing is seen; row 0 in the north, column 0 in the west.

    reach: half the side, metres.  value_bounds: all values lie between.  title: what is shown.
    """

    values: Floats
    reach: float
    value_bounds: tuple[float, float]
    title: str

    @property
    def seen(self) -> Booleans:
        """Where something was measured, echo or not."""
        return ~np.isnan(self.values)

    def colored(
        self,
        transfer: TransferFunction,
        *,
        background: ArrayLike = (1.0, 1.0, 1.0),
        unseen: ArrayLike = (0.6, 0.6, 0.6),
        rings: float | None = None,
    ) -> Floats:
        """Return an opaque image (n, n, 4): the table's colour wherever it shows anything at all.

        A slice has no thickness, so how opaque a value is does not matter.  background: where the table shows
        nothing.  unseen: where nothing was measured.  rings: draw circles this many metres apart.
        """
        seen = self.seen
        table = lookup_table(transfer, self.value_bounds)
        shown = np.where(seen, self.values, self.value_bounds[0]).reshape(-1)
        colors, strength = classify(table, shown, Workspace())
        painted = (strength > 0).reshape(seen.shape)[..., None]
        image = np.where(
            painted, colors.T.reshape(*seen.shape, 3), float_array("background", background, (3,))
        )
        image = np.where(seen[..., None], image, float_array("unseen", unseen, (3,)))
        if rings is not None:
            on = self._on_rings(number("rings", rings, above=0, high=LARGEST_RANGE))
            image = np.where(on[..., None], 0.5 * image, image)
        return np.concatenate([image, np.ones((*seen.shape, 1))], axis=-1)

    def _on_rings(self, apart: float) -> Booleans:
        """Mark the pixels through which a circle around the radar passes."""
        x, y = ground_grid(self.values.shape[0], self.reach)
        pixel = 2 * self.reach / self.values.shape[0]
        distance = np.hypot(x, y).reshape(self.values.shape)
        off = np.abs(distance - apart * np.rint(distance / apart))
        return np.asarray((off <= 0.5 * pixel) & (distance > 0.5 * apart))


def ppi(
    radar: RadarVolume, sweep: int = 0, width: int = 600, *, reach: float | None = None, gates: str = "linear"
) -> RadarMap:
    """Map of one sweep over the distance along the ground (plan position indicator).

    Parameters
    ----------
    radar
        The radar volume.
    sweep
        Which sweep, 0 for the lowest.
    width
        Pixels across and down.
    reach
        Half the side, metres; by default where the sweep ends.
    gates
        "linear": interpolated along range and azimuth.  "nearest": each gate as it was measured.

    Raises
    ------
    SceneError
        If there is no such sweep, or a number lies outside its range.

    Examples
    --------
    >>> from volref.scene import Sweep
    >>> east, west = [[2.0]], [[1.0]]
    >>> radar = RadarVolume([Sweep([90, 270], 0.0, np.array(east + west), 1000, 2000)])
    >>> ppi(radar, width=4, gates="nearest").values.tolist()[1]
    [1.0, 1.0, 2.0, 2.0]
    """
    chosen = whole_number("sweep", sweep, low=0, high=len(radar.sweeps) - 1)
    one_of("gates", gates, ("linear", "nearest"))
    pixels = whole_number("width", width, low=1, high=LARGEST_IMAGE_SIDE)
    farthest = _reach(reach, radar.sweeps[chosen].last_range)
    table, nearest = radar_table(radar), gates == "nearest"

    def value(x: Floats, y: Floats) -> Floats:
        azimuth = np.degrees(np.arctan2(x, y)) % 360.0
        tilt = sweep_elevation(table, chosen, azimuth)
        slant = slant_of_ground(np.hypot(x, y), tilt, radar.beam)
        return sweep_lookup(table, chosen, slant, azimuth, nearest=nearest)

    title = f"PPI {radar.quantity} at {radar.sweeps[chosen].elevation:.1f} degrees"
    parts = [value(x, y) for x, y in _parts(pixels, farthest)]
    return _map(radar, parts, pixels, farthest, title)


def cappi(radar: RadarVolume, height: float, width: int = 600, *, reach: float | None = None) -> RadarMap:
    """Map at one height above the antenna, metres (constant altitude plan position indicator).

    Heights above the sea are those above the antenna plus the third number of the radar's `site`.
    reach: half the side, metres; by default where the lowest sweep ends.

    Raises
    ------
    SceneError
        If a number lies outside its range.
    """
    above = number("height", height, low=-LARGEST_RANGE, high=LARGEST_RANGE)
    pixels = whole_number("width", width, low=1, high=LARGEST_IMAGE_SIDE)
    farthest = _reach(reach, radar.sweeps[0].last_range)
    table = radar_table(radar)
    antenna = np.array(radar.origin)[:, None]
    parts = [
        polar_lookup(table, antenna + np.stack((x, y, np.full_like(x, above))))[0]
        for x, y in _parts(pixels, farthest)
    ]
    return _map(radar, parts, pixels, farthest, f"CAPPI {radar.quantity} at {above / 1000:g} km")


def ground_grid(pixels: int, reach: float) -> tuple[Floats, Floats]:
    """Return how far east and north (n * n,) of the radar the middles of all pixels lie, row by row."""
    across = -reach + (np.arange(pixels) + 0.5) * (2 * reach / pixels)
    return np.tile(across, pixels), np.repeat(-across, pixels)


def _reach(reach: float | None, default: float) -> float:
    return default if reach is None else number("reach", reach, low=1.0, high=LARGEST_RANGE)


def _parts(pixels: int, reach: float) -> list[tuple[Floats, Floats]]:
    x, y = ground_grid(pixels, reach)
    return [(x[i : i + POINTS], y[i : i + POINTS]) for i in range(0, len(x), POINTS)]


def _map(radar: RadarVolume, parts: list[Floats], pixels: int, reach: float, title: str) -> RadarMap:
    return RadarMap(np.concatenate(parts).reshape(pixels, pixels), reach, radar.value_bounds, title)
