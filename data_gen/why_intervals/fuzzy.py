"""dEQP's fuzzy comparison, after VK-GL-CTS framework/common/tcuFuzzyImageCompare.cpp (commit 1a78b8c3).

Both images are blurred by (0.1, 0.8, 0.1) along x and y, with bytes in between.  On every row but the outer
ones, at pixels 1 to 8 apart, the squared distance of a pixel's colour to the nearest in the other image's
neighbourhood is taken: the pixel itself, the 8 around it, then 32 places between them.  Of the distances
in both directions the smaller counts.  The result is the sum of its squares, scaled to all pixels, with 1
for each pixel that is off by 251 in one channel.  Differences of up to 4 in a channel count as none.

Kept from the original: its random numbers (Marsaglia's xorshift, seed 667), which are drawn only where they
are needed, its arithmetic in float32, and the square that overflows at 32 bits.
"""

from collections.abc import Iterator
from functools import cache

import numpy as np
from numpy.typing import NDArray

from volref.arrays import Bytes, Integers

SEED = 667
MIN_ERROR = 4
LARGEST_SKIP = 8
PLACES = 32
KERNEL = np.array([0.1, 0.8, 0.1], np.float32)
NEIGHBOURS = [(dy, dx) for dy in (-1, 0, 1) for dx in (-1, 0, 1)]
WORD = 0xFFFFFFFF


def fuzzy_difference(reference: Bytes, candidate: Bytes) -> float:
    """Return the difference of two images (H, W, 3); dEQP's tests compare it with 0.05 or so.

    Examples
    --------
    >>> black = np.zeros((9, 9, 3), np.uint8)
    >>> fuzzy_difference(black, black + np.uint8(4))
    0.0
    """
    ours, theirs = _blurred(reference), _blurred(candidate)
    near_ours, near_theirs = _nearest_texel(ours, theirs), _nearest_texel(theirs, ours)
    height, width = reference.shape[:2]
    stream = _Stream()
    total, count = 0, 0
    for y in range(1, height - 1):
        x = 1
        while x < width - 1:
            forth = _nearest(stream, ours[y, x], theirs, x, y, int(near_ours[y, x]))
            back = _nearest(stream, theirs[y, x], ours, x, y, int(near_theirs[y, x]))
            squared = min(forth, back)
            total += squared * squared & WORD
            count += 1
            x += 1 + stream.next() % LARGEST_SKIP
    return total / (255 - MIN_ERROR) ** 4 * ((width - 2) * (height - 2) / count)


class _Stream:
    """A place in the stream of random numbers, which is the same for all images."""

    def __init__(self) -> None:
        self.at = 0

    def next(self) -> int:
        """Return the next number."""
        self.at += 1
        return int(_numbers(self.at)[self.at - 1])

    def ahead(self, count: int) -> NDArray[np.uint32]:
        """Return numbers from here on without taking them."""
        return _numbers(self.at + count)[self.at : self.at + count]


def _numbers(count: int) -> NDArray[np.uint32]:
    """Return at least so many of the first random numbers."""
    size = 1 << 12
    while size < count:
        size *= 2
    return _first_numbers(size)


@cache
def _first_numbers(size: int) -> NDArray[np.uint32]:
    numbers = _xorshift(SEED)
    return np.fromiter((next(numbers) for _ in range(size)), np.uint32, size)


def _xorshift(seed: int) -> Iterator[int]:
    """Yield the numbers of framework/delibs/debase/deRandom.c.

    Examples
    --------
    >>> numbers = _xorshift(0)
    >>> next(numbers) == (88675123 ^ 88675123 >> 19) ^ (t := 123456789 ^ 123456789 << 11 & WORD) ^ t >> 8
    True
    """
    x = (-seed & WORD) ^ 123456789
    y = 362436069 * seed & WORD
    z = 521288629 ^ seed >> 7
    w = (88675123 ^ seed << 3) & WORD
    while True:
        t = (x ^ x << 11) & WORD
        x, y, z = y, z, w
        w = (w ^ w >> 19) ^ (t ^ t >> 8)
        yield w


def _blurred(image: Bytes) -> Bytes:
    """Return the image blurred along x, rounded, then along y and rounded."""
    blurred = image
    for axis in (1, 0):
        ends = [(1, 1) if k == axis else (0, 0) for k in range(3)]
        wide = np.pad(blurred, ends, mode="edge").astype(np.float32)
        size = image.shape[axis]
        total = np.zeros(image.shape, np.float32)
        for k, weight in enumerate(KERNEL):
            total += wide.take(range(k, k + size), axis=axis) * weight
        blurred = _rounded(total)
    return blurred


def _rounded(values: NDArray[np.float32]) -> Bytes:
    """Return bytes, halves up."""
    return np.clip((values + np.float32(0.5)).astype(np.int64), 0, 255).astype(np.uint8)


def _squared_distance(a: NDArray[np.uint8], b: NDArray[np.uint8]) -> Integers:
    """Return the squared distance (...) of colours (..., 3)."""
    apart = np.abs(a.astype(np.int64) - b.astype(np.int64)) - MIN_ERROR
    return np.asarray((np.maximum(apart, 0) ** 2).sum(axis=-1))


def _nearest_texel(image: Bytes, other: Bytes) -> Integers:
    """Return the least squared distance of every pixel to the nine about it in the other image."""
    height, width = image.shape[:2]
    wide = np.pad(other, ((1, 1), (1, 1), (0, 0)), mode="edge")
    shifted = (wide[1 + dy : 1 + dy + height, 1 + dx : 1 + dx + width] for dy, dx in NEIGHBOURS)
    return np.min([_squared_distance(image, near) for near in shifted], axis=0)


def _nearest(stream: _Stream, color: Bytes, other: Bytes, x: int, y: int, known: int) -> int:
    """Return the least squared distance of a colour to the other image about (x, y)."""
    if known == 0:
        return 0
    fractions = (stream.ahead(2 * PLACES) & np.uint32(0xFFFFFFF)).astype(np.float32) / np.float32(1 << 28)
    offsets = fractions.reshape(PLACES, 2) * np.float32(2) - np.float32(0.5)
    u, v = np.float32(x) + offsets[:, 0], np.float32(y) + offsets[:, 1]
    distances = _squared_distance(color, _between(other, u, v))
    equal = np.flatnonzero(distances == 0)
    stream.at += 2 * (int(equal[0]) + 1 if equal.size else PLACES)
    return min(known, int(distances.min()))


def _between(image: Bytes, u: NDArray[np.float32], v: NDArray[np.float32]) -> Bytes:
    """Return the colours (n, 3) at places (n,), pixel centres at halves, by a linear filter."""
    height, width = image.shape[:2]
    left, top = np.floor(u - np.float32(0.5)), np.floor(v - np.float32(0.5))
    a, b = (u - np.float32(0.5) - left)[:, None], (v - np.float32(0.5) - top)[:, None]
    columns = [np.clip(left.astype(int) + k, 0, width - 1) for k in (0, 1)]
    rows = [np.clip(top.astype(int) + k, 0, height - 1) for k in (0, 1)]
    one = np.float32(1)
    upper = image[rows[0], columns[0]] * (one - a) * (one - b) + image[rows[0], columns[1]] * a * (one - b)
    lower = image[rows[1], columns[0]] * (one - a) * b
    return _rounded(upper + lower + image[rows[1], columns[1]] * a * b)
