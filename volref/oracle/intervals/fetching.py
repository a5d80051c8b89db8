"""Fetches at places that are known up to a radius.

n points; a place is known along each axis up to a radius in texture space.  What is fetched is off by

    linear        its slope times the radius in texels, and times what a machine's weights may be off
    with bits     what the other weights give, where a weight lies near the middle between two of its steps
    nearest       the step to the neighbours, where a place lies near the border of a texel
"""

from collections.abc import Iterator
from itertools import product

import numpy as np

from volref.arrays import Floats
from volref.oracle.intervals.slack import Slack
from volref.oracle.intervals.slopes import Slopes, fetch_steep
from volref.stages.textures import Texture, cells_of, fetch
from volref.workspace import Workspace

# Roundings in a linear fetch along three axes: each of a + f (b - a) has three.
ROUNDINGS = 9

# How far into the next step of a weight a place is moved to get the other weight, in steps.
INTO = 0.3

Places = list[Floats] | Floats


def fetched(
    slopes: Slopes, place: Places, radius: Floats, slack: Slack, work: Workspace
) -> tuple[Floats, Floats]:
    """Return channels (C, n) of a texture at places up to a radius (n,), and how far these may be off."""
    texture = slopes.texture
    largest = max(texture.sizes)
    texels = radius * largest + 3 * slack.control * largest
    steepness: Floats | float = 0.0
    if texture.filter == "nearest":
        found, off = _nearest(slopes, place, texels, work)
    elif texture.weight_bits is not None:
        found, off = _with_bits(slopes, place, texels, work)
        steepness = slopes.largest[:, None]
    else:
        found, off, steepness = _linear(slopes, place, texels, slack, work)
    far = np.flatnonzero(texels > 1)
    if len(far):
        cell, _ = cells_of(texture, [u[far] for u in place], work)
        off[:, far] = slopes.span(texels[far], cell)
    if texture.result_bits is None and slack.values:
        # Texels of the cell are no larger than what is found in it and its slope, or than any.
        off += ROUNDINGS * slack.values * (np.abs(found) + steepness)
    return found, off


def _linear(
    slopes: Slopes, place: Places, texels: Floats, slack: Slack, work: Workspace
) -> tuple[Floats, Floats, Floats]:
    steep = fetch_steep(slopes.texture, place, work)
    moved = texels + slack.weight
    off = steep.slope * moved + 3 * slopes.mixed[:, None] * (moved * moved)
    # A place beyond the border of its cell is on another slope, and so are the weights there.
    over = np.flatnonzero(steep.margin <= texels)
    if len(over):
        off[:, over] = np.maximum(off[:, over], slopes.near[:, steep.cell[over]] * 2 * moved[over])
    return steep.value, off, steep.slope


def _nearest(slopes: Slopes, place: Places, texels: Floats, work: Workspace) -> tuple[Floats, Floats]:
    texture = slopes.texture
    found = fetch(texture, place, work)
    near = np.zeros(len(texels), np.bool_)
    for u, size in _axes(texture, place):
        cut = 0.0 if texture.nearest_bits is None else size * 2.0**-texture.nearest_bits
        at = u.astype(np.float64) * size
        near |= np.abs(at - np.rint(at)) <= texels + cut
    off = np.zeros_like(found)
    unsure = np.flatnonzero(near)
    if len(unsure):
        cell, _ = cells_of(texture, [u[unsure] for u in place], work)
        off[:, unsure] = slopes.near[:, cell]
    return found, off


def _with_bits(slopes: Slopes, place: Places, texels: Floats, work: Workspace) -> tuple[Floats, Floats]:
    """Return the fetch in the middle of what all reachable weights give."""
    texture = slopes.texture
    found = fetch(texture, place, work)
    low, high = found, found.copy()
    quanta = 2.0 ** (texture.weight_bits or 0)
    reach = texels * quanta
    sides, unsure = [], np.zeros(len(texels), np.bool_)
    for u, size in _axes(texture, place):
        step = u.astype(np.float64) * (size * quanta) - 0.5 * quanta
        beyond = step - np.floor(step) - 0.5
        near = np.abs(beyond) <= reach
        unsure |= near
        # Well into the steps on both sides: float32 itself may round a place to just between two.
        sides.append([np.where(near, way * INTO - beyond, 0.0) / (size * quanta) for way in (-1, 1)])
    at = np.flatnonzero(unsure)
    for shifts in product(*sides) if len(at) else ():
        moved = [(u[at] + shift[at]).astype(u.dtype) for u, shift in zip(place, shifts, strict=False)]
        other = fetch(texture, [*moved, *(u[at] for u in place[len(moved) :])], work)
        low[:, at], high[:, at] = np.minimum(low[:, at], other), np.maximum(high[:, at], other)
    middle, off = (low + high) / 2, (high - low) / 2
    wide = np.flatnonzero(reach > 0.45)
    if len(wide):
        cell, _ = cells_of(texture, [u[wide] for u in place], work)
        byte = 0.0 if texture.result_bits is None else 1.0 / (2**texture.result_bits - 1)
        off[:, wide] = slopes.near[:, cell] * (texels[wide] + 1 / quanta) + 3 * byte
    return middle, off


def _axes(texture: Texture, place: Places) -> Iterator[tuple[Floats, int]]:
    yield from zip(place, texture.sizes, strict=False)
