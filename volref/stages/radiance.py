"""Stage 7 of the exact integrator: pieces together, and the bound on what the ray may be off.

n pieces of R rays, ray after ray, front to back.  Let sigma and c be the true extinction and colour along the
ray, sigma' >= 0 and c' those of the models, L the radiance that arrives from behind a point, L' that of the
models, T the transmittance in front of it.  Since L falls behind as sigma (L - c), and L' alike,

    L - L' at the eye = integral of T ((sigma' - sigma) (L' - c') + sigma (c - c'))             exactly.

With P the integral of |sigma' - sigma| over a piece, m the greatest |L' - c'| on it, which is at most
|c'(middle) - L'(far end)| + 2 max |c' - c'(middle)| as sigma' >= 0, and r the greatest |c - c'|, a piece adds
at most T (P m + (opacity + P) r), where T <= T' exp(sum of min(P, depth) in front of it).
"""

from dataclasses import dataclass

import numpy as np

from volref.arrays import Floats, Indices

ROUNDOFF = 2.0**-53

# Roundings per ray besides two per piece: see docs/certificate.md.
ROUNDINGS = 80


@dataclass(frozen=True, eq=False)
class Layout:
    """Where rays begin in n pieces: first and last piece of each ray with any, and the ray of each piece.

    rays (k,): the rays' indices; first, last (k,); member (n,): 0..k-1.
    """

    rays: Indices
    first: Indices
    last: Indices
    member: Indices


def layout_of(ray: Indices) -> Layout:
    """Return the layout of pieces with rising ray indices (n,).

    Examples
    --------
    >>> layout = layout_of(np.array([2, 2, 5]))
    >>> layout.rays.tolist(), layout.first.tolist(), layout.last.tolist(), layout.member.tolist()
    ([2, 5], [0, 2], [1, 2], [0, 0, 1])
    """
    begins = np.ones(len(ray), np.bool_)
    np.not_equal(ray[1:], ray[:-1], out=begins[1:])
    first = np.flatnonzero(begins)
    last = np.append(first[1:], len(ray)) - 1
    return Layout(ray.take(first), first, last, np.cumsum(begins) - 1)


def running_sums(values: Floats, layout: Layout) -> tuple[Floats, Floats, Floats]:
    """Return running sums (n,), and for each ray what they begin from and the ray's own sum (k,).

    The sum over a ray up to and with a piece is the running sum there less what the ray begins from.  There
    is one cumulative sum for all rays: each ray takes the sum of the ray before it off again, so that
    rounding is of the size of the ray's own sums, and what is left of it is what the ray begins from.

    Examples
    --------
    >>> sums, begin, total = running_sums(np.array([1.0, 2.0, 4.0, 8.0]), layout_of(np.array([0, 0, 0, 1])))
    >>> sums.tolist(), begin.tolist(), total.tolist()
    ([1.0, 3.0, 7.0, 8.0], [0.0, 0.0], [7.0, 8.0])
    """
    totals = np.add.reduceat(values, layout.first)
    shifted = values.copy()
    shifted[layout.first[1:]] -= totals[:-1]
    sums = np.cumsum(shifted, out=shifted)
    return sums, sums.take(layout.first) - values.take(layout.first), totals


def sums_in_front(values: Floats, layout: Layout) -> Floats:
    """Return for each piece the sum of `values` (n,) of the pieces in front of it on its ray.

    Examples
    --------
    >>> sums_in_front(np.array([1.0, 2.0, 4.0, 8.0]), layout_of(np.array([0, 0, 0, 1]))).tolist()
    [0.0, 1.0, 3.0, 0.0]
    """
    sums, begin, _ = running_sums(values, layout)
    sums -= values
    sums -= begin.take(layout.member)
    sums[layout.first] = 0.0
    return sums


@dataclass(frozen=True, eq=False)
class Modelled:
    """The model and the integrals of n pieces, as `gathered` takes them.

    depth, opacity, in_front (the transmittance there): (n,).  light (3, n): emission at the piece's near end.
    color (3, n): the model's colour in the middle; color_change (3, n): how far it may be from that.
    depth_error (n,): P.  color_error (n,): r.  light_error (3, n): error of the quadrature.
    """

    depth: Floats
    opacity: Floats
    in_front: Floats
    light: Floats
    color: Floats
    color_change: Floats
    depth_error: Floats
    color_error: Floats
    light_error: Floats


@dataclass(frozen=True, eq=False)
class Gathered:
    """Of the k rays that have pieces: premultiplied rgba (k, 4) and bound (k,).

    clear (k,): a bound on their transmittance.  share (n,): what each piece adds to the bound.
    """

    rgba: Floats
    bound: Floats
    clear: Floats
    share: Floats


def gathered(pieces: Modelled, layout: Layout, behind: Floats, brightest: float) -> Gathered:
    """Return the radiance of rays over what lies `behind` (k, 4), with its bound.

    `brightest` is the greatest colour of any channel, behind included.  A piece adds at most T (m + r), too,
    however large P is: between its near and its far end both radiances are mixtures of what it emits and of
    what arrives.  L' at the far end is what is left of the ray's sum, over the transmittance there, and as
    uncertain as that quotient.
    """
    member, last = layout.member, layout.last
    transmittance = pieces.in_front.take(last) * (1.0 - pieces.opacity.take(last))
    # No error makes a ray clearer than if its own extinction were taken off.
    gain = np.minimum(pieces.depth_error, pieces.depth)
    growth = sums_in_front(gain, layout)
    in_front = np.minimum(pieces.in_front * np.exp(np.minimum(growth, 700.0)), 1.0)
    most_left = np.minimum(transmittance * np.exp(np.minimum((growth + gain).take(last), 700.0)), 1.0)
    unsure = np.minimum(pieces.depth_error, 1.0)
    share = (most_left * (1.0 - behind[:, 3])).take(member) * unsure
    covered = np.minimum(pieces.opacity + unsure, 1.0) * pieces.color_error
    beyond = 1.0 / np.maximum(pieces.in_front * (1.0 - pieces.opacity), 1e-200)
    rounding = (2 * (last - layout.first + 1) + ROUNDINGS) * (ROUNDOFF * brightest)
    rgba = np.empty((len(layout.rays), 4))
    for channel in range(3):
        weighted = pieces.in_front * pieces.light[channel]
        lost = pieces.in_front * pieces.light_error[channel]
        sums, begin, total = running_sums(weighted, layout)
        total += transmittance * behind[:, channel]
        rgba[:, channel] = total
        total += begin
        arriving = total.take(member)
        arriving -= sums
        arriving *= beyond
        contrast = np.abs(np.subtract(pieces.color[channel], arriving, out=arriving), out=arriving)
        contrast += pieces.color_change[channel]
        contrast += pieces.color_change[channel]
        uncertain = (np.add.reduceat(lost, layout.first) + rounding).take(member)
        with np.errstate(over="ignore"):  # then nothing is known of it
            uncertain *= beyond
        contrast += uncertain
        np.minimum(contrast, brightest, out=contrast)
        contrast *= unsure
        contrast += covered
        contrast *= in_front
        contrast += lost
        np.maximum(share, contrast, out=share)
    rgba[:, 3] = 1.0 - transmittance * (1.0 - behind[:, 3])
    # Nothing is darker than black, or brighter than the brightest.
    bound = np.minimum(np.add.reduceat(share, layout.first) + rounding, brightest)
    return Gathered(np.clip(rgba, 0.0, brightest, out=rgba), bound, most_left, share)
