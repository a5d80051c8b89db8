"""How far a candidate lies outside the acceptance intervals, pixel by pixel.

H, W the image; C channels: 3 where alpha is ignored, else 4.
"""

from dataclasses import dataclass

import numpy as np

from volref.arrays import Booleans, Floats
from volref.oracle.acceptance import Acceptance
from volref.oracle.candidate import Candidate
from volref.oracle.delivery import Delivery, Interval, delivered
from volref.oracle.metrics import CHANNELS


@dataclass(frozen=True, eq=False)
class Judgement:
    """A candidate held against the intervals.

    Parameters
    ----------
    beyond
        How far each number lies outside its interval (H, W, C), in parts of 1; 0 inside, infinite where it is
        not a number.
    interval
        The intervals in the candidate's numbers (H, W, C), twice.
    left_out
        Pixels (H, W) that are not judged.
    """

    beyond: Floats
    interval: Interval
    left_out: Booleans

    @property
    def excess(self) -> Floats:
        """How far each pixel (H, W) lies outside, the worst channel's."""
        return np.asarray(np.where(self.left_out, 0.0, self.beyond.max(axis=-1)))

    @property
    def outside(self) -> Booleans:
        """The pixels (H, W) that are judged and lie outside in any channel."""
        return np.asarray(self.excess > 0)

    @property
    def count(self) -> int:
        """How many pixels lie outside."""
        return int(np.count_nonzero(self.outside))


@dataclass(frozen=True)
class Worst:
    """The number that lies farthest outside.

    x, y: its pixel, row 0 at the top.
    channel: "red", "green", "blue" or "alpha".
    value, lo, hi: what the candidate holds, and its interval, in parts of 1.
    excess: how far outside it is.
    """

    x: int
    y: int
    channel: str
    value: float
    lo: float
    hi: float
    excess: float


def judged(candidate: Candidate, acceptance: Acceptance, delivery: Delivery, left_out: Booleans) -> Judgement:
    """Return how a candidate of the right size lies in the intervals, if it was delivered so."""
    with np.errstate(invalid="ignore"):
        lo, hi = delivered(acceptance, candidate, delivery)
        numbers = candidate.numbers[..., : lo.shape[-1]]
        beyond = np.maximum(np.maximum(lo - numbers, numbers - hi), 0.0)
    # An alpha that is no number leaves its colours without an interval; it is found by its own channel.
    beyond = np.where(np.isfinite(numbers), np.nan_to_num(beyond, nan=0.0, posinf=np.inf), np.inf)
    return Judgement(beyond / (candidate.levels or 1), (lo, hi), left_out)


def worst(judgement: Judgement, candidate: Candidate) -> Worst | None:
    """Return the number that lies farthest outside, None if all are inside."""
    seen = np.where(judgement.left_out[..., None], 0.0, judgement.beyond)
    y, x, channel = (int(i) for i in np.unravel_index(seen.argmax(), seen.shape))
    if seen[y, x, channel] == 0:
        return None
    scale = 1 / (candidate.levels or 1)
    lo, hi = (float(end[y, x, channel]) * scale for end in judgement.interval)
    value = float(candidate.numbers[y, x, channel]) * scale
    return Worst(x, y, CHANNELS[4][channel], value, lo, hi, float(seen[y, x, channel]))
