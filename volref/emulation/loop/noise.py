"""The noise of seed 004, as an image of start offsets."""

import numpy as np
from numpy.typing import ArrayLike

from volref.arrays import Floats, float_array, whole_number


def hash_jitter(width: int, height: int, u: ArrayLike) -> Floats:
    """Return fract(sin(dot(uv, 79.30408 u)) 43758.5453) at the centres of pixels (height, width), top first.

    u is a unit vector (2,) that the program draws anew for each frame; uv is 0..1 with v upwards.  This is
    computed in float64: a shader's sin is off by up to 2e-4 on one machine and 7e-8 on another, of which the
    factor 43758.5453 makes noise of its own, so that no two machines have the same image.

    Raises
    ------
    SceneError
        If an argument is not such a number.

    Examples
    --------
    >>> noise = hash_jitter(4, 2, (0.6, 0.8))
    >>> noise.shape, bool((noise >= 0).all() and (noise < 1).all())
    ((2, 4), True)
    """
    wide = whole_number("width", width, low=1, high=1 << 16)
    high = whole_number("height", height, low=1, high=1 << 16)
    along = 79.30408 * float_array("u", u, (2,))
    across = (np.arange(wide) + 0.5) / wide
    upwards = 1.0 - (np.arange(high) + 0.5) / high
    scaled = np.sin(across * along[0] + upwards[:, None] * along[1]) * 43758.5453
    return np.asarray(scaled - np.floor(scaled))
