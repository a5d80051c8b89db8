"""Judged images of every kind, made up: a smooth canvas, its intervals, and what may be wrong with it."""

from dataclasses import replace

import numpy as np

from tests.oracle.made_up import acceptance_of
from volref import Acceptance, Pipeline, check
from volref.emulation.groups import Output
from volref.oracle.explanation import Explanation, Ranked
from volref.report.verdicts.cases import Case

HOSTILE = "</title></script><script>window.hacked = 1</script><img src=x onerror=window.hacked=2> \"'&amp;"


def why(ranking, message, counterfactual, verdict, status="explained"):
    """An explanation with these parts."""
    ranked = tuple(Ranked(*one) for one in ranking)
    return Explanation(
        status,
        ranking=ranked,
        identifiable=True,
        runner_up="",
        message=message,
        counterfactual=counterfactual,
        charts=(),
        verdict=verdict,
    )


def canvas(height=20, width=24):
    """Codes of a premultiplied canvas: a ball of slowly changing colour on nothing, and a last pixel."""
    y, x = np.mgrid[0:height, 0:width]
    radius = np.hypot((x - 0.5 * width) / width, (y - 0.45 * height) / height)
    alpha = np.clip(1.6 * (0.45 - radius), 0, 1)
    color = np.stack([0.2 + 0.7 * x / width, 0.9 - 0.6 * y / height, 0.5 + 0.4 * np.sin(x / 5)], axis=-1)
    codes = np.rint(255 * np.concatenate([color * alpha[..., None], alpha[..., None]], axis=-1)).astype(int)
    # Not clear: where the numbers of one channel end and those of the next begin, they differ.
    codes[-1, -1] = 30, 20, 10, 60
    return codes


def intervals(codes, spread=1, **fields):
    """Intervals of so many codes on both sides of what is drawn; some pixels ambiguous, two causes."""
    drawn = codes[..., 3] > 0
    slack = spread * drawn[..., None]
    lo, hi = np.maximum(codes - slack, 0) / 255, np.minimum(codes + slack, 255) / 255
    marked = drawn & (np.add.outer(*map(np.arange, drawn.shape)) % 7 == 0)
    width = (hi - lo).max(axis=-1)
    causes = {"filter weights": 0.75 * width, "rounding": 0.25 * width, "branches": 0 * width}
    known = {"nominal": codes / 255, "ambiguous": marked, "drawn": drawn, "causes": causes}
    return acceptance_of(lo, hi, **known | fields)


def passing(name="right", **fields):
    codes = canvas()
    return Case(name, accepted := intervals(codes), check(codes.astype(np.uint8), accepted), **fields)


def failing(name="wrong", size=(20, 24), **fields):
    """Some pixels too bright, some too dark, one both; explained."""
    codes = canvas(*size)
    wrong = codes.copy()
    wrong[5:9, 8:14, 0] += 20
    wrong[11:14, 9:12, 2] -= 6
    wrong[10, 12, :2] += np.array([9, -9])
    accepted = intervals(codes)
    verdict = check(wrong.astype(np.uint8), accepted)
    found = why(
        (
            ("O1-uncorrected", 1.0, 0.9),
            ("T4-step + G4-flip-x", (1.05, 1.0), 0.25),
            ("A1-row-divisor", 1.0, -2.0),
        ),
        "Opacity is not corrected for the step.",
        np.clip(wrong + (codes - wrong) // 8, 0, 255) / 255,
        verdict,
    )
    return Case(name, accepted, verdict, found, **fields)


def warning(name="coarse"):
    codes = canvas()
    wide = intervals(codes, 5)
    accepted = replace(intervals(codes), low_quality=lambda: wide)
    return Case(name, accepted, check(np.minimum(codes + 3 * (codes > 0), 255).astype(np.uint8), accepted))


def open_case(name="anything goes"):
    codes = canvas()
    accepted = intervals(codes, 60, advice="the filter of this device is unknown; run the probe first")
    return Case(name, accepted, check(codes.astype(np.uint8), accepted))


def unjustified(name="chosen"):
    codes = canvas().astype(np.uint8)
    accepted = Acceptance.unjustified(codes, 2 / 255)
    return Case(name, accepted, check(codes, accepted))


def floating(name="float canvas", size=(20, 24)):
    """A canvas of floats with a NaN, an infinity, and a number a little outside."""
    codes = canvas(*size)
    exact = Pipeline("mine", output=Output(format="exact"))
    numbers = codes / 255 + 1e-4 * np.sin(np.arange(codes.size)).reshape(codes.shape) * (codes > 0)
    slack = 2e-4 * (codes > 0)
    accepted = intervals(codes, nominal=numbers, pipeline=exact)
    accepted = replace(accepted, lo=numbers - slack, hi=numbers + slack)
    candidate = numbers.copy()
    candidate[8, 9, 1], candidate[9, 9, 2], candidate[10, 10, 0] = np.nan, np.inf, candidate[10, 10, 0] + 1e-3
    return Case(name, accepted, check(candidate, accepted))


def opaque_colors(name="without alpha"):
    """A candidate without an alpha, and a mask on part of it."""
    codes = canvas()
    mask = np.zeros(codes.shape[:2], bool)
    mask[:4, :10] = True
    wrong = codes[..., :3].copy()
    wrong[12, 12, 0] -= 30
    accepted = intervals(codes)
    return Case(name, accepted, check(wrong.astype(np.uint8), accepted, mask=mask))


def targets():
    """Targets of each number of channels, one of distances."""
    codes = canvas() / 255
    distance = np.where(codes[..., 3:] > 0, 30 + 10 * codes[..., :1], 1e10)
    return {"back_coordinates": codes[..., :3], "distance": distance, "canvas": codes}


def every_kind():
    return [
        passing(),
        failing(
            passes=targets(), provenance={"sha256 of the scene": "3b1f", "plan": "volume: in\nmeshes: out"}
        ),
        warning(),
        open_case(),
        unjustified(),
        floating(),
        opaque_colors(),
    ]
