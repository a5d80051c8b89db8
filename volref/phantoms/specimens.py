"""Made-up specimens: a CT of a branching artery and a light microscope's stack of filaments.

Neither is a scan of anything.  They have what such scans have that hurts a renderer: thin bright
structures beside large ones, steep edges, small very dense spots, noise, and z blur.
"""

from itertools import pairwise
from typing import TypeAlias

import numpy as np

from volref.arrays import Floats, number, whole_number
from volref.phantoms.grid import Grid, Size, Spacing, centered_grid
from volref.scene import Volume

# Hounsfield units, rounded from textbooks: fat, vessel wall, blood with contrast agent, calcification.
FAT_HU, WALL_HU, BLOOD_HU, CALCIUM_HU = -90.0, 50.0, 380.0, 1100.0

# The artery lives in a box of 128 x 96 x 192 mm about the origin, z up (towards the head); it is scaled
# to fit other extents.  Corners (x, y, z, radius) in mm.
ARTERY_BOX = (128.0, 96.0, 192.0)
Branch: TypeAlias = tuple[tuple[float, float, float, float], ...]
TRUNK: Branch = (
    (12, -22, 20, 13), (14, -24, 36, 13.5), (12, -22, 52, 13), (5, -12, 66, 12), (-3, 2, 71, 11.5),
    (-11, 15, 65, 11), (-15, 22, 50, 10.5), (-14, 24, 28, 10), (-10, 23, 4, 9.5), (-5, 21, -20, 9),
    (-1, 18, -42, 8.5), (0, 16, -56, 6.5),
)  # fmt: skip
BRANCHES: tuple[Branch, ...] = (
    ((8, -16, 62, 5), (14, -18, 76, 4.5), (26, -18, 88, 4), (36, -16, 96, 3.5)),
    ((2, -6, 68, 4), (2, -10, 84, 3.5), (4, -12, 97, 3)),
    ((-6, 6, 69, 4.5), (-12, 4, 82, 4), (-24, 0, 90, 3.5), (-34, -2, 97, 3)),
    ((-8, 22, -4, 4), (-8, 10, -6, 3.5), (-2, 2, -12, 3), (10, -4, -16, 2.5), (22, -6, -12, 2)),
    ((-7, 22, -12, 3.5), (-20, 18, -16, 3), (-34, 22, -22, 2.5), (-46, 26, -20, 2)),
    ((-6, 21, -15, 3.5), (8, 20, -20, 3), (24, 24, -26, 2.5), (38, 28, -26, 2)),
    ((0, 16, -53, 6), (10, 13, -66, 5.5), (20, 8, -82, 5), (26, 0, -98, 4.5)),
    ((0, 16, -53, 6), (-10, 13, -66, 5.5), (-20, 8, -82, 5), (-26, 0, -98, 4.5)),
)


def vessel(
    size: Size = (64, 48, 96),
    *,
    spacing: Spacing = 2.0,
    centering: str = "cell",
    calcifications: int = 24,
    noise: float = 12.0,
    seed: int = 1,
) -> Volume:
    """Return a made-up CT of an aorta with its branches and calcified plaques, int16 Hounsfield units.

    Blood with contrast agent in a thin wall in fat; edges blurred over about a voxel; `calcifications`
    plaques at random places of the trunk's wall; Gaussian noise of standard deviation `noise` HU.
    """
    grid = centered_grid(size, spacing, centering)
    scale = min(2 * half / full for half, full in zip(grid.half, ARTERY_BOX, strict=True))
    voxel = max(grid.spacing)
    rng = np.random.default_rng(seed)
    trunk, branches = _smooth_branch(TRUNK, scale), [_smooth_branch(b, scale) for b in BRANCHES]
    wall = 1.5 * scale
    margin = wall + 4 * voxel
    outside = np.full(grid.shape, margin)
    for branch in (trunk, *branches):
        _carve(grid, outside, branch, margin)
    edge = 0.35 * voxel
    values = FAT_HU + (WALL_HU - FAT_HU) * _step((wall - outside) / edge)
    values += (BLOOD_HU - WALL_HU) * _step(-outside / edge)
    plaque = _plaques(grid, outside, trunk, wall, calcifications, rng)
    values += (CALCIUM_HU - values) * plaque
    values += rng.normal(0.0, 1.0, grid.shape) * number("noise", noise, low=0)
    return grid.volume(np.rint(values).astype(np.int16))


def filaments(
    size: Size = (96, 96, 48),
    *,
    spacing: Spacing = (1.0, 1.0, 2.0),
    centering: str = "cell",
    count: int = 30,
    photons: float = 400.0,
    seed: int = 1,
) -> Volume:
    """Return a made-up fluorescence stack: sparse bright filaments, z blur, Poisson noise, uint16 counts.

    Each filament is a smooth random walk, brighter and darker along its length, one voxel thick; the blur
    of the microscope has a standard deviation of 0.8 voxels in x and y and 3 times that length in z.
    `photons` is the count where it is brightest, over a background of 4; a detector adds an offset of 100.
    """
    from scipy.ndimage import gaussian_filter

    grid = centered_grid(size, spacing, centering)
    rng = np.random.default_rng(seed)
    light = np.zeros(grid.shape)
    for _ in range(whole_number("count", count, low=1, high=100_000)):
        _deposit(light, *_filament(grid, rng))
    blur = 0.8 * min(grid.spacing[:2])
    sx, sy, sz = grid.spacing
    seen = gaussian_filter(light, (3 * blur / sz, blur / sy, blur / sx), mode="constant")
    expected = 4 + number("photons", photons, above=0) * seen / seen.max()
    counts = rng.poisson(expected) + 100
    return grid.volume(np.minimum(counts, 65535).astype(np.uint16))


def _step(x: Floats) -> Floats:
    """Return a smooth step from 0 to 1 about x = 0."""
    return np.asarray((1 + np.tanh(x)) / 2)


def _smooth_branch(corners: Branch, scale: float, pieces: int = 6) -> Floats:
    """Return points and radii (P, 4) of a Catmull-Rom curve through the corners, times `scale`."""
    points = np.array(corners, dtype=np.float64) * scale
    before = 2 * points[0] - points[1]
    after = 2 * points[-1] - points[-2]
    p = np.concatenate([[before], points, [after]])
    s = (np.arange(pieces) / pieces)[:, None]
    curve = [
        b + s * ((c - a) / 2 + s * (a - 2.5 * b + 2 * c - d / 2 + s * (1.5 * (b - c) + (d - a) / 2)))
        for a, b, c, d in zip(p, p[1:], p[2:], p[3:], strict=False)
    ]
    return np.concatenate([*curve, points[-1:]])


def _carve(grid: Grid, outside: Floats, branch: Floats, margin: float) -> None:
    """Lower `outside` to the distance beyond the branch's surface, in the boxes about its pieces."""
    axes = (grid.x.ravel(), grid.y.ravel(), grid.z.ravel())
    for start, end in pairwise(branch):
        reach = max(start[3], end[3]) + margin
        low, high = np.minimum(start, end)[:3] - reach, np.maximum(start, end)[:3] + reach
        x, y, z = (slice(*np.searchsorted(axis, (a, b))) for axis, a, b in zip(axes, low, high, strict=True))
        box = outside[z, y, x]
        away = (grid.x[..., x] - start[0], grid.y[:, y] - start[1], grid.z[z] - start[2])
        step = end - start
        along = sum(p * s for p, s in zip(away, step[:3], strict=True)) / (step[:3] @ step[:3])
        f = np.clip(along, 0.0, 1.0)
        distance = np.sqrt(sum((p - f * s) ** 2 for p, s in zip(away, step[:3], strict=True)))
        np.minimum(box, distance - (start[3] + f * step[3]), out=box)


def _plaques(
    grid: Grid, outside: Floats, trunk: Floats, wall: float, count: int, rng: np.random.Generator
) -> Floats:
    """Return the share of calcium: blobs on the trunk, kept to a thin layer about the wall's inner face."""
    plaque = np.zeros(grid.shape)
    for _ in range(whole_number("calcifications", count, low=0, high=10_000)):
        x, y, z, radius = trunk[rng.integers(len(trunk) // 5, len(trunk))]
        toward = rng.normal(0.0, 1.0, 3)
        cx, cy, cz = np.array((x, y, z)) + radius * toward / np.linalg.norm(toward)
        width = wall * rng.uniform(1.0, 2.5)
        away = (grid.x - cx) ** 2 + (grid.y - cy) ** 2 + (grid.z - cz) ** 2
        np.maximum(plaque, np.exp(-((away / (2 * width**2)) ** 2)), out=plaque)
    return np.asarray(plaque * np.exp(-((outside / wall) ** 2)))


def _filament(grid: Grid, rng: np.random.Generator) -> tuple[Floats, Floats]:
    """Return index points (P, 3) a quarter of a voxel apart along a smooth random walk, and their light."""
    spacing, size = np.array(grid.spacing), np.array(grid.shape[::-1])
    pace = spacing.min() / 4
    steps = max(1, int(rng.uniform(0.5, 1.5) * max(grid.half) / pace))
    # White noise smoothed over 12 voxels bends the heading; filaments lie flat, as cells on glass do.
    turns = np.stack([_smooth_noise(rng, steps, 96) for _ in range(3)], axis=1)
    headings = (rng.normal(0.0, 1.0, 3) + np.cumsum(turns, axis=0) * 0.004) * (1.0, 1.0, 0.35)
    headings *= pace / np.linalg.norm(headings, axis=1, keepdims=True)
    start = rng.uniform(0.05, 0.95, 3) * (size - 1)
    points = start + (np.cumsum(headings, axis=0) - headings[0]) / spacing
    return points, rng.uniform(0.3, 1.0) * np.exp(0.12 * _smooth_noise(rng, steps, 24))


def _smooth_noise(rng: np.random.Generator, count: int, width: int) -> Floats:
    """Return `count` samples of white noise under a running Hann window of `width` samples."""
    return np.convolve(rng.normal(0.0, 1.0, count + width - 1), np.hanning(width), "valid")


def _deposit(light: Floats, points: Floats, amounts: Floats) -> None:
    """Share each amount among the eight voxels about its point; what falls outside is lost."""
    size = np.array(light.shape[::-1])
    inside = ((points >= 0) & (points < size - 1)).all(axis=1)
    points, amounts = points[inside], amounts[inside]
    cell = points.astype(np.intp)
    f = points - cell
    for corner in np.ndindex(2, 2, 2):
        share = np.prod(np.where(corner, f, 1 - f), axis=1)
        x, y, z = (cell + corner).T
        np.add.at(light, (z, y, x), amounts * share)
