"""A transfer function as linear pieces over the values that a volume can take.

n pieces between n + 1 rising breaks; channels are red, green, blue and, as the fourth, the extinction or
opacity.  Piece j runs from `left[:, j]` at breaks[j] to `right[:, j]` at breaks[j + 1]; where a jump lies
between two pieces, right[:, j] and left[:, j + 1] differ, and the value itself belongs to the right one.
"""

from dataclasses import dataclass

import numpy as np

from volref.arrays import Booleans, Floats
from volref.scene.transfer import TransferFunction

STRENGTH = 3  # the channel of extinction or opacity

# A break is kept if it bends any channel by more than this part of the channel's size there.
LEAST_BEND = 2.0**-50

# Knots closer than this part of the values are taken for one.
CLOSE = 2.0**-47


@dataclass(frozen=True, eq=False)
class TablePieces:
    """Linear pieces: breaks (n + 1,), left and right (4, n).

    Knots closer than `blur` were taken for one; hidden (4, n + 1) is by how much colours vary
    among them, and their greatest strength.
    """

    breaks: Floats
    left: Floats
    right: Floats
    hidden: Floats
    blur: float = 0.0


def table_pieces(transfer: TransferFunction, low: float, high: float) -> TablePieces:
    """Return the pieces of `transfer` over values from `low` to `high`, and a little beyond on both sides.

    Examples
    --------
    >>> ramp = TransferFunction([0, 1, 3], np.ones((3, 3)), [0, 0, 4])
    >>> pieces = table_pieces(ramp, 0.5, 2.0)
    >>> pieces.breaks.tolist(), pieces.left[3].tolist(), pieces.right[3].tolist()
    ([0.0, 1.0, 3.0], [0.0, 0.0], [0.0, 4.0])
    """
    strength = transfer.opacity if transfer.extinction is None else transfer.extinction
    channels = np.concatenate([transfer.colors.T, np.asarray(strength)[None]])
    knots, first = np.unique(transfer.values, return_index=True)
    last = np.append(first[1:], len(transfer.values)) - 1
    before, at = channels[:, first], channels[:, last]  # on both sides of a jump
    knots, before, at, hidden, blur = _joined_where_close(knots, before, at, max(abs(low), abs(high)))
    margin = max(high - low, abs(low), abs(high), 1.0)
    low, high = low - blur, high + blur  # what was taken for one knot may lie on either side of it
    inside = np.flatnonzero((knots >= low) & (knots <= high))
    below, above = knots[knots < low][-1:], knots[knots > high][:1]
    start = below[0] if len(below) and low - below[0] <= margin else low - margin
    end = above[0] if len(above) and above[0] - high <= margin else high + margin
    if transfer.extinction is None and _dense(knots, before, at, start, end):
        # What is clear near an opacity of 1 has its digits at the knots only: no piece is cut.
        start, end = min([*below, start]), max([*above, end])
    breaks = np.concatenate([[start], knots[inside], [end]])
    outer = [_between(knots, before, at, start, below=False), _between(knots, before, at, end, below=True)]
    left = np.concatenate([outer[0][:, None], at[:, inside]], axis=1)
    right = np.concatenate([before[:, inside], outer[1][:, None]], axis=1)
    return TablePieces(breaks, left, right, np.pad(hidden[:, inside], [(0, 0), (1, 1)]), blur)


def _between(knots: Floats, before: Floats, at: Floats, value: float, *, below: bool) -> Floats:
    """Return the channels (4,) at `value`, or, at a knot, just `below` it."""
    k = int(np.searchsorted(knots, value, side="left" if below else "right"))  # between knots k - 1 and k
    if k == 0:
        return before[:, 0]
    if k == len(knots):
        return at[:, -1]
    # From the nearer knot, so that a far one of great size does not cancel.
    gap, rise = knots[k] - knots[k - 1], before[:, k] - at[:, k - 1]
    if value - knots[k - 1] < knots[k] - value:
        return np.asarray(at[:, k - 1] + (value - knots[k - 1]) / gap * rise)
    return np.asarray(before[:, k] - (knots[k] - value) / gap * rise)


def _dense(knots: Floats, before: Floats, at: Floats, start: float, end: float) -> bool:
    """Tell whether the opacity is more than 1/2 where pieces are to begin or to end."""
    ends = _between(knots, before, at, start, below=False), _between(knots, before, at, end, below=True)
    return any(bool(channels[STRENGTH] > 1 / 2) for channels in ends)


def _joined_where_close(
    knots: Floats, before: Floats, at: Floats, size: float
) -> tuple[Floats, Floats, Floats, Floats, float]:
    """Take neighbouring knots as one, with a jump, that values of `size` can hardly tell apart.

    Returns the knots, the channels on both sides of each (4, k), by how much colours vary among those that
    were taken for one, with their greatest strength (4, k), and the greatest distance that was lost.
    """
    gap = np.diff(knots)
    with np.errstate(over="ignore", divide="ignore"):
        steep = ~np.isfinite((before[:, 1:] - at[:, :-1]) / gap).all(axis=0)
    close = steep | (gap <= CLOSE * size)
    if not close.any():
        return knots, before, at, np.zeros(at.shape), 0.0
    begins = np.append(True, ~close)
    first = np.flatnonzero(begins)
    last = np.append(first[1:], len(knots)) - 1
    blur = float((knots[last] - knots[first]).max())
    most = np.maximum.reduceat(np.maximum(before, at), first, axis=1)
    least = np.minimum.reduceat(np.minimum(before, at), first, axis=1)
    most[:3] -= least[:3]
    hidden = np.where(last > first, most, 0.0)
    return knots[first], before[:, first], at[:, last], hidden, blur


def without_straight_breaks(pieces: TablePieces) -> tuple[TablePieces, Floats]:
    """Return the pieces with straight breaks removed, and how far each is off in each channel (4, m).

    A break is straight where no channel jumps or bends there by more than rounding, or where nothing can
    be seen on both sides, so that the colour does not matter.
    """
    breaks, left, right = pieces.breaks, pieces.left, pieces.right
    width = np.diff(breaks)
    share = width[:-1] / (width[:-1] + width[1:])
    straight = left[:, :-1] + share * (right[:, 1:] - left[:, :-1])
    bend = np.maximum(np.abs(right[:, :-1] - straight), np.abs(left[:, 1:] - straight))
    size = np.maximum.reduce([np.abs(left[:, :-1]), np.abs(right[:, :-1]), np.abs(right[:, 1:])])
    clear = (left[STRENGTH] == 0) & (right[STRENGTH] == 0)
    hides = pieces.hidden[STRENGTH, 1:-1] > 0
    kept = ((bend > LEAST_BEND * size).any(axis=0) & ~(clear[:-1] & clear[1:])) | hides
    first = np.flatnonzero(np.append(True, kept))
    last = np.append(first[1:], len(width)) - 1
    ends = np.append(first, len(width))
    merged = TablePieces(breaks[ends], left[:, first], right[:, last], pieces.hidden[:, ends], pieces.blur)
    return merged, _off_by(pieces, merged, first, clear)


def _off_by(pieces: TablePieces, merged: TablePieces, first: np.ndarray, clear: Booleans) -> Floats:
    """Return the greatest distance of the merged pieces from those they replace, per channel (4, m)."""
    member = np.repeat(np.arange(len(first)), np.diff(np.append(first, len(clear))))
    start, width = merged.breaks[:-1][member], np.diff(merged.breaks)[member]
    off = np.zeros(pieces.left.shape)
    for x, y in ((pieces.breaks[:-1], pieces.left), (pieces.breaks[1:], pieces.right)):
        share = (x - start) / width
        line = merged.left[:, member] + share * (merged.right[:, member] - merged.left[:, member])
        np.maximum(off, np.abs(y - line), out=off)
    off[:, clear] = 0.0
    single = np.diff(np.append(first, len(clear))) == 1
    return np.asarray(np.where(single, 0.0, np.maximum.reduceat(off, first, axis=1)))
