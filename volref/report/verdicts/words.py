"""What is said of a case in words and numbers."""

import math

import numpy as np

from volref.oracle.explanation import NONE_OF_THESE, NOT_IDENTIFIABLE, Explanation
from volref.oracle.metrics import Comparison
from volref.report.html import version_rows
from volref.report.markup import Row
from volref.report.pictures import LEVEL
from volref.report.verdicts.cases import KINDS, Case

MARKS = {"fail": "✗", "open": "?", "warn": "!", "pass": "✓"}
MEANINGS = {
    "fail": "outside",
    "open": "not comparable",
    "warn": "inside with low-quality filtering",
    "pass": "inside",
}


def headline(cases: list[Case]) -> str:
    """Return what came of all cases in one sentence."""
    if not cases:
        return "No image was judged."
    count, every = counts_of(cases), len(cases)
    parts = [f"{count[kind]} {MEANINGS[kind]}" for kind in KINDS if count[kind]]
    return (
        f"{every} image{'s' * (every != 1)} held against what a correct machine may draw: {', '.join(parts)}."
    )


def counts_of(cases: list[Case]) -> dict[str, int]:
    """Return how many cases are of each kind."""
    return {kind: sum(case.kind == kind for case in cases) for kind in KINDS}


def outside_words(case: Case) -> str:
    """Return how many pixels are outside and how far the worst one is."""
    outside, judged = int(case.verdict.outside.sum()), int(case.verdict.judged.sum())
    if not outside:
        return f"none of {judged:,} pixels outside"
    worst = float(case.verdict.excess.max())
    return f"{outside:,} of {judged:,} pixels outside, by up to {in_levels(worst)}"


def cause_words(why: Explanation) -> str:
    """Return the likely cause in a few words."""
    if why.status == NONE_OF_THESE or not why.ranking:
        return "no known fault"
    best = why.ranking[0]
    others = ", or others that look alike" if why.status == NOT_IDENTIFIABLE else ""
    return f"{best.fault} explains {share_words(best.explained)}{others}"


def share_words(share: float) -> str:
    """Return which share of what is outside a fault explains.

    Examples
    --------
    >>> share_words(0.996), share_words(1.0), share_words(-3.0)
    ('99%', '100%', 'nothing')
    """
    return f"{math.floor(100 * share)}%" if share > 0 else "nothing"


def in_levels(number: float) -> str:
    """Return a difference in 1/255 with three digits.

    Examples
    --------
    >>> in_levels(0.1), in_levels(2e-9), in_levels(float("inf"))
    ('25.5/255', '5.1e-07/255', 'inf/255')
    """
    return f"{number / LEVEL:.3g}/255"


def metric_rows(metrics: Comparison) -> list[Row]:
    """Return how far candidate and nominal image are apart."""
    rows = [
        ("largest difference", f"{in_levels(metrics.max)} ({_place(metrics)})"),
        ("p50, p95, p99", ", ".join(in_levels(p) for p in (metrics.p50, metrics.p95, metrics.p99))),
        ("pixels above 1/255", f"{metrics.share_above_level:.2%}"),
        ("RMS", in_levels(metrics.rms)),
        ("PSNR", f"{metrics.psnr:.2f} dB" if math.isfinite(metrics.psnr) else "infinite: equal"),
        ("SSIM", "needs 11 x 11 pixels" if metrics.ssim is None else f"{metrics.ssim:.5f}"),
    ]
    if metrics.delta_e_max is not None:
        figures = (metrics.delta_e_mean, metrics.delta_e_p95, metrics.delta_e_max)
        rows.append(("Delta E 2000: mean, p95, max", ", ".join(f"{figure:.3g}" for figure in figures)))
    return rows


def width_rows(case: Case) -> list[Row]:
    """Return how tight the intervals are."""
    acceptance = case.acceptance
    return [
        ("width, median", f"{acceptance.percentile(50):.3g}/255"),
        ("width, 99% of drawn pixels below", f"{acceptance.percentile(99):.3g}/255"),
        ("ambiguous pixels", f"{acceptance.share_ambiguous:.2%} of the drawn ones"),
    ]


def cause_rows(case: Case) -> list[tuple[str, float, float]]:
    """Return (name, mean, p99) of what each cause adds to the width over the drawn pixels, in 1/255."""
    drawn = case.acceptance.drawn
    rows = [
        (name, float(width[drawn].mean()) / LEVEL, float(np.percentile(width[drawn], 99)) / LEVEL)
        for name, width in case.acceptance.causes.items()
        if drawn.any()
    ]
    return sorted((row for row in rows if row[2] > 0 or row[1] > 0), key=lambda row: -row[1])


def provenance_rows(case: Case) -> list[Row]:
    """Return where the case comes from: program, machine, what the caller knows, versions."""
    acceptance = case.acceptance
    height, width = acceptance.drawn.shape
    rows = [
        ("image", f"{width} x {height} pixels, canvas {acceptance.pipeline.output.format}"),
        ("pipeline", acceptance.pipeline.name),
        ("device", acceptance.device.name),
        ("frames", str(acceptance.frames)),
        ("intervals in", f"{acceptance.seconds:.2f} s"),
    ]
    return rows + list(case.provenance.items()) + version_rows()


def _place(metrics: Comparison) -> str:
    if metrics.identical:
        return "the images are equal"
    x, y = metrics.worst_pixel
    return f"{metrics.worst_channel} at x {x}, y {y}"
