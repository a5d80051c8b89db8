"""An image in parts: the pixels that are worked on together."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from volref.arrays import Indices
from volref.scene.footprint import Rectangle
from volref.scene.scene import Scene

# The exact integrator takes the rays of a tile together: they go through the same cells.  Tiles of large
# images are twice as wide and high, so that NumPy has more to do per call.
TILE_WIDTH, TILE_HEIGHT = 32, 16
LARGE_IMAGE = 1 << 18


@dataclass(frozen=True, eq=False)
class Parts:
    """Some parts of an image; `pixels` makes the indices of part i, in 0..count - 1, when they are needed.

    The indices of all parts of a large image would take as much memory as two of its channels.
    """

    count: int
    pixels: Callable[[int], Indices]

    def only(self, chosen: list[int]) -> "Parts":
        """Return the parts with the numbers `chosen`."""
        return Parts(len(chosen), lambda i: self.pixels(chosen[i]))

    def grouped(self, size: int) -> list[range]:
        """Return the numbers of the parts in runs of `size`."""
        return [range(first, min(first + size, self.count)) for first in range(0, self.count, size)]


def runs(pixels: int, length: int) -> Parts:
    """Return `pixels` pixels in runs of `length`.

    Examples
    --------
    >>> parts = runs(5, 2)
    >>> [parts.pixels(i).tolist() for i in range(parts.count)]
    [[0, 1], [2, 3], [4]]
    """
    return Parts(
        -(-pixels // length), lambda i: np.arange(i * length, min((i + 1) * length, pixels), dtype=np.intp)
    )


def runs_in(rectangle: Rectangle, width: int, length: int) -> Parts:
    """Return the pixels of a rectangle of an image `width` wide, row by row, in runs of `length`.

    Examples
    --------
    >>> parts = runs_in(Rectangle(1, 3, 0, 2), 4, 3)
    >>> [parts.pixels(i).tolist() for i in range(parts.count)]
    [[1, 2, 5], [6]]
    """
    inside = runs(rectangle.pixels, length)
    across = max(rectangle.right - rectangle.left, 1)

    def pixels(number: int) -> Indices:
        y, x = np.divmod(inside.pixels(number), across)
        return np.asarray((y + rectangle.top) * width + (x + rectangle.left))

    return Parts(inside.count, pixels)


def cut(chosen: Indices, length: int) -> Parts:
    """Return the pixels `chosen` in runs of `length`."""
    return Parts(-(-len(chosen) // length), lambda i: chosen[i * length : (i + 1) * length])


def tiles(scene: Scene, rectangle: Rectangle) -> Parts:
    """Return the tiles of TILE_WIDTH x TILE_HEIGHT, or twice that, that touch the rectangle.

    They are smaller where the image ends.
    """
    times = 2 if scene.width * scene.height >= LARGE_IMAGE else 1
    tile_width, tile_height = times * TILE_WIDTH, times * TILE_HEIGHT
    left, top = rectangle.left // tile_width, rectangle.top // tile_height
    across, down = -(-rectangle.right // tile_width) - left, -(-rectangle.bottom // tile_height) - top
    if rectangle.pixels == 0:
        across, down = 1, 0

    def pixels(number: int) -> Indices:
        row, column = divmod(number, across)
        row, column = row + top, column + left
        y = np.arange(row * tile_height, min((row + 1) * tile_height, scene.height), dtype=np.intp)
        x = np.arange(column * tile_width, min((column + 1) * tile_width, scene.width), dtype=np.intp)
        return np.asarray(y[:, None] * scene.width + x).ravel()

    return Parts(across * down, pixels)
