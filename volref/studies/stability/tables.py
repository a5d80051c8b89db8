"""Cases of transfer functions: lookup, jumps, and integrals over a linear piece."""

import math

import numpy as np

from volref.arrays import Floats, Numbers
from volref.phantoms import closed
from volref.scene import TransferFunction
from volref.stages import classify
from volref.studies.stability import precise
from volref.studies.stability.case import EPS, Case, Measured, measured
from volref.workspace import Workspace

FAMILY = "Transfer functions"


def looked_up(transfer: TransferFunction, values: Floats) -> Floats:
    """Return volref's extinction or opacity at values, as a march over their range looks it up."""
    table = classify.lookup_table(transfer, (float(values.min()), float(values.max())))
    _, strength = classify.classify(table, values, Workspace())
    return strength.copy()


def _white(values: list[float], extinction: list[float]) -> TransferFunction:
    return TransferFunction(values, [(1.0, 1.0, 1.0)] * len(values), extinction)


def _interpolated(x: Numbers | float, x0: float, x1: float, y0: float, y1: float) -> Floats:
    with np.errstate(all="ignore"):
        x0, x1 = np.float64(x0), np.float64(x1)
        return np.asarray(y0 + (np.asarray(x) - x0) / (x1 - x0) * (y1 - y0))


def _at_a_jump() -> Measured:
    values = np.array([np.nextafter(0.5, 0), 0.5, np.nextafter(0.5, 1)])
    found = looked_up(_white([0.5, 0.5], [1.0, 7.0]), values)
    return measured([1.0, 7.0, 7.0], _interpolated(values, 0.5, 0.5, 1.0, 7.0), found, 0.0)


def _steepest_piece() -> Measured:
    """Give two neighbouring floats the extinctions 0 and 1e300: their slope, 9e315, is no float."""
    low, high = 0.5, float(np.nextafter(0.5, 1))
    values = np.array([0.25, low, high, 0.75])
    found = looked_up(_white([low, high], [0.0, 1e300]), values)
    with np.errstate(all="ignore"):
        slope = np.float64(1e300) / (high - low)
        naive = np.clip(values - low, 0.0, high - low) * slope
    return measured([0.0, 0.0, 1e300, 1e300], naive, found, 0.0)


def _rounded_above_one() -> Measured:
    """Take values just below a knot of opacity 1, where base + slope offset is 1 + 2.2e-16 in float64."""
    truth, naive, found = [], [], []
    for low, high, alpha in ((-10.0, 0.001, 0.1), (-3.0, 0.0, 0.08), (-10.0, 0.3, 0.21)):
        value = float(np.nextafter(high, -1))
        # A third knot, or the table would be even and the value taken for the knot's.
        knots = [low - 0.37 * (high - low), low, high]
        transfer = TransferFunction(knots, [(1.0, 1.0, 1.0)] * 3, opacity=[alpha, alpha, 1.0])
        strength = looked_up(transfer, np.array([low, value]))
        table = classify.lookup_table(transfer, (low, high))
        found.append(classify.segment_opacity(table, strength, 0.25)[1])
        opacity = alpha + (1 - alpha) / (high - low) * (value - low)
        with np.errstate(all="ignore"):
            naive.append(float(-np.expm1(0.25 * np.log1p(-opacity))))
        truth.append(precise.opacity_of_ratio(precise.line(value, low, high, alpha, 1.0), 0.25))
    return measured(truth, naive, found, (2 * EPS) ** 0.25)


def _rounded_below_zero() -> Measured:
    """Take a value just below a knot of extinction 0, where base + slope offset is -7e-18 in float64."""
    low, high, first = 1.4648852660931833, 7.903988519184711, 0.060708408767123245
    value = np.nextafter(high, 0)
    naive = first - first / (high - low) * (value - low)
    table = _white([low - 0.37 * (high - low), low, high], [first, first, 0.0])
    found = looked_up(table, np.array([low, value]))[1]
    # Turned into light that grows along the ray: only the sign counts.
    return measured(0.0, min(naive, 0.0), min(found, 0.0), 0.0)


def _narrow_window() -> Measured:
    """Open a window of one code at the upper end of uint32."""
    values = np.array([4294967290.0, 4294967290.25, 4294967291.0])
    found = looked_up(_white([4294967290.0, 4294967291.0], [0.0, 8.0]), values)
    single = values.astype(np.float32)
    naive = _interpolated(
        single.astype(np.float64), float(single[0]), float(np.float32(4294967291.0)), 0.0, 8.0
    )
    return measured([0.0, 2.0, 8.0], naive, found, 0.0)


def _wide_domain() -> Measured:
    values = np.array([-5e299, 0.0, 5e299])
    found = looked_up(_white([-1e300, 1e300], [0.0, 8.0]), values)
    with np.errstate(all="ignore"):
        single = values.astype(np.float32)
        naive = _interpolated(single, float(np.float32(-1e300)), float(np.float32(1e300)), 0.0, 8.0)
    return measured([2.0, 4.0, 6.0], naive, found, 4 * EPS * 8)


def _segment_without_change() -> Measured:
    """Opacity and colour of segments with extinctions 2 and 2, 2 + 1e-14, 2 + 1e-9; black to white.

    With q = rise / 2 the moment (see `closed.linear_moment`) is
    int exp(-2 s)(1 - q s^2) ds - exp(-2 - q) = (1 - e^-2) / 2 - q (1 - 5 e^-2) / 4 - e^(-2 - q), up to q^2.
    """
    truth, naive, found = [], [], []
    for rise in (0.0, 1e-14, 1e-9):
        end = 2.0 + rise
        q = (end - 2.0) / 2
        moment = (1 - np.exp(-2)) / 2 - q * (1 - 5 * np.exp(-2)) / 4 - np.exp(-2 - q)
        truth += [precise.opacity_of_depth(2.0 + q), moment]
        rgba = closed.linear_both((0.0, 0.0, 0.0), (1.0, 1.0, 1.0), 2.0, end, 1.0)
        found += [rgba[3], rgba[0]]
        naive += _by_primitives(2.0, end)
    return measured(truth, naive, found, 16 * EPS)


def _by_primitives(first: float, last: float) -> list[float]:
    """Return opacity and moment from differences of primitives over last - first (Engel et al. 2001)."""
    a, b = np.float64(first), np.float64(last)
    q = (b - a) / 2
    with np.errstate(all="ignore"):
        opacity = 1 - np.exp(-(b**2 - a**2) / 2 / (b - a))
        growth = np.exp(a * a / (4 * q))  # beside erf(w + r) - erf(w), which is 0 then
        w, r = a / (2 * np.sqrt(q)), np.sqrt(q)
        moment = np.sqrt(np.pi) / (2 * r) * growth * (math.erf(w + r) - math.erf(w)) - np.exp(-2 - q)
    return [float(opacity), float(moment)]


CASES = (
    Case(
        "value-on-a-jump",
        FAMILY,
        "At two knots with one value, which holds on it, just below, just above?",
        "the first knot below, the second from the value on",
        "linear interpolation between the two, whose width is 0",
        "exact: no arithmetic, a comparison",
        _at_a_jump,
    ),
    Case(
        "knots-one-ulp-apart",
        FAMILY,
        "From extinction 0 to 1e300 within one ulp of the value: is each side its own?",
        "0 up to the lower knot, 1e300 from the upper one on",
        "base + slope x offset with an infinite slope, which is NaN at the knot",
        "exact: such a pair is a jump",
        _steepest_piece,
    ),
    Case(
        "opacity-rounded-above-1",
        FAMILY,
        "Just below a knot of opacity 1, where rounding goes past it: is a quarter step still a number?",
        "the line through the knots, and 1 - (1 - alpha)^(1/4), in 400 digits",
        "the same in float64, where log1p(-1.0000000000000002) is NaN",
        "a line is off by 2 eps, and (2 eps)^(1/4) is what a quarter step makes of it: that near to 1 the "
        "problem itself is that ill-conditioned",
        _rounded_above_one,
    ),
    Case(
        "extinction-rounded-below-0",
        FAMILY,
        "Just below a knot of extinction 0, where rounding goes past it: is none negative?",
        "0: the part of the extinction below 0",
        "base + slope x offset in float64: -7e-18, which adds light",
        "exact: the result is held to at least 0",
        _rounded_below_zero,
    ),
    Case(
        "window-of-one-code-at-the-end-of-uint32",
        FAMILY,
        "Does a table over 4294967290 to 4294967291 tell the values in between apart?",
        "linear: 0, 2 and 8 at 0, 1/4 and 1",
        "the same line after rounding to float32, whose codes there are 256 apart",
        "exact: differences of these numbers are powers of 2 in float64",
        _narrow_window,
    ),
    Case(
        "table-from-minus-1e300-to-1e300",
        FAMILY,
        "Is a table over nearly all floats looked up correctly?",
        "linear: 2, 4 and 6 at 1/4, 1/2 and 3/4",
        "float32, where the knots are infinite",
        "four operations on 8",
        _wide_domain,
    ),
    Case(
        "segment-with-equal-ends",
        FAMILY,
        "Is the integral over a segment right whose two values are equal, or nearly?",
        "the series in the difference up to its first power; tau = length x mean extinction in 400 digits",
        "pre-integration: differences of primitives over the difference of the values, 0 / 0",
        "the closed form is off by at most 10 eps in thousands of trials, 16 with the series' own rounding",
        _segment_without_change,
    ),
)
