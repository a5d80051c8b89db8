"""What the samples of a program may find, and which of them may show.

n points; positions are (3, n) in texture space, their radius (n,) holds for each axis.
"""

import numpy as np

from volref.arrays import Booleans, Floats, Indices
from volref.emulation.textures.uploads import table_place
from volref.oracle.intervals.atlases import colors_between_slices
from volref.oracle.intervals.fetching import fetched
from volref.oracle.intervals.finding import Finder, Reach, classified, value_of
from volref.oracle.intervals.gradients import has_texture, with_gradient
from volref.oracle.intervals.values import read_place, value_at
from volref.workspace import Workspace


def find(finder: Finder, position: Floats, radius: Floats, work: Workspace) -> tuple[Reach, Indices]:
    """Return what samples at positions (3, n), up to radii (n,), may find, and which of them may show.

    What is found is that of the ones that may show alone.
    """
    textures = finder.textures
    pipeline = textures.pipeline
    # Without slices there is nothing to classify before they are mixed.
    late = pipeline.table.order == "post" or (pipeline.table.order, pipeline.volume.layout) == (
        "per-slice",
        "3d",
    )
    if late and not has_texture(pipeline):
        value, off = value_at(finder, position, radius, work)
        some = np.flatnonzero(_may_show(finder, value, off))
        value, off = value[some], off[some]
        return Reach(*classified(finder, value, off, work), value, off), some
    position, radius = read_place(finder, position, radius)
    if pipeline.volume.layout == "atlas":
        reach = colors_between_slices(finder, position, radius, work)
    else:
        found, off = fetched(finder.volume, position, radius, finder.slack, work)
        if pipeline.table.order == "pre":
            reach = Reach(np.stack([found, found]), off, found[3], off[3])
        else:
            value, beside = value_of(finder, found, off)
            reach = with_gradient(finder, value, beside, found[1:], off[1:], work)
    some = np.flatnonzero(_shows(reach, pipeline.opacity.source))
    return reach.take(some), some


def _may_show(finder: Finder, value: Floats, radius: Floats) -> Booleans:
    """Tell which values (n,) up to radii may have an opacity."""
    if finder.textures.pipeline.opacity.source == "value":
        return np.asarray((value != 0) | (radius > 0))
    if finder.textures.table.texels.shape[0] > 1:
        return np.ones(len(value), np.bool_)
    size, counts = finder.entries.shape[1], finder.visible
    # Two entries more than are fetched, for whatever rounds a place.
    off = (radius + 4 * finder.slack.values) * size + finder.slack.weight + 1.5
    place = table_place(finder.textures.pipeline.table, value) * size - 0.5
    first, last = (np.clip(place + side * off, 0, size - 1).astype(np.int32) for side in (-1, 1))
    return np.asarray(counts[last + 1] > counts[first])


def _shows(reach: Reach, source: str) -> Booleans:
    """Tell which samples (n,) may have any opacity."""
    if source == "value":
        return np.asarray((reach.value != 0) | (reach.radius > 0))
    return np.asarray((reach.ends[0, 3] != 0) | (reach.ends[1, 3] != 0) | (reach.spread[3] > 0))
