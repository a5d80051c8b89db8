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
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from volref.arrays import Floats, Numbers
from volref.workspace import Workspace

FILTERS = ("nearest", "linear")
WRAPS = ("clamp", "repeat")

PAD = 1  # layers added on each side


@dataclass(frozen=True, eq=False)
class Texture:
    """A texture and how it is sampled.

    texels: (H, W, C), or (D, H, W, C), floats, as a fetch gives them (decoded).
    filter, wrap: one of `FILTERS` and of `WRAPS`.
    weight_bits: places of linear fetches are rounded to 2^-weight_bits of a texel; None: not at all.
    result_bits: texels and the result of each interpolation, along x, then y, then z, are whole multiples of
    1 / (2^result_bits - 1); it needs `weight_bits`, together at most 30.  None: not at all.
    nearest_bits: coordinates of nearest fetches are cut to 2^-nearest_bits; None: not at all.

    With 8-bit textures, Mesa has weight_bits and result_bits of 8, and SwiftShader nearest_bits of 16.
    """

    texels: Floats
    filter: str = "linear"
    wrap: str = "clamp"
    weight_bits: int | None = None
    result_bits: int | None = None
    nearest_bits: int | None = None

    @cached_property
    def sizes(self) -> tuple[int, ...]:
        """Numbers of texels along x, y (and z)."""
        return self.texels.shape[-2::-1]

    @cached_property
    def strides(self) -> tuple[int, ...]:
        """Steps of the flat index along x, y (and z); 0 where there is one texel."""
        strides, step = [], 1
        for size in self.sizes:
            strides.append(step if size > 1 else 0)
            step *= size + 2 * PAD if size > 1 else 1
        return tuple(strides)

    @cached_property
    def index_type(self) -> type[np.signedinteger[Any]]:
        """What holds every flat index; int32 is twice as fast."""
        return np.int32 if np.prod(np.add(self.sizes, 2 * PAD), dtype=np.int64) < 2**31 else np.int64

    @cached_property
    def corners(self) -> tuple[tuple[Numbers, ...], ...]:
        """The flat texels of each channel from each corner of a cell on, so that one index fetches all.

        Texels are padded by one layer of those found beyond the edge; an axis of one texel is not, and has no
        corners.  They are codes where results are rounded.
        """
        numbers = self.texels
        if self.result_bits is not None:
            most = 2**self.result_bits - 1
            numbers = np.rint(np.clip(self.texels, 0.0, 1.0) * most).astype(np.int32)
        mode: Any = "edge" if self.wrap == "clamp" else "wrap"
        pad = [(PAD * (size > 1),) * 2 for size in self.texels.shape[:-1]]
        padded = np.moveaxis(np.pad(numbers, [*pad, (0, 0)], mode=mode), -1, 0)
        steps = [0]
        for stride in self.strides[::-1]:
            steps = [step + side for step in steps for side in (0, stride)] if stride else steps
        flat = [np.ascontiguousarray(channel).reshape(-1) for channel in padded]
        return tuple(tuple(channel[step:] for step in steps) for channel in flat)


def fetch(texture: Texture, coordinates: Sequence[Floats] | Floats, work: Workspace) -> Floats:
    """Return the channels (C, n) of a texture at coordinates, in a new array of the type of its texels.

    A linear fetch is evaluated as a + f (b - a) along x, then y, then z.  At a NaN it is that at 0.

    Examples
    --------
    >>> ramp = Texture(np.array([[[0.0], [1.0]]]))
    >>> fetch(ramp, np.array([[0.0, 0.25, 0.5, 2.0], [0.5] * 4]), Workspace()).tolist()
    [[0.0, 0.0, 0.5, 1.0]]
    """
    n = len(coordinates[0])
    result = np.empty((len(texture.corners), n), texture.texels.dtype)
    index, weights = cells_of(texture, coordinates, work)
    for corners, out in zip(texture.corners, result, strict=True):
        if texture.result_bits is None:
            _interpolate(corners, index, weights, out, work)
        else:
            codes = work.get("codes", n, np.int32)
            _interpolate_codes(corners, index, weights, codes, texture.weight_bits or 0, work)
            _decode(codes, texture.result_bits, out)
    return result


def fetch_slices(
    texture: Texture, u1: Floats, v1: Floats, u2: Floats, v2: Floats, work: Workspace
) -> tuple[Floats, Floats]:
    """Return the first channel (n,) at (u1, v1) and at (u2, v2), as from two slices of an atlas."""
    # One after the other: buffers for both at once would not stay in the cache.
    return fetch(texture, (u1, v1), work)[0], fetch(texture, (u2, v2), work)[0]


class Footprint(NamedTuple):
    """The texels of fetches: indices (n, k, axes), weights (n, k), numbers (n, k, C); x fastest."""

    texel: Numbers
    weight: Floats
    value: Floats


def footprint(texture: Texture, coordinates: Sequence[Floats] | Floats) -> Footprint:
    """Return the texels that a fetch at coordinates mixes, k = 1 or 2 along each axis, and with what weights.

    Examples
    --------
    >>> ramp = Texture(np.array([[[0.0], [1.0]]]))
    >>> found = footprint(ramp, np.array([[0.375], [0.5]]))
    >>> found.texel.tolist(), found.weight.tolist(), found.value.tolist()
    ([[[0, 0], [1, 0]]], [[0.75, 0.25]], [[[0.0], [1.0]]])
    """
    index, weights = cells_of(texture, coordinates, Workspace())
    shares = iter([w / 2.0 ** (texture.weight_bits or 0) if w.dtype.kind == "i" else w for w in weights])
    axes = []
    for size, stride in zip(texture.sizes, texture.strides, strict=True):
        lowest = index // stride % (size + 2 * PAD) - PAD if stride else np.zeros_like(index)
        share = next(shares) if stride and texture.filter == "linear" else None
        axes.append(_neighbors(lowest, share, size, wrap=texture.wrap == "repeat"))
    corners = [corner[::-1] for corner in product(*axes[::-1])]
    texel = np.array([[place for place, _ in corner] for corner in corners])
    weight = np.array([np.prod([part for _, part in corner], axis=0) for corner in corners])
    value = texture.texels[tuple(np.moveaxis(texel, 1, 0)[::-1])]
    return Footprint(np.moveaxis(texel, -1, 0), weight.T, np.moveaxis(value, 1, 0))


def _neighbors(
    lowest: Numbers, share: Numbers | None, size: int, *, wrap: bool
) -> list[tuple[Numbers, Numbers]]:
    """Return the places (n,) and weights (n,) of the texels along one axis that are mixed."""
    if share is None:
        return [(lowest, np.ones(len(lowest)))]
    sides = (lowest, 1 - share), (lowest + 1, share)
    return [(place % size if wrap else np.clip(place, 0, size - 1), part) for place, part in sides]


def cells_of(
    texture: Texture, coordinates: Sequence[Floats] | Floats, work: Workspace
) -> tuple[Numbers, list[Numbers]]:
    """Return the flat index (n,) of each point's lowest texel, and weights (n,) of the next along each axis.

    The index counts texels padded by `PAD`.  All are buffers of `work`: the next fetch overwrites them.

    Axes of one texel are left out, and a nearest fetch has no weights.  Weights are in the type of the
    texels, or, where results are rounded, whole numbers 0..2^weight_bits - 1.
    """
    n, linear = len(coordinates[0]), texture.filter == "linear"
    base, whole = (work.get(name, n, texture.index_type) for name in ("base", "whole"))
    base[:] = PAD * sum(texture.strides)
    weights = []
    for axis, (u, size, stride) in enumerate(zip(coordinates, texture.sizes, texture.strides, strict=True)):
        if not stride:
            continue
        place = work.get("place", n, u.dtype)
        if linear:
            weight = work.get(f"weight {axis}", n, np.int32 if texture.result_bits else texture.texels.dtype)
            _place(texture, u, size, place, whole, weight, work)
            weights.append(weight)
        else:
            np.multiply(_cut(texture, _held(texture, u, work), place), u.dtype.type(size), out=place)
            np.copyto(whole, place, casting="unsafe")
        if stride > 1:
            np.multiply(whole, stride, out=whole)
        np.add(base, whole, out=base)
    index = work.get("index", n, np.intp)
    np.copyto(index, base)
    return index, weights


def _place(
    texture: Texture, u: Floats, size: int, place: Floats, whole: Numbers, weight: Numbers, work: Workspace
) -> None:
    """Write the lower texel of each coordinate, -1..size - 1, to `whole`, and the next one's weight."""
    number = u.dtype.type
    np.multiply(_held(texture, u, work), number(size), out=place)
    np.subtract(place, number(0.5), out=place)
    bits = texture.weight_bits
    if bits is not None:
        np.multiply(place, number(2**bits), out=place)
        np.rint(place, out=place)
        np.multiply(place, number(2.0**-bits), out=place)
    floor = work.get("floor", len(u), u.dtype)
    np.floor(place, out=floor)
    np.copyto(whole, floor, casting="unsafe")
    np.subtract(place, floor, out=place)
    if texture.result_bits is not None:
        np.multiply(place, number(2 ** (bits or 0)), out=place)
    np.copyto(weight, place, casting="unsafe")


def _held(texture: Texture, u: Floats, work: Workspace) -> Floats:
    """Return coordinates as they are if all are in 0..1, else as the texture brings them there."""
    if u.size == 0 or (u.min() >= 0 and u.max() <= 1):
        return u
    held: Floats = work.get("held", len(u), u.dtype)
    if texture.wrap == "repeat":
        with np.errstate(invalid="ignore"):
            np.subtract(u, np.floor(u), out=held)
        u = held
    np.fmax(u, u.dtype.type(0), out=held)  # also makes 0 of NaN
    return np.minimum(held, u.dtype.type(1), out=held)


def _cut(texture: Texture, u: Floats, out: Floats) -> Floats:
    """Return coordinates in 0..1, cut to the bits of a nearest fetch."""
    if texture.nearest_bits is None:
        return u
    np.multiply(u, u.dtype.type(2**texture.nearest_bits), out=out)
    np.floor(out, out=out)
    return np.multiply(out, u.dtype.type(2.0**-texture.nearest_bits), out=out)


def _interpolate(
    corners: tuple[Numbers, ...], index: Numbers, weights: list[Numbers], out: Floats, work: Workspace
) -> None:
    """Write to `out` the interpolation of the 2^k corners found at `index` by k weights."""
    found = texels_of(corners[: 2 ** len(weights)], index, out, work)
    for weight in weights:
        for low, high in zip(found[::2], found[1::2], strict=True):
            np.subtract(high, low, out=high)
            np.multiply(high, weight, out=high)
            np.add(low, high, out=low)
        found = found[::2]


def _interpolate_codes(
    corners: tuple[Numbers, ...],
    index: Numbers,
    weights: list[Numbers],
    out: Numbers,
    bits: int,
    work: Workspace,
) -> None:
    """Write to `out` the codes interpolated from codes: a + (f (b - a) + half >> bits) each time."""
    half = np.int32(1 << bits >> 1)
    found = texels_of(corners[: 2 ** len(weights)], index, out, work)
    for weight in weights:
        for low, high in zip(found[::2], found[1::2], strict=True):
            np.subtract(high, low, out=high)
            np.multiply(high, weight, out=high)
            np.add(high, half, out=high)
            np.right_shift(high, np.int32(bits), out=high)
            np.add(low, high, out=low)
        found = found[::2]


def texels_of(corners: tuple[Numbers, ...], index: Numbers, out: Numbers, work: Workspace) -> list[Numbers]:
    """Return the texels of corners, those of the first in `out`."""
    found = [out, *(work.get(f"corner {k}", len(index), out.dtype) for k in range(1, len(corners)))]
    for corner, texel in zip(corners, found, strict=True):
        # mode="wrap" writes straight into `out`; "raise" would go through a buffer.
        np.take(corner, index, out=texel, mode="wrap")
    return found


def _decode(codes: Numbers, bits: int, out: Floats) -> None:
    """Write the numbers 0..1 of codes to `out`, as `volref.formats.decoded` does."""
    most = 2**bits - 1
    if out.dtype == np.float32:
        np.copyto(out, codes, casting="unsafe")
        np.multiply(out, np.float32(1 / most), out=out)
    else:
        np.divide(codes, most, out=out, casting="unsafe")


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
        low = fetch(chain[k], points, work)
        high = fetch(chain[min(k + 1, len(chain) - 1)], points, work)
        result[:, here] = low + (level[here] - k).astype(low.dtype) * (high - low)
    return result
