"""Stage 4 of the exact integrator: the transfer function over a range of values, as low polynomials.

A row holds, for a range of values about `center`, with s = value - center,

    extinction = sigma0 + sigma1 s            off by at most sigma_off, and nowhere below 0
    colour     = c0 + c1 s + c2 s^2           off by at most color_off

Rows of two kinds: one for each run of at most `longest` neighbouring pieces of the table, from a hierarchy
of ever coarser pieces, and, from row `exact` on, one for each piece between two bends of the table, where
the extinction or opacity and the colour are straight: nothing is off there but rounding, and, where the
opacity is interpolated, the extinction -log1p(-opacity) / unit_distance, which is curved.

n pieces; ranges of values are given by two (m,) arrays.
"""

import numpy as np

from volref.scene.table import STRENGTH, table_pieces, without_straight_breaks
from volref.scene.transfer import TransferFunction
from volref.stages.models.columns import (
    ALPHA0,
    ALPHA1,
    BESIDE,
    C2,
    IS_OPAQUE,
    JUMP,
    JUMP_LIGHT,
    OPAQUE_ABOVE,
    OPAQUE_BELOW,
    SEEN,
    SIGMA0,
    SIGMA1,
    SIGMA_OFF,
    TOUCHING,
)
from volref.stages.models.finding import Level, Models, locator_of, look_up, piece_of, rows_of
from volref.stages.models.pieces import FINEST, divided, in_extinction, refined
from volref.stages.models.runs import levels_of
from volref.stages.models.straight import exact_rows

__all__ = ["FEW_BENDS", "Models", "look_up", "models_of", "piece_of", "rows_of"]

# Tables with at most so many bends need no short runs: their pieces are cut at the bends at once.
FEW_BENDS = 32


def models_of(transfer: TransferFunction, low: float, high: float) -> Models:
    """Return the models of `transfer` for values from `low` to `high`."""
    unit_distance = transfer.unit_distance if transfer.extinction is None else None
    table = table_pieces(transfer, low, high)
    straight, off = without_straight_breaks(table)
    few = len(straight.breaks) <= FEW_BENDS
    # Where bends are few, pieces are cut at them before they are integrated, and runs hardly matter.
    fine = straight if few else divided(table, (high - low) / FINEST)
    fine = fine if unit_distance is None or few else refined(fine)
    fine, sag = in_extinction(fine, unit_distance)
    blocks, levels, count = [], [], 0
    for shift, groups, longest, block in levels_of(fine, sag):
        levels.append(Level(shift, count, groups, longest))
        blocks.append(block)
        count += block.shape[1]
    blocks.append(exact_rows(straight, off, unit_distance))
    rows = np.concatenate(blocks, axis=1)
    visible = [SIGMA0, SIGMA1, SIGMA_OFF, ALPHA0, ALPHA1, JUMP, JUMP_LIGHT, OPAQUE_BELOW, OPAQUE_ABOVE]
    rows[SEEN] = rows[visible].any(axis=0)
    return Models(
        rows,
        locator_of(fine.breaks, low, high),
        tuple(levels),
        count,
        straight.breaks,
        locator_of(straight.breaks, low, high),
        table.blur,
        float(max(fine.left[STRENGTH].max(), fine.right[STRENGTH].max())),
        float(rows[JUMP].max()),
        float(rows[BESIDE].max()) if not rows[TOUCHING].any() else np.inf,
        bool(rows[C2].any()),
        bool(rows[IS_OPAQUE].any()),
        unit_distance,
        np.maximum(table.left[:3].max(axis=1), table.right[:3].max(axis=1)),
    )
