"""What marching in float32 instead of float64 can change: a bound, from the scene alone.

With u = 2^-24: the index of a sample is counted from a whole number near where its block begins, so that
it is less than M = 4 + 2 S for samples up to S indices away, and off by 3 u M: the stride, its multiple,
where the block begins, and two sums.  That makes its value off by 3 u M times the sum over the axes of the
steepest steps.  The samples and the knots are rounded by u max|v| each, and three interpolations one after
the other by 3 u max|v| and 2 u times the steps.  Call all that d.  By the identity
of `stages.radiance` an extinction that is off by e(t) and a colour that is off by r change the image by at
most

    integral of T e dt + r,        e <= s(v) d + 4 u sigma,        r <= d max|c'| + 4 u max c

where s(v) is the slope of the extinction.  Below any level of extinction the integral is at most the length
of the ray times the steepest slope there; above it, since T sigma integrates to at most 1, at most the
greatest s / sigma.  The best level is taken.  Nothing can be said of a table with a jump, or that reaches
opacity 1.
"""

from weakref import WeakKeyDictionary

import numpy as np

from volref.arrays import Floats, Numbers
from volref.scene.transfer import TransferFunction
from volref.scene.volume import Volume

UNIT = 2.0**-24

# Samples of a slab whose differences are taken at a time.
SLAB = 1 << 20

# An opacity above this has no slope of its logarithm to speak of.
MOST_OPACITY = 0.999

_steps: WeakKeyDictionary[Volume, tuple[float, float, float]] = WeakKeyDictionary()


def float32_error(volume: Volume, transfer: TransferFunction, longest: float, furthest: float) -> float:
    """Return a bound on what float32 changes in any channel of a ray at most `longest` long; inf: unknown.

    Samples lie at most `furthest` indices along any axis from where their block begins.  The roundings of
    compositing are left out, one unit a segment and operation.
    """
    if max(map(abs, volume.value_bounds)) > 1e30:
        return np.inf
    slopes = _slopes(transfer, *volume.value_bounds)
    if slopes is None:
        return np.inf
    steepness, extinction, color_slope = slopes
    off = UNIT * (3 * (4 + 2 * furthest) + 2) * sum(steepest_steps(volume))
    off += 5 * UNIT * max(map(abs, volume.value_bounds))
    levels = np.unique(extinction[1])
    depth = min(_split_at(level, steepness, extinction, longest) for level in [np.inf, *levels.tolist()])
    brightest = max(float(transfer.colors.max()), 1.0)
    return (depth * off + 8 * UNIT) * brightest + color_slope * off


def steepest_steps(volume: Volume) -> tuple[float, float, float]:
    """Return the greatest difference between neighbouring samples along x, y and z; found once per volume."""
    if volume not in _steps:
        values = volume.values
        thick = max(SLAB // max(values[0].size, 1), 1)
        steps = np.zeros(3)
        for first in range(0, len(values), thick):
            slab = values[first : first + thick + 1]
            for axis in range(3):
                planes = np.moveaxis(slab, axis, 0)
                if len(planes) > 1:
                    steps[2 - axis] = max(steps[2 - axis], _greatest_difference(planes[1:], planes[:-1]))
        _steps[volume] = (float(steps[0]), float(steps[1]), float(steps[2]))
    return _steps[volume]


def _greatest_difference(a: Numbers, b: Numbers) -> float:
    """Return the greatest |a - b|, computed in the arrays' own type: bytes take an eighth of the time.

    Examples
    --------
    >>> _greatest_difference(np.array([-128, 3], np.int8), np.array([127, 1], np.int8))
    255.0
    """
    difference = np.maximum(a, b)
    difference -= np.minimum(a, b)
    if difference.dtype.kind == "i":  # the difference of two signed numbers may need the sign's bit
        difference = difference.view(difference.dtype.str.replace("i", "u"))
    return float(difference.max())


def _slopes(transfer: TransferFunction, low: float, high: float) -> tuple[Floats, Floats, float] | None:
    """Return slopes (n,) and extinctions at both ends (2, n) of the pieces within reach, and the colours'.

    The least extinction of a piece is the first of its ends.
    """
    knots = transfer.values
    margin = 1e-5 * max(abs(low), abs(high))
    inside = (knots[1:] >= low - margin) & (knots[:-1] <= high + margin)
    gap = np.diff(knots)
    strength = np.asarray(transfer.opacity if transfer.extinction is None else transfer.extinction)
    change = np.abs(np.diff(strength)), np.abs(np.diff(transfer.colors, axis=0)).max(axis=1, initial=0.0)
    close = inside & (gap <= margin)
    if (close & ((change[0] > 0) | (change[1] > 0))).any() or not np.isfinite(strength).all():
        return None
    inside &= ~close
    slope = change[0][inside] / gap[inside]
    ends = np.sort(np.stack([strength[:-1], strength[1:]])[:, inside], axis=0)
    if transfer.extinction is None:
        if strength.max() > MOST_OPACITY:
            return None
        slope = slope / (1 - ends[1]) / transfer.unit_distance
        ends = -np.log1p(-ends) / transfer.unit_distance
    return slope, ends, float((change[1][inside] / gap[inside]).max(initial=0.0))


def _split_at(level: float, slope: Floats, extinction: Floats, longest: float) -> float:
    """Return the bound on the integral of T s dt that splits pieces at a level of extinction."""
    below = extinction[0] < level
    steep = float(slope[below].max(initial=0.0)) * longest
    above = slope[~below] / np.maximum(extinction[0][~below], 1e-300)
    return steep + float(above.max(initial=0.0))
