"""Optical depth and emission of a piece of a ray, by Taylor series with a proven remainder.

In a step the place is z, from -1 to 1, and the value of the field a cubic s(z).  The rest are power series
about z = 0, their coefficients by recurrence; with l the world length per z and d the unit distance,

    g       optical depth per z: l (extinction), or -(l / d) log(1 - opacity)
    E       transmittance from the start of the step on: E' = -g E
    depth   int g dz
    moment  int (s - s(0)) g E dz

As colours are linear in s, a step with transmittance T in front of it adds to a channel the light
T (c(s(0)) (1 - exp(-depth)) + (dc/ds) moment).

Remainder.  On the disc |z| <= rho let X be the sum of the sizes of the terms of
(1 - opacity(z)) / (1 - opacity(0)) - 1, 0 for extinctions, and V that of (dc/ds) (s - s(0)).  If X < 1,
then |g| is at most G = |r0| + (|r1| rho + |r2| rho^2 + |r3| rho^3) / (1 - X), where r are the rates: the
coefficients of g itself for extinctions, g(0) and those of (l / d) opacity / (1 - opacity(0)) for
opacities, as log(1 - opacity) is log(1 + x) with |x| <= X.  And E is at most exp(rho G).  By Cauchy's
estimate the terms beyond z^n of a function that is at most M on the disc add to its integral from -1 to 1
no more than M rho^-n / (rho - 1).  M = V G exp(rho G) for the moment.  M = G for the depth, whose error
any channel feels at most times the brightest colour B in sight, and, as it makes E(0) wrong, at most times V
in the moment.  So n is chosen such that

    (B + 2 V) G exp(rho G) rho^-n / (rho - 1) <= tolerance B max(G(1), SHARE (depth in front))

at the best of some rho.  G(1) is little more than the depth of the step, so the remainder of a whole ray
is relative to its depth: the faintest keep their digits.
"""

import math
import operator
from collections.abc import Sequence
from dataclasses import dataclass

from volref.truth.digits.table import Context, Interval, Number

# G(1) of a step is at most this, so that exp(rho G) does not eat what rho^-n gives.
MOST_DEPTH = 2.0
RHOS = (4.0, 6.0, 9.0, 14.0, 24.0, 48.0, 100.0, 300.0, 1e3, 1e4, 1e6)
# A step may have this share of the remainder of all before it, however thin it is itself.
SHARE = 1 / 64
# X at the least rho is at most this, so that at least that one can be used.
MOST_X = 0.9


@dataclass(frozen=True)
class Medium:
    """What is the same in all steps of a piece.

    interval: the table there, neither clear nor opaque.  unit_distance: None where the strength is an
    extinction.  brightest: no channel, in the table or behind, is above it.  tolerance: see the module.
    """

    interval: Interval
    unit_distance: Number | None
    brightest: float
    tolerance: float


@dataclass(frozen=True)
class Step:
    """Optical depth and moment of a step, and what their remainders do at most to any channel."""

    depth: Number
    moment: Number
    remainder: Number


def taylor_step(
    mp: Context, medium: Medium, value: Sequence[Number], length: Number, depth_before: Number
) -> Step | None:
    """Return the step in which the field is the cubic `value` of z, and `length` the world length per z.

    `depth_before` is the optical depth in front of it.  None where the series would converge too slowly:
    halve the step.

    Examples
    --------
    From value 0 to 1, which is the extinction, over a length of 2; colour is the value too, so the moment
    about 1/2 is int_0^2 (t / 2 - 1/2) (t / 2) exp(-t^2 / 4) dt:

    >>> from mpmath import mp
    >>> from volref.scene import TransferFunction
    >>> from volref.truth.digits.table import exact_table
    >>> table = exact_table(mp, TransferFunction([0, 1], [(0, 0, 0), (1, 1, 1)], [0, 1]))
    >>> medium = Medium(table.intervals[1], None, 1.0, 1e-15)
    >>> step = taylor_step(mp, medium, [mp.mpf(c) for c in (0.5, 0.5, 0, 0)], mp.one, mp.zero)
    >>> moment = mp.quad(lambda t: (t / 2 - 0.5) * (t / 2) * mp.exp(-t * t / 4), [0, 2])
    >>> float(step.depth), bool(abs(step.moment - moment) <= 1e-15)
    (1.0, True)
    """
    interval = medium.interval
    strength = interval.strength_at(value[0])
    slopes = [interval.strength_slope * s for s in value[1:]]
    x: list[Number] = []
    if medium.unit_distance is None:
        rates = [length * strength, *(length * slope for slope in slopes)]
    else:
        clear, scale = 1 - strength, length / medium.unit_distance
        if _at(RHOS[0], [abs(slope) for slope in slopes]) > MOST_X * clear:
            return None
        x = [-slope / clear for slope in slopes]
        rates = [-scale * mp.log1p(-strength), *(-scale * term for term in x)]
    sizes, bends = [abs(rate) for rate in rates], [abs(term) for term in x] or [mp.zero] * 3
    most = sizes[0] + sum(sizes[1:]) / (1 - sum(bends))
    if most > MOST_DEPTH:
        return None
    if not most:
        return Step(mp.zero, mp.zero, mp.zero)
    allowed = medium.tolerance * max(most, depth_before * SHARE)
    steepest = max(map(abs, interval.color_slope))
    order = _order(
        float(most),
        [float(size / allowed) for size in sizes],
        [float(bend) for bend in bends],
        [float(steepest * abs(s) / medium.brightest) for s in value[1:]],
    )
    series = [_to_fixed(mp, rate / most) for rate in rates]
    if any(x):
        series = _logarithm(mp, series, x, order)
    depth = most * _rounded(mp, sum(2 * term // (k + 1) for k, term in enumerate(series) if k % 2 == 0))
    moment = _moment(mp, value, series, most, order) if steepest else mp.zero
    return Step(depth, moment, allowed * medium.brightest)


def edge_step(mp: Context, medium: Medium, value: Sequence[Number], length: Number) -> Step | None:
    """Return a step so short that its colour hardly changes, for opacities that reach 1 at its edge.

    Its depth is finite, for -log(w) is integrable at w = 0, and tanh-sinh quadrature finds it; what the
    colour changes about its middle bounds the remainder.  None where that is above the tolerance.
    """
    interval = medium.interval
    change = max(map(abs, interval.color_slope)) * sum(map(abs, value[1:]))
    tiny = mp.mpf(10) ** -mp.dps
    scale = length / medium.unit_distance

    def rate(z: Number) -> Number:
        clear = 1 - interval.strength_at(((value[3] * z + value[2]) * z + value[1]) * z + value[0])
        return -scale * mp.log(max(clear, tiny))

    allowed = medium.tolerance * medium.brightest
    if change * min(1, rate(mp.zero)) > allowed:
        return None
    depth = mp.quad(rate, [-1, 1])
    remainder = -change * mp.expm1(-depth)
    return Step(depth, mp.zero, remainder) if remainder <= allowed else None


def _order(most: float, shares: Sequence[float], bends: Sequence[float], changes: Sequence[float]) -> int:
    """Return the power n to which the series are taken.

    G(1) is `most`; `shares` (4,) are the sizes of the rates divided by what the remainder may be, over B;
    `bends` and `changes` (3,) are the sizes of the terms of X and V / B from the first power on.
    """
    orders: list[float] = []
    for rho in RHOS:
        bend = _at(rho, bends)
        if bend < 1:
            share = shares[0] + _at(rho, shares[1:]) / (1 - bend)
            bound = (1 + 2 * _at(rho, changes)) * share / (rho - 1)
            growth = share / (shares[0] + sum(shares[1:]) / (1 - sum(bends)))
            orders.append((math.log(bound) + rho * growth * most) / math.log(rho))
    return max(1, math.ceil(min(orders)))


def _at(rho: float, terms: Sequence[Number]) -> Number:
    """Return terms[0] rho + terms[1] rho^2 + terms[2] rho^3."""
    return ((terms[2] * rho + terms[1]) * rho + terms[0]) * rho


def _to_fixed(mp: Context, number: Number) -> int:
    """Return a number in fixed point: as a whole number of 2^-prec, prec the context's precision in bits.

    Python's whole numbers are ten times as fast as mpmath's, and all numbers of the series are near 1.
    """
    return int(number.to_fixed(mp.prec))


def _rounded(mp: Context, fixed: int) -> Number:
    return mp.ldexp(mp.mpf(fixed), -mp.prec)


def _logarithm(mp: Context, rates: Sequence[int], x: Sequence[Number], order: int) -> list[int]:
    """Return the coefficients, up to z^order, of r0 + r log(1 + x0 z + x1 z^2 + x2 z^3), in fixed point.

    `rates` are r0, r x0, r x1, r x2.  From q' (1 + x) = x' for q = log(1 + x):
    k q_k = k x_k - sum over j of x_j (k - j) q_(k-j).
    """
    factors = [_to_fixed(mp, term) for term in x]
    slope: list[int] = []  # k r q_k, from k = 1 on
    for k in range(1, order + 1):
        inner = sum(map(operator.mul, factors, reversed(slope))) >> mp.prec
        slope.append((k * rates[k] if k < len(rates) else 0) - inner)
    return [rates[0], *(term // k for k, term in enumerate(slope, 1))]


def _moment(mp: Context, value: Sequence[Number], series: Sequence[int], most: Number, order: int) -> Number:
    """Return the integral of (s - s(0)) g E from -1 to 1, its integrand taken up to z^order.

    `series` are the coefficients of g / `most` in fixed point.  g E = -E', so the series of E gives it:
    (k + 1) E_(k+1) = -sum over j of g_j E_(k-j).
    """
    far = max(map(abs, value[1:]))
    if not far:
        return mp.zero
    before = sum((term if k % 2 == 0 else -term) // (k + 1) for k, term in enumerate(series))
    transmittance, emitted = [_to_fixed(mp, mp.exp(-most * _rounded(mp, before)))], []  # E, and g E / most
    prec, scale = mp.prec, _to_fixed(mp, most)
    for k in range(order):
        emitted.append(sum(map(operator.mul, series, reversed(transmittance))) >> prec)
        transmittance.append(-(scale * emitted[k] >> prec) // (k + 1))
    away = [_to_fixed(mp, s / far) for s in value[1:]]
    moment = sum(
        2 * sum(map(operator.mul, away, reversed(emitted[:power]))) // (power + 1)
        for power in range(2, order + 1, 2)
    )
    return far * most * _rounded(mp, moment >> prec)
