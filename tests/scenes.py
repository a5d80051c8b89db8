"""Small scenes that several tests share."""

import numpy as np

from volref import Camera, Scene, TransferFunction, Volume


def rough_volume(seed=0, shape=(7, 6, 5), dtype=np.float64, centering="cell", **place):
    """Independent random samples in 0..1 (0..255 for uint8): the least smooth field there is."""
    values = np.random.default_rng(seed).random(shape)
    if np.dtype(dtype).kind == "u":
        values *= np.iinfo(dtype).max
    return Volume(values.astype(dtype), centering=centering, **place)


def colorful_transfer(top=1.0, extinction=2.0):
    """Transparent up to 0.3 of `top`, then denser, with a colour that changes throughout."""
    values = np.array([0.0, 0.3, 0.6, 1.0]) * top
    colors = [(0.2, 0.0, 1.0), (0.2, 0.4, 1.0), (1.0, 0.6, 0.1), (0.9, 0.9, 0.3)]
    return TransferFunction(values, colors, np.array([0.0, 0.0, 0.5, 1.0]) * extinction)


def camera_towards(volume, direction=(1.1, 0.7, 0.9), fov_y=35.0, distance=2.5):
    """A camera outside that sees the whole volume."""
    low, high = volume.corners.min(axis=0), volume.corners.max(axis=0)
    center, size = (low + high) / 2, np.linalg.norm(high - low)
    eye = center + np.array(direction) / np.linalg.norm(direction) * size * distance / 2
    return Camera.look_at(eye, center, (0, 0, 1), fov_y, size / 100, size * 10)


def sparse_scene(side=32, size=24):
    """A small visible cube in an empty volume: almost everything can be skipped."""
    values = np.zeros((side, side, side))
    values[8:12, 16:20, 16:20] = 1.0
    volume = Volume(values)
    return Scene(volume, colorful_transfer(), camera_towards(volume), size, size)


def rough_scene(width=24, height=16, *, seed=0, transfer=None, background=(0.0, 0.0, 0.0, 0.0), **volume):
    field = rough_volume(seed, **volume)
    transfer = transfer or colorful_transfer(field.value_bounds[1])
    return Scene(field, transfer, camera_towards(field), width, height, background=background)
