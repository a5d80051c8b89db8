"""The field of a weather radar: looked up by range, azimuth and elevation.

Its space is the world; what has no data is transparent.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np

from volref.arrays import Floats
from volref.planning import Plan, may_be_seen
from volref.scene.radar import RadarVolume
from volref.scene.radar_blocks import RadarBins, flag_bins
from volref.scene.scene import Scene
from volref.scene.transfer import TransferFunction
from volref.stages.classify import Table, classify, lookup_table
from volref.stages.polar import RadarTable, polar_lookup, radar_table
from volref.stages.sampling import PAD
from volref.truth.fields.field import Field, Samples, reach_of
from volref.workspace import Workspace


@dataclass(frozen=True, eq=False)
class PolarField(Field):
    """The gates of a radar and a table of values; `bins` outside which nothing is seen, None: not known."""

    gates: RadarTable
    table: Table
    bins: RadarBins | None

    def look(self, samples: Samples, work: Workspace) -> tuple[Floats, Floats]:
        """Return the colours (3, n) and the strength (n,), 0 where nothing was measured."""
        values, measured = polar_lookup(self.gates, samples.absolute() - PAD, self.bins)
        colors, strength = classify(self.table, np.where(measured, values, self.table.low), work)
        strength[~measured] = 0.0
        return colors, strength


def polar_field(scene: Scene, plan: Plan) -> PolarField:
    """Prepare the radar volume of `scene`."""
    radar, transfer = scene.volume, scene.transfer
    assert isinstance(radar, RadarVolume)
    assert isinstance(transfer, TransferFunction)
    low, high = radar.box
    return PolarField(
        space_from_world=np.eye(4),
        low=low,
        high=high,
        reach=reach_of(plan, np.eye(4)),
        color_limit=float(transfer.colors.max()),
        interpolation=transfer.interpolation,
        unit_distance=transfer.unit_distance,
        dtype=np.dtype(np.float64),
        gates=radar_table(radar),
        table=lookup_table(transfer, radar.value_bounds),
        bins=flag_bins(radar, partial(may_be_seen, transfer)) if plan.occupancy else None,
    )
