"""Images of separable volumes in closed form, pixel by pixel.

Let the samples of a volume be a sum of three profiles, values[k, j, i] = X[i] + Y[j] + Z[k].  Trilinear
interpolation is linear in the samples, and interpolating X[i] along x (constant along y and z) is plain
linear interpolation of X; so the interpolated field is X(x) + Y(y) + Z(z) with three broken lines, and
along a straight ray it is ONE broken line that bends where the ray crosses a sample plane.  Between bends
and table knots, value, extinction and colour are all linear in t: `closed.linear_both`.

Plain scalar code, with rays of its own: it shares nothing with the stages that it judges.
"""

import math
from bisect import bisect_right
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import TypeAlias

import numpy as np

from volref.arrays import Floats, Vector
from volref.errors import SceneError
from volref.phantoms.closed import linear_both
from volref.scene import Camera, Scene, TransferFunction, Volume


def separable_image(scene: Scene) -> Floats:
    """Return the image (height, width, 4) of a scene whose volume is a sum of three profiles.

    Any camera made by `look_at` or `orthographic`, any placement of the volume, any table with linear
    extinction; the scene's background lies behind.

    Raises
    ------
    SceneError
        If the volume is not such a sum to 4 ulp of its largest value, or the scene holds something else.

    Examples
    --------
    >>> camera = Camera.look_at((0.5, 0.5, 5), (0.5, 0.5, 0), (0, 1, 0), 30.0, 0.1, 10.0)
    >>> table = TransferFunction([0], [(0.9, 0.5, 0.2)], [1e3])
    >>> scene = Scene(Volume(np.zeros((2, 2, 2))), table, camera, 1, 1, background=(0, 0, 0, 1))
    >>> separable_image(scene).tolist()
    [[[0.9, 0.5, 0.2, 1.0]]]
    """
    if scene.volume is None or scene.meshes or scene.lights or scene.clip or scene.mode != "composite":
        message = "scene must hold a volume and no more for the closed form, got another; remove the rest"
        raise SceneError(message)
    volume, table = scene.gridded
    profiles, pieces = _profiles(volume), _table_pieces(table)
    image = np.empty((scene.height, scene.width, 4))
    for row in range(scene.height):
        for column in range(scene.width):
            origin, direction = pixel_ray(scene.camera, scene.width, scene.height, column, row)
            image[row, column] = _ray_image(volume, profiles, pieces, origin, direction, scene.background)
    return image


def pixel_ray(camera: Camera, width: int, height: int, column: int, row: int) -> tuple[Vector, Vector]:
    """Return origin and unit direction of the ray through a pixel's centre, by trigonometry.

    Raises
    ------
    SceneError
        If the camera was built from matrices.

    Examples
    --------
    >>> camera = Camera.look_at((0, 0, 5), (0, 0, 0), (0, 1, 0), 90.0, 0.1, 10.0)
    >>> pixel_ray(camera, 1, 1, 0, 0)
    ((0.0, 0.0, 5.0), (0.0, 0.0, -1.0))
    """
    across = (2 * (column + 0.5) / width - 1) * (width / height)
    upwards = 1 - 2 * (row + 0.5) / height
    rows = camera.view_from_world[:3].tolist()  # right, up and back, each with its shift
    eye = [0.0 - sum(r[k] * r[3] for r in rows) for k in range(3)]
    if camera.fov_y is not None:
        half = math.tan(math.radians(camera.fov_y) / 2)
        toward = [across * half * rows[0][k] + upwards * half * rows[1][k] - rows[2][k] for k in range(3)]
        length = math.hypot(*toward)
        return _vector(eye), _vector([c / length for c in toward])
    if camera.height is not None:
        half = camera.height / 2
        shift = across * half, upwards * half, -camera.near
        start = [eye[k] + sum(s * r[k] for s, r in zip(shift, rows, strict=True)) for k in range(3)]
        return _vector(start), _vector([0.0 - c for c in rows[2][:3]])
    message = "scene.camera must come from look_at or orthographic for the closed form, got 'matrix'; "
    raise SceneError(message + "build it from an eye and a target")


def ray_box(origin: Sequence[float], direction: Sequence[float], volume: Volume) -> tuple[float, float]:
    """Return t_near and t_far (world units, t >= 0) of a ray in the extent of `volume`; (0, 0) outside.

    A ray that runs along a face is inside.

    Examples
    --------
    >>> ray_box((0.5, 0.5, 5), (0, 0, -1), Volume(np.zeros((2, 2, 2))))
    (3.5, 5.5)
    """
    start, step = _index_ray(volume, origin, direction)
    near, far = 0.0, math.inf
    for p, d, low, high in zip(start, step, *(b.tolist() for b in volume.index_bounds), strict=True):
        if d == 0:
            if not low <= p <= high:
                return 0.0, 0.0
            continue
        ends = sorted(((low - p) / d, (high - p) / d))
        near, far = max(near, ends[0]), min(far, ends[1])
    return (near, far) if near < far else (0.0, 0.0)


# Piece of the table: values from, to; extinction at both; colour at both.
Piece: TypeAlias = tuple[float, float, float, float, Floats, Floats]


def _table_pieces(table: TransferFunction) -> list[Piece]:
    if table.extinction is None:
        message = "transfer.extinction must be linear between knots for the closed form, got opacity; "
        raise SceneError(message + "use interpolation='extinction'")
    values, extinction, colors = table.values.tolist(), table.extinction.tolist(), table.colors
    inner = [
        (values[i], values[i + 1], extinction[i], extinction[i + 1], colors[i], colors[i + 1])
        for i in range(len(values) - 1)
    ]
    before = (-math.inf, values[0], extinction[0], extinction[0], colors[0], colors[0])
    after = (values[-1], math.inf, extinction[-1], extinction[-1], colors[-1], colors[-1])
    return [before, *inner, after]


def _profiles(volume: Volume) -> tuple[list[float], list[float], list[float]]:
    """Return X, Y, Z with values[k, j, i] = X[i] + Y[j] + Z[k]."""
    values = np.asarray(volume.values, dtype=np.float64)
    corner = values[0, 0, 0]
    x, y, z = values[0, 0, :], values[0, :, 0] - corner, values[:, 0, 0] - corner
    error = np.abs(x + y[:, None] + z[:, None, None] - values).max()
    if error > 4 * np.spacing(np.abs(values).max()):
        message = f"volume.values must be X[i] + Y[j] + Z[k] for the closed form, got {error:g} off; "
        raise SceneError(message + "use a ramp or the squared distance")
    return x.tolist(), y.tolist(), z.tolist()


def _ray_image(
    volume: Volume,
    profiles: tuple[list[float], list[float], list[float]],
    pieces: list[Piece],
    origin: Vector,
    direction: Vector,
    background: Sequence[float],
) -> Floats:
    start, step = _index_ray(volume, origin, direction)
    t_near, t_far = ray_box(origin, direction, volume)
    bends = _plane_crossings(start, step, volume.size, t_near, t_far)
    heights = [
        sum(_broken_line(profile, p + t * d) for profile, p, d in zip(profiles, start, step, strict=True))
        for t in bends
    ]
    color, depth = np.zeros(3), 0.0
    for (t0, v0), (t1, v1) in pairwise(zip(bends, heights, strict=True)):
        for length, sigma0, sigma1, color0, color1 in _linear_parts(pieces, t1 - t0, v0, v1):
            color += math.exp(-depth) * linear_both(color0, color1, sigma0, sigma1, length)[:3]
            depth += length * (sigma0 + sigma1) / 2
    front = np.append(color, -math.expm1(-depth))
    return front + math.exp(-depth) * np.asarray(background)


def _index_ray(
    volume: Volume, origin: Sequence[float], direction: Sequence[float]
) -> tuple[list[float], list[float]]:
    """Return start and step per world unit in index space."""
    matrix = volume.index_from_world.tolist()
    start = [sum(m * o for m, o in zip(row, origin, strict=False)) + row[3] for row in matrix[:3]]
    step = [sum(m * d for m, d in zip(row, direction, strict=False)) for row in matrix[:3]]
    return start, step


def _plane_crossings(
    start: list[float], step: list[float], size: tuple[int, int, int], t_near: float, t_far: float
) -> list[float]:
    inside = {
        t
        for p, d, count in zip(start, step, size, strict=True)
        if d != 0
        for plane in range(count)
        if t_near < (t := (plane - p) / d) < t_far
    }
    return [t_near, *sorted(inside), t_far]


def _broken_line(profile: list[float], index: float) -> float:
    """Interpolate a profile at a real index, constant beyond its ends."""
    at = min(max(index, 0.0), len(profile) - 1.0)
    i = min(int(at), len(profile) - 2)
    f = at - i
    return (1 - f) * profile[i] + f * profile[i + 1]


def _linear_parts(
    pieces: list[Piece], length: float, first: float, last: float
) -> Iterator[tuple[float, float, float, Floats, Floats]]:
    """Cut a line of values from `first` to `last` at the table's knots; yield the linear parts in order."""
    knots = [piece[1] for piece in pieces[:-1]]
    low, high = min(first, last), max(first, last)
    cuts = sorted({(k - first) / (last - first) for k in knots if low < k < high})
    edges = [0.0, *cuts, 1.0]
    for s0, s1 in pairwise(edges):
        middle = first + (s0 + s1) / 2 * (last - first)
        v0, v1, sigma0, sigma1, color0, color1 = pieces[bisect_right(knots, middle)]
        width = v1 - v0
        f0, f1 = (
            min(max((first + s * (last - first) - v0) / width, 0.0), 1.0) if math.isfinite(width) else 0.0
            for s in (s0, s1)
        )
        yield (
            (s1 - s0) * length,
            (1 - f0) * sigma0 + f0 * sigma1,
            (1 - f1) * sigma0 + f1 * sigma1,
            (1 - f0) * color0 + f0 * color1,
            (1 - f1) * color0 + f1 * color1,
        )


def _vector(numbers: Sequence[float]) -> Vector:
    x, y, z = numbers
    return x, y, z
