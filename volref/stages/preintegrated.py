"""Pre-integrated classification: a table of what a whole segment does, by the values at its ends.

Engel, Kraus and Ertl (2001) take the value as linear between the samples in front and behind; opacity and
premultiplied colour of a segment of fixed length then depend on these two numbers only, and are looked up,
bilinearly, in a table of n x n entries that knows every knot of the transfer function.  El Hajjar, Marchesin,
Dischler and Mongenet (2008) take a parabola through a third sample in the middle.  Here the third
coordinate of its table is the bulge, how far the middle lies above the mean of the ends:

    value    front ___..--o--..___ back          bulge b = middle - (front + back) / 2
                  o      middle   o              value at u in 0..1: front + (back - front) u + 4 b u (1 - u)

with three layers, at -B, 0 and B, the greatest bulge that a step can meet, between which it is linear.

Where it is known how much a value can change in a segment, only that band about front = back is made.
m entries of one diagonal of the table, q parts of a segment.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from volref.arrays import Floats, Indices

# From values (...) to straight colours (3, ...) and extinctions (...), finite; both may be overwritten later.
Paint: TypeAlias = Callable[[Floats], tuple[Floats, Floats]]

# Parts that the segment of an entry is cut into: one for each entry between its ends, but no more than this;
# a parabola always as many.
MOST_PARTS = 32

# Gauss nodes for the extinction between two neighbouring entries or knots.
NODES = 8

# Values closer than this part of the spacing of entries count as one: the difference of the integrals up to
# them would be rounding.
CLOSE = 1e-4


@dataclass(frozen=True, eq=False)
class Lattice:
    """Entries along one side of a table: values low + i spacing, i < n.

    sigma (n,): extinction there.  integral (n,): of the extinction over the value, from `low`.
    """

    low: float
    spacing: float
    sigma: Floats
    integral: Floats

    def at(self, entry: Indices) -> Floats:
        """Return the values of entries."""
        return np.asarray(self.low + self.spacing * entry, dtype=np.float64)


@dataclass(frozen=True, eq=False)
class Segments:
    """A pre-integrated table: `entries` (4, layers, n, 2 band + 1) of red, green, blue and opacity.

    Column band + j - i of row i is for front value i and back value j.  bulge: that of the last layer.
    """

    lattice: Lattice
    entries: Floats
    band: int
    bulge: float


def preintegrated_table(
    paint: Paint,
    knots: Floats,
    bounds: tuple[float, float],
    length: float,
    size: int,
    *,
    most_change: float | None = None,
    order: int = 1,
) -> Segments:
    """Return the table of segments of one length, for values of degree `order` (1 or 2) within them.

    Parameters
    ----------
    paint
        The transfer function.
    knots
        Values (K,) where it bends or jumps, in any order.
    bounds
        The least and the greatest value of the field.
    length
        World length of a segment.
    size
        Entries along each side of the table, at least 2.
    most_change
        How much a value can change in a segment; the table has no entries beyond.  None: all of `bounds`.

    Examples
    --------
    >>> def ramp(values):
    ...     return np.ones((3, *values.shape)), values
    >>> table = preintegrated_table(ramp, np.array([0.0, 1.0]), (0.0, 1.0), 2.0, 65)
    >>> opacity = look_up(table, np.array([0.25]), np.array([0.75]))[3, 0]
    >>> round(float(-np.log1p(-opacity)), 12)  # length 2 times the mean extinction 1/2
    1.0
    """
    lattice = entries_along(paint, knots, bounds, size)
    most = lattice.spacing * (size - 1) if most_change is None else most_change
    band = int(min(np.ceil(most / lattice.spacing) + 2, size - 1))
    greatest = most / 2 or 1.0
    bulges = (0.0,) if order == 1 else (-greatest, 0.0, greatest)
    entries = np.zeros((4, len(bulges), size, 2 * band + 1))
    for layer, bulge in enumerate(bulges):
        for offset in range(-band, band + 1):
            rows = np.arange(max(0, -offset), min(size, size - offset))
            ends = lattice.at(rows), lattice.at(rows + offset)
            parts = min(max(abs(offset), 1), MOST_PARTS) if bulge == 0 else MOST_PARTS
            light = _segment(paint, bounds, lattice, ends, bulge, length / parts, parts)
            entries[:, layer, rows, offset + band] = light
    return Segments(lattice, entries, band, greatest)


def entries_along(paint: Paint, knots: Floats, bounds: tuple[float, float], size: int) -> Lattice:
    """Return `size` entries over the values of the field, and the integral of the extinction up to each."""
    low, high = bounds
    spacing = (high - low) / (size - 1) or 1.0
    values: Floats = low + spacing * np.arange(size, dtype=np.float64)
    inside = knots[(knots > values[0]) & (knots < values[-1])]
    edges = np.union1d(values, inside)
    nodes, weights = np.polynomial.legendre.leggauss(NODES)
    width = np.diff(edges)
    between = np.zeros(len(width))
    for node, weight in zip((nodes + 1) / 2, weights / 2, strict=True):
        between += weight * width * paint(edges[:-1] + node * width)[1]
    integral = np.concatenate([[0.0], np.cumsum(between)])[np.searchsorted(edges, values)]
    return Lattice(low, spacing, paint(values)[1].copy(), integral)


def look_up(table: Segments, front: Floats, back: Floats, bulge: Floats | None = None) -> Floats:
    """Return premultiplied colour and opacity (4, n) of segments: bilinear, and linear in the bulge."""
    _, layers, size, width = table.entries.shape
    row, along = _cell(table.lattice, front, size)
    column, across = _cell(table.lattice, back, size)
    place = row * width + np.clip(column - row, 1 - table.band, table.band - 1) + table.band
    corners = [
        (place, (1 - along) * (1 - across)),
        (place + 1, (1 - along) * across),
        (place + width - 1, along * (1 - across)),
        (place + width, along * across),
    ]
    if bulge is not None:
        bent = np.minimum(np.abs(bulge) / table.bulge, 1.0)
        outer = np.where(bulge < 0, 0, layers - 1) * (size * width)
        middle = layers // 2 * size * width
        corners = [(at + outer, weight * bent) for at, weight in corners] + [
            (at + middle, weight * (1 - bent)) for at, weight in corners
        ]
    light = np.zeros((4, len(front)))
    for at, weight in corners:
        for out, channel in zip(light, table.entries.reshape(4, -1), strict=True):
            out += weight * channel.take(at)
    return light


def _cell(lattice: Lattice, value: Floats, size: int) -> tuple[Indices, Floats]:
    """Return the entry below each value, and how far it lies towards the next, 0..1."""
    place = np.clip((value - lattice.low) / lattice.spacing, 0.0, size - 1.0)
    entry = np.minimum(place.astype(np.intp), size - 2)
    return entry, place - entry


def _segment(
    paint: Paint,
    bounds: tuple[float, float],
    lattice: Lattice,
    ends: tuple[Floats, Floats],
    bulge: float,
    length: float,
    parts: int,
) -> Floats:
    """Return premultiplied colour and opacity (4, m) of segments of `parts` of one `length` each.

    `ends` are the values (m,) in front and behind.

    tau of a part is its length times the mean of sigma over its values, by differences of the integral of
    sigma (Engel et al. 2001), so that no spike of the table is missed.  The colour, by parts,

        C = c(0) - c(1) T(1) + integral of T dc,    T its mean over a part that is taken as homogeneous,

    stays within the range of the colours however thick the parts are.
    """
    u = np.linspace(0.0, 1.0, parts + 1)[:, None]
    line = ends[0] + (ends[1] - ends[0]) * u + 4 * bulge * u * (1 - u)
    # A parabola lies 2/3 bulge / parts^2 above its chords on average.
    depth = length * _mean_extinction(lattice, line + 2 / 3 * bulge / parts**2)
    colors = paint(np.clip(line, *bounds))[0]
    through = np.concatenate([np.zeros((1, depth.shape[1])), np.cumsum(depth, axis=0)])
    transmittance = np.exp(-through)
    mean = np.divide(-np.expm1(-depth), depth, out=np.ones_like(depth), where=depth > 0) * transmittance[:-1]
    light = np.empty((4, depth.shape[1]))
    light[:3] = (
        colors[:, 0] - colors[:, -1] * transmittance[-1] + (mean * np.diff(colors, axis=1)).sum(axis=1)
    )
    light[3] = -np.expm1(-through[-1])
    return np.maximum(light, 0.0)


def _mean_extinction(lattice: Lattice, line: Floats) -> Floats:
    """Return the mean extinction over the values from each row of `line` (q + 1, m) to the next, (q, m)."""
    size = len(lattice.sigma)
    entry, x = _cell(lattice, line, size)
    first, second = lattice.sigma[entry], lattice.sigma[entry + 1]
    area, next_area = lattice.integral[entry], lattice.integral[entry + 1]
    integral = area + (next_area - area) * x + lattice.spacing * (second - first) * (x * x - x) / 2
    sigma = first + (second - first) * x
    value = lattice.low + lattice.spacing * (entry + x)  # held to the lattice
    rise, area = np.diff(value, axis=0), np.diff(integral, axis=0)
    close = np.abs(rise) < CLOSE * lattice.spacing
    mean = np.where(close, (sigma[:-1] + sigma[1:]) / 2, area / np.where(close, 1.0, rise))
    return np.maximum(mean, 0.0)
