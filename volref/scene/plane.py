"""Planes that cut a scene: the half-space in front of a plane stays.

behind, cut away  |  in front, kept
                  | --> normal
                point
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from volref.arrays import LARGEST_LENGTH, Floats, float_array, set_fields
from volref.errors import SceneError
from volref.scene.lights import unit_vector


@dataclass(frozen=True, eq=False, init=False)
class Plane:
    """The plane through `point` with the unit `normal`; of a clipping plane the side of the normal stays.

    Examples
    --------
    >>> plane = Plane((0, 0, 2), (0, 0, 5))
    >>> plane.normal.tolist(), plane.height(np.array([[0.0, 0.0, 5.0]])).tolist()
    ([0.0, 0.0, 1.0], [3.0])
    """

    point: Floats
    normal: Floats

    def __init__(self, point: ArrayLike, normal: ArrayLike) -> None:
        set_fields(
            self,
            point=float_array("plane.point", point, (3,), limit=LARGEST_LENGTH),
            normal=unit_vector("plane.normal", normal),
        )

    def height(self, points: Floats) -> Floats:
        """Return how far points (..., 3) lie in front of the plane."""
        x, y, z = np.moveaxis((points - self.point) * self.normal, -1, 0)
        return np.asarray(x + y + z)


def clip_box(low: ArrayLike, high: ArrayLike) -> tuple[Plane, ...]:
    """Return the six planes that keep the box from `low` to `high` (x, y, z).

    Raises
    ------
    SceneError
        If the box is empty.

    Examples
    --------
    >>> planes = clip_box((0, 0, 0), (1, 2, 3))
    >>> [plane.height(np.array([0.25, 0.5, 1.0])).tolist() for plane in planes]
    [0.25, 0.75, 0.5, 1.5, 1.0, 2.0]
    """
    least = float_array("clip_box.low", low, (3,), limit=LARGEST_LENGTH)
    most = float_array("clip_box.high", high, (3,), limit=LARGEST_LENGTH)
    if not (least < most).all():
        message = f"clip_box.high must lie above low on each axis, got {most.tolist()} and {least.tolist()}; "
        raise SceneError(message + "swap them")
    axes = np.eye(3)
    return tuple(plane for axis in axes for plane in (Plane(least, axis), Plane(most, -axis)))
