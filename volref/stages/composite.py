"""Stage 5: compositing along the ray, front to back.

R rays and a block of S consecutive segments; opacities are (S, R), colours (3, S, R), and what is
accumulated is transmittance (R,) and premultiplied colour (3, R).  Rays are sorted so that those whose
k-th segment exists come first: `counts[k]` of them.
"""

import numpy as np

from volref.arrays import Floats, Indices
from volref.workspace import Workspace


def composite_block(
    transmittance: Floats, color: Floats, opacity: Floats, colors: Floats, counts: Indices, work: Workspace
) -> None:
    """Add a block of segments to `transmittance` and `color`, in place.

    weight_k = T_k opacity_k and T_(k+1) = T_k - weight_k (Max 1995, eq. 8, with the product telescoped):
    the weights and the last transmittance then add up to 1 but for one rounding each.
    """
    segments, rays = opacity.shape
    weight: Floats = work.get("weight", segments * rays).reshape(segments, rays)
    for k, count in enumerate(counts):
        np.multiply(transmittance[:count], opacity[k, :count], out=weight[k, :count])
        np.subtract(transmittance[:count], weight[k, :count], out=transmittance[:count])
        weight[k, count:] = 0.0
    for channel in range(3):
        color[channel] += np.einsum("sr,sr->r", weight, colors[channel])


def composite_block_coarse(
    transmittance: Floats,
    color: Floats,
    opacity: Floats,
    colors: Floats,
    counts: Indices,
    unshortened: Indices,
) -> None:
    """Add the same block as if the step were three times as long.

    Of three segments of one length the middle one's sample is the midpoint of their union, so the coarse
    midpoint rule needs no sample of its own: its opacity is 1 - (1 - a)^3 = a (3 - 3 a + a^2).  Where the
    ray ends within the three, or the last of them is shortened, they are taken one by one;
    `unshortened[g]` rays have all three of group g at full length.
    """
    for group, full in enumerate(unshortened):
        middle = 3 * group + 1
        a = opacity[middle, :full]
        weight = (a * a - 3 * a + 3) * a * transmittance[:full]
        transmittance[:full] -= weight
        color[:, :full] += weight * colors[:, middle, :full]
        for k in range(3 * group, 3 * group + 3):
            tail = slice(full, counts[k])
            weight = transmittance[tail] * opacity[k, tail]
            transmittance[tail] -= weight
            color[:, tail] += weight * colors[:, k, tail]


def over(color: Floats, transmittance: Floats, behind: Floats) -> Floats:
    """Return the premultiplied RGBA (R, 4) of colour (3, R) over the premultiplied `behind` (R, 4).

    Porter & Duff 1984: C + T B, with the alpha 1 - T + T B_alpha.

    Examples
    --------
    >>> over(np.array([[0.2], [0.0], [0.0]]), np.array([0.5]), np.array([[0.0, 1.0, 0.0, 1.0]])).tolist()
    [[0.2, 0.5, 0.0, 1.0]]
    """
    rgba = transmittance[:, None] * behind
    rgba[:, :3] += color.T
    rgba[:, 3] += 1.0 - transmittance
    return rgba
