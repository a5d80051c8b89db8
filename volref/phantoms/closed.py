"""Closed forms of the emission-absorption integral along one ray.

With extinction sigma(t), straight colour c(t), and t from 0 (front) to L:

    tau(t) = int_0^t sigma      T = exp(-tau)      C = int_0^L c sigma T dt      alpha = 1 - T(L)

(N. Max, Optical models for direct volume rendering, IEEE TVCG 1(2) 1995, eqs. 5-9, with the source term
c sigma).  C is premultiplied.  All functions take plain numbers and return (r, g, b, alpha), or what
they say.  A colour is three numbers.

Colours that run linearly in some s from 0 (front) to 1 (back) need, besides alpha, one number:

    moment = int s sigma T dt,    C = color0 (alpha - moment) + color1 moment,    0 <= moment <= alpha
"""

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from volref.arrays import Floats


def homogeneous(color: ArrayLike, extinction: float, length: float) -> Floats:
    """Return c (1 - exp(-sigma L)) and alpha of a slab of one colour and one extinction.

    Written with expm1: 1 - exp(-x) has no digit left at x = 1e-17.

    Examples
    --------
    >>> homogeneous((1, 0.5, 0), 1e-17, 2.0).tolist()
    [2e-17, 1e-17, 0.0, 2e-17]
    """
    return _one_color(color, extinction * length)


def linear_extinction(color: ArrayLike, extinction0: float, extinction1: float, length: float) -> Floats:
    """Return the integral for one colour and an extinction that runs linearly along the ray.

    tau = L (sigma0 + sigma1) / 2, whatever the order of the ends.

    Examples
    --------
    >>> linear_extinction((1, 1, 1), 0.0, 2.0, 1.0).tolist() == [-math.expm1(-1.0)] * 4
    True
    """
    return _one_color(color, length * (extinction0 + extinction1) / 2)


def linear_color(color0: ArrayLike, color1: ArrayLike, extinction: float, length: float) -> Floats:
    """Return the integral for one extinction and a colour that runs linearly along the ray.

    moment = (1 - (1 + tau) exp(-tau)) / tau, which has no digit left as tau goes to 0 (moment -> tau / 2);
    `linear_moment` has the stable form.

    Examples
    --------
    >>> linear_color((0, 0, 0), (1, 1, 1), 1e-20, 1.0).tolist()
    [5e-21, 5e-21, 5e-21, 1e-20]
    """
    depth = extinction * length
    return _two_colors(color0, color1, depth, linear_moment(depth, depth))


def linear_both(
    color0: ArrayLike, color1: ArrayLike, extinction0: float, extinction1: float, length: float
) -> Floats:
    """Return the integral where colour and extinction both run linearly along the ray.

    This is what a piecewise linear table makes of a field that is linear along the ray.  See
    `linear_moment` for the formula.

    Examples
    --------
    >>> a = linear_both((0, 0, 0), (1, 1, 1), 1.0, 1.0, 2.0)
    >>> b = linear_color((0, 0, 0), (1, 1, 1), 1.0, 2.0)
    >>> bool(abs(a - b).max() < 1e-15)
    True
    """
    depth = length * (extinction0 + extinction1) / 2
    return _two_colors(color0, color1, depth, linear_moment(extinction0 * length, extinction1 * length))


def exponential_extinction(
    color0: ArrayLike, color1: ArrayLike, extinction0: float, extinction1: float, length: float
) -> Floats:
    """Return the integral for sigma(t) = sigma0 (sigma1 / sigma0)^(t / L), colour linear IN sigma.

    With k = log(sigma1 / sigma0), tau = L sigma0 expm1(k) / k.  As d sigma = (k / L) d tau, a colour that
    is linear in the extinction is linear in the optical depth, so that the moment is that of one
    extinction with the same optical depth.  One colour: give it twice.  Both extinctions must be positive.

    Examples
    --------
    >>> exponential_extinction((1, 1, 1), (1, 1, 1), 1.0, math.e, 1.0).tolist()[3] == -math.expm1(1 - math.e)
    True
    """
    k = math.log(extinction1 / extinction0)
    depth = length * extinction0 * (math.expm1(k) / k if k else 1.0)
    return _two_colors(color0, color1, depth, linear_moment(depth, depth))


def linear_opacity(
    color: ArrayLike, opacity0: float, opacity1: float, length: float, unit_distance: float = 1.0
) -> Floats:
    """Return the integral for one colour and an OPACITY that runs linearly along the ray.

    sigma = -log1p(-opacity) / unit_distance.  With the mean m of the two 1 - opacity and
    r = (half their difference) / m,

        tau = (L / unit_distance) (-log m + 1 - ((1 + r) log(1 + r) - (1 - r) log(1 - r)) / (2 r))

    and for small r, where that cancels, its series 1 - ... = sum r^(2 k) / (2 k (2 k + 1)), k >= 1.
    An opacity of 1 at one end is allowed (r = 1); the depth stays finite.

    Examples
    --------
    >>> linear_opacity((1, 1, 1), 0.5, 0.5, 2.0).tolist()
    [0.75, 0.75, 0.75, 0.75]
    >>> linear_opacity((1, 1, 1), 0.0, 1.0, 1.0).tolist() == [-math.expm1(-1.0)] * 4
    True
    """
    if opacity0 == opacity1 == 1:
        return _one_color(color, math.inf if length > 0 else 0.0)
    mean = ((1 - opacity0) + (1 - opacity1)) / 2
    r = abs(opacity1 - opacity0) / (2 * mean)
    if r < 0.25:  # r^2k < 1e-19 from k = 16 on
        bulge = sum(r ** (2 * k) / (2 * k * (2 * k + 1)) for k in range(16, 0, -1))
    else:
        below = (1 - r) * math.log1p(-r) if r < 1 else 0.0
        bulge = 1 - ((1 + r) * math.log1p(r) - below) / (2 * r)
    # log of the mean keeps the digits of opacities near 1, log1p those of opacities near 0.
    log_mean = math.log(mean) if mean < 0.5 else math.log1p(-(opacity0 + opacity1) / 2)
    return _one_color(color, length / unit_distance * (bulge - log_mean))


def ball_span(
    origin: Sequence[float], direction: Sequence[float], center: Sequence[float], radius: float
) -> tuple[float, float]:
    """Return t_near and t_far of a ray (unit direction) in a ball, t >= 0; (0, 0) where it misses.

    With b the distance of the line from the centre, half the chord is sqrt((R - b) (R + b)), which keeps
    the digits that R^2 - b^2 loses near the rim.

    Examples
    --------
    >>> ball_span((0, 0, 5), (0, 0, -1), (0, 0, 0), 2.0), ball_span((0, 0, 1), (0, 0, -1), (0, 0, 0), 2.0)
    ((3.0, 7.0), (0.0, 3.0))
    """
    middle, half = _chord(origin, direction, center, radius)
    return max(middle - half, 0.0), max(middle + half, 0.0)


def homogeneous_ball(
    color: ArrayLike,
    extinction: float,
    origin: Sequence[float],
    direction: Sequence[float],
    center: Sequence[float] = (0.0, 0.0, 0.0),
    radius: float = 1.0,
) -> Floats:
    """Return the integral of a ray through a ball of one colour and one extinction: sigma x its chord."""
    middle, half = _chord(origin, direction, center, radius)
    # t_far - t_near would round a short chord at a great distance.
    return homogeneous(color, extinction, half + min(half, max(middle, -half)))


def concentric_shells(
    colors: ArrayLike,
    extinctions: Sequence[float],
    radii: Sequence[float],
    origin: Sequence[float],
    direction: Sequence[float],
    center: Sequence[float] = (0.0, 0.0, 0.0),
) -> Floats:
    """Return the integral of a ray through shells of constant colour and extinction.

    `radii` (K,) rise; shell k reaches from radii[k - 1] (0 for k = 0) to radii[k].  The ray is cut at
    every sphere it meets, and each part is a slab of the shell in which its middle lies.

    Examples
    --------
    >>> twice = concentric_shells([(1, 1, 1)] * 2, [1.0, 1.0], [1.0, 2.0], (0, 0, 5), (0, 0, -1))
    >>> twice.tolist() == [-math.expm1(-4.0)] * 4
    True
    """
    paints = np.asarray(colors, dtype=np.float64)
    edges = sorted({t for radius in radii for t in ball_span(origin, direction, center, radius)})
    result = np.zeros(4)
    for t0, t1 in pairwise(edges):
        middle = [o + (t0 + t1) / 2 * d for o, d in zip(origin, direction, strict=True)]
        distance = math.dist(middle, center)
        shell = next((k for k, radius in enumerate(radii) if distance < radius), None)
        if shell is not None:
            result = over(result, homogeneous(paints[shell], extinctions[shell], t1 - t0))
    return result


def over(front: Floats, back: Floats) -> Floats:
    """Return premultiplied `front` over `back` (Porter & Duff 1984)."""
    return np.asarray(front + (1 - front[3]) * back)


def linear_moment(depth0: float, depth1: float) -> float:
    """Return int_0^1 s sigma(s) T(s) ds for sigma(s) = depth0 + (depth1 - depth0) s.

    `depth0` and `depth1` are the end extinctions times the length of the ray.  With tau(s) = p s + q s^2,
    p = depth0, q = (depth1 - depth0) / 2, integration by parts gives

        moment = K - exp(-tau(1)),    K = int_0^1 exp(-p s - q s^2) ds,    r = sqrt |q|,    w = p / (2 r)
        q > 0: K = sqrt(pi) / (2 r) (erfcx(w) - exp(-tau(1)) erfcx(w + r)),  erfcx(w) = exp(w^2) erfc(w)
        q < 0: K = (F(w) - exp(-tau(1)) F(w - r)) / r,                       F Dawson's integral

    erfcx and Dawson's integral hold the large exponentials that erf would need; both behave as 1 / w, so
    the forms stay good as q -> 0.  For p + |q| <= 1, where K - exp(-tau) cancels, the power series
    exp(-p s - q s^2) = sum h_n s^n, (n + 1) h_(n+1) = -p h_n - 2 q h_(n-1), is integrated term by term.

    Examples
    --------
    >>> abs(linear_moment(1.0, 1.0) - (1 - 2 / math.e)) < 1e-16
    True
    """
    p, q = depth0, (depth1 - depth0) / 2
    if p + abs(q) <= 1:
        return _moment_series(p, q)
    if q == 0:
        return (1 - (1 + p) * math.exp(-p)) / p
    from scipy.special import dawsn, erfcx

    end = math.exp(-(depth0 + depth1) / 2)
    r = math.sqrt(abs(q))
    # far is w + r for q > 0 and w - r for q < 0; the difference would cancel where the extinction ends at 0.
    w, far = depth0 / (2 * r), depth1 / (2 * r)
    if q > 0:
        whole = math.sqrt(math.pi) / (2 * r) * (erfcx(w) - end * erfcx(far))
    else:
        whole = (dawsn(w) - end * dawsn(far)) / r
    return float(whole - end)


def _chord(
    origin: Sequence[float], direction: Sequence[float], center: Sequence[float], radius: float
) -> tuple[float, float]:
    """Return t of the point of a line nearest to a ball's centre and half its chord; (0, 0) if it misses."""
    offset = [o - c for o, c in zip(origin, center, strict=True)]
    middle = -sum(o * d for o, d in zip(offset, direction, strict=True))
    miss = math.hypot(*(o + middle * d for o, d in zip(offset, direction, strict=True)))
    if miss >= radius:
        return 0.0, 0.0
    return middle, math.sqrt((radius - miss) * (radius + miss))


def _moment_series(p: float, q: float) -> float:
    # |h_n| <= the coefficients of exp(s + s^2) at p + |q| <= 1: below 1e-17 from n = 32 on.
    before, here, total = 0.0, 1.0, 0.0
    for n in range(40):
        total += here * (p / (n + 2) + 2 * q / (n + 3))
        before, here = here, (-p * here - 2 * q * before) / (n + 1)
    return total


def _one_color(color: ArrayLike, depth: float) -> Floats:
    alpha = -math.expm1(-depth)
    return np.append(np.asarray(color, dtype=np.float64) * alpha, alpha)


def _two_colors(color0: ArrayLike, color1: ArrayLike, depth: float, moment: float) -> Floats:
    front, back = np.asarray(color0, dtype=np.float64), np.asarray(color1, dtype=np.float64)
    alpha = -math.expm1(-depth)
    return np.append(front * (alpha - moment) + back * moment, alpha)
