"""Charts of light along a ray: opacity and steps, first and last samples, ends of rays, tables."""

import numpy as np

from volref.golden.charts.building import (
    BLUE,
    CYAN,
    RED,
    UNIT_DISTANCE,
    YELLOW,
    bytes_volume,
    indices,
    pictured,
    rainbow,
    view,
)
from volref.scene.scene import Scene
from volref.scene.transfer import TransferFunction
from volref.scene.volume import Volume


def opaque_border() -> Scene:
    """Return a hollow box, dense on all faces: the first sample of each ray decides most of it."""
    x, y, z = indices(10, 10, 10)
    near = np.minimum.reduce([x, 9 - x, y, 9 - y, z, 9 - z])
    values = np.where(near < 1, 100 + 10 * x + 5 * y, 0.0)
    volume = bytes_volume(values)
    return pictured(volume, rainbow(0.95, 1.0), view(volume, (0.7, 0.5, 1.0)))


def thin_slab() -> Scene:
    """Return a leaf one voxel thick, oblique to all axes: few samples, and where they lie decides."""
    x, y, z = indices(12, 12, 12)
    apart = abs(0.8 * (z - 5.5) + 0.5 * (x - 5.5) + 0.33 * (y - 5.5))
    values = np.where(apart < 0.6, 120 + 12 * x, 0.0)
    volume = bytes_volume(values)
    return pictured(volume, rainbow(0.8, 1.0), view(volume, (0.3, 0.5, 1.0)))


def _long_voxels(direction: tuple[float, float, float]) -> Scene:
    x, y, z = indices(8, 12, 14)
    ball = ((x - 3.5) / 4) ** 2 + ((y - 5.5) / 6) ** 2 + ((z - 6.5) / 7) ** 2
    values = 255 * np.clip(1.1 - ball, 0, 1) * np.where(x + z < 9, 1.0, 0.6)
    volume = bytes_volume(values, (2.4, 0.8, 1.2))
    return pictured(volume, rainbow(0.4), view(volume, direction, up=(0.1, 0.3, 1.0)))


def long_voxels_x() -> Scene:
    """Return voxels three times as long in x as in y, seen along x."""
    return _long_voxels((1.0, 0.12, 0.17))


def long_voxels_y() -> Scene:
    """Return the same, seen along y."""
    return _long_voxels((0.12, 1.0, 0.17))


def bright_back() -> Scene:
    """Return a dark front, denser from left to right, before a back that is bright."""
    x, _, z = indices(14, 10, 10)
    front = np.where(z >= 5, 8 * x, 0.0)
    back = np.where(z < 2, 255.0, front)
    volume = bytes_volume(back)
    colors = [(0.2, 0.0, 0.4), (0.2, 0.0, 0.4), (0.4, 0.0, 0.2), (1.0, 1.0, 0.6), (1.0, 1.0, 0.6)]
    look = TransferFunction.from_opacity([0, 20, 140, 240, 255], colors, [0, 0.05, 0.8, 0.9, 0.9], 2.0)
    return pictured(volume, look, view(volume, (0.25, 0.4, 1.0)))


def long_rays() -> Scene:
    """Return a rod seen along its length: thin all the way, and bright at its far end."""
    x, y, z = indices(6, 6, 16)
    values = np.where(z < 3, 255.0, 40 + 4 * x + 8 * y)
    volume = bytes_volume(values)
    return pictured(volume, rainbow(0.7, 4.0), view(volume, (0.15, 0.12, 1.0), distance=1.2))


def grey_slab() -> Scene:
    """Return one value, one colour, up to the faces: what is seen is length alone."""
    volume = bytes_volume(np.full((6, 10, 12), 127.5))
    look = TransferFunction.from_opacity([0, 255], [(1.0, 0.8, 0.4)] * 2, [0.2, 0.2])
    return pictured(volume, look, view(volume, (0.4, 0.5, 1.0)))


def inside() -> Scene:
    """Return a box with the eye in it."""
    x, y, z = indices(12, 12, 12)
    values = 127 + 127 * np.sin(0.9 * x + 0.4) * np.cos(0.7 * y) * np.sin(0.5 * z + 1)
    volume = bytes_volume(values)
    camera = view(volume, (0.8, 0.5, 0.6), distance=0.15, fov_y=75.0)
    return pictured(volume, rainbow(0.5, 4.0), camera)


def _waves() -> Volume:
    x, y, z = indices(12, 10, 8)
    return bytes_volume(127.5 + 127.5 * np.sin(0.5 * x + 0.3 * z) * np.cos(0.45 * y - 0.2 * z))


def two_entries() -> Scene:
    """Return waves through a table of two entries, all of which lies between them."""
    volume = _waves()
    look = TransferFunction.from_opacity([0, 255], [BLUE, YELLOW], [0.2, 0.6])
    return pictured(volume, look, view(volume, (0.5, 0.6, 1.0)))


def spike() -> Scene:
    """Return waves through a table that is transparent but for a narrow spike: shells."""
    volume = _waves()
    look = TransferFunction.from_opacity(
        [0, 118, 128, 138, 255], [BLUE, CYAN, YELLOW, RED, RED], [0, 0, 0.9, 0, 0], 1.0
    )
    return pictured(volume, look, view(volume, (0.5, 0.6, 1.0)))


def fine_values() -> Scene:
    """Return values that lie closer than 8 or 16 bits tell, through a table that is steep there."""
    x, y, z = indices(12, 10, 8)
    values = 0.7 + 0.002 * np.sin(0.5 * x + 0.3 * z) * np.cos(0.45 * y - 0.2 * z)
    look = TransferFunction.from_opacity(
        [0, 0.698, 0.7, 0.702, 1], [BLUE, BLUE, YELLOW, RED, RED], [0, 0, 0.4, 0.8, 0.8], UNIT_DISTANCE
    )
    volume = Volume(values.astype(np.float32))
    return pictured(volume, look, view(volume, (0.5, 0.6, 1.0)))
