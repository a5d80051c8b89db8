"""Scenes whose image is known in closed form, pixel by pixel.

The closed form is that of the field that a trilinear reader sees, not of the field that was sampled, so
nothing but rounding separates it from a perfect renderer:

    homogeneous   one value
    ramp          linear along one axis         one line along every ray
    exponential   exponential at the samples    a line that bends at every z plane
    ball          x^2 + y^2 + z^2               a line that bends at every plane; the ball is a polytope

See `separable` for why a sum of functions of one coordinate makes that possible.
"""

from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from volref.arrays import Floats
from volref.phantoms import transfer as tables
from volref.phantoms.fields import exponential_ramp, homogeneous_box, linear_ramp, squared_distance
from volref.phantoms.grid import Size, Spacing
from volref.phantoms.separable import separable_image
from volref.phantoms.views import view_around
from volref.scene import Camera, Scene, TransferFunction, Volume

Known: TypeAlias = tuple[Scene, Floats]


def homogeneous_scene(
    width: int = 16,
    height: int = 12,
    *,
    color: ArrayLike = (0.9, 0.5, 0.2),
    extinction: float = 0.3,
    size: Size = 4,
    spacing: Spacing = 1.0,
    centering: str = "cell",
    camera: Camera | None = None,
    parallel: bool = False,
    background: ArrayLike = (0.0, 0.0, 0.0, 0.0),
) -> Known:
    """Return a box of one colour and one extinction, and its image (height, width, 4).

    Every pixel is c (1 - exp(-sigma chord)), the chord of the ray in the box.  `camera` defaults to an
    oblique one, in `parallel` projection if asked.
    """
    volume = homogeneous_box(size, spacing=spacing, centering=centering, value=0.5)
    table = TransferFunction([0.5], [np.asarray(color, dtype=np.float64)], [extinction])
    return _known(volume, table, camera, width, height, background, parallel=parallel)


def ramp_scene(
    width: int = 16,
    height: int = 12,
    *,
    transfer: TransferFunction | None = None,
    size: Size = 6,
    spacing: Spacing = 1.0,
    centering: str = "node",
    axis: str = "z",
    camera: Camera | None = None,
    parallel: bool = False,
    background: ArrayLike = (0.0, 0.0, 0.0, 0.0),
) -> Known:
    """Return a linear ramp from 0 to 1 along `axis`, and its image (height, width, 4).

    The default table has knots at 0 and 1 only, so extinction and colour are linear along any ray; a
    table with more knots bends them there.
    """
    volume = linear_ramp(size, spacing=spacing, centering=centering, axis=axis)
    table = tables.two_colors() if transfer is None else transfer
    return _known(volume, table, camera, width, height, background, parallel=parallel)


def exponential_scene(
    width: int = 16,
    height: int = 12,
    *,
    size: Size = 8,
    spacing: Spacing = 1.0,
    centering: str = "node",
    low: float = 0.02,
    high: float = 2.0,
    camera: Camera | None = None,
    parallel: bool = False,
    background: ArrayLike = (0.0, 0.0, 0.0, 0.0),
) -> Known:
    """Return an extinction that is exponential along z at the samples, and its image (height, width, 4).

    The table makes the value the extinction.  The image is that of the straight lines between the
    samples; it tends to `closed.exponential_extinction` with the square of the spacing.
    """
    volume = exponential_ramp(size, spacing=spacing, centering=centering, low=low, high=high)
    table = TransferFunction([low, high], [(0.2, 0.4, 0.9), (1.0, 0.7, 0.3)], [low, high])
    return _known(volume, table, camera, width, height, background, parallel=parallel)


def ball_scene(
    width: int = 16,
    height: int = 12,
    *,
    radius: float = 7.0,
    transfer: TransferFunction | None = None,
    size: Size = 16,
    spacing: Spacing = 1.0,
    centering: str = "cell",
    camera: Camera | None = None,
    parallel: bool = False,
    background: ArrayLike = (0.0, 0.0, 0.0, 0.0),
) -> Known:
    """Return a ball cut out of the squared distance by a step, and its image (height, width, 4).

    The ball that a trilinear reader sees is the polytope X(x) + Y(y) + Z(z) < radius^2 inside the sphere;
    its surface lies within (sx^2 + sy^2 + sz^2) / (8 radius) of it, to first order.  The image is the
    polytope's.  `transfer` may be any table of the squared distance, such as `transfer.steps` for shells.
    """
    volume = squared_distance(size, spacing=spacing, centering=centering)
    table = tables.jump(radius**2) if transfer is None else transfer
    return _known(volume, table, camera, width, height, background, parallel=parallel)


def _known(
    volume: Volume,
    table: TransferFunction,
    camera: Camera | None,
    width: int,
    height: int,
    background: ArrayLike,
    *,
    parallel: bool,
) -> Known:
    eye = view_around(volume, parallel=parallel) if camera is None else camera
    scene = Scene(volume, table, eye, width, height, background=background)
    return scene, separable_image(scene)
