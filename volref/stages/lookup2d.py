"""Stage 4, where the gradient counts: tables of value and gradient magnitude, and factors of the opacity.

n samples; values and magnitudes are (n,), colours (3, n), all in float64.  The texel rule, for a table of
n columns over a domain from a to b (rows likewise):

    |--0--|--1--|--2--|--3--|      place = (value - a) / (b - a) n - 1/2, held to 0 .. n - 1;
    a                       b      for n = 4 over 0..8, value 4 lies at 1.5 and value 0 at 0
"""

import numpy as np

from volref.arrays import Floats, Indices
from volref.scene.transfer import TransferFunction
from volref.scene.transfer2d import TransferFunction2D


def lookup_2d(table: TransferFunction2D, values: Floats, magnitudes: Floats) -> tuple[Floats, Floats]:
    """Return straight colours (3, n) and opacities per unit distance (n,), bilinear between the entries.

    Across columns first, then between the two rows: each time below + part (above - below), which is exact
    where both are equal.  Its rounding leaves 0..1 nowhere: part is less than 1 by at least as much as the
    difference can be too large.

    Examples
    --------
    >>> rgba = np.zeros((2, 4, 4))
    >>> rgba[1, :, 3] = [0.0, 0.2, 0.4, 0.6]
    >>> table = TransferFunction2D(rgba, (0, 8), (0, 2))
    >>> lookup_2d(table, np.array([4.0, 4.0, 9.0]), np.array([1.0, 5.0, 1.5]))[1].round(12).tolist()
    [0.15, 0.3, 0.6]
    """
    rows, columns = table.rgba.shape[:2]
    left, across = _place(values, table.value_domain, columns)
    low, up = _place(magnitudes, table.magnitude_domain, rows)
    right, high = np.minimum(left + 1, columns - 1), np.minimum(low + 1, rows - 1)
    channels = np.empty((4, len(values)))
    for channel, out in zip(table.rgba.reshape(-1, 4).T, channels, strict=True):
        below = _mix(channel[low * columns + left], channel[low * columns + right], across)
        above = _mix(channel[high * columns + left], channel[high * columns + right], across)
        out[:] = _mix(below, above, up)
    return channels[:3], channels[3]


def gradient_factor(transfer: TransferFunction, magnitudes: Floats) -> Floats:
    """Return by what the extinction or opacity is multiplied where the gradient has these magnitudes (n,).

    1 everywhere where the transfer function has no gradient opacity.  At a jump the later factor holds from
    the magnitude on.

    Examples
    --------
    >>> edges = ([0, 10, 10], [0, 0.5, 1])
    >>> transfer = TransferFunction([0], [(1, 1, 1)], [2.0], gradient_opacity=edges)
    >>> gradient_factor(transfer, np.array([0.0, 5.0, 9.0, 10.0, 99.0])).tolist()
    [0.0, 0.25, 0.45, 1.0, 1.0]
    """
    if transfer.gradient_opacity is None:
        return np.ones(len(magnitudes))
    at, factors = transfer.gradient_opacity
    after = np.searchsorted(at, magnitudes, side="right")
    low, high = np.maximum(after - 1, 0), np.minimum(after, len(at) - 1)
    width = at[high] - at[low]
    part = np.divide(magnitudes - at[low], width, out=np.zeros(len(magnitudes)), where=width > 0)
    return _mix(factors[low], factors[high], part)


def _place(x: Floats, domain: tuple[float, float], count: int) -> tuple[Indices, Floats]:
    """Return the entry at or before each x, and which part of the way to the next it lies."""
    first, last = domain
    place = np.clip((x - first) / (last - first) * count - 0.5, 0.0, count - 1.0)
    entry = place.astype(np.intp)
    return entry, place - entry


def _mix(below: Floats, above: Floats, part: Floats) -> Floats:
    return np.asarray(below + part * (above - below))
