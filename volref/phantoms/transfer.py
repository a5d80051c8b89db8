"""Transfer functions for made-up fields; extinctions are per world unit.

`low` and `high` are the values at the ends of a table, `extinction` its largest extinction.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from volref.arrays import Floats, number, whole_number
from volref.scene import TransferFunction

# Colours from cold to hot at fractions of the table.
_HUES = (0.0, 0.3, 0.6, 1.0)
_RED, _GREEN, _BLUE = (0.1, 0.9, 0.9, 1.0), (0.2, 0.3, 0.8, 0.9), (0.8, 0.2, 0.1, 0.7)

# Extinction, as a share of the largest, at fractions of the table: empty below 0.15.
_SHARES_AT, _SHARES = (0.0, 0.15, 0.35, 0.55, 0.8, 1.0), (0.0, 0.0, 0.15, 0.4, 1.0, 1.0)

# Reflectivity from 5 dBZ on in steps of 5, 8-bit codes as the National Weather Service has them.
_REFLECTIVITY = (
    *((4, 233, 231), (1, 159, 244), (3, 0, 244), (2, 253, 2), (1, 197, 1), (0, 142, 0), (253, 248, 2)),
    *((229, 188, 0), (253, 149, 0), (253, 0, 0), (212, 0, 0), (188, 0, 0), (248, 0, 253), (152, 84, 198)),
    (253, 253, 253),
)


def grey_ramp(low: float = 0.0, high: float = 1.0, extinction: float = 1.0) -> TransferFunction:
    """Return black to white and clear to `extinction`, linear, two knots.

    Examples
    --------
    >>> grey_ramp(0, 255, 0.5).knot_extinction.tolist()
    [0.0, 0.5]
    """
    return TransferFunction([low, high], [(0, 0, 0), (1, 1, 1)], [0.0, extinction])


def two_colors(low: float = 0.0, high: float = 1.0, extinction: float = 0.8) -> TransferFunction:
    """Return a table without interior knots whose colour and extinction both run: 1/4 to the whole."""
    return TransferFunction([low, high], [(0.9, 0.1, 0.2), (0.1, 0.6, 1.0)], [extinction / 4, extinction])


def few_knots(low: float = 0.0, high: float = 1.0, extinction: float = 0.12) -> TransferFunction:
    """Return a table as people draw them: eight knots, clear in the lowest 15 %, bends seen by every ray."""
    at = np.union1d(_HUES, _SHARES_AT)
    return _table(low, high, at, np.interp(at, _SHARES_AT, _SHARES) * extinction)


def smooth_curve(at: Floats) -> Floats:
    """Return the share of the largest extinction (0 to 1) at fractions `at` of the table.

    (1 - cos(pi u)) / 2 with u = (at - 0.15) / 0.85, 0 below: continuous with a continuous slope.
    """
    u = np.clip((at - 0.15) / 0.85, 0.0, 1.0)
    return np.asarray((1 - np.cos(np.pi * u)) / 2)


def smooth(
    low: float = 0.0, high: float = 1.0, extinction: float = 0.12, *, knots: int = 33
) -> TransferFunction:
    """Return `smooth_curve` at `knots` equally spaced knots."""
    at = np.linspace(0.0, 1.0, whole_number("knots", knots, low=2, high=65536))
    return _table(low, high, at, smooth_curve(at) * extinction)


def smooth_curve_256(low: float = 0.0, high: float = 1.0, extinction: float = 0.12) -> TransferFunction:
    """Return `smooth_curve` at 256 knots: a slope change at every entry, the dear case of exact methods."""
    return smooth(low, high, extinction, knots=256)


def spiky(low: float = 0.0, high: float = 1.0, voxel: float = 1.0) -> TransferFunction:
    """Return a stiff table: three spikes 1, 2 and 1 entries wide to either side, of 256 entries, else clear.

    Their extinctions are 1e4, 50 and 1e3 per voxel; `voxel` is its world length, so that the table's
    extinction is those divided by `voxel`.  A march with half a voxel per step misses the first one on
    every other ray.

    Examples
    --------
    >>> table = spiky(0, 255, voxel=2.0)
    >>> table.knot_extinction[59:62].tolist(), table.knot_extinction[119:122].tolist()
    ([0.0, 5000.0, 0.0], [12.5, 25.0, 12.5])
    """
    length = number("voxel", voxel, above=0)
    entry = np.arange(256)
    extinction = np.zeros(256)
    for center, peak, width in ((60, 1e4, 1), (120, 50.0, 2), (200, 1e3, 1)):
        share = np.clip(1 - np.abs(entry - center) / width, 0.0, 1.0)
        extinction = np.maximum(extinction, peak / length * share)
    return _table(low, high, entry / 255, extinction)


def jump(at: float, color: ArrayLike = (1.0, 0.6, 0.3), extinction: float = 0.3) -> TransferFunction:
    """Return one colour and one extinction below the value `at`, clear from there on: cuts out a ball.

    Examples
    --------
    >>> jump(4.0).values.tolist(), jump(4.0).knot_extinction.tolist()
    ([4.0, 4.0], [0.3, 0.0])
    """
    return steps([at], [color], [extinction])


def steps(
    edges: Sequence[float], colors: Sequence[ArrayLike], extinctions: Sequence[float]
) -> TransferFunction:
    """Return constant parts: part k holds below edges[k] and from edges[k - 1] on; clear beyond the last.

    On a distance field (`fields.sphere`) with the radii as edges, these are the shells of
    `closed.concentric_shells`; on `fields.squared_distance` the edges are their squares.

    Examples
    --------
    >>> steps([1, 2], [(1, 0, 0), (0, 1, 0)], [0.5, 3.0]).knot_extinction.tolist()
    [0.5, 3.0, 3.0, 0.0]
    """
    paints = np.asarray(colors, dtype=np.float64)
    inside = np.asarray(extinctions, dtype=np.float64)
    below = np.arange(len(edges))
    above = np.minimum(below + 1, len(edges) - 1)
    beyond = np.append(inside[1:], 0.0)
    return TransferFunction(
        np.repeat(np.asarray(edges, dtype=np.float64), 2),
        np.stack([paints[below], paints[above]], axis=1).reshape(-1, 3),
        np.stack([inside, beyond], axis=1).ravel(),
    )


def dbz_transfer(extinction: float = 1e-3, *, banded: bool = True) -> TransferFunction:
    """Return the usual colours of radar reflectivity (dBZ): those of the US National Weather Service.

    The colours are screen codes over 255: write images of them with encoding "none".

    Bands of 5 dBZ from 5 to 75 and above: blue, green, yellow, red, purple, white.  `banded=False` runs from
    the colour of one band's beginning to the next's.  Below 5 dBZ, and so where there is no echo, nothing is
    seen; from there the extinction grows with the square of the distance to 5 dBZ, up to `extinction` per
    world unit at 75, so that drizzle is a veil and hail is solid.  The default is for metres: half of the
    light is lost in 3.8 km of 35 dBZ, and in 0.7 km of 75.

    Examples
    --------
    >>> transfer = dbz_transfer()
    >>> transfer.is_visible([-32.0, 5.0], [4.9, 5.1]).tolist(), transfer.units
    ([False, True], 'dBZ')
    """
    start = 5.0 + 5.0 * np.arange(len(_REFLECTIVITY))
    colors = np.array(_REFLECTIVITY) / 255
    share = ((start - 5.0) / 70.0) ** 2
    if not banded:
        return TransferFunction(start, colors, extinction * share, units="dBZ")
    # Two knots at each band's beginning: the colour jumps, the extinction does not.
    return TransferFunction(
        np.repeat(start, 2)[1:],
        np.repeat(colors, 2, axis=0)[:-1],
        extinction * np.repeat(share, 2)[1:],
        units="dBZ",
    )


def _table(low: float, high: float, at: Floats, extinction: Floats) -> TransferFunction:
    colors = np.stack([np.interp(at, _HUES, channel) for channel in (_RED, _GREEN, _BLUE)], axis=1)
    return TransferFunction(low + (high - low) * at, colors, extinction)
