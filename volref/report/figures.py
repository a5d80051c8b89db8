"""The numbers that belong under an image: how far off it may be, and what it cost."""

from dataclasses import dataclass
from decimal import ROUND_CEILING, Context

import numpy as np

from volref.report.pictures import LEVEL
from volref.truth.result import Render

# What `Render.bound_kind` means, for a sentence that begins with "error".
KINDS = {
    "estimate": (
        "estimated",
        "An estimate, not a proven bound: it compares the image with a coarser one of the same ray samples.",
    ),
    "certified": (
        "certified",
        "Certified means proven: no pixel is further than this from the emission-absorption integral along "
        "its ray, rounding included.",
    ),
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
    method
        The method that answered: "exact" or "march".
    within
        Part of the pixels, 0..1, whose error does not exceed `tolerance`.
    tolerance
        The error the image was asked to stay below.
    seconds, threads
        Wall time of the rendering, and the threads it ran on.
    samples
        Values interpolated by a march, pieces integrated by "exact".
    ns_per_sample
        Wall time for each of them in nanoseconds; None without any.
    """

    error_max: float
    error_p99: float
    error_median: float
    error_kind: str
    method: str
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
        method=out.plan.method,
        within=float((out.bound <= out.plan.tolerance).mean()),
        tolerance=out.plan.tolerance,
        seconds=out.seconds,
        threads=out.threads,
        samples=out.samples,
        ns_per_sample=out.seconds / out.samples * 1e9 if out.samples else None,
    )


def error_and_time(out: Render) -> str:
    """Return the largest error of an image and its cost, in a line that begins with the error."""
    if out.bound_kind == "none":
        return f"error unknown, {duration(out.seconds)}"
    return f"error <= {levels(out.bound.max())}/255 ({KINDS[out.bound_kind][0]}), {duration(out.seconds)}"


def levels(error: float) -> str:
    """Return an error of the working space in 8-bit levels: three digits, rounded up to stay a bound.

    Rounding of the division, far below a digit shown, is forgiven: 1/510 is half a level.

    Examples
    --------
    >>> levels(1 / 510), levels(0.0), levels(2e-9), levels(0.3741 / 255)
    ('0.5', '0', '5.1e-07', '0.375')
    """
    nearest = Context(prec=12).create_decimal_from_float(float(error) / LEVEL)
    return f"{float(Context(prec=3, rounding=ROUND_CEILING).plus(nearest)):.3g}"


def duration(seconds: float) -> str:
    """Return a time in words.

    Examples
    --------
    >>> duration(0.0234), duration(2.14), duration(61.0)
    ('0.023 s', '2.1 s', '61.0 s')
    """
    return f"{seconds:.1f} s" if seconds >= 1 else f"{seconds:.2g} s"
