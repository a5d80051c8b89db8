"""What samples may find in an atlas of slices, and in one of a radar's sweeps.

Where a place is so near to a slice that a machine may take it for the one before or behind, both are asked.
"""

import numpy as np

from volref.arrays import Booleans, Floats, Indices
from volref.emulation.textures.slices import SlicePair, slice_pair
from volref.oracle.intervals.fetching import fetched
from volref.oracle.intervals.finding import Finder, Reach, classified, joined, value_of
from volref.oracle.intervals.polar import polar_pairs
from volref.workspace import Workspace


def between_slices(finder: Finder, position: Floats, radius: Floats, work: Workspace) -> Reach:
    """Return what samples at positions (3, n) up to radii (n,) may find between two slices."""
    volume, size = finder.textures.pipeline.volume, finder.textures.size
    slices = size[2]
    off = radius * slices + 2 * finder.slack.control * slices
    pair = slice_pair(volume, size, finder.textures.tiles, position)
    share = pair.share
    if volume.between == "x":
        share = _place_along_z(finder, position) - pair.first
    found = _mixed(finder, pair, radius, work)
    near = np.flatnonzero((share <= off) | (share >= 1 - off))
    if len(near):
        for side in (-1, 1):
            moved = position[:, near].copy()
            moved[2] += (side * 2 * off[near] / slices).astype(moved.dtype)
            other = slice_pair(volume, size, finder.textures.tiles, moved)
            changed = np.flatnonzero(other.first != pair.first[near])
            if len(changed):
                taken = SlicePair(*(number[changed] for number in other))
                at = near[changed]
                found = joined(
                    found, _mixed(finder, taken, 3 * radius[at] + 4 * finder.slack.control, work), at
                )
    return found


def _place_along_z(finder: Finder, position: Floats) -> Floats:
    switches, count = finder.textures.pipeline.volume, finder.textures.size[2]
    kind = position.dtype.type
    if switches.slices == "centers":
        return np.asarray(np.maximum(position[2] * kind(count) - kind(0.5), kind(0)))
    return np.asarray(position[2] * kind(count - (switches.slices == "last")))


def _mixed(finder: Finder, pair: SlicePair, radius: Floats, work: Workspace) -> Reach:
    """Return what may be found between the slices of a pair, at places up to radii (n,) of texture space."""
    textures = finder.textures
    pipeline, texture = textures.pipeline, textures.volume
    nx, ny, nz = textures.size
    # In texture space of the atlas: its tiles are smaller than the slices' own.
    shrunk = radius * (max(nx, ny) / max(texture.sizes))
    sides = [
        fetched(finder.volume, [u, v], shrunk, finder.slack, work)
        for u, v in zip(pair[3::2], pair[4::2], strict=True)
    ]
    share_off = radius * nz + 2 * finder.slack.control * nz
    share = pair.share.astype(np.float64)
    if pipeline.table.order == "per-slice":
        return _per_slice(finder, sides, share, share_off, work)
    if pipeline.table.order == "pre":
        found, off = _between(finder, sides[0], sides[1], share, share_off)
        return Reach(np.stack([found, found]), off, found[3], off[3])
    values = [value_of(finder, *side) for side in sides]
    value, off = _between(finder, values[0], values[1], share, share_off)
    return Reach(*classified(finder, value, off, work), value, off)


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


def between_sweeps(finder: Finder, position: Floats, radius: Floats, work: Workspace) -> Reach:
    """Return what samples may find between two sweeps of a radar; 0 where none is seen."""
    grid = finder.textures.grid
    assert grid is not None
    whole: Reach | None = None
    for at, pair, places, share_off, seen, unseen in polar_pairs(finder, grid, position, radius):
        reach = _swept(finder, pair, places, share_off, work)
        reach = _or_nothing(finder, reach, seen, unseen, work)
        whole = reach if whole is None else joined(whole, reach, at)
    assert whole is not None
    return whole


def _swept(finder: Finder, pair: SlicePair, places: Floats, share_off: Floats, work: Workspace) -> Reach:
    """Return what may be found between the sweeps of a pair; places (n,): how far off in the image."""
    sides = [
        value_of(finder, *fetched(finder.volume, [u, v], places, finder.slack, work))
        for u, v in zip(pair[3::2], pair[4::2], strict=True)
    ]
    share = np.nan_to_num(pair.share.astype(np.float64), posinf=0.0, neginf=0.0)
    value, off = _between(finder, sides[0], sides[1], share, share_off)
    return Reach(*classified(finder, value, off, work), value, off)


def _or_nothing(finder: Finder, reach: Reach, seen: Booleans, unseen: Booleans, work: Workspace) -> Reach:
    """Return what may be found where samples (n,) may be seen, may not be seen, or either."""
    nothing = np.flatnonzero(unseen)
    if not len(nothing):
        return reach
    zero = np.zeros(len(nothing))
    ends, spread = classified(finder, zero, zero, work)
    empty = Reach(ends, spread, zero, zero)
    only = unseen & ~seen
    at: Indices = np.flatnonzero(only)
    chosen = only[nothing]
    new_ends, new_spread = reach.ends.copy(), reach.spread.copy()
    value, radius = reach.value.copy(), reach.radius.copy()
    new_ends[:, :, at], new_spread[:, at] = ends[:, :, chosen], spread[:, chosen]
    value[at], radius[at] = 0.0, 0.0
    replaced = Reach(new_ends, new_spread, value, radius)
    both = np.flatnonzero(unseen & seen)
    rest = np.flatnonzero(seen[nothing])
    if not len(both):
        return replaced
    either = Reach(empty.ends[:, :, rest], empty.spread[:, rest], zero[rest], zero[rest])
    return joined(replaced, either, both)
