"""What `accept` returns: for every pixel and channel, what a correct machine may draw."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from volref.arrays import Booleans, Floats
from volref.emulation.device import Device
from volref.emulation.pipeline import Pipeline


@dataclass(frozen=True, eq=False)
class Acceptance:
    """The acceptance interval of every pixel of a canvas.

    Parameters
    ----------
    lo, hi
        The least and the greatest that a correct machine may leave on the canvas (H, W, 4), in the canvas's
        own number format, colours and alpha as `pipeline.output` has them.
    nominal
        What `emulate` draws on the same device (H, W, 4).
    raw_lo, raw_hi
        The same before the canvas rounds to its number format (H, W, 4).
    ambiguous
        Pixels (H, W) that hang on a comparison: two correct machines may differ there by a whole sample.
    drawn
        Pixels (H, W) that a correct machine may draw anything on; the others hold the clear colour.
    causes
        How wide each cause makes the interval (H, W), by name.
    advice
        Why the interval is of no use, and what would settle it; "" where it is of use.
    pipeline, device, frames
        What was accepted, on what.
    seconds
        Wall time.
    """

    lo: Floats
    hi: Floats
    nominal: Floats
    raw_lo: Floats
    raw_hi: Floats
    ambiguous: Booleans
    drawn: Booleans
    causes: Mapping[str, Floats]
    advice: str
    pipeline: Pipeline
    device: Device
    frames: int
    seconds: float

    @property
    def width(self) -> Floats:
        """Width (H, W) of the interval before the canvas rounds, the widest channel's."""
        return np.asarray((self.raw_hi - self.raw_lo).max(axis=-1))

    @property
    def share_ambiguous(self) -> float:
        """Share of the drawn pixels that are ambiguous."""
        return float(self.ambiguous[self.drawn].mean()) if self.drawn.any() else 0.0

    def percentile(self, percent: float) -> float:
        """Width, in 1/255, that so many of a hundred drawn pixels do not exceed."""
        widths = self.width[self.drawn]
        return 255 * float(np.percentile(widths, percent)) if widths.size else 0.0
