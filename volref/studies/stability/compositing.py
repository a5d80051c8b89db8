"""Cases of many segments: front-to-back compositing."""

import math

import numpy as np

from volref.arrays import Floats
from volref.stages import composite
from volref.studies.stability import textbook
from volref.studies.stability.case import Case, Measured, measured
from volref.studies.stability.pictures import rounding
from volref.studies.stability.segments import EXTINCTION, segment_opacities
from volref.workspace import Workspace

FAMILY = "Many segments"


def composited(opacities: Floats, color: float = 1.0) -> tuple[Floats, Floats]:
    """Return transmittance (R,) and colour (R,) that volref composites of segments (S, R), one colour."""
    segments, rays = opacities.shape
    transmittance, total = np.ones(rays), np.zeros((3, rays))
    colors = np.full((3, segments, rays), color)
    composite.composite_block(transmittance, total, opacities, colors, Workspace())
    return transmittance, total[0]


def _column(opacities: Floats | list[float]) -> Floats:
    return np.asarray(opacities, dtype=np.float64)[:, None]


def _long_steps() -> Measured:
    opacity = segment_opacities(EXTINCTION, np.full(5, 3.0), 1.0)
    transmittance, total = composited(_column(opacity))
    reference = [-math.expm1(-15.0), math.exp(-15.0)]
    return measured(reference, textbook.riemann(3.0, 5), [total[0], transmittance[0]], rounding(5))


def _million() -> Measured:
    """Composite a thousand rays of a thousand segments, then those as the segments of one ray."""
    opacity = segment_opacities(EXTINCTION, [2e-8], 1.0)[0]
    part, _ = composited(np.full((1000, 1000), opacity))
    transmittance, total = composited(_column(1 - part))
    steps = np.full(10**6, 1 - np.float32(2e-8), np.float32)
    naive = float(np.multiply.accumulate(steps)[-1])
    reference = [math.exp(-0.02), -math.expm1(-0.02)]
    return measured(reference, [naive, 1 - naive], [transmittance[0], total[0]], rounding(1_001_000))


def _underflow() -> Measured:
    depths = np.full(400, 2.0)
    _, total = composited(_column(segment_opacities(EXTINCTION, depths, 1.0)), 0.7)
    products = np.cumprod(np.exp(-depths))
    with np.errstate(all="ignore"):
        own = 1 - products[1:] / products[:-1]
        naive = 0.7 * (1 - products[0] + (products[:-1] * own).sum())
    return measured(-0.7 * math.expm1(-800.0), naive, total, rounding(400))


def _sheets() -> Measured:
    opacities = np.tile([1.0, 0.0], 32)
    transmittance, total = composited(_column(opacities), 0.7)
    with np.errstate(all="ignore"):
        depth = np.append(0.0, np.cumsum(-np.log1p(-opacities)))
        own = -np.expm1(-np.diff(depth))
        naive = 0.7 * (np.exp(-depth[:-1]) * own).sum()
    return measured([0.7, 0.0], [naive, np.exp(-depth[-1])], [total[0], transmittance[0]], 0.0)


def _weights_sum() -> Measured:
    opacity = segment_opacities(EXTINCTION, np.full(4096, 8 / 4096), 1.0)
    transmittance, total = composited(_column(opacity))
    naive = float(np.sum(textbook.front_to_back(opacity.astype(np.float32), 1.0)))
    return measured(1.0, naive, total + transmittance, rounding(4096))


ADDED = "rounding of the transmittance and the colour, one eps per segment, and of the opacities, 4 eps"

CASES = (
    Case(
        "long-steps",
        FAMILY,
        "What comes of five segments of optical depth 3 each?",
        "alpha = 1 - exp(-15), T = exp(-15); Max 1995, eq. 9",
        "opacity = extinction x length: T *= 1 - 3 changes its sign and grows",
        ADDED,
        _long_steps,
    ),
    Case(
        "million-thin-samples",
        FAMILY,
        "Do a million samples of optical depth 2e-8 dim the light by 2 %?",
        "T = exp(-0.02): optical depths add up",
        "the product of a million 1 - 2e-8 in float32",
        f"{ADDED}; a million and a thousand segments",
        _million,
    ),
    Case(
        "underflowing-transmittance",
        FAMILY,
        "Is the light of a ray still a number after an optical depth of 800?",
        "0.7 (1 - exp(-800)): one colour throughout",
        "opacities recovered as 1 - P[k + 1] / P[k] from cumulative products P, which reach 0 / 0",
        ADDED,
        _underflow,
    ),
    Case(
        "opaque-clear-opaque",
        FAMILY,
        "Of sheets that are opaque and clear in turn, is only the first seen?",
        "the colour of the first sheet, and nothing behind it",
        "differences of cumulative optical depths, which reach infinity - infinity",
        "exact: T - T x 1 = 0, and nothing times 0 is added",
        _sheets,
    ),
    Case(
        "weights-and-transmittance",
        FAMILY,
        "Do the weights of 4096 segments and the last transmittance add up to 1?",
        "1: what is not absorbed passes",
        "C += T a and T *= 1 - a in float32",
        ADDED,
        _weights_sum,
    ),
)
