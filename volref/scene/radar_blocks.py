"""Where something of a radar may be seen: blocks of the world, for leaving out what is transparent.

A point takes its value from gates of two neighbouring sweeps, and a point on a sweep from that one alone.
So gates are gathered in bins of range and azimuth, and over each column of blocks lie, one above the other,

    sweep s + 1   ------------------      the pair: seen if the values of its bins in both sweeps may show
                                          the same below and above
    sweep s       ------------------      the sheet: seen if those of the one sweep may show

of which the column's blocks take what lies at their heights.  Every range is taken a little too wide.

A azimuths and J ranges of bins; by, bx columns; bz blocks of a column.
"""

import math
from collections.abc import Callable, Iterator
from typing import NamedTuple, TypeAlias
from weakref import WeakKeyDictionary

import numpy as np

from volref.arrays import Booleans, Floats, Indices, Vector
from volref.scene.beams import EFFECTIVE_RADIUS, slant_of_ground, world_of_beam
from volref.scene.radar import RadarVolume
from volref.scene.sweep import Sweep

# Bins of azimuth, one degree each, and at most so many of range, from the antenna to the farthest gate.
BEARINGS, MOST_RINGS = 360, 320

# Blocks are two gates long and wide, or that many times larger that there are no more than so many along x
# and y, without the layer around them; along z there are a quarter as many.
GATES_A_SIDE, MOST_BLOCKS = 2, 256

# How high blocks are at least, as a part of their width.
LEAST_HEIGHT = 1e-3

# Distances along the ground at which the height and range of beams are known.
PLACES = 1024

# A look-up may take a block that is this part of a block away.
ROUNDED_BLOCK = 1e-3

# Azimuths, elevations (degrees) and gates are looked up with a slack of 1e-9 and rounded below that;
# lengths are rounded to this part of the farthest range, and of the antenna's distance from the origin.
SLACK, ROUNDED = 1e-6, 1e-9

# The flag of ranges of values from the first to the second array.
Flag: TypeAlias = Callable[[Floats, Floats], Booleans]


class RadarBlocks(NamedTuple):
    """Flags (bz, by, bx) of blocks of `size` (x, y, z), metres; the corner of the first is at `low`."""

    seen: Booleans
    low: Vector
    size: Vector


class RadarBins(NamedTuple):
    """Flags (S, A, J) of bins of range, each `ring` metres long, and azimuth, on and above each sweep."""

    seen: Booleans
    ring: float

    def show(self, sweep: Indices, slant: Floats, azimuth: Floats) -> Booleans:
        """Tell of points (n,) with `sweep` at or below them whether anything may be seen there.

        Their slant ranges and azimuths (0 to 360) may be rounded: bins are a little wider than they say.
        """
        _, bearings, rings = self.seen.shape
        place = sweep * bearings
        place += (azimuth * (bearings / 360.0)).astype(np.intp)
        place *= rings
        place += np.minimum(slant * (1 / self.ring), rings - 1).astype(np.intp)
        return np.asarray(self.seen.reshape(-1).take(place))


class _Ranges(NamedTuple):
    """Least and greatest value (S, A, J) of what the gates of each sweep show in a bin; NaN: no data."""

    least: Floats
    greatest: Floats


class _Columns(NamedTuple):
    """Columns (by bx,), a bit wider: first bearing, the one after the last, nearest and farthest place."""

    first: Indices
    end: Indices
    near: Indices
    far: Indices


_KEPT: WeakKeyDictionary[RadarVolume, _Ranges] = WeakKeyDictionary()


def flag_radar(radar: RadarVolume, reach: float, flag: Flag) -> RadarBlocks:
    """Return the blocks of the world, around all that can be seen, that have anything flagged within `reach`.

    `flag` takes the least and greatest of the values (n,) that make a point's, and says of each such range
    whether anything in it may be seen.

    Examples
    --------
    >>> gates = np.array([[-np.inf] * 6 + [30.0, -np.inf]] * 4)
    >>> radar = RadarVolume([Sweep([0, 90, 180, 270], e, gates, 500, 1000) for e in (0, 30)])
    >>> blocks = flag_radar(radar, 10.0, lambda low, high: high > 20)
    >>> middle, east = (int((x - blocks.low[0]) / blocks.size[0]) for x in (0.0, 6500.0))
    >>> row, bottom = int(-blocks.low[1] / blocks.size[1]), int(-blocks.low[2] / blocks.size[2])
    >>> blocks.seen[bottom, row, [middle, east]].tolist()
    [False, True]
    """
    low, high = radar.box
    across = (high[0] - low[0]) / (GATES_A_SIDE * radar.gate_length)
    count = math.ceil(min(max(across, 2), MOST_BLOCKS))
    size = (high - low) / (count, count, max(count // 4, 1))
    # The box of a single level sweep has no height to speak of.
    size[2] = max(size[2], LEAST_HEIGHT * size[0])
    low = low - size
    shape = max(count // 4, 1) + 2, count + 2, count + 2
    farthest, ring = _rings(radar)
    rounded = ROUNDED * farthest + 1e-12 * float(np.abs(radar.origin).max())
    reaches = reach + ROUNDED_BLOCK * size + rounded
    places = np.linspace(0.0, float(np.hypot(*(high - low)[:2])), PLACES)
    columns = _columns(low - radar.origin, size, reaches, places[1], shape[1:])
    # How many flagged layers begin, less how many end, at each block.
    begins = np.zeros((shape[0] + 1, shape[1] * shape[2]), np.int16)
    for low_tilt, high_tilt, flagged in _layers(radar, flag):
        if not flagged.any():
            continue
        tilts = max(low_tilt - SLACK, -90.0), min(high_tilt + SLACK, 90.0)
        heights, ranges = _reached(tilts, places, columns, radar.beam)
        bins = ranges[0] / ring, ranges[1] / ring
        shown = np.flatnonzero(_any_flagged(flagged, columns, bins))
        base = low[2] - radar.origin[2]
        first, last = (
            np.clip((height.take(shown) + way * reaches[2] - base) / size[2], 0, shape[0] - 1).astype(np.intp)
            for height, way in zip(heights, (-1, 1), strict=True)
        )
        begins[first, shown] += 1
        begins[last + 1, shown] -= 1
    seen = np.cumsum(begins[:-1], axis=0, dtype=np.int16, out=begins[:-1]) > 0
    return RadarBlocks(seen.reshape(shape), _vector(low), _vector(size))


def flag_bins(radar: RadarVolume, flag: Flag) -> RadarBins:
    """Return the bins in which a value may be flagged, on a sweep or between it and the next one.

    Examples
    --------
    >>> gates = np.array([[-np.inf] * 6 + [30.0, -np.inf]] * 4)
    >>> radar = RadarVolume([Sweep([0, 90, 180, 270], e, gates, 500, 1000) for e in (0, 30)])
    >>> flag_bins(radar, lambda low, high: high > 20).seen[0, 0].tolist()
    [False, False, False, False, False, True, True, True]
    """
    layers = [flagged for _, _, flagged in _layers(radar, flag)]
    sheets, pairs = layers[::2], [*layers[1::2], np.zeros_like(layers[0])]
    return RadarBins(np.stack(sheets) | np.stack(pairs), _rings(radar)[1])


def _vector(values: Floats) -> Vector:
    x, y, z = values.tolist()
    return x, y, z


def _columns(low: Floats, size: Floats, reach: Floats, apart: float, shape: tuple[int, ...]) -> _Columns:
    """Return where columns lie as seen from the antenna, `low` being counted from there."""
    sides = [
        low[axis] + size[axis] * np.arange(count) - reach[axis]
        for axis, count in ((0, shape[1]), (1, shape[0]))
    ]
    west, south = np.meshgrid(*sides)
    east, north = west + size[0] + 2 * reach[0], south + size[1] + 2 * reach[1]
    nearest = np.hypot(np.maximum(np.maximum(west, -east), 0.0), np.maximum(np.maximum(south, -north), 0.0))
    furthest = np.hypot(np.maximum(-west, east), np.maximum(-south, north))
    middle = np.degrees(np.arctan2(west + east, south + north))
    # Seen from outside, a rectangle's corners are its outermost bearings.
    turns = np.stack([np.degrees(np.arctan2(x, y)) - middle for x in (west, east) for y in (south, north)])
    turns = (turns + 180.0) % 360.0 - 180.0
    around = nearest == 0
    begin = np.where(around, 0.0, (middle + turns.min(axis=0) - SLACK) % 360.0)
    width = np.where(around, 360.0, np.ptp(turns, axis=0) + 2 * SLACK)
    first = np.minimum(begin * (BEARINGS / 360.0), BEARINGS - 1).astype(np.intp)
    end = np.minimum(((begin + width) * (BEARINGS / 360.0)).astype(np.intp) + 1, first + BEARINGS)
    return _Columns(
        first.ravel(),
        end.ravel(),
        (nearest / apart).astype(np.intp).ravel(),
        np.minimum((furthest / apart).astype(np.intp) + 1, PLACES - 1).ravel(),
    )


def _layers(radar: RadarVolume, flag: Flag) -> Iterator[tuple[float, float, Booleans]]:
    """Yield the lowest and highest elevation and the flags (A, J) of the bins of each sheet and each pair."""
    sweeps, ranges = radar.sweeps, _ranges(radar)
    tilts = [(float(sweep.elevations.min()), float(sweep.elevations.max())) for sweep in sweeps]
    for s, (low, high) in enumerate(tilts):
        yield low, high, _flagged(ranges.least[s], ranges.greatest[s], radar.no_echo, flag)
        if s + 1 < len(sweeps):
            # NaN, and not flagged, where either has no data.
            least = np.minimum(*ranges.least[s : s + 2])
            greatest = np.maximum(*ranges.greatest[s : s + 2])
            yield low, tilts[s + 1][1], _flagged(least, greatest, radar.no_echo, flag)


def _flagged(least: Floats, greatest: Floats, no_echo: float | None, flag: Flag) -> Booleans:
    """Return the flags of bins, of those without any echo, which are most, by asking once."""
    flags = ~np.isnan(least)
    if no_echo is not None:
        silent, nothing = (least == no_echo) & (greatest == no_echo), np.array([no_echo])
        flags &= ~silent
        flags[flags] = flag(least[flags], greatest[flags])
        flags |= silent & flag(nothing, nothing)
        return flags
    flags[flags] = flag(least[flags], greatest[flags])
    return flags


def _ranges(radar: RadarVolume) -> _Ranges:
    """Return the ranges of values in all bins, made once for each radar."""
    if radar not in _KEPT:
        farthest, ring = _rings(radar)
        edges = np.arange(round(farthest / ring) + 1.0) * ring
        parts = [_binned(sweep, radar.no_echo, edges) for sweep in radar.sweeps]
        _KEPT[radar] = _Ranges(*(np.stack(part) for part in zip(*parts, strict=True)))
    return _KEPT[radar]


def _rings(radar: RadarVolume) -> tuple[float, float]:
    """Return the farthest range, and how long bins of range are."""
    farthest = max(sweep.last_range for sweep in radar.sweeps)
    return farthest, farthest / math.ceil(min(farthest / radar.gate_length, MOST_RINGS))


def _binned(sweep: Sweep, no_echo: float | None, edges: Floats) -> tuple[Floats, Floats]:
    """Return the least and greatest value (A, J) of the gates that a value in each bin may depend on.

    edges (J + 1,): where the bins of range begin and end.
    """
    silent = np.isneginf(sweep.values)
    values = np.where(silent, np.nan if no_echo is None else no_echo, sweep.values)
    gates = values.shape[1]
    places = (edges - sweep.first_gate) / sweep.gate_spacing
    begin, end = places[:-1], places[1:]
    first = np.clip(np.floor(begin - SLACK), 0, gates - 1).astype(np.intp)
    last = np.clip(np.ceil(end + SLACK), 0, gates - 1).astype(np.intp)
    outside = (end < -0.5 - SLACK) | (begin > gates - 0.5 + SLACK)
    # Before the first radial comes the last one, and after that the first.
    ring = np.concatenate((values[-1:], values, values[:1]))
    bearings = np.arange(BEARINGS + 1) * (360.0 / BEARINGS)
    before = np.searchsorted(sweep.azimuths, bearings[:-1] - SLACK, side="right")
    after = np.searchsorted(sweep.azimuths, bearings[1:] + SLACK, side="left") + 1
    least, greatest = (
        _reduced(ufunc, _reduced(ufunc, ring, first, last, 1), before, after, 0)
        for ufunc in (np.fmin, np.fmax)
    )
    least[:, outside] = np.nan
    greatest[:, outside] = np.nan
    return least, greatest


def _reduced(ufunc: np.ufunc, values: Floats, first: Indices, last: Indices, axis: int) -> Floats:
    """Reduce `values` along an axis from each index in `first` to that in `last`."""
    pairs = np.stack((first, last + 1), axis=1).ravel()
    # An index past the end needs an element.
    padded = np.concatenate((values, np.take(values, [-1], axis=axis)), axis=axis)
    return np.asarray(np.take(ufunc.reduceat(padded, pairs, axis=axis), range(0, len(pairs), 2), axis=axis))


def _reached(
    tilts: tuple[float, float], places: Floats, columns: _Columns, beam: str
) -> tuple[tuple[Floats, Floats], tuple[Floats, Floats]]:
    """Return the least and greatest height, and slant range, of beams from one elevation to another."""
    low, high = tilts
    round_earth = beam == "4/3-earth"
    # Over a round earth a beam is nearest to the antenna where it runs level.
    turn = np.degrees(places / EFFECTIVE_RADIUS) if round_earth else np.zeros(len(places))
    nearest = slant_of_ground(places, np.clip(-turn, low, high), beam)
    lowest, highest = (slant_of_ground(places, np.array(tilt), beam) for tilt in tilts)
    bottom, top = (
        world_of_beam(slant, np.array(0.0), np.array(tilt), beam)[2]
        for slant, tilt in ((lowest, low), (highest, high))
    )
    # Both are huge where a beam goes straight up or down: the farthest place is never the antenna's.
    farthest = np.maximum(lowest, highest)
    floor = np.minimum(bottom.take(columns.near), bottom.take(columns.far))
    if round_earth:
        # Between two places a beam sags below both by at most 1/8 of their distance squared over the radius.
        floor -= (places.take(columns.far) - places.take(columns.near)) ** 2 / (4 * EFFECTIVE_RADIUS)
    ceiling = np.maximum(top.take(columns.near), top.take(columns.far))
    return (floor, ceiling), (nearest.take(columns.near), farthest.take(columns.far))


def _any_flagged(flagged: Booleans, columns: _Columns, ranges: tuple[Floats, Floats]) -> Booleans:
    """Tell of each column whether any bin of its bearings, and of `ranges` in bins, is flagged."""
    rings = flagged.shape[1]
    # How many are flagged before each bin, twice around.
    counts = np.zeros((2 * BEARINGS + 1, rings + 1), np.int32)
    np.cumsum(flagged, axis=1, out=counts[1 : BEARINGS + 1, 1:])
    np.cumsum(counts[: BEARINGS + 1], axis=0, out=counts[: BEARINGS + 1])
    np.add(counts[1 : BEARINGS + 1], counts[BEARINGS], out=counts[BEARINGS + 1 :])
    first = np.clip(ranges[0] * (1 - ROUNDED) - SLACK, 0, rings).astype(np.intp)
    end = np.clip(ranges[1] * (1 + ROUNDED) + SLACK, 0, rings - 1).astype(np.intp) + 1
    before, after, flat = columns.first * (rings + 1), columns.end * (rings + 1), counts.reshape(-1)
    up_to_end, up_to_first = (flat.take(after + place) - flat.take(before + place) for place in (end, first))
    return np.asarray(up_to_end > up_to_first)
