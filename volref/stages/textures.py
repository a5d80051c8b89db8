"""A stage of emulations: fetches from textures, as OpenGL ES says and as its implementations round.

n points; coordinates are (2, n) or (3, n), or rows u, v and w of (n,), in texture space: 0..1, edge to edge.

Texel i of N lies at (i + 1/2) / N, so its place is u N - 1/2, the whole part of which is a texel and the rest
the weight of the next (OpenGL ES 2.0, section 3.7.7; 3.0, section 3.8.10).  Row 0 is at v = 0: the first one
uploaded.  Places are computed in the type of the coordinates, and values in the type of the texels.

What is beyond an edge is the edge's texel ("clamp") or the texture again ("repeat").
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from volref.arrays import Floats, Numbers
from volref.workspace import Workspace

FILTERS = ("nearest", "linear")
WRAPS = ("clamp", "repeat")


@dataclass(frozen=True, eq=False)
class Texture:
    """A texture and how it is sampled.

    texels: (H, W, C), or (D, H, W, C), floats, as a fetch gives them (decoded).
    filter, wrap: one of `FILTERS` and of `WRAPS`.
    weight_bits: places are rounded to 2^-weight_bits of a texel; None: not at all.
    result_bits: texels and the result of each interpolation, along x, then y, then z, are whole multiples of
    1 / (2^result_bits - 1), as in Mesa, where both are 8; None: numbers.  It needs `weight_bits`.
    """

    texels: Floats
    filter: str = "linear"
    wrap: str = "clamp"
    weight_bits: int | None = None
    result_bits: int | None = None

    @cached_property
    def sizes(self) -> tuple[int, ...]:
        """Numbers of texels along x, y (and z)."""
        return self.texels.shape[-2::-1]

    @cached_property
    def corners(self) -> tuple[tuple[Numbers, ...], ...]:
        """The flat texels of each channel from each corner of a cell on, so that one index fetches all.

        One texel is added behind each axis, the one that is found there; an axis of one texel has no corners.
        """
        spatial = [axis for axis, size in enumerate(self.texels.shape[:-1]) if size > 1]
        mode: Any = "edge" if self.wrap == "clamp" else "wrap"
        pad = [(0, int(axis in spatial)) for axis in range(self.texels.ndim)]
        padded = np.moveaxis(np.pad(self._numbers, pad, mode=mode), -1, 0)
        channels = [np.ascontiguousarray(channel).reshape(-1) for channel in padded]
        steps = [0]
        for stride in self.strides[::-1]:
            steps = [step + side for step in steps for side in (0, stride)] if stride else steps
        return tuple(tuple(channel[step:] for step in steps) for channel in channels)

    @cached_property
    def strides(self) -> tuple[int, ...]:
        """Steps of the flat index along x, y (and z); 0 where there is one texel."""
        strides, step = [], 1
        for size in self.sizes:
            strides.append(step if size > 1 else 0)
            step *= size + 1 if size > 1 else 1
        return tuple(strides)

    @property
    def _numbers(self) -> Numbers:
        """The texels, or their codes."""
        if self.result_bits is None:
            return self.texels
        most = 2**self.result_bits - 1
        return np.rint(np.clip(self.texels, 0.0, 1.0) * most).astype(np.int32)


def fetch(texture: Texture, coordinates: Sequence[Floats] | Floats, work: Workspace) -> Floats:
    """Return the channels (C, n) of a texture at coordinates, which are left as they are.

    A linear fetch is evaluated as a + f (b - a) along x, then y, then z.  At a NaN it is that at 0.
    The result lies in `work` until the next call.

    Examples
    --------
    >>> ramp = Texture(np.array([[[0.0], [1.0]]]))
    >>> fetch(ramp, np.array([[0.0, 0.25, 0.5, 2.0], [0.5] * 4]), Workspace()).tolist()
    [[0.0, 0.0, 0.5, 1.0]]
    """
    n = len(coordinates[0])
    result: Floats = work.get("fetched", len(texture.corners) * n, texture.texels.dtype).reshape(-1, n)
    if texture.filter == "nearest":
        index = _nearest(texture, coordinates, work)
        flat = texture.texels.reshape(-1, texture.texels.shape[-1])
        for channel, out in enumerate(result):
            np.take(flat[:, channel], index, out=out, mode="wrap")
        return result
    index, weights = _cells(texture, coordinates, work)
    if texture.result_bits is None:
        for corners, out in zip(texture.corners, result, strict=True):
            _interpolated(corners, index, weights, out, work)
        return result
    codes = work.get("codes", n, np.int32)
    for corners, out in zip(texture.corners, result, strict=True):
        _interpolated_codes(texture, corners, index, weights, codes, work)
        np.divide(codes, 2**texture.result_bits - 1, out=out, casting="unsafe")
    return result


def fetch_slices(
    texture: Texture, u1: Floats, v1: Floats, u2: Floats, v2: Floats, work: Workspace
) -> tuple[Floats, Floats]:
    """Return the first channel (n,) at (u1, v1) and at (u2, v2), as from two slices of an atlas."""
    n = len(u1)
    both = work.get("slices", 4 * n, u1.dtype).reshape(2, 2 * n)
    for row, (first, second) in zip(both, ((u1, u2), (v1, v2)), strict=True):
        row[:n], row[n:] = first, second
    values = fetch(texture, both, work)[0]
    return values[:n], values[n:]


def _nearest(texture: Texture, coordinates: Sequence[Floats] | Floats, work: Workspace) -> Numbers:
    """Return the flat index of the texel in which each point lies."""
    n, dtype = len(coordinates[0]), coordinates[0].dtype
    index, whole, place = (
        work.get("index", n, np.intp),
        work.get("whole", n, np.int32),
        work.get("place", n, dtype),
    )
    index[:] = 0
    step = 1
    for u, size in zip(coordinates, texture.sizes, strict=True):
        _unit(texture, u, place)
        np.multiply(place, dtype.type(size), out=place)
        np.fmax(place, dtype.type(0), out=place)
        np.minimum(place, dtype.type(size - 1), out=place)
        np.copyto(whole, place, casting="unsafe")
        np.multiply(whole, np.int32(step), out=whole)
        np.add(index, whole, out=index)
        step *= size
    return index


def _unit(texture: Texture, u: Floats, out: Floats) -> None:
    """Write coordinates to `out`, brought to 0..1 if the texture repeats."""
    if texture.wrap == "repeat":
        with np.errstate(invalid="ignore"):
            np.subtract(u, np.floor(u), out=out)
    else:
        np.copyto(out, u)


def _cells(
    texture: Texture, coordinates: Sequence[Floats] | Floats, work: Workspace
) -> tuple[Numbers, list[Numbers]]:
    """Return the flat index (n,) of each point's lowest texel, and weights (n,) of the next along each axis.

    Axes of one texel are left out.  Weights are in the type of the texels, or, where results are rounded,
    whole numbers 0..2^weight_bits.
    """
    n, dtype = len(coordinates[0]), coordinates[0].dtype
    base, whole = work.get("base", n, np.int32), work.get("whole", n, np.int32)
    place, floor = work.get("place", n, dtype), work.get("floor", n, dtype)
    base[:] = 0
    weights = []
    for axis, (u, size, stride) in enumerate(zip(coordinates, texture.sizes, texture.strides, strict=True)):
        if not stride:
            continue
        _unit(texture, u, place)
        np.multiply(place, dtype.type(size), out=place)
        np.subtract(place, dtype.type(0.5), out=place)
        if texture.wrap == "repeat":
            np.add(place, dtype.type(size), out=place, where=place < 0)
        np.fmax(place, dtype.type(0), out=place)
        np.minimum(place, dtype.type(size - (texture.wrap == "clamp")), out=place)
        if texture.weight_bits is not None:
            np.multiply(place, dtype.type(2**texture.weight_bits), out=place)
            np.rint(place, out=place)
            np.multiply(place, dtype.type(2.0**-texture.weight_bits), out=place)
        np.copyto(whole, place, casting="unsafe")
        np.copyto(floor, whole)
        np.subtract(place, floor, out=place)
        if texture.result_bits is not None:
            assert texture.weight_bits is not None
            weight = work.get(f"weight {axis}", n, np.int32)
            np.multiply(place, 2**texture.weight_bits, out=weight, casting="unsafe")
        else:
            weight = work.get(f"weight {axis}", n, texture.texels.dtype)
            np.copyto(weight, place, casting="same_kind")
        weights.append(weight)
        np.multiply(whole, np.int32(stride), out=whole)
        np.add(base, whole, out=base)
    index = work.get("index", n, np.intp)
    np.copyto(index, base)
    return index, weights


def _interpolated(
    corners: tuple[Numbers, ...], index: Numbers, weights: list[Numbers], out: Floats, work: Workspace
) -> None:
    """Write to `out` the interpolation of the 2^k corners found at `index` by k weights."""
    n = len(index)
    found = [out, *(work.get(f"corner {k}", n, out.dtype) for k in range(1, len(corners)))]
    for corner, texel in zip(corners, found, strict=True):
        np.take(corner, index, out=texel, mode="wrap")
    for weight in weights:
        for low, high in zip(found[::2], found[1::2], strict=True):
            np.subtract(high, low, out=high)
            np.multiply(high, weight, out=high)
            np.add(low, high, out=low)
        found = found[::2]


def _interpolated_codes(
    texture: Texture,
    corners: tuple[Numbers, ...],
    index: Numbers,
    weights: list[Numbers],
    out: Numbers,
    work: Workspace,
) -> None:
    """Write to `out` the codes interpolated from codes: a + (f (b - a) + half >> weight_bits) each time."""
    assert texture.weight_bits is not None
    half = np.int32(2 ** (texture.weight_bits - 1))
    found = [out, *(work.get(f"corner {k}", len(index), np.int32) for k in range(1, len(corners)))]
    for corner, texel in zip(corners, found, strict=True):
        np.take(corner, index, out=texel, mode="wrap")
    for weight in weights:
        for low, high in zip(found[::2], found[1::2], strict=True):
            np.subtract(high, low, out=high)
            np.multiply(high, weight, out=high)
            np.add(high, half, out=high)
            np.right_shift(high, np.int32(texture.weight_bits), out=high)
            np.add(low, high, out=low)
        found = found[::2]


def mip_chain(texels: Floats) -> list[Floats]:
    """Return texels (H, W, C) and their halvings down to one texel, each the mean of 2 x 2 of the last.

    A size that is odd is halved downwards, and its last row or column left out.

    Examples
    --------
    >>> [level[..., 0].tolist() for level in mip_chain(np.array([[[0.0], [1.0], [9.0]]]))]
    [[[0.0, 1.0, 9.0]], [[0.5]]]
    """
    chain = [texels]
    while max(chain[-1].shape[:2]) > 1:
        level = chain[-1]
        for axis in (1, 0):
            size = level.shape[axis]
            if size > 1:
                even, odd = (np.moveaxis(level, axis, 0)[start : size // 2 * 2 : 2] for start in (0, 1))
                level = np.moveaxis((even + odd) / 2, 0, axis)
        chain.append(np.ascontiguousarray(level))
    return chain


def fetch_mipmapped(
    chain: Sequence[Texture], coordinates: Sequence[Floats] | Floats, lod: Floats, work: Workspace
) -> Floats:
    """Return the channels (C, n) of a chain of textures, largest first, each point at its level `lod` (n,).

    Between whole levels the two next to it are mixed (linear-mipmap-linear); a level below 0 is 0.
    """
    level = np.minimum(np.fmax(lod, 0), len(chain) - 1)
    whole = level.astype(np.int32)
    result = np.empty((chain[0].texels.shape[-1], len(lod)), chain[0].texels.dtype)
    for k in np.unique(whole).tolist():
        here = np.flatnonzero(whole == k)
        points = [row[here] for row in coordinates]
        low = fetch(chain[k], points, work).copy()
        high = fetch(chain[min(k + 1, len(chain) - 1)], points, work)
        result[:, here] = low + (level[here] - k).astype(low.dtype) * (high - low)
    return result
