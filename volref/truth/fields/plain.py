"""The plain field: a volume on a grid, looked up by its value."""

from dataclasses import dataclass

import numpy as np

from volref.arrays import Floats
from volref.planning import Plan
from volref.scene.scene import Scene
from volref.stages.classify import Table, classify, lookup_table
from volref.stages.sampling import Grid, grid_of, trilinear
from volref.truth.fields.field import Field, Samples, box_of, reach_of
from volref.workspace import Workspace


@dataclass(frozen=True, eq=False)
class PlainField(Field):
    """A grid of samples and a table of values."""

    grid: Grid
    table: Table

    def look(self, samples: Samples, work: Workspace) -> tuple[Floats, Floats]:
        """Return the colours that are looked up (c, n) and the strength (n,)."""
        values = trilinear(self.grid, samples.position, work, samples.corner)
        return classify(self.table, values, work)


def plain_field(scene: Scene, plan: Plan) -> PlainField:
    """Prepare the volume of `scene`, whatever else it holds."""
    volume, transfer = scene.gridded
    kind = np.dtype(plan.precision)
    return PlainField(
        **box_of(volume),
        reach=reach_of(plan, volume.index_from_world),
        color_limit=float(transfer.colors.max()),
        interpolation=transfer.interpolation,
        unit_distance=transfer.unit_distance,
        dtype=kind,
        grid=grid_of(volume, kind),
        table=lookup_table(transfer, volume.value_bounds, colors=plan.palette.looked_up, dtype=kind),
    )
