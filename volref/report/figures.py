"""The numbers that belong under an image: how far off it may be, and what it cost."""

from dataclasses import dataclass

import numpy as np

from volref.report.pictures import LEVEL
from volref.truth.result import Render

# What `Render.bound_kind` means, for a sentence that begins with "error".
KINDS = {
    "estimate": (
        "estimated",
        "An estimate, not a proven bound: it compares the image with a coarser one of the same ray samples.",
    ),
    "certified": ("proven", "A proven bound: no pixel is further from the integral than this."),
    "none": ("unknown", "No error is known for this image."),
}


@dataclass(frozen=True)
class Figures:
    """Error and cost of an image.

    Parameters
    ----------
    error_max, error_p99, error_median
        Of the error per pixel (the largest over the four channels), in the working space.
    error_kind
        "estimate", "certified" or "none".
    within
        Part of the pixels, 0..1, whose error does not exceed `tolerance`.
    tolerance
        The error the image was asked to stay below.
    seconds, threads
        Wall time of the rendering, and the threads it ran on.
    samples
        Values interpolated.
    ns_per_sample
        Wall time per value in nanoseconds; None without samples.
    """

    error_max: float
    error_p99: float
    error_median: float
    error_kind: str
    within: float
    tolerance: float
    seconds: float
    threads: int
    samples: int
    ns_per_sample: float | None

    @property
    def sentence(self) -> str:
        """Error and time in one sentence."""
        kind = KINDS[self.error_kind][0]
        error = (
            "Error unknown"
            if self.error_kind == "none"
            else f"{kind.capitalize()} error at most {levels(self.error_max)}/255, "
            f"99% of the pixels below {levels(self.error_p99)}/255"
        )
        threads = f"{self.threads} thread{'s' * (self.threads > 1)}"
        return f"{error}; rendered in {self.seconds:.2f} s on {threads}."


def figures_of(out: Render) -> Figures:
    """Return the figures of a rendered image."""
    p99, median = (float(q) for q in np.percentile(out.bound, (99, 50)))
    return Figures(
        error_max=float(out.bound.max()),
        error_p99=p99,
        error_median=median,
        error_kind=out.bound_kind,
        within=float((out.bound <= out.plan.tolerance).mean()),
        tolerance=out.plan.tolerance,
        seconds=out.seconds,
        threads=out.threads,
        samples=out.samples,
        ns_per_sample=out.seconds / out.samples * 1e9 if out.samples else None,
    )


def levels(error: float) -> str:
    """Return an error of the working space in 8-bit levels, three digits.

    Examples
    --------
    >>> levels(1 / 510), levels(0.0), levels(2e-9)
    ('0.5', '0', '5.1e-07')
    """
    return f"{error / LEVEL:.3g}"
