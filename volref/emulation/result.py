"""What an emulation returns."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from volref.arrays import Bytes, Floats, Integers
from volref.emulation.device import Device
from volref.emulation.pipeline import Pipeline
from volref.formats import codes_of
from volref.io.npy import write_npz


@dataclass(frozen=True, eq=False)
class Emulation:
    """The image of a GPU program, every target that it draws on the way, and what it took.

    Parameters
    ----------
    rgba
        The canvas (H, W, 4) as the program leaves it, in its own number format, colours and alpha as
        `pipeline.output` has them.
    distance
        World distance (H, W) to the opaque surface that the program shows, +inf elsewhere.
    passes
        Every target by name, in the order of drawing, ending with "canvas": (H, W, channels), row 0 at the
        top, in the target's number format.  Volumes are (D, H, W, channels).
    samples
        Iterations of the loop (H, W), 0 where no ray was cast.
    seconds
        Wall time.
    pipeline, device
        What was emulated, on what.
    """

    rgba: Floats
    distance: Floats
    passes: Mapping[str, Floats]
    samples: Integers
    seconds: float
    pipeline: Pipeline
    device: Device

    @property
    def rgba8(self) -> Bytes:
        """The canvas as bytes: rint(255 value), as an RGBA8 target stores it."""
        nan = 1.0 if self.device.nan_stored == "one" else 0.0
        return codes_of(self.rgba, 8, nan=nan)

    def save(self, path: str | Path, *, overwrite: bool = False) -> None:
        """Write canvas, distance, samples and all passes to one .npz.

        Raises
        ------
        FormatError
            If the file exists and `overwrite` is False.
        """
        arrays = {"rgba": self.rgba, "distance": self.distance, "samples": self.samples}
        write_npz(
            path,
            arrays | {f"pass_{name}": target for name, target in self.passes.items()},
            overwrite=overwrite,
        )
