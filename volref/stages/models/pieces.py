"""The pieces of a table made fine and straight enough for their runs to be fitted.

n pieces; see `volref.scene.table`.
"""

import dataclasses

import numpy as np

from volref.arrays import Floats, Indices
from volref.scene.table import STRENGTH, TablePieces

# Pieces are cut to at most this part of the volume's values, so that a run near a bend can be short.
FINEST = 128

# A piece of interpolated opacity is cut until its extinction is straight to this part of itself,
# or to this optical depth per unit distance; above the last opacity it is left as it is.
# It is cut into at most MOST_PARTS parts over all pieces, or two each.
STRAIGHT, STRAIGHT_DEPTH, MOST_OPACITY, MOST_PARTS = 1e-4, 1e-7, 1 - 1e-4, 2048

# The largest float below 1.
MOST_OPACITY_BELOW_1 = 1 - 2.0**-53


def divided(table: TablePieces, width: float) -> TablePieces:
    """Cut pieces wider than `width` into equal parts, up to FINEST of each."""
    if not width > 0:
        return table
    parts = np.minimum(np.clip(np.ceil(np.diff(table.breaks) / width), 1, FINEST), _most_parts(table))
    parts = parts.astype(np.intp)
    piece = np.repeat(np.arange(len(parts)), parts)
    number = np.arange(len(piece)) - np.repeat(np.cumsum(parts) - parts, parts)
    return _cut(table, piece, number / parts[piece], (number + 1) / parts[piece])


def _cut(table: TablePieces, piece: Indices, start: Floats, end: Floats) -> TablePieces:
    """Return the parts of pieces from the share `start` to `end` of each."""
    width = np.diff(table.breaks)[piece]
    breaks = np.append(table.breaks[:-1][piece] + width * start, table.breaks[-1])
    # The channels are those of the rounded breaks.
    begin = table.breaks[:-1][piece]
    start = np.divide(breaks[:-1] - begin, width, out=np.zeros(len(width)), where=width > 0)
    stop = np.divide(breaks[1:] - begin, width, out=np.ones(len(width)), where=width > 0)
    rise = (table.right - table.left)[:, piece]
    left, right = table.left[:, piece] + rise * start, table.left[:, piece] + rise * stop
    whole = end == 1.0
    right[:, whole] = table.right[:, piece[whole]]
    hidden = np.zeros((len(left), len(breaks)))
    return dataclasses.replace(table, breaks=breaks, left=left, right=right, hidden=hidden)


def _most_parts(table: TablePieces) -> Floats:
    """Return into how many parts each piece may be cut that are still wider than rounding, (n,)."""
    ulp = np.spacing(np.maximum(np.abs(table.breaks[:-1]), np.abs(table.breaks[1:])))
    return np.asarray(np.maximum(np.floor(np.diff(table.breaks) / (64 * ulp)), 1.0))


def refined(table: TablePieces) -> TablePieces:
    """Cut pieces of interpolated opacity until the extinction on each is nearly straight."""
    clear = np.clip(1.0 - np.stack([table.left[STRENGTH], table.right[STRENGTH]]), 1 - MOST_OPACITY, 1.0)
    depth = -np.log(clear)
    sag = np.maximum(STRAIGHT * depth.mean(axis=0), STRAIGHT_DEPTH)
    parts = np.clip(
        np.ceil(np.abs(depth[1] - depth[0]) / np.sqrt(8 * sag)), 1, max(MOST_PARTS // len(sag), 2)
    )
    parts = np.minimum(parts, _most_parts(table)).astype(np.intp)
    piece = np.repeat(np.arange(len(parts)), parts)
    number = np.arange(len(piece)) - np.repeat(np.cumsum(parts) - parts, parts)
    ends = []
    for k in (number, number + 1):
        # Equal steps of depth, so that each part bends by the same share.
        opacity = -np.expm1(-(depth[0][piece] + (depth[1] - depth[0])[piece] * (k / parts[piece])))
        rise = (table.right[STRENGTH] - table.left[STRENGTH])[piece]
        share = np.divide(
            opacity - table.left[STRENGTH][piece], rise, out=np.zeros(len(piece)), where=rise != 0
        )
        share = np.where(k == 0, 0.0, np.where(k == parts[piece], 1.0, np.clip(share, 0.0, 1.0)))
        ends.append(share)
    return _cut(table, piece, *ends)


def in_extinction(table: TablePieces, unit_distance: float | None) -> tuple[TablePieces, Floats]:
    """Return the pieces with extinction at their ends, and how far it hangs below the line between (n,).

    Where the opacity reaches 1 the extinction has no bound: some finite line, off by infinity, stands for it.
    """
    if unit_distance is None:
        return table, np.zeros(table.left.shape[1])
    clear = 1.0 - np.stack([table.left[STRENGTH], table.right[STRENGTH]])
    near, far = np.minimum(*clear), np.maximum(*clear)
    with np.errstate(divide="ignore", invalid="ignore"):
        # -log is furthest below its chord where its slope is the chord's: at 1 / that slope.
        slope = np.log(far / near) / (far - near)
        at = 1.0 / slope
        sag = np.log(at / near) - slope * (at - near)
        curved = (far - near) / far
    sag = np.where(curved > 1e-6, sag + 2.0**-50, curved**2)  # its own rounding is below 2^-50
    left, right = table.left.copy(), table.right.copy()
    for side in (left, right):
        side[STRENGTH] = -np.log1p(-np.minimum(side[STRENGTH], MOST_OPACITY_BELOW_1)) / unit_distance
    return dataclasses.replace(table, left=left, right=right), np.where(near > 0, sag, np.inf) / unit_distance
