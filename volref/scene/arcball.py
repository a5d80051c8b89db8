r"""The arcball: turning what a camera sees by dragging a point of a ball across the screen.

    screen: the shorter side spans -1..1                  from the side
            +---------------------+                        z ^   . - ~ hyperbola z = 1 / (2 d)
            |       .---.         |                          |.'
            |      /     \\       |   width 4, height 2      |    ball z = sqrt(1 - d^2)
            |      \\     /       |   the corner is (2, 1)   +------+--------> d, distance from the centre
            |       '---'         |                                 1
            +---------------------+

Ken Shoemake, ARCBALL (Graphics Interface 1992): the points under the pointer at the start and at the end of
a drag are lifted to the unit ball, p and q, and the object is turned by the quaternion q conj(p), that is
(p x q, p . q).  That is twice the arc from p to q, so a drag across the whole ball is a full turn, and what a
path of drags does depends on its ends only.

A point beside the ball goes to the nearest point of its rim ("clamp", Shoemake), or to a hyperbola that meets
the ball at d = sqrt(1/2), whose points are then put at length 1 ("hyperbola", Gavin Bell's trackball): there
the object follows smoothly, but a drag along the edge no longer turns it about the viewing axis alone.
"""

import dataclasses
import math

import numpy as np
from numpy.typing import ArrayLike

from volref.arrays import LARGEST_LENGTH, Floats, float_array, one_of, whole_number
from volref.scene.camera import Camera, arcball_matrix
from volref.scene.transform import affine

OUTSIDE = ("clamp", "hyperbola")


def arcball_rotation(start: ArrayLike, end: ArrayLike, *, outside: str = "clamp") -> Floats:
    """Quaternion (x, y, z, w) by which a drag from `start` to `end` turns what the camera sees.

    The points (x, y) are on the screen, x right and y up, the ball's centre at 0 and its radius 1.  The
    quaternion acts in view space and has length 1.

    Raises
    ------
    SceneError
        If a point is not two finite numbers, or `outside` is another word.

    Examples
    --------
    From the centre to the right rim is a quarter of the ball: half a turn about y.

    >>> arcball_rotation((0, 0), (1, 0)).tolist()
    [0.0, 1.0, 0.0, 0.0]
    """
    one_of("outside", outside, OUTSIDE)
    p, q = (
        _lifted(float_array(name, point, (2,), limit=LARGEST_LENGTH), outside)
        for name, point in (("start", start), ("end", end))
    )
    quaternion = np.append(np.cross(p, q), p @ q)
    return np.asarray(quaternion / np.linalg.norm(quaternion))


def drag(
    camera: Camera,
    start: ArrayLike,
    end: ArrayLike,
    width: int,
    height: int,
    *,
    target: ArrayLike,
    outside: str = "clamp",
) -> Camera:
    """Return `camera` after a drag that turns what it sees about `target`.

    `start` and `end` are in pixels of an image of `width` x `height`, x right and y down, (0, 0) its upper
    left corner, so pixel (0, 0) has its centre at (0.5, 0.5).  The ball fills the shorter side.

    Raises
    ------
    SceneError
        If a point is not two finite numbers.

    Examples
    --------
    >>> camera = Camera.look_at((0, 0, 5), (0, 0, 0), (0, 1, 0), 40.0, 0.1, 10.0)
    >>> turned = drag(camera, (4, 2), (6, 2), 8, 4, target=(0, 0, 0))  # from the centre to the right rim
    >>> (turned.world_from_view[:3, 3].round(12) + 0.0).tolist()
    [0.0, 0.0, -5.0]
    """
    width, height = (
        whole_number(name, side, low=1, high=2**31) for name, side in (("width", width), ("height", height))
    )
    points = (
        _on_screen(float_array(name, point, (2,), limit=LARGEST_LENGTH), width, height)
        for name, point in (("start", start), ("end", end))
    )
    quaternion = arcball_rotation(*points, outside=outside)
    center = float_array("target", target, (3,), limit=LARGEST_LENGTH)
    view = camera.view_from_world
    in_view = view[:3, :3] @ center + view[:3, 3]
    turn = arcball_matrix(quaternion, (0.0, 0.0, 0.0), 1.0)[:3, :3]
    around_target = affine(turn, in_view - turn @ in_view)
    return dataclasses.replace(camera, view_from_world=around_target @ view)


def _on_screen(pixel: Floats, width: int, height: int) -> tuple[float, float]:
    shorter = min(width, height)
    return (2 * float(pixel[0]) - width) / shorter, (height - 2 * float(pixel[1])) / shorter


def _lifted(point: Floats, outside: str) -> Floats:
    """Return the point (3,) of the unit ball that lies over `point` (2,)."""
    x, y = point.tolist()
    d = math.hypot(x, y)
    if outside == "clamp":
        return np.array([x / d, y / d, 0.0]) if d > 1 else np.array([x, y, math.sqrt(1 - d * d)])
    z = math.sqrt(1 - d * d) if d * d <= 0.5 else 1 / (2 * d)
    return np.array([x, y, z]) / math.hypot(d, z)
