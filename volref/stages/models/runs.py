"""Rows for runs of neighbouring pieces: the line and the quadratics that are off by least.

n pieces, r runs.
"""

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from volref.arrays import Floats
from volref.scene.table import STRENGTH, TablePieces
from volref.stages.models.columns import C0, C1, C2, CENTER, COLOR_OFF, COLUMNS, SIGMA0, SIGMA1, SIGMA_OFF

# A run has at most this many pieces, fewer in long tables so that there are at most about MOST_ROWS rows.
LONGEST, SHORTEST, MOST_ROWS = 24, 8, 1 << 16


def levels_of(table: TablePieces, sag: Floats) -> list[tuple[int, int, int, Floats]]:
    """Return shift, number of groups, longest run and rows of each level, finest first."""
    pieces = len(sag)
    longest = int(np.clip(MOST_ROWS // pieces, SHORTEST, LONGEST))
    found = []
    shift = 0
    while True:
        groups = -(-pieces // (1 << shift))
        padded, padded_sag = _padded(table, sag, groups << shift)
        most = min(longest, groups)
        rows = np.zeros((COLUMNS, most * groups))
        # Runs shorter than about half the longest are found on the finer level.
        for length in range(1 if shift == 0 else longest // 2 - 1, most + 1):
            block = _fitted(padded, padded_sag, length << shift, 1 << shift)
            start = (length - 1) * groups
            rows[:, start : start + block.shape[1]] = block
        found.append((shift, groups, most, rows))
        if groups <= longest:
            return found
        shift += 1


def _padded(table: TablePieces, sag: Floats, count: int) -> tuple[TablePieces, Floats]:
    """Append pieces of no width, up to `count`."""
    more = count - len(sag)
    ends = [np.repeat(table.right[:, -1:], more, axis=1)] * 2
    left, right = (np.concatenate(pair, axis=1) for pair in zip((table.left, table.right), ends, strict=True))
    breaks = np.append(table.breaks, np.repeat(table.breaks[-1], more))
    hidden = np.zeros((len(left), len(breaks)))
    return TablePieces(breaks, left, right, hidden), np.append(sag, np.zeros(more))


def _fitted(table: TablePieces, sag: Floats, length: int, every: int) -> Floats:
    """Return the rows of all runs of `length` pieces that start at each `every`-th piece."""

    def runs(values: Floats) -> Floats:
        return sliding_window_view(values, length)[::every]

    start, end = runs(table.breaks[:-1])[:, 0], runs(table.breaks[1:])[:, -1]
    rows = np.zeros((COLUMNS, len(start)))
    rows[CENTER] = center = 0.5 * (start + end)
    half = np.maximum(0.5 * (end - start), 1e-300)
    offsets = runs(table.breaks[:-1]) - center[:, None], runs(table.breaks[1:]) - center[:, None]
    sigma = runs(table.left[STRENGTH]), runs(table.right[STRENGTH])
    rows[[SIGMA0, SIGMA1, SIGMA_OFF]] = _line_above_zero(offsets, sigma, runs(sag), half)
    gap = (offsets[1] - offsets[0]).max(axis=1)
    for channel in range(3):
        color = runs(table.left[channel]), runs(table.right[channel])
        at = center[:, None] + half[:, None] * np.array([-(0.75**0.5), 0.0, 0.75**0.5])
        fit, off = _quadratic(offsets, color, table, channel, at, half, gap)
        rows[[C0.start + channel, C1.start + channel, C2.start + channel]] = fit
        rows[COLOR_OFF] = np.maximum(rows[COLOR_OFF], off)
    return rows


def _line_above_zero(
    offsets: tuple[Floats, Floats], sigma: tuple[Floats, Floats], sag: Floats, half: Floats
) -> tuple[Floats, Floats, Floats]:
    """Return s0, s1 and the greatest error of lines that stay above 0 on each run, (r,) each.

    Of two lines the better: along the chord, midway between the extremes above and below it; and from 0 at
    the end where that one would be negative.
    """
    unbounded = ~np.isfinite(sag).all(axis=1)
    sag = np.where(np.isfinite(sag), sag, 0.0)
    low_end, high_end = sigma
    slope = (high_end[:, -1] - low_end[:, 0]) / (2 * half)
    level, off = _leveled(offsets, (low_end, high_end), sag, slope)
    deficit = np.maximum(np.abs(slope) * half - level, 0.0)
    from_zero = (level + np.abs(slope) * half) / (2 * half) * np.sign(slope)
    zero_level = np.abs(from_zero) * half
    above = np.maximum(
        (low_end - zero_level[:, None] - from_zero[:, None] * offsets[0]).max(axis=1),
        (high_end - zero_level[:, None] - from_zero[:, None] * offsets[1]).max(axis=1),
    )
    below = np.maximum(
        (zero_level[:, None] + from_zero[:, None] * offsets[0] - low_end).max(axis=1),
        (zero_level[:, None] + from_zero[:, None] * offsets[1] - high_end).max(axis=1),
    )
    zero_off = np.maximum(above, below + sag.max(axis=1))
    better = (deficit > 0) & (zero_off < off + deficit)
    return (
        np.where(better, zero_level, level + deficit),
        np.where(better, from_zero, slope),
        np.where(unbounded, np.inf, np.where(better, zero_off, off + deficit)),
    )


def _leveled(
    offsets: tuple[Floats, Floats], values: tuple[Floats, Floats], sag: Floats, slope: Floats
) -> tuple[Floats, Floats]:
    """Return the best level of lines of given slope, and their greatest error, (r,) each."""
    above, below = -np.inf, np.inf
    for offset, value in zip(offsets, values, strict=True):
        rest = value - slope[:, None] * offset
        above, below = np.maximum(above, rest.max(axis=1)), np.minimum(below, rest.min(axis=1))
    below = below - sag.max(axis=1)
    return 0.5 * (above + below), 0.5 * (above - below)


def _quadratic(
    offsets: tuple[Floats, Floats],
    color: tuple[Floats, Floats],
    table: TablePieces,
    channel: int,
    at: Floats,
    half: Floats,
    gap: Floats,
) -> tuple[Floats, Floats]:
    """Return c0, c1, c2 (3, r) and their greatest error (r,): through three Chebyshev points, or a line."""
    knots = np.ravel(np.column_stack([table.breaks[:-1], table.breaks[1:]]))
    values = np.ravel(np.column_stack([table.left[channel], table.right[channel]]))
    low, middle, high = np.interp(at, knots, values).T
    reach = 0.75**0.5 * half
    with np.errstate(over="ignore", invalid="ignore", divide="ignore", under="ignore"):
        curve = (low - 2 * middle + high) / (2 * reach**2)
    # A curve whose square would over- or underflow is left out.
    curve = np.where(np.isfinite(curve) & (half < 1e100) & (half > 1e-100), curve, 0.0)
    bent = [value - (curve[:, None] * offset) * offset for offset, value in zip(offsets, color, strict=True)]
    level, off = _leveled(offsets, (bent[0], bent[1]), np.zeros((len(half), 1)), (high - low) / (2 * reach))
    # Between the ends of a piece the curve leaves its chord by at most |c2| gap^2 / 4.
    off = off + np.abs(curve) * gap * gap / 4
    chord = (color[1][:, -1] - color[0][:, 0]) / (2 * half)
    line_level, line_off = _leveled(offsets, color, np.zeros((len(half), 1)), chord)
    line = line_off <= off
    fit = np.where(line, [line_level, chord, 0 * curve], [level, (high - low) / (2 * reach), curve])
    return fit, np.where(line, line_off, off)
