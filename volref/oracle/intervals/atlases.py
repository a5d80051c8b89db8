"""What samples may find in an atlas of slices, and in one of a radar's sweeps.

Where a place is so near to a slice that a machine may take it for the one before or behind, both are asked.
"""

from collections.abc import Iterator
from typing import TypeAlias

import numpy as np

from volref.arrays import Floats, Indices
from volref.emulation.textures.slices import SlicePair, slice_pair
from volref.oracle.intervals.fetching import fetched
from volref.oracle.intervals.finding import Finder, Reach, classified, joined, value_of
from volref.oracle.intervals.polar import polar_pairs
from volref.workspace import Workspace

# Numbers and how far they may be off.
Known: TypeAlias = tuple[Floats, Floats]


def value_between_slices(finder: Finder, position: Floats, radius: Floats, work: Workspace) -> Known:
    """Return values (n,) at positions (3, n) up to radii (n,) between two slices, and their errors (n,)."""
    found: Known | None = None
    for at, pair, reach in _pairs(finder, position, radius):
        sides, share, share_off = _fetched_sides(finder, pair, reach, work)
        one, two = (value_of(finder, *side) for side in sides)
        value = _between(finder, one, two, share, share_off)
        found = value if found is None else _either(found, value, at)
    assert found is not None
    return found


def colors_between_slices(finder: Finder, position: Floats, radius: Floats, work: Workspace) -> Reach:
    """Return what samples may find of slices that are classified before they are mixed."""
    whole: Reach | None = None
    for at, pair, reach in _pairs(finder, position, radius):
        sides, share, share_off = _fetched_sides(finder, pair, reach, work)
        if finder.textures.pipeline.table.order == "per-slice":
            found = _per_slice(finder, sides, share, share_off, work)
        else:
            color, off = _between(finder, sides[0], sides[1], share, share_off)
            found = Reach(np.stack([color, color]), off, color[3], off[3])
        whole = found if whole is None else joined(whole, found, at)
    assert whole is not None
    return whole


def _pairs(finder: Finder, position: Floats, radius: Floats) -> Iterator[tuple[Indices, SlicePair, Floats]]:
    """Yield the slices around points, then those of the ones that may lie between others; and their radii."""
    volume, size, tiles = finder.textures.pipeline.volume, finder.textures.size, finder.textures.tiles
    slices = size[2]
    off = radius * slices + 2 * finder.slack.control * slices
    pair = slice_pair(volume, size, tiles, position)
    yield np.arange(len(radius)), pair, radius
    share = pair.share
    if volume.between == "x":
        share = _place_along_z(finder, position) - pair.first
    near = np.flatnonzero((share <= off) | (share >= 1 - off))
    for side in (-1, 1) if len(near) else ():
        moved = position[:, near].copy()
        moved[2] += (side * 2 * off[near] / slices).astype(moved.dtype)
        other = slice_pair(volume, size, tiles, moved)
        changed = np.flatnonzero(other.first != pair.first[near])
        if len(changed):
            at = near[changed]
            taken = SlicePair(*(number[changed] for number in other))
            yield at, taken, 3 * radius[at] + 4 * finder.slack.control


def _either(found: Known, other: Known, at: Indices) -> Known:
    """Return values with what those at `at` may be too."""
    value, off = (one.copy() for one in found)
    low = np.minimum(value[at] - off[at], other[0] - other[1])
    high = np.maximum(value[at] + off[at], other[0] + other[1])
    value[at], off[at] = (low + high) / 2, (high - low) / 2
    return value, off


def _place_along_z(finder: Finder, position: Floats) -> Floats:
    switches, count = finder.textures.pipeline.volume, finder.textures.size[2]
    kind = position.dtype.type
    if switches.slices == "centers":
        return np.asarray(np.maximum(position[2] * kind(count) - kind(0.5), kind(0)))
    return np.asarray(position[2] * kind(count - (switches.slices == "last")))


def _fetched_sides(
    finder: Finder, pair: SlicePair, radius: Floats, work: Workspace
) -> tuple[list[Known], Floats, Floats]:
    """Return what both slices of a pair hold at places up to radii, the share of the second, its error."""
    nx, ny, nz = finder.textures.size
    # In texture space of the atlas: its tiles are smaller than the slices' own.
    shrunk = radius * (max(nx, ny) / max(finder.textures.volume.sizes))
    sides = [
        fetched(finder.volume, [u, v], shrunk, finder.slack, work)
        for u, v in zip(pair[3::2], pair[4::2], strict=True)
    ]
    share_off = radius * nz + 2 * finder.slack.control * nz
    return sides, np.nan_to_num(pair.share.astype(np.float64)), share_off


def _between(
    finder: Finder, one: tuple[Floats, Floats], two: tuple[Floats, Floats], share: Floats, share_off: Floats
) -> tuple[Floats, Floats]:
    """Return a mix and how far it may be off, of two numbers that are off themselves."""
    if finder.textures.pipeline.volume.between == "none":
        return one
    apart = two[0] - one[0]
    found = one[0] + apart * share
    off = np.abs(1 - share) * one[1] + np.abs(share) * two[1] + np.abs(apart) * share_off
    size = np.abs(one[0]) + np.abs(share) * (np.abs(one[0]) + np.abs(two[0]))
    return found, off + share_off * (one[1] + two[1]) + 4 * finder.slack.values * size


def _per_slice(
    finder: Finder, sides: list[tuple[Floats, Floats]], share: Floats, share_off: Floats, work: Workspace
) -> Reach:
    """Return what may be found where each slice is classified before they are mixed."""
    values = [value_of(finder, *side) for side in sides]
    value, off = _between(finder, values[0], values[1], share, share_off)
    colors = []
    for one, radius in values:
        ends, spread = classified(finder, one, radius, work)
        colors.append(((ends[0] + ends[1]) / 2, np.abs(ends[1] - ends[0]) / 2 + spread))
    color, beside = _between(finder, colors[0], colors[1], share, share_off)
    return Reach(np.stack([color, color]), beside, value, off)


def value_between_sweeps(finder: Finder, position: Floats, radius: Floats, work: Workspace) -> Known:
    """Return values (n,) between two sweeps of a radar, 0 where none is seen, and how far they are off."""
    grid = finder.textures.grid
    assert grid is not None
    found: Known | None = None
    for at, pair, places, share_off, seen, unseen in polar_pairs(finder, grid, position, radius):
        sides = [
            value_of(finder, *fetched(finder.volume, [u, v], places, finder.slack, work))
            for u, v in zip(pair[3::2], pair[4::2], strict=True)
        ]
        share = np.nan_to_num(pair.share.astype(np.float64), posinf=0.0, neginf=0.0)
        value, off = _between(finder, sides[0], sides[1], share, share_off)
        low = np.where(unseen, np.minimum(value - off, 0.0), value - off)
        high = np.where(unseen, np.maximum(value + off, 0.0), value + off)
        low, high = np.where(seen, low, 0.0), np.where(seen, high, 0.0)
        one = (low + high) / 2, (high - low) / 2
        found = one if found is None else _either(found, one, at)
    assert found is not None
    return found
