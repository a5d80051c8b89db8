"""What `accept` returns: for every pixel and channel, what a correct machine may draw."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from volref.arrays import Booleans, Floats, float_array, number, plain_array
from volref.emulation.device import Device
from volref.emulation.groups import Output
from volref.emulation.pipeline import Pipeline
from volref.errors import SceneError


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
    low_quality
        Makes the intervals of the same on a machine with linear filters of 4 bits, which some have and no
        specification forbids; None where the program or the device leaves no room for one.
    justified
        Whether the intervals are derived from the scene; False where somebody chose them.
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
    low_quality: "Callable[[], Acceptance] | None" = None
    justified: bool = True

    @classmethod
    def unjustified(cls, image: ArrayLike, tolerance: float) -> Self:
        """Return the intervals image +- tolerance: a number that somebody chose, nothing derives it.

        Every verdict by it says so.

        Parameters
        ----------
        image
            RGBA (H, W, 4), bytes or numbers of a canvas, premultiplied.
        tolerance
            The largest difference to let pass, in parts of 1.

        Raises
        ------
        SceneError
            If the image is none, of another type than `check` takes, or the tolerance is negative.

        Examples
        --------
        >>> grey = np.full((1, 1, 4), 51, np.uint8)
        >>> chosen = Acceptance.unjustified(grey, 1 / 255)
        >>> (255 * chosen.lo[0, 0]).round().tolist(), chosen.justified
        ([50.0, 50.0, 50.0, 50.0], False)
        """
        codes = plain_array("image", image)
        if codes.dtype.kind != "f" and codes.dtype not in (np.uint8, np.uint16):
            message = f"image must be of uint8, uint16 or floats, got {codes.dtype}; "
            raise SceneError(message + "read it from the canvas again")
        unit = codes / np.iinfo(codes.dtype).max if codes.dtype.kind == "u" else codes
        nominal = float_array("image", unit, ("height", "width", 4))
        slack = number("tolerance", tolerance, low=0)
        lo, hi = nominal - slack, nominal + slack
        height, width = nominal.shape[:2]
        marked: Booleans = np.zeros((height, width), np.bool_)
        drawn: Booleans = np.asarray(nominal.any(axis=-1))
        # Numbers as they are: no canvas is known that would round them.
        program = Pipeline("none", output=Output(format="exact"))
        return cls(
            lo,
            hi,
            nominal,
            lo,
            hi,
            marked,
            drawn,
            {},
            "",
            program,
            Device(),
            1,
            0.0,
            None,
            justified=False,
        )

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
