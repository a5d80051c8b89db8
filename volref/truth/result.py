"""What a reference integrator returns."""

from dataclasses import dataclass
from pathlib import Path

from volref.arrays import Floats
from volref.io.images import write_image
from volref.io.npy import write_npz
from volref.planning import Plan


@dataclass(frozen=True, eq=False)
class Render:
    """An image, how far from the truth it may be, and what it cost.

    Parameters
    ----------
    rgba
        The image (H, W, 4): premultiplied, in the working space, background included.
    distance
        World distance (H, W) to the first opaque surface or isosurface, +inf elsewhere, and where no time was
        left to look for an isosurface.
    bound
        Error per pixel (H, W), the largest over the four channels.
    bound_kind
        What `bound` is: "certified", an "estimate", or "none".
    seconds
        Wall time of the rendering.
    samples
        Values interpolated by a march, or pieces integrated by the exact method.
    threads
        Threads that worked.
    plan
        What was done and what was left out.
    """

    rgba: Floats
    distance: Floats
    bound: Floats
    bound_kind: str
    seconds: float
    samples: int
    threads: int
    plan: Plan

    @property
    def met_tolerance(self) -> bool:
        """Whether no pixel's bound exceeds the plan's tolerance."""
        return bool(self.bound.max() <= self.plan.tolerance)

    def save(self, path: str | Path, *, encoding: str = "srgb", overwrite: bool = False) -> None:
        """Write the image: .png for people, .npy and .exr rgba, .npz rgba, distance and bound.

        `encoding` is for PNG only: "srgb" or "gamma2.2" for a linear working space, "none" to store its
        numbers as codes.

        Raises
        ------
        FormatError
            If the suffix is another one, or the file exists and `overwrite` is False.
        """
        if Path(path).suffix.lower() == ".npz":
            arrays = {"rgba": self.rgba, "distance": self.distance, "bound": self.bound}
            write_npz(path, arrays, overwrite=overwrite)
        else:
            write_image(path, self.rgba, encoding=encoding, overwrite=overwrite)
