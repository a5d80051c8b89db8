"""How steep a texture is: what a fetch changes by when its place is moved.

Cells are those between neighbouring texels, numbered by their lowest corner among the texels padded by one
layer, as `volref.stages.textures.cells_of` numbers them.  In a cell a linear fetch is a product of lines: its
derivative along each axis is a mix of differences along the cell's edges, with the same weights.  Moved by d
texels along each axis it changes by at most

    d (|dv/dx| + |dv/dy| + |dv/dz|) + 3 d^2 m

where m bounds the mixed differences.  A place that is moved over the border of its cell ends in a neighbour,
whose slope is bounded by the largest differences along its edges.
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from volref.arrays import Floats, Indices, Numbers
from volref.stages.textures import PAD, Texture, cells_of, texels_of
from volref.workspace import Workspace


class Steep(NamedTuple):
    """A linear fetch: channels (C, n), the sum of their derivatives' sizes per texel (C, n), where it lies.

    cell (n,): its cell.  margin (n,): how far, in texels, it is from the border of the cell.
    """

    value: Floats
    slope: Floats
    cell: Indices
    margin: Floats


@dataclass(frozen=True, eq=False)
class Slopes:
    """A texture and its slopes: `near` (C, cells) bounds those of a cell and of its neighbours."""

    texture: Texture

    @cached_property
    def mixed(self) -> Floats:
        """Bound (C,) of the mixed differences: twice the steepest slope, as an edge's differs by that."""
        return np.asarray(2 * self.steepest)

    @cached_property
    def steepest(self) -> Floats:
        """The steepest slope (C,)."""
        return np.asarray(self.near.max(axis=1))

    @cached_property
    def largest(self) -> Floats:
        """Size (C,) of the largest texel."""
        texels = self.texture.texels
        return np.asarray(np.abs(texels).reshape(-1, texels.shape[-1]).max(axis=0).astype(np.float64))

    @cached_property
    def near(self) -> Floats:
        """Slope (C, cells) of the steepest of each cell and its neighbours."""
        from scipy import ndimage

        width = [3 if size > 1 else 1 for size in self._cells.shape[1:]]
        found = np.stack([ndimage.maximum_filter(one, size=width, mode="nearest") for one in self._cells])
        return found.reshape(len(found), -1)

    def span(self, texels: Floats, cell: Indices) -> Floats:
        """Return how far fetches (C, n) may be apart within some texels (n,) around a place in cells (n,)."""
        found = np.zeros((len(self.near), len(cell)))
        level = np.ceil(np.log2(np.maximum(np.minimum(texels, max(self.texture.sizes)), 1.0))).astype(
            np.int64
        )
        for one in np.unique(level).tolist():
            at = np.flatnonzero(level == one)
            found[:, at] = self._spans(one)[:, cell[at]]
        return found

    def _spans(self, level: int) -> Floats:
        """Return greatest less least texel (C, cells) up to 2^level texels away from each cell."""
        if level not in self._kept:
            from scipy import ndimage

            padded = self._padded
            away = 2 * (2**level + 1) + 1
            width = [away if size > 1 else 1 for size in padded.shape[1:]]
            spans = [
                ndimage.maximum_filter(one, size=width, mode="nearest")
                - ndimage.minimum_filter(one, size=width, mode="nearest")
                for one in padded
            ]
            self._kept[level] = np.stack(spans).reshape(len(padded), -1)
        return self._kept[level]

    @cached_property
    def _kept(self) -> dict[int, Floats]:
        return {}

    @cached_property
    def _padded(self) -> Floats:
        """Texels (C, ...) with one layer of what lies beyond each edge."""
        texels = self.texture.texels
        mode: Any = "edge" if self.texture.wrap == "clamp" else "wrap"
        pad = [(PAD * (size > 1),) * 2 for size in texels.shape[:-1]]
        if texels.dtype == np.float16:  # what scipy.ndimage does not take
            texels = texels.astype(np.float32)
        return np.moveaxis(np.pad(texels, [*pad, (0, 0)], mode=mode), -1, 0)

    @cached_property
    def _cells(self) -> Floats:
        """Slopes (C, ...) on the padded grid; the last layers, which begin no cell, have those before."""
        padded = self._padded
        total = np.zeros(padded.shape)
        axes = [axis for axis in range(1, padded.ndim) if padded.shape[axis] > 1]
        for axis in axes:
            step = np.abs(np.diff(padded, axis=axis, append=np.take(padded, [-1], axis=axis)))
            others = [other for other in axes if other != axis]
            steepest = step
            for sides in product((0, 1), repeat=len(others)):
                moved = step
                for other, side in zip(others, sides, strict=True):
                    if side:
                        last = np.take(moved, [-1], axis=other)
                        moved = np.concatenate(
                            [np.take(moved, range(1, moved.shape[other]), axis=other), last], axis=other
                        )
                steepest = np.maximum(steepest, moved)
            total += steepest
        return total


def fetch_steep(texture: Texture, place: list[Floats] | Floats, work: Workspace) -> Steep:
    """Return a linear fetch, without rounded weights, with its derivatives; places as for `fetch`."""
    n = len(place[0])
    cell, weights = cells_of(texture, place, work)
    value = np.empty((len(texture.corners), n), texture.texels.dtype)
    slope = np.empty_like(value)
    for corners, out, steep in zip(texture.corners, value, slope, strict=True):
        _steep_channel(corners, cell, weights, out, steep, work)
    margin = np.full(n, 0.5)
    for weight in weights:
        np.minimum(margin, np.minimum(weight, 1 - weight), out=margin)
    return Steep(value, slope, cell, margin)


def _steep_channel(
    corners: tuple[Numbers, ...],
    cell: Indices,
    weights: list[Numbers],
    value: Floats,
    slope: Floats,
    work: Workspace,
) -> None:
    """Write one channel of a fetch to `value`, and the sum of its derivatives' sizes to `slope`."""
    found = texels_of(corners[: 2 ** len(weights)], cell, value, work)
    # Derivatives along the axes already taken, each as many as there are values left.
    derivatives: list[list[Floats]] = []
    for weight in weights:
        steps = []
        for low, high in zip(found[::2], found[1::2], strict=True):
            np.subtract(high, low, out=high)
            steps.append(high.copy())
            np.multiply(high, weight, out=high)
            np.add(low, high, out=low)
        derivatives = [_mixed(along, weight) for along in derivatives]
        derivatives.append(steps)
        found = found[::2]
    # One texel has no slope.
    slope[...] = 0
    for along in derivatives:
        slope += np.abs(along[0])


def _mixed(along: list[Floats], weight: Numbers) -> list[Floats]:
    """Return derivatives mixed along one more axis, two by two."""
    return [low + (high - low) * weight for low, high in zip(along[::2], along[1::2], strict=True)]
