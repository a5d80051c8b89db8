"""Values at places that are known up to a radius: of a 3-D texture, between slices, between sweeps.

n points; positions are (3, n) in texture space, their radius (n,) holds for each axis.
"""

import dataclasses

import numpy as np

from volref.arrays import Floats
from volref.emulation.textures.lookup import read_at
from volref.oracle.intervals.atlases import value_between_slices, value_between_sweeps
from volref.oracle.intervals.fetching import fetched
from volref.oracle.intervals.finding import Finder, value_of
from volref.workspace import Workspace


def value_at(finder: Finder, position: Floats, radius: Floats, work: Workspace) -> tuple[Floats, Floats]:
    """Return values (n,) at positions (3, n) up to radii (n,), and how far they may be off (n,)."""
    textures = finder.textures
    if textures.grid is not None:
        return value_between_sweeps(finder, position, radius, work)
    position, radius = read_place(finder, position, radius)
    if textures.pipeline.volume.layout == "atlas":
        return value_between_slices(finder, position, radius, work)
    return value_of(finder, *fetched(finder.volume, position, radius, finder.slack, work))


def read_place(finder: Finder, position: Floats, radius: Floats) -> tuple[Floats, Floats]:
    """Return where samples at positions (3, n) are read in the texture, and up to what radii (n,)."""
    switches, size = finder.textures.pipeline.volume, finder.textures.size
    place = read_at(switches, size, position)
    if place is position:
        return position, radius
    off = radius + 4 * finder.slack.control * (1 + np.abs(switches.shift) / min(size))
    if switches.brick is not None:
        # Read from the other brick, a place near the border of two lies up to a voxel further.
        count = np.array(size, np.float64)[:, None]
        whole = read_at(dataclasses.replace(switches, brick=None), size, position)
        side = whole * count / switches.brick
        near = np.abs(side - np.rint(side)) * switches.brick <= off * count
        off = off + np.where(near, 1 / count, 0.0).max(axis=0)
    return place, off
