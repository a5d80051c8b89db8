"""Where on the screen a volume can show: the rectangle of pixels whose rays may meet its box."""

from dataclasses import dataclass

import numpy as np

from volref.arrays import Floats
from volref.scene.scene import Scene


@dataclass(frozen=True)
class Rectangle:
    """Pixels with left <= x < right and top <= y < bottom."""

    left: int
    right: int
    top: int
    bottom: int

    @property
    def pixels(self) -> int:
        """How many pixels there are."""
        return max(self.right - self.left, 0) * max(self.bottom - self.top, 0)


def footprint(scene: Scene) -> Rectangle:
    """Return the rectangle of the pixels whose rays may meet the box of the volume, and one pixel around.

    A projection maps a box before the eye into the convex hull of its corners.  If only some corners lie
    beside or behind the eye, all pixels may see the box; if all do, none.

    Examples
    --------
    >>> from volref import Camera, TransferFunction, Volume
    >>> camera = Camera.orthographic((0, 0, 9), (0, 0, 0), (0, 1, 0), 8.0, 0.0, 20.0)
    >>> table = TransferFunction([0], [(1, 1, 1)], [1])
    >>> volume = Volume(np.zeros((2, 2, 2)), origin=(-3, 1, 0))
    >>> footprint(Scene(volume, table, camera, 8, 8))
    Rectangle(left=0, right=4, top=0, bottom=5)
    """
    width, height = scene.width, scene.height
    everything = Rectangle(0, width, 0, height)
    points = np.concatenate([scene.corners, np.ones((8, 1))], axis=1)
    view = points @ scene.camera.view_from_world.T
    clip = view @ scene.camera.clip_from_view(width, height).T
    if not scene.camera.is_parallel:
        # A corner nearly beside the eye would land far away, with few digits.
        nearly = 1e-6 * float(np.abs(view).max())
        if (clip[:, 3] < -nearly).all():
            return Rectangle(0, 0, 0, 0)
        if (clip[:, 3] <= nearly).any():
            return everything
    x = (clip[:, 0] / clip[:, 3] + 1) / 2 * width
    y = (1 - clip[:, 1] / clip[:, 3]) / 2 * height
    if not (np.isfinite(x).all() and np.isfinite(y).all()):
        return everything
    left, right = _range(x, width)
    top, bottom = _range(y, height)
    return Rectangle(left, right, top, bottom)


def _range(places: Floats, length: int) -> tuple[int, int]:
    """Return the pixels from first to end that places (8,) span, one more on each side, within 0..length."""
    first = int(np.clip(np.floor(places.min()) - 1, 0, length))
    end = int(np.clip(np.ceil(places.max()) + 1, first, length))
    return first, end
