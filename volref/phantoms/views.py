"""Cameras that see the whole of a volume."""

import math

import numpy as np

from volref.scene import Camera, Volume


def view_around(
    volume: Volume,
    azimuth: float = 35.0,
    elevation: float = 25.0,
    *,
    parallel: bool = False,
    fov_y: float = 30.0,
    distance: float | None = None,
) -> Camera:
    """Return a camera that looks at the middle of `volume`.

    `azimuth` (degrees) turns the eye about the y axis, 0 on the +z side and 90 on the +x side;
    `elevation` lifts it, above -90 and below 90.  `distance` (world units from the middle) defaults to
    where the sphere about the volume just fits the opening; smaller ones may lie inside the volume.

    Examples
    --------
    >>> camera = view_around(Volume(np.zeros((2, 2, 2))), 0.0, 0.0)
    >>> camera.world_from_view[:2, 3].tolist()
    [0.5, 0.5]
    """
    corners = volume.corners
    middle = (corners.min(axis=0) + corners.max(axis=0)) / 2
    radius = float(np.linalg.norm(corners - middle, axis=1).max())
    away = radius / math.sin(math.radians(fov_y) / 2) if distance is None else distance
    turn, lift = math.radians(azimuth), math.radians(elevation)
    toward_eye = (math.sin(turn) * math.cos(lift), math.sin(lift), math.cos(turn) * math.cos(lift))
    eye = middle + away * np.array(toward_eye)
    far = away + 2 * radius
    if parallel:
        return Camera.orthographic(eye, middle, (0, 1, 0), 2 * radius, 0.0, far)
    return Camera.look_at(eye, middle, (0, 1, 0), fov_y, far / 1000, far)
