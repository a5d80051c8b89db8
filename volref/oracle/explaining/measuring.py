"""How much of what is outside the intervals a picture explains.

Before the canvas rounds, the nominal picture n has the interval [lo, hi] around it, and a fault's picture f
one of the same widths, f - (n - lo) to f + (hi - n).  Rounding moves its ends outward by half a level, and

    explained = 1 - (sum of how far image c is outside the interval around f) / (the same around n)

so that 1 is all of it, 0 is no more than nothing, and less than 0 is worse.  It is a sum of distances, not of
squares: a fault that is nearly right leaves much of it.  Pictures that are not rounded change evenly with a
fault's strength, which makes it easy to fit; rounded ones would do so by leaps.

P pixels, C channels.
"""

from dataclasses import dataclass

import numpy as np

from volref.arrays import Booleans, Floats
from volref.emulation.pipeline import Pipeline
from volref.oracle.acceptance import Acceptance
from volref.oracle.delivery import canvas_levels
from volref.oracle.explaining.drawing import canvas_at
from volref.oracle.faults.fault import Subject
from volref.oracle.verdict import Verdict

# What is no number counts as this, which no canvas holds, and numbers beyond LARGEST as that.
NO_NUMBER, LARGEST = -1.0, 8.0

# Noise of float64 in the numbers of an image, far below any level.
NOISE = 1e-9

# More levels than this are no rounding.
MOST_ROUNDING = 2.0

# How far from a whole level the number of a canvas that was read as a float may lie, in levels.
NEARLY_WHOLE = 0.01


@dataclass(frozen=True, eq=False)
class Measure:
    """An image at some of its pixels.

    Parameters
    ----------
    chosen
        The pixels (H, W).
    weight
        How many pixels each of them stands for (P, 1).
    image
        What the image holds there (P, C).
    below, above
        How far it may lie below and above a picture (P, C).
    nothing
        How far the image is outside around the nominal picture.
    """

    chosen: Booleans
    weight: Floats
    image: Floats
    below: Floats
    above: Floats
    nothing: float

    def looked_at(self, picture: Floats) -> Floats:
        """Return what of a picture (H, W, 4) is measured (P, C)."""
        return finite(picture[self.chosen][:, : self.image.shape[1]])

    def explained(self, looked_at: Floats) -> float:
        """Return the share of what is outside that a picture explains, looked at here (P, C)."""
        return 1.0 - self.outside(looked_at) / self.nothing

    def outside(self, looked_at: Floats) -> float:
        """Return how far the image is outside around a picture, looked at here (P, C), in sum."""
        apart = self.image - looked_at
        beyond = np.maximum(np.maximum(apart - self.above, -apart - self.below), 0.0)
        return float(np.sum(beyond * self.weight))


def measure_of(
    verdict: Verdict, acceptance: Acceptance, subject: Subject, most: int | None = None
) -> Measure:
    """Return an image outside its intervals at all pixels that are not left out, or at `most` of them.

    Half of these are spread over the pixels outside, half over the others: a fault is wrong if it changes
    what is right.
    """
    channels = verdict.candidate.shape[-1]
    image = on_levels(finite(verdict.candidate), acceptance.pipeline)
    weights = _weights(verdict, most)
    chosen = weights > 0
    nominal = finite(canvas_at(subject, chosen)[..., :channels])
    rounding = rounding_of(acceptance) + NOISE
    below = np.maximum(nominal - finite(acceptance.raw_lo[..., :channels]), 0.0) + rounding
    above = np.maximum(finite(acceptance.raw_hi[..., :channels]) - nominal, 0.0) + rounding
    weight = weights[chosen][:, None]
    apart = (image - nominal)[chosen]
    beyond = np.maximum(np.maximum(apart - above[chosen], -apart - below[chosen]), 0.0)
    nothing = max(float(np.sum(beyond * weight)), NOISE)
    return Measure(chosen, weight, image[chosen], below[chosen], above[chosen], nothing)


def rounding_of(acceptance: Acceptance) -> float:
    """Return how far rounding moves an interval's ends: half a level, or more where bytes are blended."""
    levels = canvas_levels(acceptance.pipeline)
    if levels is None:
        return 0.0
    beyond = np.maximum(acceptance.hi - acceptance.raw_hi, acceptance.raw_lo - acceptance.lo)
    inside = (acceptance.raw_lo > 0) & (acceptance.raw_hi < 1) & acceptance.drawn[..., None]
    most = float(beyond[inside].max(initial=0.0))
    return min(max(most, 0.5 / levels), MOST_ROUNDING / levels)


def finite(numbers: Floats) -> Floats:
    """Return numbers held to what can be measured, NaN as one that no canvas holds."""
    return np.clip(np.nan_to_num(numbers, nan=NO_NUMBER, posinf=LARGEST), -LARGEST, LARGEST)


def on_levels(image: Floats, pipeline: Pipeline) -> Floats:
    """Return the numbers of a canvas rounded to its levels, if they are nearly those.

    Straight colours of a file, multiplied again, are off by up to half a level.
    """
    levels = canvas_levels(pipeline)
    if levels is None:
        return image
    whole = np.rint(image * levels)
    bytes_ = np.abs(image[..., -1] * levels - whole[..., -1]) < NEARLY_WHOLE
    return whole / levels if bytes_.mean() > 1 - NEARLY_WHOLE else image


def _weights(verdict: Verdict, most: int | None) -> Floats:
    """Return how many pixels each pixel (H, W) stands for, 0 for those that are not looked at."""
    outside, inside = verdict.outside & ~verdict.left_out, ~verdict.outside & ~verdict.left_out
    weights = np.zeros(outside.size)
    room = outside.size if most is None else most
    for left, pixels in ((room // 2, outside), (None, inside)):
        there = np.flatnonzero(pixels)
        spare = room - np.count_nonzero(weights)
        count = min(len(there), spare if left is None or spare >= outside.size else left)
        if count:
            taken = there[np.linspace(0, len(there) - 1, count).astype(np.int64)]
            weights[taken] = len(there) / count
    return weights.reshape(outside.shape)
