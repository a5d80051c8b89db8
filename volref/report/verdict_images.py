"""Images of a verdict for people, each with its legend, for files that stand alone.

H, W the image.  The colours are those of the page of verdicts.
"""

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np

from volref.arrays import Bytes
from volref.oracle.acceptance import Acceptance
from volref.oracle.verdict import Verdict
from volref.report.pictures import NEUTRAL
from volref.report.verdicts.cases import Case
from volref.report.verdicts.views import (
    ABOVE,
    AMBIGUOUS,
    BELOW,
    BOTH,
    difference_of,
    difference_picture,
    interval_picture,
    scale_of,
    shown,
)

# A colour and what it says; without a colour, a heading.
Key: TypeAlias = tuple[tuple[int, ...] | None, str]

# Small images are enlarged by a whole factor to about this width, so that pixels can be told apart.
LEAST_WIDTH = 384

PAPER, INK = (24, 25, 28), (236, 236, 236)


def verdict_images(acceptance: Acceptance, verdict: Verdict) -> dict[str, Bytes]:
    """Return pictures (h, w, 3) by name: "candidate", "nominal", "difference" and "overlay".

    The difference is that of the channel that differs most, blue where the candidate is too dark and orange
    where it is too bright.  The overlay shows the candidate in grey, pixels outside in colours, ambiguous
    pixels that are inside in yellow, and in a neutral tone what the mask leaves out.
    """
    case = Case("", acceptance, verdict)
    apart = difference_of(verdict.candidate, verdict.nominal)
    scale = scale_of(apart)
    return {
        "candidate": _large(shown(verdict.candidate)),
        "nominal": _large(shown(acceptance.nominal)),
        "difference": _with_key(difference_picture(apart, scale), _scale_keys(scale)),
        "overlay": _with_key(*_overlay(case)),
    }


def _overlay(case: Case) -> tuple[Bytes, list[Key]]:
    acceptance, verdict = case.acceptance, case.verdict
    picture = interval_picture(case.candidate, acceptance.lo, acceptance.hi, verdict.outside)
    marked = acceptance.ambiguous & ~verdict.outside & ~verdict.left_out
    # Half the colour, so that what is drawn shows through.
    picture[marked] = picture[marked] // 2 + np.array(AMBIGUOUS, np.uint8) // 2
    picture[verdict.left_out] = NEUTRAL
    outside, judged = (int(np.count_nonzero(mask)) for mask in (verdict.outside, verdict.judged))
    keys: list[Key] = [
        (None, f"{outside} of {judged} drawn pixels outside"),
        (BELOW, "too low"),
        (ABOVE, "too high"),
        (BOTH, "too low in one channel, too high in another"),
        (AMBIGUOUS, f"ambiguous, and inside ({int(np.count_nonzero(marked))})"),
    ]
    if verdict.left_out.any():
        keys.append((NEUTRAL, "left out by the mask"))
    return picture, keys


def _scale_keys(scale: int) -> list[Key]:
    parts = np.array([-1.0, -0.5, 0.0, 0.5, 1.0]) * scale
    keys: list[Key] = [(None, "candidate - nominal: blue is too dark, orange too bright")]
    for part, color in zip(parts, difference_picture(parts, scale).tolist(), strict=True):
        keys.append((tuple(color), f"{part:+g}/255" if part else "equal"))
    return keys


def _large(picture: Bytes) -> Bytes:
    factor = max(1, LEAST_WIDTH // picture.shape[1])
    return np.asarray(picture.repeat(factor, axis=0).repeat(factor, axis=1))


def _with_key(picture: Bytes, keys: Sequence[Key]) -> Bytes:
    """Return the picture, enlarged, above a line for each colour."""
    from PIL import Image, ImageDraw, ImageFont

    large = _large(picture)
    size = max(9, min(14, large.shape[1] // 30))
    line = size + size // 2
    strip = Image.new("RGB", (large.shape[1], line * len(keys) + size), PAPER)
    draw, font = ImageDraw.Draw(strip), ImageFont.load_default(size)
    for i, (color, word) in enumerate(keys):
        top = size // 2 + i * line
        if color is not None:
            draw.rectangle((size, top, 2 * size, top + size), fill=color, outline=NEUTRAL)
        draw.text((3 * size if color else size, top), word, fill=INK, font=font)
    return np.concatenate([large, np.asarray(strip)])
