"""A volume that no flip or swap of axes leaves the same, places for it, and how to tell that it is there."""

import numpy as np

from volref.scene.transform import transform_points

FLIPS = [(1, 1, 1), (-1, 1, 1), (1, -1, 1), (1, 1, -1), (-1, -1, -1)]
FLIP_LPS = np.diag([-1.0, -1.0, 1.0])


def letter_f(dtype=np.int16):
    """An F in x and y, another thickness in each slice: no flip or swap of axes leaves it the same."""
    values = np.zeros((4, 6, 5), dtype)
    values[:, :, 1] = 3
    values[:, 0, 1:5] = 5
    values[:, 2, 1:4] = 7
    return values * (np.arange(4, dtype=dtype) + 1)[:, None, None]


def oblique(*, flips=(1, 1, 1), spacing=(0.7, 1.3, 5.0), origin=(-98.25, 134.5, 72.125)):
    """A rotated, anisotropic, possibly mirrored matrix from (i, j, k) to the world."""
    a, b = 0.3, -0.5
    turn = np.array([[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]])
    tilt = np.array([[1, 0, 0], [0, np.cos(b), -np.sin(b)], [0, np.sin(b), np.cos(b)]])
    matrix = np.eye(4)
    matrix[:3, :3] = turn @ tilt @ np.diag(flips) @ np.diag(spacing)
    matrix[:3, 3] = origin
    return matrix


def assert_places_equal(volume, affine, values_zyx):
    """Each voxel has the value and the position that the library's own matrix gives it."""
    nx, ny, nz = volume.size
    index = np.stack(np.meshgrid(range(nx), range(ny), range(nz), indexing="ij"), axis=-1).reshape(-1, 3)
    expected = index @ affine[:3, :3].T + affine[:3, 3]
    # Splitting a column into length and unit vector and joining them again costs at most 2 ulp of each
    # entry; a sum of 4 products adds 3 more roundings at the size of the largest term.
    size = np.abs(index) @ np.abs(affine[:3, :3]).T + np.abs(affine[:3, 3])
    error = np.abs(transform_points(volume.world_from_index, index) - expected)
    assert (error <= 8 * np.finfo(np.float64).eps * size).all()
    assert np.array_equal(volume.values, values_zyx)
    assert volume.values.dtype.isnative
