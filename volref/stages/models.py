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

import dataclasses
from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from volref.arrays import Floats, Indices
from volref.scene.table import STRENGTH, TablePieces, table_pieces, without_straight_breaks
from volref.scene.transfer import TransferFunction

# Columns of the rows.
CENTER, SIGMA0, SIGMA1, SIGMA_OFF, COLOR_OFF = range(5)
C0, C1, C2 = slice(5, 8), slice(8, 11), slice(11, 14)
# Of exact rows only: opacity at the centre and its slope, the end where it is greatest, and what is clear
# there;
ALPHA0, ALPHA1, DENSE_END, LEAST_CLEAR = range(14, 18)
# the steepest extinction and colour on the pieces beside; what misplacing an end costs per world length, in
# extinction and in light; where the opacity reaches 1 without a jump here or beside, its least slope, else 0;
BESIDE, COLOR_BESIDE, JUMP, JUMP_LIGHT, TOUCHING = range(18, 23)
# 1 where the piece is opaque throughout; where the one below is, and the one above.
IS_OPAQUE, OPAQUE_BELOW, OPAQUE_ABOVE = range(23, 26)
# Of all rows: 1 where anything can be seen.
SEEN = 26
COLUMNS = 27

# A run has at most this many pieces, fewer in long tables so that there are at most about MOST_ROWS rows.
LONGEST, SHORTEST, MOST_ROWS = 24, 8, 1 << 16

# Pieces are cut to at most this part of the volume's values, so that a run near a bend can be short.
FINEST = 128

# Tables with at most so many bends need no short runs: their pieces are cut at the bends at once.
FEW_BENDS = 32

# A piece of interpolated opacity is cut until its extinction is straight to this part of itself,
# or to this optical depth per unit distance; above the last opacity it is left as it is.
# It is cut into at most MOST_PARTS parts over all pieces, or two each.
STRAIGHT, STRAIGHT_DEPTH, MOST_OPACITY, MOST_PARTS = 1e-4, 1e-7, 1 - 1e-4, 2048

# The relative error of values that are sampled where a ray enters or leaves.
NEARBY = 1e-12

# The largest float below 1.
MOST_OPACITY_BELOW_1 = 1 - 2.0**-53

MOST_BUCKETS = 1 << 16


@dataclass(frozen=True, eq=False)
class Locator:
    """Finds the piece of a value: `below` counts the inner breaks below a bucket, `knot` is the one in it.

    Where buckets would be too many, `scale` is None and the inner breaks are searched.
    """

    low: float
    scale: float | None
    below: Indices
    knot: Floats
    inner: Floats


@dataclass(frozen=True, eq=False)
class Level:
    """Runs of groups of 2^shift pieces: row first + (length - 1) count + first group of the run."""

    shift: int
    first: int
    count: int
    longest: int


@dataclass(frozen=True, eq=False)
class Models:
    """Rows (COLUMNS, rows) of models, and how to find them.

    bends (m + 1,): the values between which the exact rows hold.  blur: how close knots were taken for one.
    most_sigma, most_jump, most_slope: the greatest finite extinction, jump and slope of it.  bent: whether
    any row's colour is. unit_distance is None where the extinction is interpolated.  largest (3,): the
    greatest colour.
    """

    rows: Floats
    locator: Locator
    levels: tuple[Level, ...]
    exact: int
    bends: Floats
    bend_locator: Locator
    blur: float
    most_sigma: float
    most_jump: float
    most_slope: float
    bent: bool
    opaque: bool
    unit_distance: float | None
    largest: Floats


def models_of(transfer: TransferFunction, low: float, high: float) -> Models:
    """Return the models of `transfer` for values from `low` to `high`."""
    unit_distance = transfer.unit_distance if transfer.extinction is None else None
    table = table_pieces(transfer, low, high)
    straight, off = without_straight_breaks(table)
    few = len(straight.breaks) <= FEW_BENDS
    # Where bends are few, pieces are cut at them before they are integrated, and runs hardly matter.
    fine = straight if few else _divided(table, (high - low) / FINEST)
    fine = fine if unit_distance is None or few else _refined(fine)
    fine, sag = _in_extinction(fine, unit_distance)
    blocks, levels, count = [], [], 0
    for shift, groups, longest, block in _levels(fine, sag):
        levels.append(Level(shift, count, groups, longest))
        blocks.append(block)
        count += block.shape[1]
    blocks.append(_exact_rows(straight, off, unit_distance))
    rows = np.concatenate(blocks, axis=1)
    visible = [SIGMA0, SIGMA1, SIGMA_OFF, ALPHA0, ALPHA1, JUMP, JUMP_LIGHT, OPAQUE_BELOW, OPAQUE_ABOVE]
    rows[SEEN] = rows[visible].any(axis=0)
    return Models(
        rows,
        _locator(fine.breaks, low, high),
        tuple(levels),
        count,
        straight.breaks,
        _locator(straight.breaks, low, high),
        table.blur,
        float(max(fine.left[STRENGTH].max(), fine.right[STRENGTH].max())),
        float(rows[JUMP].max()),
        float(rows[BESIDE].max()) if not rows[TOUCHING].any() else np.inf,
        bool(rows[C2].any()),
        bool(rows[IS_OPAQUE].any()),
        unit_distance,
        np.maximum(table.left[:3].max(axis=1), table.right[:3].max(axis=1)),
    )


def _locator(breaks: Floats, low: float, high: float) -> Locator:
    inner = breaks[1:-1]
    span = max(high - low, 1e-300)
    gap = float(np.diff(inner).min()) if len(inner) > 1 else span
    buckets = np.ceil(2 * span / gap) + 1 if gap > span / MOST_BUCKETS else 2 * MOST_BUCKETS
    width = span / buckets
    # A bucket of a few ulp could not tell its values apart.
    if buckets > MOST_BUCKETS or width < 16 * np.spacing(max(abs(low), abs(high))):
        return Locator(low, None, np.empty(0, np.intp), np.empty(0), inner)
    # One bucket more on each side takes the values that rounding put outside the bounds.
    edges = low + width * np.arange(-1, int(buckets) + 1)
    below = np.searchsorted(inner, edges - width / 4, side="right")
    knot = np.append(inner, np.inf)[below]
    return Locator(float(edges[0]), 1.0 / width, below, knot, inner)


def piece_of(locator: Locator, values: Floats) -> Indices:
    """Return how many inner breaks lie at or below each value (m,): the index of its piece."""
    if locator.scale is None:
        return np.searchsorted(locator.inner, values, side="right")
    bucket = ((values - locator.low) * locator.scale).astype(np.int32)
    piece = locator.below.take(bucket, mode="clip")
    return np.asarray(piece + (values >= locator.knot.take(bucket, mode="clip")))


def rows_of(models: Models, low: Floats, high: Floats) -> Indices:
    """Return the row that holds for values from `low` to `high`, (m,) each."""
    first, last = piece_of(models.locator, low), piece_of(models.locator, high)
    length = last - first
    level = models.levels[0]
    row = first + length * level.count
    long = np.flatnonzero(length >= level.longest)
    for coarser in models.levels[1:]:
        if len(long) == 0:
            break
        start = first[long] >> coarser.shift
        groups = (last[long] >> coarser.shift) - start
        row[long] = coarser.first + groups * coarser.count + start
        long = long[groups >= coarser.longest]
    return row


def look_up(models: Models, values: Floats) -> tuple[Floats, Floats, Floats]:
    """Return a bound on extinction, up to 1e200, colour (3, m) and its error, for values off by rounding."""
    slack = NEARBY * np.abs(values)
    row = rows_of(models, values - slack, values + slack)
    rows = models.rows
    offset = values - rows[CENTER].take(row)
    reach = np.abs(offset) + slack
    extinction = rows[SIGMA0].take(row) + np.abs(rows[SIGMA1].take(row)) * reach + rows[SIGMA_OFF].take(row)
    c1, c2 = rows[C1].take(row, axis=1), rows[C2].take(row, axis=1)
    color = rows[C0].take(row, axis=1) + (c1 + c2 * offset) * offset
    off = rows[COLOR_OFF].take(row) + (np.abs(c1) + 2 * np.abs(c2) * reach).max(axis=0) * slack
    return np.minimum(extinction, 1e200), color, off


def _divided(table: TablePieces, width: float) -> TablePieces:
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


def _refined(table: TablePieces) -> TablePieces:
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


def _in_extinction(table: TablePieces, unit_distance: float | None) -> tuple[TablePieces, Floats]:
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


def _levels(table: TablePieces, sag: Floats) -> list[tuple[int, int, int, Floats]]:
    """Return shift, number of groups, longest run and rows of each level, finest first."""
    pieces = len(sag)
    longest = int(np.clip(MOST_ROWS // pieces, SHORTEST, LONGEST))
    levels = []
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
        levels.append((shift, groups, most, rows))
        if groups <= longest:
            return levels
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


def _exact_rows(straight: TablePieces, off: Floats, unit_distance: float | None) -> Floats:
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
