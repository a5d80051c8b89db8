"""Stage 1: viewing rays through pixel centres.

R rays; pixels are flat indices y * width + x, row 0 at the top.
"""

import numpy as np

from volref.arrays import Floats, Indices
from volref.records import Rays
from volref.scene.camera import Camera
from volref.scene.transform import transform_directions, transform_points


def pixel_rays(camera: Camera, width: int, height: int, pixels: Indices) -> Rays:
    """Return the world rays through the centres of `pixels` (R,).

    With the projection rows P of `clip_from_view`, a view point (x, y, z) lands at
    x_ndc = (P00 x + P01 y + P02 z + P03) / w, and y_ndc likewise.  A perspective ray leaves the eye along
    the (x, y) that solves this at z = -1 (w = 1).  A parallel ray leaves the near plane from the (x, y) that
    solves it there, along the direction that leaves it unchanged: -z, or obliquely where P02 or P12 is not
    0.  Directions have length 1 to rounding (2 ulp).

    Examples
    --------
    >>> camera = Camera.look_at((0, 0, 5), (0, 0, 0), (0, 1, 0), 90.0, 0.1, 10.0)
    >>> rays = pixel_rays(camera, 1, 1, np.array([0]))
    >>> rays.origins.tolist(), rays.directions.tolist()
    ([[0.0, 0.0, 5.0]], [[0.0, 0.0, -1.0]])
    """
    clip = camera.clip_from_view(width, height)
    view_z = -camera.near if camera.is_parallel else -1.0
    x, y = (
        ndc - (row[2] * view_z + row[3])
        for ndc, row in zip(pixel_ndc(width, height, pixels).T, clip[:2], strict=True)
    )
    view = np.stack([*_solve(clip[:2, :2], x, y), np.full(len(pixels), view_z)]).T
    world_from_view = camera.world_from_view
    if camera.is_parallel:
        forward = transform_directions(world_from_view, np.array([*_solve(clip[:2, :2], *clip[:2, 2]), -1.0]))
        directions = np.broadcast_to(forward / np.linalg.norm(forward), view.shape)
        return Rays(transform_points(world_from_view, view), directions)
    directions = transform_directions(world_from_view, view)
    x, y, z = directions.T
    directions /= np.sqrt(x * x + y * y + z * z)[:, None]
    return Rays(np.broadcast_to(world_from_view[:3, 3], view.shape), directions)


def _solve(matrix: Floats, x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """Return the solution of matrix (2, 2) @ (u, v) = (x, y), each computed by itself."""
    (a, b), (c, d) = matrix
    determinant = a * d - b * c
    return (d * x - b * y) / determinant, (a * y - c * x) / determinant


def pixel_ndc(width: int, height: int, pixels: Indices) -> Floats:
    """Return the normalised device coordinates (R, 2) of pixel centres, y upwards.

    Examples
    --------
    >>> pixel_ndc(4, 2, np.array([1, 4])).tolist()
    [[-0.25, 0.5], [-0.75, -0.5]]
    """
    y, x = np.divmod(pixels, width)
    return np.stack([2 * (x + 0.5) / width - 1, 1 - 2 * (y + 0.5) / height]).T
