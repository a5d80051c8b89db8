"""What samples may find: the textures of a program, sampled at places that are known up to a radius.

n points.  Positions are (3, n) in texture space, their radius (n,) holds for each axis.  Colours are (4, n):
straight red, green, blue, and the table's alpha.

A value v is known up to r.  Over v - r ... v + r the table runs through one curve of colour and alpha, which
share one place in it: they are kept together, as the two ends of the curve's chord and the spread around the
chord, not as a box of their ranges, which can be almost twice as wide.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from volref.arrays import Floats, Indices, Integers
from volref.emulation.textures.lookup import Textures
from volref.emulation.textures.uploads import table_place
from volref.oracle.intervals.fetching import fetched
from volref.oracle.intervals.slack import Slack
from volref.oracle.intervals.slopes import Slopes
from volref.stages.textures import fetch
from volref.workspace import Workspace

# Roundings in a fetch from a table, and in the multiplications after it.
ROUNDINGS = 6


class Reach(NamedTuple):
    """What samples may find: ends (2, 4, n) of the chord of colours, and how far beside it (4, n) they lie.

    value, radius (n,): the value itself.  gradient (3, n) and magnitude (n,) with their radii, where the
    texture holds gradients.
    """

    ends: Floats
    spread: Floats
    value: Floats
    radius: Floats
    gradient: Floats | None = None
    magnitude: Floats | None = None
    gradient_radius: Floats | None = None

    def take(self, at: Indices) -> "Reach":
        """Return some of them."""
        more = (
            None if one is None else np.take(one, at, axis=-1)
            for one in (self.gradient, self.magnitude, self.gradient_radius)
        )
        return Reach(*(np.take(one, at, axis=-1) for one in self[:4]), *more)


@dataclass(frozen=True, eq=False)
class Finder:
    """Textures of a program, how steep they are, and how far a machine may be off."""

    textures: Textures
    slack: Slack
    srgb: float = 0.0

    @cached_property
    def volume(self) -> Slopes:
        """Slopes of the volume's texture."""
        return Slopes(self.textures.volume)

    @cached_property
    def table(self) -> Slopes:
        """Slopes of the table's texture."""
        return Slopes(self.textures.table)

    @cached_property
    def entries(self) -> Floats:
        """Entries (4, size) of a table of one row."""
        return np.ascontiguousarray(self.textures.table.texels[0].T.astype(np.float64))

    @cached_property
    def visible(self) -> Integers:
        """How many of the first k entries of a table of one row have an opacity (size + 1,)."""
        return np.concatenate([[0], np.cumsum(self.entries[3] != 0)])

    @cached_property
    def brightest(self) -> float:
        """The largest size of a colour in the table, at least 1."""
        return max(1.0, float(np.abs(self.textures.table.texels[..., :3]).max(initial=0.0)))

    @cached_property
    def padded(self) -> tuple[Floats, Floats]:
        """Entries (4, size + 2) with the outer ones twice, and the steps from each to the next."""
        entries = np.pad(self.entries, ((0, 0), (1, 1)), mode="edge")
        return entries, np.diff(entries, axis=1, append=entries[:, -1:])

    @cached_property
    def ranges(self) -> tuple[Floats, Floats]:
        """Least and greatest entries (levels, 4, size) of runs of 2^level entries from each on."""
        lows, highs = [self.entries], [self.entries]
        size, run = self.entries.shape[1], 1
        while 2 * run <= size:
            later = np.minimum(np.arange(size) + run, size - 1)
            lows.append(np.minimum(lows[-1], lows[-1][:, later]))
            highs.append(np.maximum(highs[-1], highs[-1][:, later]))
            run *= 2
        return np.array(lows), np.array(highs)


def classified(finder: Finder, value: Floats, radius: Floats, work: Workspace) -> tuple[Floats, Floats]:
    """Return ends (2, 4, n) and spread (4, n) of the table's colours for values (n,) up to radii (n,)."""
    switches, table = finder.textures.pipeline.table, finder.textures.table
    size = table.sizes[0]
    off = radius + 2 * finder.slack.values + (finder.slack.weight / size if table.filter == "linear" else 0.0)
    wide = value.astype(np.float64, copy=False)
    places = [table_place(switches, wide - off), table_place(switches, wide + off)]
    if table.filter == "linear" and table.weight_bits is None:
        ends = _between_entries(finder, places)
    else:
        half = np.full(len(value), 0.5)
        ends = np.stack([fetch(table, (place, half), work) for place in places])
    # Opacities of 0 are exactly that; what a colour is off by counts with its opacity.
    spread = np.full(ends[0].shape, ROUNDINGS * finder.slack.values * finder.brightest)
    spread[3] = ROUNDINGS * finder.slack.values * np.maximum(np.abs(ends[0, 3]), np.abs(ends[1, 3]))
    if finder.srgb:
        spread[:3] += finder.srgb
    low, high = (place * size - 0.5 for place in places)
    if table.filter == "nearest":
        low, high = np.floor(low + 0.5), np.floor(high + 0.5)
        crossed = np.flatnonzero(high > low)
        first, last = low, high
    else:
        first, last = np.ceil(low), np.floor(high)
        crossed = np.flatnonzero(last >= first)
    if len(crossed):
        bounds = first[crossed], last[crossed], low[crossed], high[crossed]
        spread[:, crossed] += _beside(finder, bounds, ends[:, :, crossed], linear=table.filter == "linear")
    if table.weight_bits is not None:
        # Each channel is a staircase of its own between the ends: nothing is known of the way there.
        middle = (ends[0] + ends[1]) / 2
        spread += np.abs(ends[1] - ends[0]) / 2
        ends = np.stack([middle, middle])
    return ends, spread


def _between_entries(finder: Finder, places: list[Floats]) -> Floats:
    """Return a linear table's colours (2, 4, n) at two places each, the first not after the second.

    Most pairs lie between the same two entries, which are then fetched once.
    """
    entries, steps = finder.padded
    size = finder.entries.shape[1]
    low, high = (np.clip(place, 0.0, 1.0) * size + 0.5 for place in places)
    cell = low.astype(np.intp)
    first, second = low - cell, high - cell
    base, step = np.take(entries, cell, axis=1), np.take(steps, cell, axis=1)
    ends = np.empty((2, *base.shape))
    for weight, end in ((first, ends[0]), (second, ends[1])):
        np.multiply(step, weight, out=end)
        end += base
    further = np.flatnonzero(second > 1)
    if len(further):
        at = high[further].astype(np.intp)
        ends[1][:, further] = entries[:, at] + steps[:, at] * (high[further] - at)
    return ends


def _beside(
    finder: Finder, bounds: tuple[Floats, Floats, Floats, Floats], ends: Floats, *, linear: bool
) -> Floats:
    """Return how far (4, n) entries `first` to `last` lie beside the chord between places low and high."""
    size = finder.entries.shape[1]
    first, last = (np.clip(bound, 0, size - 1).astype(np.intp) for bound in bounds[:2])
    low, high = bounds[2:]
    whole = ends[1] - ends[0]
    with np.errstate(divide="ignore", invalid="ignore"):
        along = np.where(high > low, np.clip((bounds[0] - low) / (high - low), 0, 1), 0.5)
    one: Floats = np.abs(finder.entries[:, first] - (ends[0] + along * whole))
    more = np.flatnonzero((last > first) | (not linear))
    if len(more):
        level = np.floor(np.log2(last[more] - first[more] + 1)).astype(np.intp)
        start = last[more] - (1 << level) + 1
        lows, highs = finder.ranges
        least = np.minimum(lows[level, :, first[more]], lows[level, :, start]).T
        most = np.maximum(highs[level, :, first[more]], highs[level, :, start]).T
        middle = ends[0][:, more] + 0.5 * whole[:, more]
        one[:, more] = np.maximum(most - middle, middle - least)
    return np.maximum(one, 0.0)


def classified_2d(
    finder: Finder, value: Floats, radius: Floats, magnitude: Floats, reach: Floats, work: Workspace
) -> tuple[Floats, Floats]:
    """Return the same of a table of values and gradient magnitudes (n,), these up to `reach` (n,)."""
    switches, slopes = finder.textures.pipeline.table, finder.table
    place = table_place(switches, value)
    off = np.maximum(radius, reach) + 2 * finder.slack.values
    found, beside = fetched(slopes, [place, magnitude], off, finder.slack, work)
    return np.stack([found, found]), beside


def value_of(finder: Finder, channels: Floats, off: Floats) -> tuple[Floats, Floats]:
    """Return values (n,) that channels stand for, and how far they may be off."""
    if finder.textures.pipeline.volume.format != "unorm16-split":
        return channels[0], off[0]
    high, low = 65280 / 65535, 255 / 65535
    return channels[0] * high + channels[1] * low, off[0] * high + off[1] * low + 2 * finder.slack.values


def joined(one: Reach, other: Reach, at: Indices) -> Reach:
    """Return `one` with what `other`, of the samples `at` alone, may find too."""
    middle = (one.ends[0][:, at] + one.ends[1][:, at]) / 2
    reach = [np.abs(end - middle) + other.spread for end in other.ends]
    spread = one.spread.copy()
    spread[:, at] = np.maximum(one.spread[:, at], np.maximum(*reach))
    radius = one.radius.copy()
    radius[at] = np.maximum(radius[at], np.abs(other.value - one.value[at]) + other.radius)
    return one._replace(spread=spread, radius=radius)
