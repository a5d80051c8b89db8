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
    for k, count in enumerate(counts):
        weight = work.get("weight", count)
        light = work.get("light", count)
        np.multiply(transmittance[:count], opacity[k, :count], out=weight)
        np.subtract(transmittance[:count], weight, out=transmittance[:count])
        for channel in range(3):  # no einsum: it fuses all but the odd last rays, which then differ by an ulp
            np.multiply(weight, colors[channel, k, :count], out=light)
            np.add(color[channel, :count], light, out=color[channel, :count])


def composite_block_coarse(
    transmittance: Floats, color: Floats, opacity: Floats, colors: Floats, counts: Indices, lengths: Floats
) -> None:
    """Add the same block as if the step were three times as long.

    Of three whole segments the middle one's sample is the midpoint of their union, so the coarse midpoint
    rule needs no sample of its own: its opacity is 1 - (1 - a)^3 = a (3 - 3 a + a^2).  The last one to
    three segments of a ray, of which the last is shortened, are united as well and take the sample of
    the second of three, or of the first of two or one.  `lengths` (R,) says how many segments of full
    length each ray has from the start of the block on, the shortened one as its fraction.
    """
    for group in range(len(counts) // 3):
        first = 3 * group
        remaining = lengths - first
        whole = int(np.searchsorted(-remaining, -3.0, side="left"))
        a = opacity[first + 1, :whole]
        _add(transmittance, color, slice(0, whole), (a * a - 3 * a + 3) * a, colors[:, first + 1])
        bounds = (whole, int(counts[first + 2]), int(counts[first + 1]), int(counts[first]))
        for k, sample in enumerate((first + 1, first, first)):
            ending = slice(bounds[k], bounds[k + 1])
            a = opacity[sample, ending]
            if k < 2:  # the opacity is that of a whole segment
                with np.errstate(divide="ignore"):
                    a = -np.expm1(remaining[ending] * np.log1p(-a))
            _add(transmittance, color, ending, a, colors[:, sample])


def _add(transmittance: Floats, color: Floats, rays: slice, opacity: Floats, colors: Floats) -> None:
    weight = transmittance[rays] * opacity
    transmittance[rays] -= weight
    color[:, rays] += weight * colors[:, rays]


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
