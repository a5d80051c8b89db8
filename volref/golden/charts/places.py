"""Charts of where things are: axes, halves of voxels, slices of an atlas, the volume's own place."""

import numpy as np
from numpy.typing import ArrayLike

from volref.arrays import Vector
from volref.golden.charts.building import UPWARDS, bytes_volume, indices, pictured, rainbow, view
from volref.scene.scene import Scene
from volref.scene.transfer import TransferFunction
from volref.scene.volume import Volume

# A turn about an oblique axis, orthogonal to rounding.
_OBLIQUE, _UPPER = np.linalg.qr(np.array([[2.0, -1.0, 0.5], [1.0, 2.0, 0.3], [-0.4, 0.2, 2.0]]))
TURN = _OBLIQUE * np.sign(np.diag(_UPPER))


def letter(
    nz: int = 9,
    spacing: Vector = (1.0, 1.0, 1.0),
    direction: ArrayLike | None = None,
    origin: Vector = (0.0, 0.0, 0.0),
) -> Volume:
    """Return an F of bars with a value of their own each, none like another when mirrored or turned.

    y  9  ########      the top arm reaches back, in z, the middle one comes forward
       7  ##            a dot lies in one corner of the box
       5  #####
       1  ##    .       x and y from 0; the stem is 2 thick
    """
    x, y, z = indices(10, 12, nz)
    values = np.zeros(x.shape)
    bars = (
        (102, (2, 3), (1, 10), (3, 5)),
        (153, (2, 8), (9, 10), (3, nz - 2)),
        (204, (2, 6), (5, 6), (1, 5)),
        (255, (8, 8), (1, 2), (1, 2)),
    )
    for value, *box in bars:
        held = [(axis >= low) & (axis <= high) for axis, (low, high) in zip((x, y, z), box, strict=True)]
        values[np.logical_and.reduce(held)] = value
    return bytes_volume(values, spacing, direction, origin)


def f_shape() -> Scene:
    """Return an F in a 3-D texture."""
    volume = letter()
    return pictured(volume, rainbow(0.8), view(volume, (0.55, 0.35, 1.0)))


def f_atlas() -> Scene:
    """Return the F in an atlas of 11 slices, 4 x 3 tiles: neither square nor full."""
    volume = letter(11)
    return pictured(volume, rainbow(0.8), view(volume, (0.75, 0.4, 1.0)))


def turned() -> Scene:
    """Return the F of voxels of three lengths in a volume that is turned and moved."""
    volume = letter(9, (1.2, 0.9, 0.6), direction=TURN, origin=(3.0, -2.0, 5.0))
    return pictured(volume, rainbow(0.8), view(volume, TURN @ (0.5, 0.4, 1.0), up=TURN @ UPWARDS))


def ramp_by_bright() -> Scene:
    """Return a ramp along z beside a slice that is bright alone, and a last slice that is bright too."""
    x, y, z = indices(12, 10, 11)
    ramp = np.where((x < 5) & (y > 1), 25.5 * z, 0.0)
    alone = np.where((x >= 7) & (y < 8) & ((z == 4) | (z == 10)), 255.0, 0.0)
    volume = bytes_volume(np.maximum(ramp, alone))
    return pictured(volume, rainbow(0.7), view(volume, (1.0, 0.45, 0.3)))


def full_tiles() -> Scene:
    """Return values up to the faces that differ from slice to slice, as does a neighbour in an atlas."""
    x, y, z = indices(8, 10, 10)
    near = np.minimum.reduce([x, 7 - x, y, 9 - y])
    values = np.where(near < 2, 255 * ((3 * z) % 10) / 9, 20.0)
    volume = bytes_volume(values)
    return pictured(volume, rainbow(0.6), view(volume, (0.8, 0.6, 1.0)))


def checkers() -> Scene:
    """Return values that jump from voxel to voxel."""
    x, y, z = indices(9, 8, 7)
    values = 51 * ((x + 2 * y + 3 * z) % 6) * ((x + y + z) % 2)
    volume = bytes_volume(values)
    return pictured(volume, rainbow(0.7), view(volume, (0.7, 0.5, 1.0)))


def no_data() -> Scene:
    """Return a slab with a hole of voxels without a value, which hold the least value of the table."""
    x, y, z = indices(12, 10, 6)
    values = 100 + 12 * x
    hole = (abs(x - 7) <= 2) & (abs(y - 4) <= 2) & (z >= 1)
    volume = Volume(np.where(hole, np.nan, np.rint(values)), nan=0.0)
    look = TransferFunction.from_opacity(
        [0, 99, 100, 255],
        [(0.2, 0.2, 0.2), (0.2, 0.2, 0.2), (0.2, 0.6, 1.0), (1.0, 0.6, 0.2)],
        [0, 0, 0.4, 0.6],
    )
    return pictured(volume, look, view(volume, (0.5, 0.4, 1.0)))
