"""The volume with transparent surfaces in it: what lies between two of them is integrated by itself.

R pixels; slab k lies behind layer k - 1 and before layer k, and the last one ends at the opaque surface:

    eye   slab 0   layer 0   slab 1   layer 1   slab 2   opaque surface or background

From back to front each is laid over all behind it.  Be B the image behind, off by at most e.  A slab gives
C + T B with T <= 1, hence is off by its own bound and e; a layer of opacity a gives a c + (1 - a) B, which is
off by (1 - a) e and a few roundings.
"""

import numpy as np

from volref.arrays import Floats, Indices
from volref.records import Layers
from volref.truth.integration import Integrated, Integration, worker

ROUNDOFF = 2.0**-53
# Of a c + (1 - a) B: of 1 - a, two products and a sum, each of numbers up to the greatest of c, B and 1.
ROUNDINGS = 4
# Bounds are sums and products of a few numbers above 0, which are rounded too.
UPWARDS = 1 + 16 * ROUNDOFF
# The part of the tolerance that slabs share; the rest is for roundings.
SHARE = 0.99
# A slab of which next to nothing arrives may be off by this, or by the tolerance if that is more.
ANYTHING = 1.0


def integrate_layered(
    integration: Integration | None,
    layers: Layers | None,
    pixels: Indices,
    distance: Floats,
    behind: Floats,
    tolerance: float,
) -> Integrated:
    """Integrate the rays of `pixels` (R,) to `distance` (R,) over what lies `behind` (R, 4), through layers.

    `layers` are those of these pixels, None where a scene has none; without a volume `integration` is None.
    The tolerance is shared out among the slabs: what lies behind layers may be off by more.

    Examples
    --------
    A red pane of opacity 1/2 before a green one, before white:

    >>> layers = Layers(
    ...     np.array([0, 2]), np.array([1.0, 2.0]), np.array([[1.0, 0, 0], [0, 1, 0]]), np.array([0.5, 0.5]),
    ...     np.array([0, 1]), np.array([0, 0])
    ... )
    >>> white = np.ones((1, 4))
    >>> integrate_layered(None, layers, np.array([0]), np.array([np.inf]), white, 0.0).rgba.tolist()
    [[0.75, 0.5, 0.25, 1.0]]
    """
    begin, end = (0.0, distance) if integration is None else integration.limits(pixels, distance)
    counts = np.zeros(len(pixels), np.intp) if layers is None else layers.counts
    tolerances = [tolerance] if layers is None else _shared_out(layers, tolerance)
    rgba, bound, end, samples = behind.copy(), np.zeros(len(pixels)), end.copy(), 0
    hit = np.full(len(pixels), np.inf)
    for rank in reversed(range(counts.max(initial=0))):
        assert layers is not None
        has = np.flatnonzero(counts > rank)
        its = layers.starts[has] + rank
        near = layers.distance[its]
        slab = _slab(integration, pixels[has], near, end[has], rgba[has], tolerances[rank + 1])
        samples += slab.samples
        if slab.hit is not None:
            hit[has] = np.minimum(hit[has], slab.hit)
        rgba[has], bound[has] = _layer_over(
            layers.color[its], layers.opacity[its], slab.rgba, (slab.bound + bound[has]) * UPWARDS
        )
        end[has] = near
    slab = _slab(integration, pixels, begin, end, rgba, tolerances[0])
    nearest = None if slab.hit is None else np.minimum(hit, slab.hit)
    return Integrated(slab.rgba, (slab.bound + bound) * UPWARDS, samples + slab.samples, slab.worker, nearest)


def _slab(
    integration: Integration | None,
    pixels: Indices,
    begin: Floats | float,
    end: Floats,
    behind: Floats,
    tolerance: float,
) -> Integrated:
    if integration is None:
        return Integrated(behind, np.zeros(len(pixels)), 0, worker())
    return integration.between(pixels, begin, end, behind, tolerance)


def _layer_over(color: Floats, opacity: Floats, behind: Floats, bound: Floats) -> tuple[Floats, Floats]:
    """Return the premultiplied layers (n,) over what lies `behind` (n, 4), known to `bound` (n,)."""
    straight = np.append(color, np.ones((len(color), 1)), axis=1)
    clear = 1.0 - opacity
    rgba = opacity[:, None] * straight + clear[:, None] * behind
    brightest = np.maximum(straight, behind).max(axis=1)
    return rgba, (clear * bound + ROUNDINGS * ROUNDOFF * brightest) * UPWARDS


def _shared_out(layers: Layers, tolerance: float) -> list[float]:
    """Return the tolerance of each slab, so that together they stay within `tolerance` at every pixel.

    Of slab k at most w arrives, the product of 1 - a over the layers before it, wherever it is greatest.
    """
    counts = layers.counts
    slabs = int(counts.max(initial=0)) + 1
    arriving, shares = np.ones(len(counts)), []
    for rank in range(slabs):
        if rank > 0:
            has = counts >= rank
            arriving[~has] = 0.0
            arriving[has] *= 1.0 - layers.opacity[layers.starts[:-1][has] + rank - 1]
        most = float(arriving.max(initial=0.0))
        share = SHARE * tolerance / slabs
        shares.append(share / most if share < ANYTHING * most else max(tolerance, ANYTHING))
    return shares if slabs > 1 else [tolerance]
