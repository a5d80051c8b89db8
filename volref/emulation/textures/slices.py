"""From a position in the box to the texture coordinates of two slices of an atlas (seed 001, eq. 5 to 14).

n points; all arrays are (n,), in the control type of the device.  M tiles across, P down, N slices; for a
"fract" column, "columns" row and first tile at v0:

    s1 = floor(z N)   s2 = s1 + 1   u = fract(s / M) + x / M   v = floor(s / M) / P + y / P
"""

from typing import Any, NamedTuple

import numpy as np

from volref.arrays import Floats
from volref.emulation.groups import VolumeTexture


class SlicePair(NamedTuple):
    """The slices before and behind a point, how far it is towards the second, and where it lies in each."""

    first: Floats
    second: Floats
    share: Floats
    u1: Floats
    v1: Floats
    u2: Floats
    v2: Floats


def slice_pair(
    switches: VolumeTexture, size: tuple[int, int, int], tiles: tuple[int, int], position: Floats
) -> SlicePair:
    """Return the two slices of points (3, n) in texture space, by the rules of the switches.

    Examples
    --------
    Slices 2 and 3 of 4 in 2 x 2 tiles, a quarter from the first to the second:

    >>> rules = VolumeTexture(layout="atlas", slices="last")
    >>> pair = slice_pair(rules, (8, 8, 4), (2, 2), np.array([[0.5], [0.5], [0.75]]))
    >>> [number.item() for number in pair]
    [2.0, 3.0, 0.25, 0.25, 0.75, 0.75, 0.75]
    """
    x, y, z = position
    kind = position.dtype.type
    count = size[2]
    if switches.slices == "centers":
        place = np.maximum(z * kind(count) - kind(0.5), kind(0))
    else:
        place = z * kind(count - (switches.slices == "last"))
    first = np.floor(place)
    second = first + kind(1)
    if switches.second_slice == "clamped":
        second = np.minimum(second, kind(count - 1))
    share = place - first
    if switches.between == "x":
        share = x * kind(count) - first
    x, y = (_in_tile(switches, axis, length) for axis, length in ((x, size[0]), (y, size[1])))
    return SlicePair(first, second, share, *in_atlas(switches, (first, second), (x, y), tiles))


def in_atlas(
    switches: VolumeTexture,
    slices: tuple[Floats, Floats],
    place: tuple[Floats, Floats],
    tiles: tuple[int, int],
) -> tuple[Floats, Floats, Floats, Floats]:
    """Return u1, v1, u2 and v2 of a place (x, y) in two slices (eq. 7 to 14)."""
    (first, second), (x, y) = slices, place
    kind = x.dtype.type
    if switches.rows == "against-v":
        y = kind(1) - y
    across, down = kind(tiles[0]), kind(tiles[1])
    x, y = x / across, y / down
    columns = _column(switches, first, across), _column(switches, second, across)
    if switches.second_column == "printed":
        columns = columns[0], np.floor(second / across)
    rows = (_row(switches, s, across, down) for s in (first, second))
    v1, v2 = (row + y for row in rows)
    return columns[0] + x, v1, columns[1] + x, v2


def _in_tile(switches: VolumeTexture, place: Floats, texels: int) -> Floats:
    """Return where 0..1 of a slice lies in its tile of `texels` and the padding around them."""
    kind = place.dtype.type
    if switches.in_tile == "clamped":
        half = kind(0.5 / texels)
        place = np.minimum(np.maximum(place, half), kind(1) - half)
    if switches.padding:
        whole = kind(texels + 2 * switches.padding)
        place = (place * kind(texels) + kind(switches.padding)) / whole
    return place


def _column(switches: VolumeTexture, number: Floats, across: np.floating[Any]) -> Floats:
    """Return the u at which the column of a slice's tile begins."""
    if switches.tile_column == "fract":
        return _fract(number / across)
    return np.asarray((number - across * np.floor(number / across)) / across)


def _row(switches: VolumeTexture, number: Floats, across: np.floating[Any], down: np.floating[Any]) -> Floats:
    """Return the v at which the row of a slice's tile begins."""
    if switches.tile_row == "printed":
        row = _fract(number / down)
    else:
        row = np.floor(number / (across if switches.tile_row == "columns" else down))
    if switches.first_tile == "v1":
        row = (down - 1) - row
    return np.asarray(row / down)


def _fract(number: Floats) -> Floats:
    return np.asarray(number - np.floor(number))
