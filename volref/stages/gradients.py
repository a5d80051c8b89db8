"""Stage: the gradient of the field, in index space and in the world.

n points; gradients are (3, n), x first, in value units per index or per world unit.

The 3 x 3 x 3 operators are correlations with weights on the 27 samples around.  Sobel's x component (Sobel
and Feldman 1968, in three dimensions) is the central difference along x, smoothed by 1 2 1 along y and z:

    slice x - 1        slice x        slice x + 1
    -1 -2 -1           0  0  0         1  2  1
    -2 -4 -2           0  0  0         2  4  2        / 32
    -1 -2 -1           0  0  0         1  2  1

so that a ramp of slope 1 has the gradient 1.  Beyond the border the outer samples go on, so that on the outer
samples themselves a ramp has half its slope: of the two differences around them one is 0.
"""

from functools import cache

import numpy as np

from volref.arrays import Floats, Numbers


def cell_gradient(corners: list[Floats], fraction: Floats) -> Floats:
    """Return the gradient of the trilinear field in cells with eight samples (n,), x fastest, at `fraction`.

    Examples
    --------
    >>> corners = [np.array([x + 10.0 * y + 100 * z * x]) for z in (0, 1) for y in (0, 1) for x in (0, 1)]
    >>> cell_gradient(corners, np.array([[0.25], [0.5], [0.5]])).ravel().tolist()
    [51.0, 10.0, 25.0]
    """
    c = np.stack(corners).reshape(2, 2, 2, -1)  # z, y, x
    x, y, z = fraction
    gradient = np.empty(fraction.shape)
    across = c[:, :, 1] - c[:, :, 0]
    gradient[0] = _mix(_mix(across[0, 0], across[0, 1], y), _mix(across[1, 0], across[1, 1], y), z)
    rows = _mix(c[:, :, 0], c[:, :, 1], x)
    gradient[1] = _mix(rows[0, 1] - rows[0, 0], rows[1, 1] - rows[1, 0], z)
    gradient[2] = _mix(rows[1, 0], rows[1, 1], y) - _mix(rows[0, 0], rows[0, 1], y)
    return gradient


@cache
def sobel_kernels() -> Floats:
    """Return the weights (3, 3, 3, 3) of the x, y and z components over the samples [z, y, x]."""
    smooth, across = np.array([1.0, 2.0, 1.0]) / 4, np.array([-1.0, 0.0, 1.0]) / 2
    along_x = smooth[:, None, None] * smooth[:, None] * across
    return np.stack([along_x, along_x.transpose(0, 2, 1), along_x.transpose(2, 1, 0)])


@cache
def cej_kernels() -> Floats:
    """Return the weights with which Cej 2020 computes MINUS the gradient, its misprint included.

    Sobel's weights without their normalisation, divided by 27.  In the z component one weight of the far
    slice is -2 in place of -1, so that a constant field c has the gradient -c / 27 along z.
    """
    kernels = sobel_kernels() * (-32.0 / 27.0)
    kernels[2, 2, 2, 2] = -2.0 / 27.0
    return kernels


def sobel(values: Numbers, axis: int) -> Numbers:
    """Return Sobel's component (nz, ny, nx) along x, y or z (0, 1, 2), in float32 where that is exact.

    The difference is taken first, and smoothed after: all 27 products at once leave 1e-18 of a constant 0.1,
    and a gradient of any length has a direction.

    Examples
    --------
    >>> ramp = np.arange(5.0) * np.ones((4, 3, 1))
    >>> sobel(ramp, 0)[0, 0].tolist(), sobel(ramp, 1)[0, 0].tolist()
    ([0.5, 1.0, 1.0, 1.0, 0.5], [0.0, 0.0, 0.0, 0.0, 0.0])
    """
    from scipy.ndimage import correlate1d

    # Whole numbers of 16 bits take 21: one more for a difference, four for the weights.
    narrow = values.dtype.kind in "iu" and values.itemsize <= 2
    result = np.empty(values.shape, np.float32 if narrow else np.float64)
    correlate1d(_readable(values), [-0.5, 0.0, 0.5], 2 - axis, result, mode="nearest")
    for across in {0, 1, 2} - {axis}:
        correlate1d(result, [0.25, 0.5, 0.25], 2 - across, result, mode="nearest")
    return result


def differentiated(values: Numbers, kernels: Floats, dtype: np.typing.DTypeLike = np.float64) -> Numbers:
    """Return the three components (3, nz, ny, nx) of correlating samples with `kernels`, in `dtype`.

    Examples
    --------
    >>> ramp = np.arange(5.0) * np.ones((4, 3, 1))
    >>> differentiated(ramp, sobel_kernels())[:, 2, 1, 2].tolist()
    [1.0, 0.0, 0.0]
    """
    from scipy.ndimage import correlate

    result = np.empty((3, *values.shape), dtype)
    for component, kernel in zip(result, kernels, strict=True):
        correlate(_readable(values), kernel, component, mode="nearest")
    return result


def in_world(gradient: Floats, index_from_world: Floats) -> Floats:
    """Return the world gradient of an index gradient: by the chain rule, times the matrix transposed.

    Examples
    --------
    >>> in_world(np.array([[1.0], [1.0], [1.0]]), np.diag([1, 0.5, 0.25, 1])).ravel().tolist()
    [1.0, 0.5, 0.25]
    """
    rows = index_from_world[:3, :3].T
    # Summed one by one: a matrix product rounds differently by how many points there are.
    return np.stack([row[0] * gradient[0] + row[1] * gradient[1] + row[2] * gradient[2] for row in rows])


def length_and_direction(vectors: Floats) -> tuple[Floats, Floats]:
    """Return how long vectors (3, n) are, and the unit vectors along them, 0 where there is no length.

    They are scaled first: the squares of numbers below 1e-162 are zero, and those of 1e155 are infinite.

    Examples
    --------
    >>> length, direction = length_and_direction(np.array([[3e-200, 0.0], [0.0, 0.0], [4e-200, 0.0]]))
    >>> length.tolist(), direction.T.round(12).tolist()
    ([5e-200, 0.0], [[0.6, 0.0, 0.8], [0.0, 0.0, 0.0]])
    """
    largest = np.abs(vectors).max(axis=0)
    direction = vectors / np.where(largest > 0, largest, 1.0)
    x, y, z = direction
    length = np.sqrt(x * x + y * y + z * z)
    direction /= np.where(largest > 0, length, 1.0)
    return largest * length, direction


def _readable(values: Numbers) -> Numbers:
    """Return samples in a type that SciPy knows: it has no float16."""
    return values.astype(np.float32) if values.dtype == np.float16 else values


def _mix(low: Floats, high: Floats, share: Floats) -> Floats:
    return np.asarray(low + share * (high - low))
