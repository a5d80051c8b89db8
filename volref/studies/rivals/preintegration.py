"""Pre-integrated classification as a rival: one look-up for each segment, see `volref.stages.preintegrated`.

Only the band of the table that the field can meet is made: no value changes faster than its steepest slope.
S segments, R rays.
"""

from typing import Any

import numpy as np

from volref.arrays import Floats
from volref.stages import preintegrated as stage
from volref.stages.preintegrated import Lattice, Segments, look_up
from volref.studies.rivals.medium import Bundle, Integrator, Medium, paint, sample, steepest_slope
from volref.studies.rivals.uniform import marcher
from volref.workspace import Workspace


def preintegrated(medium: Medium, step: float, size: int, order: int) -> Integrator:
    """Integrate by a table of `size` x `size` entries, the value of degree `order` (1 or 2) in a segment.

    The last, shortened segment takes its entry's opacity to the power of its share of the step, and as much
    of the colour: GPUs do the same, and one segment of third order costs nothing.
    """
    table = segment_table(medium, step, size, order)

    def block(rays: Bundle, edges: Floats, work: Workspace) -> tuple[Floats, Floats]:
        length = np.diff(edges, axis=0)
        ends = sample(medium, rays.start, rays.slope, edges, work).copy()
        bulge = None
        if order == 2:
            middle = sample(medium, rays.start, rays.slope, edges[:-1] + length / 2, work)
            bulge = (middle - (ends[:-1] + ends[1:]) / 2).ravel()
        light = look_up(table, ends[:-1].ravel(), ends[1:].ravel(), bulge)
        _shorten(light, (length / step).ravel())
        light = light.reshape(4, *length.shape)
        return 1.0 - light[3], light[:3]

    return marcher(step, block, per_segment=order, at_ends=True)


def _shorten(light: Floats, share: Floats) -> None:
    """Replace the light (4, n) of whole segments by that of the first `share` (n,) of each, in place."""
    short = np.flatnonzero(share < 1)
    whole = np.minimum(light[3, short], 1 - 2.0**-53)
    part = -np.expm1(share[short] * np.log1p(-whole))
    light[:, short] *= np.divide(part, whole, out=np.zeros_like(part), where=whole > 0)


def segment_table(medium: Medium, step: float, size: int, order: int) -> Segments:
    """Return the table of segments of length `step` through a medium."""
    most = steepest_slope(medium.volume) * step
    return stage.preintegrated_table(**_of(medium), length=step, size=size, most_change=most, order=order)


def entries_along(medium: Medium, size: int) -> Lattice:
    """Return `size` entries over the values of the field, and the integral of the extinction up to each."""
    return stage.entries_along(**_of(medium), size=size)


def _of(medium: Medium) -> dict[str, Any]:
    """Return what a table is made of."""
    work = Workspace()

    def painted(values: Floats) -> tuple[Floats, Floats]:
        return paint(medium, values, work)

    return {
        "paint": painted,
        "knots": np.unique(medium.transfer.values),
        "bounds": medium.volume.value_bounds,
    }
