"""What becomes of an acceptance interval on the way from the canvas into a file.

A canvas is delivered in many ways: its bytes as they are (`readPixels`), divided by alpha (`toBlob`, whose
PNG has straight colours), encoded as sRGB by a tool, as numbers of 16, 32 or 64 bits.  To undo that on the
image would lose what rounding took, and with it correct images: 1/255 of colour at alpha 2/255 becomes
128/255, and back 1.004/255.  So the interval goes that way instead, and rounding moves its ends outward:

    canvas [lo, hi]  -->  divided by alpha  -->  encoded  -->  times alpha  -->  rounded outward  =  delivered

Each step is monotone in the colour.  Alpha itself is never changed on the way, so that the candidate's own
alpha is what it was divided by: that ties colour to alpha, and a candidate passes only if *one* canvas within
the intervals gives both.

H, W the image; intervals are pairs (lo, hi) of (H, W, C).
"""

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from volref.arrays import Booleans, Floats, one_of
from volref.emulation.pipeline import Pipeline
from volref.errors import SceneError
from volref.image import (
    ENCODINGS,
    decode_light,
    encode_light,
    premultiplied_from_straight,
    straight_from_premultiplied,
)
from volref.oracle.acceptance import Acceptance
from volref.oracle.candidate import Candidate

Interval: TypeAlias = tuple[Floats, Floats]

ALPHAS = ("premultiplied", "straight", "ignored")

# Curves put over the canvas's numbers as they are, multiplied by alpha or not: no choices of a caller, but
# mistakes to recognise.  The first is what a target of sRGB does behind the blend.
ENCODED_TARGET = "srgb-target"
DECODED = "decoded"
DIRECT = (ENCODED_TARGET, DECODED)

# Colours where alpha is 0 and was divided by: they say nothing.
FREE = 1e30

# Arithmetic in float32 between canvas and file, in relative terms: division 2.5 units in the last place
# (OpenGL ES 3.2, table 4.5.1 of SPIR-V for Vulkan); the power of a curve some 2, its offset triples that.
CONVERSION_ROUNDING = 8 * 2.0**-23

# What the products and quotients of this module may be off, in levels' parts of 1: 16 units in the last place
# of float64.  A number this close to a whole code is that code.
OWN_ROUNDING = 2.0**-48


@dataclass(frozen=True)
class Delivery:
    """How a file holds a canvas.

    alpha: "premultiplied" or "straight" colours, or "ignored": alpha is not looked at and colours are the
    canvas's own.
    encoding: what the colours were encoded by on the way, "none" for the canvas's own numbers.
    """

    alpha: str
    encoding: str

    def converts(self, pipeline: Pipeline) -> bool:
        """Tell whether colours were computed with on the way."""
        return self.encoding != "none" or self.alpha not in (canvas_alpha(pipeline), "ignored")


def delivery_of(
    candidate: Candidate, pipeline: Pipeline, alpha: str | None, encoding: str | None
) -> Delivery:
    """Return how a candidate was delivered: as told, else as the canvas has it.

    Raises
    ------
    SceneError
        If a word is none of those, or alpha is asked of an image that has none.
    """
    chosen = one_of("encoding", encoding or "none", ENCODINGS)
    if alpha is None:
        return Delivery(canvas_alpha(pipeline) if candidate.has_alpha else "ignored", chosen)
    kind = one_of("alpha", alpha, ALPHAS)
    if kind != "ignored" and not candidate.has_alpha:
        message = f"alpha must be 'ignored' for an image without alpha, got {kind!r}; "
        raise SceneError(message + "leave it out, or save the image with four channels")
    return Delivery(kind, chosen)


def canvas_alpha(pipeline: Pipeline) -> str:
    """Return what the canvas's colours are: "straight" if they are divided by alpha and never multiplied."""
    divided = pipeline.accumulation.normalize == "always" and pipeline.accumulation.alpha != "one"
    return "straight" if divided and pipeline.output.blend == "none" else "premultiplied"


def canvas_levels(pipeline: Pipeline) -> int | None:
    """Return the greatest code of the canvas, None if it holds floats."""
    kind = pipeline.output.mean_format or pipeline.output.format
    return {"unorm8": 255, "unorm16": 65535}.get(kind)


def delivered(acceptance: Acceptance, candidate: Candidate, delivery: Delivery) -> Interval:
    """Return the intervals in the numbers of the candidate, (H, W, 3) where alpha is ignored, else (H, W, 4).

    Every image that a correct canvas can become by this delivery lies inside.  An image of floats that are no
    codes of the canvas was read before the canvas rounded: it passes if its rounding would.
    """
    own = canvas_alpha(acceptance.pipeline)
    lo, hi = acceptance.lo, acceptance.hi
    levels = canvas_levels(acceptance.pipeline)
    if levels is not None and not _on_levels(candidate, delivery, own, levels):
        lo, hi = lo - 0.5 / levels, hi + 0.5 / levels
    colors = lo[..., :3], hi[..., :3]
    if delivery.alpha == "ignored":
        ends = _encoded(colors, delivery.encoding)
    else:
        between = _encoded_kind(delivery, own)
        exact = levels is not None and levels == candidate.levels
        alphas = _alpha_range(lo[..., 3:], hi[..., 3:], candidate, exact=exact)
        encoded = _encoded(_as_kind(colors, alphas, own, between), delivery.encoding)
        colors = _as_kind(encoded, alphas, between, delivery.alpha)
        ends = (
            np.concatenate([colors[0], lo[..., 3:]], axis=-1),
            np.concatenate([colors[1], hi[..., 3:]], axis=-1),
        )
    return _stored(ends, candidate, converted=delivery.converts(acceptance.pipeline))


@np.errstate(over="ignore", invalid="ignore")
def canvas_numbers(candidate: Candidate, delivery: Delivery, own: str) -> Floats:
    """Return the numbers on the canvas that a candidate comes from, as nearly as it tells them."""
    if delivery.alpha == "ignored":
        return _decoded(candidate.unit[..., :3], delivery.encoding)
    between = _encoded_kind(delivery, own)
    encoded = _numbers_as(candidate.unit, delivery.alpha, between)
    colors = _decoded(encoded[..., :3], delivery.encoding)
    return _numbers_as(np.concatenate([colors, encoded[..., 3:]], axis=-1), between, own)


def _encoded_kind(delivery: Delivery, own: str) -> str:
    """Return what colours are in the moment when they are encoded."""
    if delivery.encoding == "none":
        return delivery.alpha
    return own if delivery.encoding in DIRECT else "straight"


def _numbers_as(numbers: Floats, kind: str, wanted: str) -> Floats:
    if kind == wanted:
        return numbers
    change = premultiplied_from_straight if wanted == "premultiplied" else straight_from_premultiplied
    return change(numbers)


def _on_levels(candidate: Candidate, delivery: Delivery, own: str, levels: int) -> bool:
    """Tell whether the candidate's numbers are codes of the canvas, as exactly as its type can say."""
    if candidate.levels is not None:
        return True
    slack = levels * (candidate.rounding + 2 * CONVERSION_ROUNDING)
    with np.errstate(over="ignore", invalid="ignore"):
        codes = levels * canvas_numbers(candidate, delivery, own)
        apart = np.abs(codes - np.rint(codes))
    # Types that cannot tell a code from a quarter beside it cannot tell at all.
    return slack < 0.25 and not bool((apart > slack).any())


def _alpha_range(lo: Floats, hi: Floats, candidate: Candidate, *, exact: bool) -> Interval:
    """Return which alphas (H, W, 1) of the canvas the candidate's may come from."""
    alpha = candidate.unit[..., 3:]
    if exact:
        return alpha, alpha
    slack = alpha * candidate.rounding if candidate.levels is None else 1 / candidate.levels
    least, most = np.maximum(alpha - slack, 0.0), alpha + slack
    # An alpha that no canvas within the intervals has is found by its own channel.
    met: Booleans = (least <= hi) & (most >= lo)
    return np.where(met, np.maximum(least, lo), least), np.where(met, np.minimum(most, hi), most)


def _as_kind(colors: Interval, alphas: Interval, kind: str, wanted: str) -> Interval:
    """Return colours of one kind of alpha as the other; straight ones held to 1 or not: tools do either."""
    if kind == wanted:
        return colors
    (lo, hi), (least, most) = colors, alphas
    if wanted == "premultiplied":
        return np.minimum(lo * least, lo * most), np.maximum(hi * least, hi * most)
    free = least <= 0
    least, most = np.where(free, 1.0, least), np.where(free, 1.0, most)
    low, high = np.minimum(lo / least, lo / most), np.maximum(hi / least, hi / most)
    return np.where(free, 0.0, np.minimum(low, 1.0)), np.where(free, FREE, high)


def _encoded(colors: Interval, encoding: str) -> Interval:
    """Return colours encoded, held to 1 before or not: tools do either."""
    if encoding == "none":
        return colors
    change = decode_light if encoding == DECODED else encode_light
    word = "srgb" if encoding in DIRECT else encoding
    return change(np.minimum(colors[0], 1.0), word), change(colors[1], word)


def _decoded(colors: Floats, encoding: str) -> Floats:
    if encoding == DECODED:
        return encode_light(colors, "srgb")
    return decode_light(colors, "srgb" if encoding == ENCODED_TARGET else encoding)


def _stored(ends: Interval, candidate: Candidate, *, converted: bool) -> Interval:
    """Return the ends in the candidate's numbers, outward by as much as storing them may round."""
    lo, hi = ends
    if candidate.levels is None:
        share = candidate.rounding + (CONVERSION_ROUNDING if converted else 0.0)
        return lo - share * np.abs(lo), hi + share * np.abs(hi)
    levels, slack = candidate.levels, candidate.levels * OWN_ROUNDING
    low, high = np.clip(lo, 0, 1) * levels, np.clip(hi, 0, 1) * levels
    return np.floor(low + slack), np.ceil(high - slack)
