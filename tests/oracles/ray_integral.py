"""The emission-absorption integral of one ray by adaptive quadrature at 30 digits (mpmath).

Shares nothing with volref: the integrand is written down as in Max (1995) and handed to Gauss-Legendre
quadrature, the optical depth inside it too.  `breaks` are the t at which the integrand bends or jumps.
"""

from functools import cache
from itertools import pairwise

from mpmath import mp, mpf


def ray_integral(colors, extinction, length, breaks=()):
    """Return the premultiplied channels and alpha, [*C, alpha], of t from 0 to `length`.

    `colors` is a list of functions of t, one per channel, `extinction` a function of t.
    """
    with mp.workdps(30):
        edges = sorted({mpf(0), mpf(length), *(mpf(t) for t in breaks if 0 < t < length)})
        channels, depth = [mpf(0) for _ in colors], mpf(0)
        for a, b in pairwise(edges):
            weight = _weight(extinction, a, depth)
            for i, color in enumerate(colors):
                channels[i] += _quad(lambda t, c=color, w=weight: c(t) * w(t), a, b)
            depth += _quad(extinction, a, b)
        return [*channels, -mp.expm1(-depth)]


def graded(length, depth):
    """Return breaks that halve towards t = 0 and t = `length`: a thick ray is seen near its ends only."""
    count = max(0, int(depth).bit_length())
    near = [length / 2**k for k in range(1, count + 2)]
    return near + [length - t for t in near]


def _weight(extinction, start, depth):
    """Return sigma T as a function of t, with optical depth `depth` in front of `start`."""

    @cache  # the channels are integrated at the same nodes
    def weight(t):
        return extinction(t) * mp.exp(-depth - _quad(extinction, start, t))

    return weight


def _quad(function, a, b):
    return mp.quad(function, [a, b], method="gauss-legendre") if a != b else mpf(0)
