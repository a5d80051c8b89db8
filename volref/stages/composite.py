"""Stage 5: compositing along the ray, front to back.

R rays and a block of S consecutive segments of equal length, S a multiple of 3; opacities are (S, R), colours
(c, S, R), and what is accumulated is transmittance (R,) and premultiplied colour (c, R), or (c + 1, R) with
the sum of the weights, which is all that a colour that never changes needs.
"""

import numpy as np

from volref.arrays import Floats
from volref.workspace import Workspace


def composite_block(
    transmittance: Floats, color: Floats, opacity: Floats, colors: Floats, work: Workspace
) -> None:
    """Add a block of segments to `transmittance` and `color`, in place; destroys `colors`.

    weight_k = T_k opacity_k and T_(k+1) = T_k - weight_k (Max 1995, eq. 8, with the product telescoped):
    the weights and the last transmittance then add up to 1 but for one rounding each.
    """
    weights = work.get("weights", opacity.size, opacity.dtype).reshape(opacity.shape)
    for weight, alpha in zip(weights, opacity, strict=True):
        np.multiply(transmittance, alpha, out=weight)
        np.subtract(transmittance, weight, out=transmittance)
    if len(color) > len(colors):
        for weight in weights:
            np.add(color[-1], weight, out=color[-1])
    # No einsum, and no sum over an axis: they round a ray differently by its place in the array.
    shining = color[: len(colors)]
    light = np.multiply(colors, weights, out=colors)
    for k in range(len(opacity)):
        np.add(shining, light[:, k], out=shining)


def composite_block_coarse(
    transmittance: Floats, color: Floats, opacity: Floats, colors: Floats, work: Workspace
) -> None:
    """Add the same block as if the step were three times as long.

    Of three segments the middle one's sample is the midpoint of their union, so the coarse midpoint rule
    needs no sample of its own: its opacity is 1 - (1 - a)^3 = a (3 - 3 a + a^2).
    """
    middle, middle_colors = opacity[1::3], colors[:, 1::3]
    united = work.get("united", middle.size, opacity.dtype).reshape(middle.shape)
    np.subtract(middle, 3, out=united)
    np.multiply(united, middle, out=united)
    np.add(united, 3, out=united)
    np.multiply(united, middle, out=united)
    shining = color[: len(colors)]
    light = work.get("coarse light", shining.size, opacity.dtype).reshape(shining.shape)
    for k, weight in enumerate(united):
        np.multiply(weight, transmittance, out=weight)
        np.subtract(transmittance, weight, out=transmittance)
        if len(color) > len(colors):
            np.add(color[-1], weight, out=color[-1])
        np.multiply(middle_colors[:, k], weight, out=light)
        np.add(shining, light, out=shining)


def over(color: Floats, transmittance: Floats, behind: Floats) -> Floats:
    """Return the premultiplied RGBA (R, 4) of colour (3, R) over the premultiplied `behind` (R, 4).

    Porter & Duff 1984: C + T B, with the alpha 1 - T + T B_alpha.

    Examples
    --------
    >>> over(np.array([[0.2], [0.0], [0.0]]), np.array([0.5]), np.array([[0.0, 1.0, 0.0, 1.0]])).tolist()
    [[0.2, 0.5, 0.0, 1.0]]
    """
    rgba = np.empty((4, len(transmittance)))
    np.multiply(behind.T, transmittance, out=rgba)
    rgba[:3] += color
    rgba[3] += 1.0 - transmittance
    return rgba.T
