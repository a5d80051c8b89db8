"""Where the samples of a made-up volume lie: a box about the world's origin.

Four samples, spacing 2:

    cell:   |--0--|--1--|--2--|--3--|    samples at -3 -1 1 3, extent -4 to 4
    node:      0-----1-----2-----3       samples at -3 -1 1 3, extent -3 to 3

The half voxel at each end is part of a "cell" volume only.
"""

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from volref.arrays import Floats, Numbers, Vector, float_array, one_of, whole_number
from volref.scene import Volume

Size: TypeAlias = int | tuple[int, int, int]
Spacing: TypeAlias = float | tuple[float, float, float]

LARGEST_SIDE = 65536


@dataclass(frozen=True, eq=False)
class Grid:
    """Sample coordinates x (1, 1, nx), y (1, ny, 1), z (nz, 1, 1) that broadcast to (nz, ny, nx).

    `half` is half the extent (x, y, z) of the volume in world units.
    """

    x: Floats
    y: Floats
    z: Floats
    spacing: Vector
    half: Vector
    centering: str

    @property
    def shape(self) -> tuple[int, int, int]:
        """Shape (nz, ny, nx) of the values."""
        return self.z.size, self.y.size, self.x.size

    def volume(self, values: Numbers) -> Volume:
        """Return the volume with `values`, which broadcast to (nz, ny, nx)."""
        origin = float(self.x.flat[0]), float(self.y.flat[0]), float(self.z.flat[0])
        full = np.ascontiguousarray(np.broadcast_to(values, self.shape))
        return Volume(full, self.spacing, origin, centering=self.centering)


def centered_grid(size: Size, spacing: Spacing, centering: str) -> Grid:
    """Return the grid of `size` samples (one number, or (nx, ny, nz)) about the world's origin.

    Raises
    ------
    SceneError
        If `size` is below 2, `spacing` is not positive, or `centering` is neither "cell" nor "node".

    Examples
    --------
    >>> grid = centered_grid((4, 2, 2), 2.0, "cell")
    >>> grid.x.ravel().tolist(), grid.half, grid.shape
    ([-3.0, -1.0, 1.0, 3.0], (4.0, 2.0, 2.0), (2, 2, 4))
    """
    one_of("centering", centering, ("cell", "node"))
    counts = (size, size, size) if isinstance(size, int) else tuple(size)
    counts = tuple(whole_number("size", n, low=2, high=LARGEST_SIDE) for n in counts)
    steps = float_array("spacing", (spacing,) * 3 if np.ndim(spacing) == 0 else spacing, (3,)).tolist()
    x, y, z = ((np.arange(n) - (n - 1) / 2) * s for n, s in zip(counts, steps, strict=True))
    ends = 0 if centering == "cell" else 1
    half = tuple((n - ends) / 2 * s for n, s in zip(counts, steps, strict=True))
    return Grid(x[None, None, :], y[None, :, None], z[:, None, None], tuple(steps), half, centering)
