"""A radar as a program uploads it (seed 001, section 4): its sweeps in one image, one above the other.

S sweeps, A radials of each, G gates.  Columns are azimuths and rows are gates, two sweeps of four gates:

    v = 1 +-----------------+
          | sweep 1, gate 3 |      u: azimuth, clockwise from north
          |   ...           |      v: distance from the antenna, in each sweep from 0 on
          | sweep 1, gate 0 |
          | sweep 0, gate 3 |
          |   ...           |
    v = 0 +-----------------+

The program has one number of radials, one of gates and one distance between these.  A sweep that has others
is brought to them gate by gate, without interpolation: each texel is the gate that lies there.
"""

from dataclasses import dataclass

import numpy as np

from volref.arrays import Floats
from volref.emulation.groups import VolumeTexture
from volref.emulation.pipeline import Pipeline
from volref.errors import SceneError
from volref.scene.radar import RadarVolume
from volref.scene.sweep import Sweep
from volref.stages.polar import radar_table, sweep_lookup

# What the lookup of a radar needs, by group.  Others would be ignored in silence.
NEEDED: dict[str, dict[str, object]] = {
    "volume": {"layout": "atlas", "tiles_across": 1, "padding": 0, "tile_column": "fract"},
    "table": {"order": "post", "rows": 1},
    "lighting": {"model": "none", "gradient": "none"},
    "opacity": {"by_gradient": 0.0},
}


@dataclass(frozen=True, eq=False)
class PolarGrid:
    """Where the texels of a radar's image lie, in the units of texture space.

    tilts (S,): elevations of the sweeps, radians, rising.  start, span: where gate 0 begins, and how far all
    gates reach from there.  turn: the share of a turn, clockwise from north, at which column 0 begins.
    columns, gates: A and G.
    """

    tilts: Floats
    start: float
    span: float
    turn: float
    columns: int
    gates: int


def is_spherical(volume: VolumeTexture) -> bool:
    """Whether a program looks up a radar's image."""
    return volume.geometry != "box"


def reach(radar: RadarVolume) -> float:
    """Return the world length from the antenna to a face of the cube in whose middle it stands."""
    return max(sweep.last_range for sweep in radar.sweeps)


def polar_grid(radar: RadarVolume) -> PolarGrid:
    """Return the grid on which a radar is uploaded: that of its sweep with most radials, up to its last gate.

    Examples
    --------
    >>> from volref import Sweep
    >>> sweeps = [Sweep([0, 90, 180, 270], tilt, np.zeros((4, 5)), 50, 100) for tilt in (1, 2)]
    >>> grid = polar_grid(RadarVolume(sweeps))
    >>> grid.columns, grid.gates, grid.start, grid.span, grid.turn
    (4, 5, 0.0, 0.5, -0.125)
    """
    most = max(radar.sweeps, key=lambda sweep: len(sweep.azimuths))
    first, far, spacing = _gates(radar)
    columns = len(most.azimuths)
    count = max(1, round((far - first) / spacing))
    side = 2 * far
    return PolarGrid(
        np.radians([sweep.elevation for sweep in radar.sweeps]),
        first / side,
        count * spacing / side,
        float(most.azimuths[0]) / 360.0 - 0.5 / columns,
        columns,
        count,
    )


def polar_image(radar: RadarVolume, grid: PolarGrid, seam: str) -> Floats:
    """Return the values (S, G, A), NaN where there is no gate or it has no data.

    With seam "wrapped" it has A + 2 columns: the last one before the first, and the first behind the last.
    """
    table = radar_table(radar)
    first, _, spacing = _gates(radar)
    slant = first + (np.arange(grid.gates) + 0.5) * spacing
    azimuth = (grid.turn + (np.arange(grid.columns) + 0.5) / grid.columns) * 360.0 % 360.0
    points = np.repeat(slant, grid.columns), np.tile(azimuth, grid.gates)
    sweeps = [sweep_lookup(table, s, *points, nearest=True) for s in range(len(radar.sweeps))]
    image = np.stack(sweeps).reshape(-1, grid.gates, grid.columns)
    return np.pad(image, ((0, 0), (0, 0), (1, 1)), mode="wrap") if seam == "wrapped" else image


def uploaded_radar(radar: RadarVolume, grid: PolarGrid, values: Floats) -> RadarVolume:
    """Return the radar that an image (S, G, A) stands for: all gates have data, beams are straight."""
    side = 2 * reach(radar)
    spacing = grid.span * side / grid.gates
    azimuths = 360.0 * (grid.turn + (np.arange(grid.columns) + 0.5) / grid.columns)
    first = grid.start * side + 0.5 * spacing
    tilts = np.degrees(grid.tilts).tolist()
    sweeps = [
        Sweep(azimuths, tilt, image.T, first, spacing) for tilt, image in zip(tilts, values, strict=True)
    ]
    return RadarVolume(sweeps, origin=radar.origin, quantity=radar.quantity, units=radar.units)


def _gates(radar: RadarVolume) -> tuple[float, float, float]:
    """Return where the first gate begins and the last one ends, and the least distance of gates, metres."""
    first = min(sweep.first_gate - 0.5 * sweep.gate_spacing for sweep in radar.sweeps)
    return max(first, 0.0), reach(radar), radar.gate_length


def check_spherical(pipeline: Pipeline) -> None:
    """Refuse programs for radars with switches that the lookup of a radar does not have.

    Raises
    ------
    SceneError
        If there is such a switch.
    """
    for group, wanted in NEEDED.items():
        for name, value in wanted.items():
            got = getattr(getattr(pipeline, group), name)
            if got != value:
                message = f"pipeline.{group}.{name} must be {value!r} where volume.geometry is "
                message += f"{pipeline.volume.geometry!r}, got {got!r}; "
                raise SceneError(message + "set it so, or volume.geometry to 'box'")
    if pipeline.stepping.rule == "voxel-count":
        message = "pipeline.stepping.rule must be one without voxels for a radar, got 'voxel-count' in "
        raise SceneError(message + f"{pipeline.name!r}; choose 'count' or a length")
