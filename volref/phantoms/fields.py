"""Fields with a formula, sampled on a grid about the world's origin.

Every maker takes `size` (one number of samples, or (nx, ny, nz)), `spacing` (one world distance, or
(sx, sy, sz)) and `centering` ("cell" or "node"), and returns a `Volume` of float64 values.

What trilinear interpolation makes of them: a homogeneous box and a linear ramp are reproduced exactly
(inside the outer samples); a field that is a sum f(x) + g(y) + h(z) becomes piecewise linear along every
straight ray; any other field with second derivatives up to D errs by at most D (sx^2 + sy^2 + sz^2) / 8.
"""

import numpy as np

from volref.arrays import Floats, Vector, number, one_of, whole_number
from volref.phantoms.grid import Grid, Size, Spacing, centered_grid
from volref.scene import Volume

AXES = ("x", "y", "z")


def homogeneous_box(
    size: Size = 8, *, spacing: Spacing = 1.0, centering: str = "node", value: float = 1.0
) -> Volume:
    """Return a box of one value.

    Examples
    --------
    >>> homogeneous_box(2, value=3.0).value_bounds
    (3.0, 3.0)
    """
    return centered_grid(size, spacing, centering).volume(np.array(float(value)))


def linear_ramp(
    size: Size = 8,
    *,
    spacing: Spacing = 1.0,
    centering: str = "node",
    axis: str = "z",
    low: float = 0.0,
    high: float = 1.0,
) -> Volume:
    """Return a field that runs linearly from `low` at the first sample along `axis` to `high` at the last.

    Trilinear interpolation reproduces it; with "cell" centering it is constant in the outer half voxels.

    Examples
    --------
    >>> linear_ramp(3, axis="x").values[0, 0].tolist()
    [0.0, 0.5, 1.0]
    """
    grid = centered_grid(size, spacing, centering)
    return grid.volume(low + (high - low) * _fraction(grid, axis))


def exponential_ramp(
    size: Size = 8,
    *,
    spacing: Spacing = 1.0,
    centering: str = "node",
    axis: str = "z",
    low: float = 0.1,
    high: float = 10.0,
) -> Volume:
    """Return low (high / low)^u, u = 0 at the first sample along `axis` and 1 at the last.

    With an extinction proportional to the value, the extinction is exponential along the axis AT the
    samples.  Between them a trilinear reader sees straight lines, up to log(high/low)^2 / (8 (n - 1)^2)
    above the curve, relative to the curve's larger end.

    Raises
    ------
    SceneError
        If `low` or `high` is not positive.

    Examples
    --------
    >>> exponential_ramp(3, axis="x", low=1, high=100).values[0, 0].tolist()
    [1.0, 10.0, 100.0]
    """
    grid = centered_grid(size, spacing, centering)
    start, end = number("low", low, above=0), number("high", high, above=0)
    return grid.volume(start * (end / start) ** _fraction(grid, axis))


def sphere(size: Size = 32, *, spacing: Spacing = 1.0, centering: str = "cell") -> Volume:
    """Return the distance from the box's centre, in world units: a step in the table cuts a ball out.

    The distance is convex, so the interpolated field lies above it: by at most (sx^2 + sy^2 + sz^2) / (8 r)
    at a distance r from the centre, less one voxel diagonal.  A cut at radius R is a ball whose surface
    lies between R minus that and R.

    Examples
    --------
    >>> sphere(3, spacing=2.0).values[1, 1].tolist()
    [2.0, 0.0, 2.0]
    """
    grid = centered_grid(size, spacing, centering)
    return grid.volume(np.sqrt(grid.x**2 + grid.y**2 + grid.z**2))


def squared_distance(size: Size = 32, *, spacing: Spacing = 1.0, centering: str = "cell") -> Volume:
    """Return x^2 + y^2 + z^2 about the box's centre: a ball whose trilinear form is known exactly.

    It is a sum of functions of one coordinate, so along any ray the interpolated field is piecewise
    linear between the sample planes, and every integral through it has a closed form.
    """
    grid = centered_grid(size, spacing, centering)
    return grid.volume(grid.x**2 + grid.y**2 + grid.z**2)


def shells(
    size: Size = 32, *, spacing: Spacing = 1.0, centering: str = "cell", period: float = 8.0
) -> Volume:
    """Return (1 - cos(2 pi r / period)) / 2: concentric shells, 0 at the centre, `period` world units apart.

    For shells of constant extinction with sharp edges, whose integral is `closed.concentric_shells`, use
    `sphere` with `transfer.steps`.

    Examples
    --------
    >>> shells(5, period=4.0).values[2, 2].round(12).tolist()
    [1.0, 0.5, 0.0, 0.5, 1.0]
    """
    grid = centered_grid(size, spacing, centering)
    radius = np.sqrt(grid.x**2 + grid.y**2 + grid.z**2)
    return grid.volume((1 - np.cos(2 * np.pi * radius / number("period", period, above=0))) / 2)


def marschner_lobb_value(
    x: Floats, y: Floats, z: Floats, *, frequency: float = 6.0, amplitude: float = 0.25
) -> Floats:
    """Return the test signal of Marschner & Lobb at points of the cube -1..1.

        rho(x, y, z) = (1 - sin(pi z / 2) + alpha (1 + rho_r(sqrt(x^2 + y^2)))) / (2 (1 + alpha))
        rho_r(r)     = cos(2 pi f_M cos(pi r / 2))

    with f_M = `frequency` and alpha = `amplitude`; values lie in 0..1.  On 40 samples per axis the finest
    ripples come close to the Nyquist limit, so any fault of the filter shows.

    Source: S. R. Marschner and R. J. Lobb, An evaluation of reconstruction filters for volume rendering,
    IEEE Visualization 1994, eqs. 11 and 12.

    Examples
    --------
    >>> zero, one = np.zeros(1), np.ones(1)
    >>> marschner_lobb_value(zero, zero, zero).tolist(), marschner_lobb_value(zero, zero, -one).tolist()
    ([0.6], [1.0])
    """
    radial = np.cos(2 * np.pi * frequency * np.cos(np.pi / 2 * np.sqrt(x**2 + y**2)))
    return np.asarray((1 - np.sin(np.pi / 2 * z) + amplitude * (1 + radial)) / (2 * (1 + amplitude)))


def marschner_lobb(size: Size = 41, *, spacing: Spacing = 1.0, centering: str = "node") -> Volume:
    """Return the Marschner-Lobb signal with its cube -1..1 stretched over the extent of the volume."""
    grid = centered_grid(size, spacing, centering)
    return grid.volume(marschner_lobb_value(*_unit_coordinates(grid)))


def gaussian_blobs(
    size: Size = 32, *, spacing: Spacing = 1.0, centering: str = "cell", count: int = 14, seed: int = 1
) -> Volume:
    """Return a sum of `count` round Gaussians at random places, scaled to a largest sample of 1.

    On the cube -1..1 stretched over the extent, centres lie within 0.6 of the middle, standard deviations
    between 0.08 and 0.3, heights between 0.4 and 1.
    """
    grid = centered_grid(size, spacing, centering)
    x, y, z = _unit_coordinates(grid)
    rng = np.random.default_rng(seed)
    total = np.zeros(grid.shape)
    for _ in range(whole_number("count", count, low=1, high=10_000)):
        cx, cy, cz = rng.uniform(-0.6, 0.6, 3)
        width, height = rng.uniform(0.08, 0.3), rng.uniform(0.4, 1.0)
        # A round Gaussian is a product of three profiles: three short exponentials instead of n^3.
        profiles = (np.exp(-((p - c) ** 2) / (2 * width**2)) for p, c in ((x, cx), (y, cy), (z, cz)))
        along_x, along_y, along_z = profiles
        total += height * along_z * along_y * along_x
    return grid.volume(total / total.max())


def _unit_coordinates(grid: Grid) -> tuple[Floats, Floats, Floats]:
    half: Vector = grid.half
    return grid.x / half[0], grid.y / half[1], grid.z / half[2]


def _fraction(grid: Grid, axis: str) -> Floats:
    """Return 0 at the first sample along the axis to 1 at the last."""
    along = {"x": grid.x, "y": grid.y, "z": grid.z}[one_of("axis", axis, AXES)]
    return np.linspace(0.0, 1.0, along.size).reshape(along.shape)
