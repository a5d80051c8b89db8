"""4x4 matrices between right-handed spaces, named destination first.

`world_from_view` takes a view point to the world: `p_world = world_from_view @ p_view`.
Points are rows in NumPy, so a matrix acts on many points as `points @ matrix[:3, :3].T + matrix[:3, 3]`.
"""

import numpy as np

from volref.arrays import Floats
from volref.errors import SceneError


def affine(linear: Floats, translation: Floats) -> Floats:
    """Return the 4x4 matrix of `p -> linear @ p + translation`."""
    matrix = np.eye(4)
    matrix[:3, :3] = linear
    matrix[:3, 3] = translation
    return matrix


def transform_points(matrix: Floats, points: Floats) -> Floats:
    """Apply an affine 4x4 matrix to points (..., 3).

    Examples
    --------
    >>> transform_points(affine(np.eye(3), np.array([1.0, 0.0, 0.0])), np.zeros((1, 3)))
    array([[1., 0., 0.]])
    """
    x, y, z = np.moveaxis(points, -1, 0)
    parts = [row[0] * x + row[1] * y + row[2] * z + row[3] for row in matrix[:3]]
    return np.moveaxis(np.stack(parts), 0, -1)


def transform_directions(matrix: Floats, directions: Floats) -> Floats:
    """Apply the linear part of an affine 4x4 matrix to directions (..., 3).

    Written out, because a matrix product may round a row differently in an array of another length, and a
    ray must not depend on the chunk that it stands in.
    """
    x, y, z = np.moveaxis(directions, -1, 0)
    return np.moveaxis(np.stack([row[0] * x + row[1] * y + row[2] * z for row in matrix[:3, :3]]), 0, -1)


def invert_affine(name: str, matrix: Floats) -> Floats:
    """Return the inverse of an affine 4x4 matrix.

    Raises
    ------
    SceneError
        If the last row is not (0, 0, 0, 1) or the linear part is singular.
    """
    if not np.array_equal(matrix[3], (0.0, 0.0, 0.0, 1.0)):
        message = f"{name} must have the last row (0, 0, 0, 1), got {matrix[3].tolist()}; "
        raise SceneError(message + "give an affine matrix, rows first")
    check_regular(name, matrix[:3, :3])
    linear = np.asarray(np.linalg.inv(matrix[:3, :3]), dtype=np.float64)
    return affine(linear, np.asarray(-linear @ matrix[:3, 3]))


def check_regular(name: str, linear: Floats) -> None:
    """Refuse a 3x3 matrix whose columns are, to rounding, linearly dependent.

    The determinant of the matrix with its columns scaled to unit length is the volume of the box they
    span, between 0 and 1; below 1e-9 an inverse keeps fewer than 7 digits.

    Raises
    ------
    SceneError
        If the matrix is singular by that measure.
    """
    lengths = np.linalg.norm(linear, axis=0)
    if (lengths > 0).all() and abs(np.linalg.det(linear / lengths)) > 1e-9:
        return
    message = f"{name} must be invertible, got {linear.tolist()}; give three independent columns"
    raise SceneError(message)
