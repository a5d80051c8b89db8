"""Stage: the colour of a value as a layer one unit distance thick, over what lies behind it.

R rays, K knots.  With a the opacity of the layer, which is the table's opacity, or 1 - exp(-extinction d) for
the unit distance d, and c its colour, over what lies behind, b, premultiplied:

    rgba = (1 - a) b + a (c, 1)

If the value is only known to lie from `least` to `most`, opacity and colour lie between their extremes at
both ends and at the knots between, for they are linear there, and the result is off by at most
|a' - a| |c' - b| + a |c' - c|.  A jump of the table between the two is such a knot.
"""

import numpy as np

from volref.arrays import Floats, Indices
from volref.scene.transfer import TransferFunction

ROUNDOFF = 2.0**-53

# Roundings in a channel between two knots, of the greater of its sizes there each.
LOOKUP = 6


def unit_layers(
    transfer: TransferFunction, value: Floats, least: Floats, most: Floats, behind: Floats
) -> tuple[Floats, Floats]:
    """Return the rgba (R, 4) of layers of `value` (R,) over `behind` (R, 4), and how far it may be off (R,).

    The true value lies from `least` to `most` (R,).

    Examples
    --------
    >>> table = TransferFunction([0, 1], [(0, 0, 0), (1, 1, 1)], opacity=[0, 1])
    >>> value, behind = np.array([0.5]), np.array([[1.0, 0.0, 0.0, 1.0]])
    >>> rgba, bound = unit_layers(table, value, value - 0.25, value + 0.25, behind)
    >>> rgba.tolist(), bound.round(12).tolist()
    ([[0.75, 0.25, 0.25, 1.0]], [0.3125])
    """
    strength = transfer.opacity if transfer.extinction is None else transfer.extinction
    channels = np.concatenate([transfer.colors.T, np.asarray(strength)[None]])
    at, size = _channels_at(transfer.values, channels, value)
    low, high = at.copy(), at.copy()
    for end in (least, most):
        found, its = _channels_at(transfer.values, channels, end)
        np.minimum(low, found, out=low)
        np.maximum(high, found, out=high)
        np.maximum(size, its, out=size)
    _with_knots_between(transfer.values, channels, least, most, low, high)
    rounding = LOOKUP * ROUNDOFF * np.maximum(size, high)
    low, high = np.maximum(low - rounding, 0.0), high + rounding
    opacity, thin, dense = (_opacity(transfer, x[3]) for x in (at, low, high))
    thin, dense = thin * (1 - 8 * ROUNDOFF), np.minimum(dense * (1 + 8 * ROUNDOFF), 1.0)
    color, arriving = np.append(at[:3], np.ones((1, len(value))), axis=0), behind.T
    rgba = (1 - opacity) * arriving + opacity * color
    low[3], high[3] = 1.0, 1.0
    contrast = np.maximum(np.abs(low - arriving), np.abs(high - arriving))
    change = np.maximum(dense - opacity, opacity - thin) * contrast
    change += opacity * np.maximum(high - color, color - low) + 4 * ROUNDOFF * np.maximum(color, arriving)
    return np.ascontiguousarray(rgba.T), np.asarray(change.max(axis=0))


def straight_colors(transfer: TransferFunction, values: Floats) -> tuple[Floats, Floats]:
    """Return the straight colours (3, R) of values, and how far rounding may put them off (3, R).

    Examples
    --------
    >>> table = TransferFunction([0, 2], [(0, 0, 1), (1, 0, 0)], [1, 1])
    >>> straight_colors(table, np.array([0.5]))[0].ravel().tolist()
    [0.25, 0.0, 0.75]
    """
    found, size = _channels_at(transfer.values, np.ascontiguousarray(transfer.colors.T), values)
    return found, LOOKUP * ROUNDOFF * size


def _opacity(transfer: TransferFunction, strength: Floats) -> Floats:
    if transfer.extinction is None:
        return np.clip(strength, 0.0, 1.0)
    with np.errstate(over="ignore"):
        return np.asarray(-np.expm1(-(strength * transfer.unit_distance)))


def _channels_at(knots: Floats, channels: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Return the channels (4, R) at values, and the greater size of each at the knots around."""
    above: Indices = np.searchsorted(knots, values, side="right")
    below, above = np.maximum(above - 1, 0), np.minimum(above, len(knots) - 1)
    left, right = channels.take(below, axis=1), channels.take(above, axis=1)
    gap = knots.take(above) - knots.take(below)
    share = np.divide(values - knots.take(below), gap, out=np.zeros(len(values)), where=gap > 0)
    share = np.clip(share, 0.0, 1.0)
    found = np.where(share < 0.5, left + share * (right - left), right - (1 - share) * (right - left))
    return found, np.where((share > 0) & (left != right), np.maximum(left, right), 0.0)


def _with_knots_between(
    knots: Floats, channels: Floats, least: Floats, most: Floats, low: Floats, high: Floats
) -> None:
    """Widen low and high (4, R) by the channels at the knots above `least` and up to `most`, in place."""
    first, last = (np.searchsorted(knots, end, side="right") for end in (least, most))
    some = np.flatnonzero(last > first)
    if len(some) == 0:
        return
    # `reduceat` takes every other pair of ends; a column beyond the last knot lets one end there.
    ends = np.stack([first[some], last[some]], axis=1).ravel()
    padded = np.append(channels, channels[:, -1:], axis=1)
    low[:, some] = np.minimum(low[:, some], np.minimum.reduceat(padded, ends, axis=1)[:, ::2])
    high[:, some] = np.maximum(high[:, some], np.maximum.reduceat(padded, ends, axis=1)[:, ::2])
