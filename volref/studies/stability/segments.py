"""Cases of one segment: from extinction or opacity and a length to the segment's opacity."""

import numpy as np
from numpy.typing import ArrayLike

from volref.arrays import Floats
from volref.scene import TransferFunction
from volref.stages import classify
from volref.studies.stability import precise, textbook
from volref.studies.stability.case import EPS, Case, Measured, measured

FAMILY = "One segment"

WHITE = [(1.0, 1.0, 1.0)] * 2
EXTINCTION = TransferFunction([0, 1], WHITE, extinction=[0, 1])
OPACITY = TransferFunction([0, 1], WHITE, opacity=[0, 1])


def segment_opacities(transfer: TransferFunction, strength: ArrayLike, length: float) -> Floats:
    """Return volref's opacities of segments of one length."""
    table = classify.lookup_table(transfer, (0.0, 1.0))
    return classify.segment_opacity(table, np.array(strength, dtype=np.float64), length)


def _of_depths(depths: Floats) -> Measured:
    return measured(
        [precise.opacity_of_depth(depth) for depth in depths.tolist()],
        textbook.opacity(depths),
        segment_opacities(EXTINCTION, depths, 1.0),
        2 * EPS,
    )


def _of_ratios(alpha: float, ratios: list[float], naive: Floats, limit: float) -> Measured:
    return measured(
        [precise.opacity_of_ratio(alpha, ratio) for ratio in ratios],
        naive,
        [segment_opacities(OPACITY, [alpha], ratio)[0] for ratio in ratios],
        limit,
    )


def _thin() -> Measured:
    return _of_depths(np.array([1e-9, 1e-12, 1e-15, 1e-17]))


def _range() -> Measured:
    return _of_depths(np.power(10.0, np.arange(-300.0, 301.0, 25.0)))


def _single_precision() -> Measured:
    depths = np.array([1e-9, 2e-8])
    found = _of_depths(depths)
    return measured(
        found.reference, textbook.opacity(depths.astype(np.float32)), found.answers[0].value, 2 * EPS
    )


def _denormal() -> Measured:
    depths = np.array([5e-324, 1e-320, 1e-310])
    return measured(depths, textbook.opacity(depths), segment_opacities(EXTINCTION, depths, 1.0), 0.0)


def _faint_over_long() -> Measured:
    naive = textbook.corrected_opacity(np.array([1e-17]), 1e3)
    return _of_ratios(1e-17, [1e3], naive, 6 * EPS)


def _faint_half_step() -> Measured:
    naive = textbook.corrected_opacity(np.array([1e-17, 1e-17]), np.array([0.5, 0.25]))
    return _of_ratios(1e-17, [0.5, 0.25], naive, 6 * EPS)


def _opaque() -> Measured:
    ratios = [1e-300, 1e-12, 0.5, 1.0, 1e3]
    naive = textbook.corrected_opacity(np.full(5, 1 - 1e-7, np.float32), np.array(ratios, np.float32))
    return measured(np.ones(5), naive, [segment_opacities(OPACITY, [1.0], r)[0] for r in ratios], 0.0)


def _just_below_opaque() -> Measured:
    alpha, ratio = 1 - 2.0**-53, 1e-3
    naive = textbook.corrected_opacity(np.array([alpha], np.float32), np.array([ratio], np.float32))
    return _of_ratios(alpha, [ratio], naive, 6 * EPS)


def _short_of_unit() -> Measured:
    """Take opacity 1/2 per unit distance over 2^-60 to 2^10 of it."""
    ratios = [2.0**-60, 1e-12, 0.75, 3.0, 2.0**10]
    naive = textbook.corrected_opacity(np.full(5, 0.5), np.array(ratios))
    return _of_ratios(0.5, ratios, naive, 6 * EPS)


EXPM1 = "the product extinction x length is off by half an ulp, expm1 by 1 (NumPy's own tests): 2 in all"
LOG1P = "log1p and expm1 are off by 1 ulp each (NumPy's own tests), two products by half of one, and the "
LOG1P += "errors of the depth reach the opacity at most undiminished: below 6 ulp"
CLOSED = "1 - exp(-tau) in 400 decimal digits; Max 1995, eq. 9"
CORRECTED = "1 - (1 - alpha)^(length / unit distance) in 400 decimal digits; Engel et al. 2006"

CASES = (
    Case(
        "thin-segment",
        FAMILY,
        "Does a segment of optical depth 1e-9 to 1e-17 keep its opacity?",
        CLOSED,
        "1 - exp(-tau) in float64",
        EXPM1,
        _thin,
        "relative",
    ),
    Case(
        "thin-segment-float32",
        FAMILY,
        "And against a float32 shader, at depths of 1e-9 and 2e-8?",
        CLOSED,
        "1 - exp(-tau) in float32",
        EXPM1,
        _single_precision,
        "relative",
    ),
    Case(
        "depth-1e-300-to-1e300",
        FAMILY,
        "Is the opacity right for optical depths from 1e-300 to 1e300?",
        CLOSED,
        "1 - exp(-tau) in float64",
        EXPM1,
        _range,
        "relative",
    ),
    Case(
        "denormal-depth",
        FAMILY,
        "Do optical depths below the least normal number survive?",
        "opacity = tau to rounding, as tau^2 / 2 lies below the least float64",
        "1 - exp(-tau) in float64",
        "exact: expm1(-x) is -x there, and the product with length 1 changes nothing",
        _denormal,
        "relative",
    ),
    Case(
        "opacity-1e-17-over-1000-units",
        FAMILY,
        "Does an opacity of 1e-17 add up to 1e-14 over 1000 unit distances?",
        CORRECTED,
        "1 - (1 - alpha)^ratio in float64",
        LOG1P,
        _faint_over_long,
        "relative",
    ),
    Case(
        "opacity-1e-17-over-half-a-unit",
        FAMILY,
        "Does it halve and quarter (the usual step has a square root of its own)?",
        CORRECTED,
        "1 - (1 - alpha)^ratio in float64",
        LOG1P,
        _faint_half_step,
        "relative",
    ),
    Case(
        "opacity-half-from-2^-60-to-2^10-units",
        FAMILY,
        "Is the step-size correction right for very short and very long steps?",
        CORRECTED,
        "1 - (1 - alpha)^ratio in float64",
        LOG1P,
        _short_of_unit,
        "relative",
    ),
    Case(
        "opacity-1",
        FAMILY,
        "Is a table entry of opacity 1 opaque over any length, however short?",
        "1: the limit of 1 - (1 - alpha)^ratio for alpha to 1, at any ratio above 0",
        "alpha clamped to 1 - 1e-7 to keep the logarithm finite, in float32",
        "exact: log1p(-1) is -infinity, and expm1 of it is -1",
        _opaque,
    ),
    Case(
        "opacity-next-below-1",
        FAMILY,
        "Is the float64 next below 1 not taken for 1 (over a thousandth of a unit it lets 96 % through)?",
        CORRECTED,
        "1 - (1 - alpha)^ratio in float32, where alpha is 1",
        LOG1P,
        _just_below_opaque,
        "relative",
    ),
)
