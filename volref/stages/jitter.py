"""Start offsets: where in its segments a ray takes its samples, one number per pixel and frame.

Where all rays sample at the same distances, steps show as rings; a random offset for each ray turns them into
noise, and the mean of many frames takes the noise away (seed systems: a random start, then frame averaging).

    u = 0.3     |--x------|--x------|--x------|     the first sample lies 0.3 of a step behind the entry
    u = 1/2     |----x----|----x----|----x----|     no jitter: the midpoint rule
"""

import numpy as np

from volref.arrays import Floats, whole_number


def jitter_images(width: int, height: int, frames: int = 1, seed: int = 0, *, first: int = 0) -> Floats:
    """Return random offsets (frames, height, width) in 0 <= u < 1, uniform and independent.

    Frame k comes from NumPy's Philox generator with the key (seed, k): it is the same however many frames
    are made, on every machine, and does not depend on how an image is cut into parts.  `first` is the number
    of the first frame.

    Raises
    ------
    SceneError
        If a number is out of range.

    Examples
    --------
    >>> jitter_images(2, 1, frames=2, seed=7).round(3).tolist()
    [[[0.872, 0.295]], [[0.882, 0.369]]]
    >>> bool((jitter_images(4, 3, 1, 7)[0] == jitter_images(4, 3, 5, 7)[0]).all())
    True
    """
    width, height = (
        whole_number(name, side, low=1, high=65536) for name, side in (("width", width), ("height", height))
    )
    count = whole_number("frames", frames, low=1, high=2**31)
    begin = whole_number("first", first, low=0, high=2**31)
    key = whole_number("seed", seed, low=0, high=2**63)
    numbers = range(begin, begin + count)
    return np.stack(
        [np.random.Generator(np.random.Philox(key=[key, k])).random((height, width)) for k in numbers]
    )


def repeated(texture: Floats, width: int, height: int) -> Floats:
    """Return a texture (h, w) repeated from the upper left corner to (height, width), as GL_REPEAT does.

    Examples
    --------
    >>> repeated(np.array([[0.0, 0.5]]), 3, 2).tolist()
    [[0.0, 0.5, 0.0], [0.0, 0.5, 0.0]]
    """
    rows, columns = np.arange(height) % texture.shape[0], np.arange(width) % texture.shape[1]
    return np.asarray(texture[rows[:, None], columns])
