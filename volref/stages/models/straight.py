"""Rows for the pieces between two bends, where nothing is off but rounding.

m pieces.
"""

import numpy as np

from volref.arrays import Floats
from volref.scene.table import STRENGTH, TablePieces
from volref.stages.models.columns import (
    ALPHA0,
    ALPHA1,
    BESIDE,
    C0,
    C1,
    CENTER,
    COLOR_BESIDE,
    COLOR_OFF,
    COLUMNS,
    DENSE_END,
    IS_OPAQUE,
    JUMP,
    JUMP_LIGHT,
    LEAST_CLEAR,
    OPAQUE_ABOVE,
    OPAQUE_BELOW,
    SIGMA0,
    SIGMA1,
    SIGMA_OFF,
    TOUCHING,
)


def exact_rows(straight: TablePieces, off: Floats, unit_distance: float | None) -> Floats:
    """Return the rows of the pieces between bends (COLUMNS, m)."""
    breaks, left, right = straight.breaks, straight.left, straight.right
    rows = np.zeros((COLUMNS, len(breaks) - 1))
    rows[CENTER] = center = 0.5 * (breaks[:-1] + breaks[1:])
    slope = (right - left) / np.diff(breaks)
    middle = left + slope * (center - breaks[:-1])  # at the centre as it was rounded
    rows[C0], rows[C1] = middle[:3], slope[:3]
    rows[COLOR_OFF] = off[:3].max(axis=0)
    sigma = np.stack([left[STRENGTH], right[STRENGTH]])
    hidden = straight.hidden[STRENGTH]
    if unit_distance is None:
        rows[SIGMA0], rows[SIGMA1], rows[SIGMA_OFF] = middle[STRENGTH], slope[STRENGTH], off[STRENGTH]
        steep = np.abs(slope[STRENGTH])
    else:
        rows[ALPHA0], rows[ALPHA1] = np.clip(middle[STRENGTH], 0.0, 1.0), slope[STRENGTH]
        rows[DENSE_END] = np.where(slope[STRENGTH] > 0, breaks[1:], breaks[:-1])
        rows[LEAST_CLEAR] = clear = 1.0 - sigma.max(axis=0)
        with np.errstate(divide="ignore", invalid="ignore"):
            hidden = np.where(hidden > 0, -np.log1p(-hidden) / unit_distance, 0.0)
            sigma = -np.log1p(-sigma) / unit_distance
            steep = np.where(slope[STRENGTH] == 0, 0.0, np.abs(slope[STRENGTH]) / clear / unit_distance)
            rows[SIGMA_OFF] = np.where(off[STRENGTH] == 0, 0.0, off[STRENGTH] / clear / unit_distance)
        opaque = np.isinf(sigma).all(axis=0)
        rows[IS_OPAQUE], rows[OPAQUE_BELOW, 1:], rows[OPAQUE_ABOVE, :-1] = opaque, opaque[:-1], opaque[1:]
    touching = ~np.isfinite(steep)
    rows[BESIDE] = _with_neighbors(np.where(touching, 0.0, steep))
    least = np.where(touching, np.abs(slope[STRENGTH]), np.inf)
    least = -_with_neighbors(-least)
    rows[TOUCHING] = np.where(np.isfinite(least), least, 0.0)
    rows[COLOR_BESIDE] = _with_neighbors(np.abs(slope[:3]).max(axis=0))
    rows[[JUMP, JUMP_LIGHT]] = _jumps(left, right, sigma, hidden, straight.hidden[:3])
    return rows


def _jumps(left: Floats, right: Floats, sigma: Floats, hidden: Floats, hidden_color: Floats) -> Floats:
    """Return what misplacing the ends of each piece costs per world length, (2, m): extinction, and light.

    hidden (m + 1,) is by how much the extinction varies among knots that were taken for one, and hidden_color
    (3, m + 1) the colour.

    Beside an opaque piece, whatever is shown there instead is at most the light of the clearer one.
    """
    before, after = sigma[1, :-1], sigma[0, 1:]
    opaque = ~np.isfinite(before) | ~np.isfinite(after)
    with np.errstate(invalid="ignore"):
        depth = np.where(opaque, 0.0, np.abs(after - before))
    depth = np.maximum(depth, hidden[1:-1])
    color = np.maximum(np.abs(left[:3, 1:] - right[:3, :-1]), hidden_color[:, 1:-1]).max(axis=0)
    brightest = np.maximum(left[:3].max(), right[:3].max())
    clearer = np.minimum(before, after)
    light = np.where(opaque, np.where(np.isfinite(clearer), clearer, 0.0) * brightest, 0.0)
    light += color * np.where(opaque, 0.0, np.maximum(np.maximum(before, after), hidden[1:-1]))
    return np.stack([np.maximum(np.append(0.0, x), np.append(x, 0.0)) for x in (depth, light)])


def _with_neighbors(values: Floats) -> Floats:
    """Return the greatest of each value and those beside it."""
    edged = np.pad(values, 1, mode="edge")
    return np.maximum(np.maximum(edged[:-2], edged[2:]), values)
