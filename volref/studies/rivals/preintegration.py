"""Pre-integrated classification: a table of what a whole segment does, by the values at its ends.

Engel, Kraus and Ertl (2001) take the value as linear between the samples in front and behind; opacity and
premultiplied colour of a segment of fixed length then depend on these two numbers only, and are looked up,
bilinearly, in a table of n x n entries that knows every knot of the transfer function.  El Hajjar, Marchesin,
Dischler and Mongenet (2008) take a parabola through a third sample in the middle.  Here the third
coordinate of its table is the bulge, how far the middle lies above the mean of the ends:

    value    front ___..--o--..___ back          bulge b = middle - (front + back) / 2
                  o      middle   o              value at u in 0..1: front + (back - front) u + 4 b u (1 - u)

with three layers, at -B, 0 and B, the greatest bulge that a step can meet, between which it is linear.

Only a band of the table about front = back is made: no value changes faster than the field's steepest slope.
S segments, R rays; m entries of one diagonal of the table, q parts of a segment.
"""

from dataclasses import dataclass

import numpy as np

from volref.arrays import Floats, Indices
from volref.studies.rivals.gauss import gauss_rule
from volref.studies.rivals.medium import Bundle, Integrator, Medium, paint, sample, steepest_slope
from volref.studies.rivals.uniform import marcher
from volref.workspace import Workspace

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


def preintegrated(medium: Medium, step: float, size: int, order: int) -> Integrator:
    """Integrate by a table of `size` x `size` entries, the value of degree `order` (1 or 2) in a segment.

    The last, shortened segment takes its entry's opacity to the power of its share of the step, and as much
    of the colour: GPUs do the same, and one segment of third order costs nothing.
    """
    table = segment_table(medium, step, size, order)

    def block(rays: Bundle, edges: Floats, work: Workspace) -> tuple[Floats, Floats]:
        length = np.diff(edges, axis=0)
        ends = sample(medium, rays.start, rays.slope, edges, work).copy()
        bulge = None
        if order == 2:
            middle = sample(medium, rays.start, rays.slope, edges[:-1] + length / 2, work)
            bulge = (middle - (ends[:-1] + ends[1:]) / 2).ravel()
        light = look_up(table, ends[:-1].ravel(), ends[1:].ravel(), bulge)
        _shorten(light, (length / step).ravel())
        light = light.reshape(4, *length.shape)
        return 1.0 - light[3], light[:3]

    return marcher(step, block, per_segment=order, at_ends=True)


def _shorten(light: Floats, share: Floats) -> None:
    """Replace the light (4, n) of whole segments by that of the first `share` (n,) of each, in place."""
    short = np.flatnonzero(share < 1)
    whole = np.minimum(light[3, short], 1 - 2.0**-53)
    part = -np.expm1(share[short] * np.log1p(-whole))
    light[:, short] *= np.divide(part, whole, out=np.zeros_like(part), where=whole > 0)


def look_up(table: Segments, front: Floats, back: Floats, bulge: Floats | None) -> Floats:
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


def segment_table(medium: Medium, step: float, size: int, order: int) -> Segments:
    """Return the table of segments of length `step`, for values of degree `order` within them."""
    work = Workspace()
    lattice = entries_along(medium, size)
    most = steepest_slope(medium.volume) * step
    band = int(min(np.ceil(most / lattice.spacing) + 2, size - 1))
    greatest = most / 2 or 1.0
    bulges = (0.0,) if order == 1 else (-greatest, 0.0, greatest)
    entries = np.zeros((4, len(bulges), size, 2 * band + 1))
    for layer, bulge in enumerate(bulges):
        for offset in range(-band, band + 1):
            rows = np.arange(max(0, -offset), min(size, size - offset))
            ends = lattice.at(rows), lattice.at(rows + offset)
            parts = min(max(abs(offset), 1), MOST_PARTS) if bulge == 0 else MOST_PARTS
            light = _segment(medium, lattice, ends, bulge, step, parts, work)
            entries[:, layer, rows, offset + band] = light
    return Segments(lattice, entries, band, greatest)


def entries_along(medium: Medium, size: int) -> Lattice:
    """Return `size` entries over the values of the field, and the integral of the extinction up to each."""
    work = Workspace()
    low, high = medium.volume.value_bounds
    spacing = (high - low) / (size - 1) or 1.0
    values: Floats = low + spacing * np.arange(size, dtype=np.float64)
    knots = np.unique(medium.transfer.values)
    inside = knots[(knots > values[0]) & (knots < values[-1])]
    edges = np.union1d(values, inside)
    rule = gauss_rule(NODES)
    width = np.diff(edges)
    between = np.zeros(len(width))
    for node, weight in zip(rule.nodes, rule.weights, strict=True):
        between += weight * width * paint(medium, edges[:-1] + node * width, work)[1]
    integral = np.concatenate([[0.0], np.cumsum(between)])[np.searchsorted(edges, values)]
    return Lattice(low, spacing, paint(medium, values, work)[1].copy(), integral)


def _segment(
    medium: Medium,
    lattice: Lattice,
    ends: tuple[Floats, Floats],
    bulge: float,
    step: float,
    parts: int,
    work: Workspace,
) -> Floats:
    """Return premultiplied colour and opacity (4, m) of segments between values at their `ends` (m,).

    tau of a part is its length times the mean of sigma over its values, by differences of the integral of
    sigma (Engel et al. 2001), so that no spike of the table is missed.  The colour, by parts,

        C = c(0) - c(1) T(1) + integral of T dc,    T its mean over a part that is taken as homogeneous,

    stays within the range of the colours however thick the parts are.
    """
    u = np.linspace(0.0, 1.0, parts + 1)[:, None]
    line = ends[0] + (ends[1] - ends[0]) * u + 4 * bulge * u * (1 - u)
    # A parabola lies 2/3 bulge / parts^2 above its chords on average.
    depth = step / parts * _mean_extinction(lattice, line + 2 / 3 * bulge / parts**2)
    colors = paint(medium, np.clip(line, *medium.volume.value_bounds), work)[0]
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
