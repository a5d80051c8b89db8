"""Gauss-Legendre rules, and the optical depth in front of their nodes.

k nodes, n pieces of rays; per piece values are (n,), colours (3, n).
"""

from dataclasses import dataclass
from functools import cache

import numpy as np

from volref.arrays import Floats, Indices
from volref.studies.rivals.medium import Bundle, Light, Medium, paint, sample
from volref.workspace import Workspace


@dataclass(frozen=True, eq=False)
class Rule:
    """Nodes and weights (k,) on 0..1, and `before` (k, k).

    Row i of `before` gives, times f at the nodes, the integral from 0 to node i of the polynomial of degree
    k - 1 through them.
    """

    nodes: Floats
    weights: Floats
    before: Floats


@cache
def gauss_rule(count: int) -> Rule:
    """Return the rule with `count` nodes, exact for polynomials of degree 2 count - 1.

    The interpolant is sum_p a_p P_p in Legendre polynomials, a_p = (2 p + 1) / 2 sum_j w_j P_p(x_j) f_j (the
    rule is exact for these products), and the integral of P_p from -1 to x is
    (P_(p+1)(x) - P_(p-1)(x)) / (2 p + 1), that of P_0 x + 1.  Neither step is ill conditioned; the inverse
    of a matrix of powers would cost 11 digits at 16 nodes.

    Examples
    --------
    >>> rule = gauss_rule(2)
    >>> rule.weights.round(15).tolist(), (rule.before @ rule.nodes * 2 - rule.nodes**2).round(15).tolist()
    ([0.5, 0.5], [0.0, 0.0])
    """
    x, w = np.polynomial.legendre.leggauss(count)
    p = np.polynomial.legendre.legvander(x, count)
    integrals = np.empty((count, count))  # of P_p up to x_i, times 2 p + 1
    integrals[:, 0] = x + 1
    integrals[:, 1:] = p[:, 2:] - p[:, : count - 1]
    return Rule((x + 1) / 2, w / 2, integrals @ (p[:, :count] * w[:, None]).T / 4)


def gauss_pieces(
    medium: Medium, bundle: Bundle, ray: Indices, start: Floats, length: Floats, count: int, work: Workspace
) -> tuple[Floats, Floats]:
    """Return the optical depth (n,) and the light (3, n) of pieces of rays by `count` nodes each.

        tau = h sum_i w_i sigma_i         C = h sum_i w_i c_i sigma_i exp(-tau_i)

    with tau_i the integral of the interpolated extinction up to node i, not below 0.  Where the integrand
    is smooth both are of order 2 k: the error of tau_i is a multiple of the Legendre polynomial P_(k-1) at
    the nodes, to which the sum over i is blind but for the k-th derivative.
    """
    rule = gauss_rule(count)
    origin, slope = bundle.start[:, ray], bundle.slope[:, ray]
    colors, depths = [], []
    for node in rule.nodes:
        values = sample(medium, origin, slope, start + node * length, work)
        color, sigma = paint(medium, values, work)
        colors.append(color.copy())
        depths.append(sigma * length)
    light = np.zeros((3, len(ray)))
    total = np.zeros(len(ray))
    for color, depth, weight, row in zip(colors, depths, rule.weights, rule.before, strict=True):
        before = np.zeros(len(ray))
        for share, other in zip(row, depths, strict=True):
            before += share * other
        light += weight * depth * np.exp(-np.maximum(before, 0.0)) * color
        total += weight * depth
    return total, light


def composite_pieces(ray: Indices, depth: Floats, light: Floats, rays: int, samples: int) -> Light:
    """Composite pieces that lie front to back along each ray, ray after ray.

    Transmittances are exponentials of sums of optical depths, ray by ray, so that a thick ray costs the
    others no digits.
    """
    counts = np.bincount(ray, minlength=rays)
    place = np.arange(len(ray)) - (np.cumsum(counts) - counts)[ray]
    depths = np.zeros((counts.max(initial=0) + 1, rays))
    depths[place + 1, ray] = depth
    depths = np.cumsum(depths, axis=0)
    weight = np.exp(-depths[place, ray])
    color = np.zeros((3, rays))
    for out, channel in zip(color, light, strict=True):
        out += np.bincount(ray, weight * channel, minlength=rays)
    return Light(np.exp(-depths[-1]), color, samples)
