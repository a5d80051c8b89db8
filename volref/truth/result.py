"""What a reference integrator returns."""

from dataclasses import dataclass

from volref.arrays import Floats
from volref.planning import Plan


@dataclass(frozen=True, eq=False)
class Render:
    """An image, how far from the truth it may be, and what it cost.

    rgba (H, W, 4): premultiplied, in the working space, background included.
    distance (H, W): world distance to the first opaque surface, +inf elsewhere.
    bound (H, W): error per pixel, the largest over the four channels; `bound_kind` says whether it is
    "certified", an "estimate", or "none".
    met_tolerance: whether no pixel's bound exceeds the plan's tolerance.
    seconds: wall time.  samples: values interpolated.
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
