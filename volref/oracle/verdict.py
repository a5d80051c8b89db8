"""`check`: whether an image lies inside the acceptance intervals, in numbers and in a sentence."""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from volref.arrays import Booleans, Floats
from volref.errors import SceneError
from volref.io.guard import DEFAULT_MAX_BYTES
from volref.oracle.acceptance import Acceptance
from volref.oracle.candidate import Candidate, ImageSource, read_candidate, read_mask
from volref.oracle.delivery import Delivery, canvas_alpha, canvas_numbers, delivery_of
from volref.oracle.judging import Judgement, Worst, judged, worst
from volref.oracle.metrics import Comparison, compare
from volref.oracle.readings import recognised

INSIDE = "inside"
LOW_QUALITY = "inside only with low-quality filtering"
OUTSIDE = "outside"
NOT_COMPARABLE = "not comparable"
FILTERS = "linear filters of 4 bits, which are too coarse for this but allowed, would account for all of them"
# What is said of intervals that nothing derives.
UNJUSTIFIED = "an unjustified tolerance"


@dataclass(frozen=True, eq=False)
class Verdict:
    """Whether an image is one that a correct machine may draw.

    Parameters
    ----------
    status
        "inside"; "inside only with low-quality filtering", a warning; "outside"; or "not comparable", where
        the intervals are too wide to say so or nothing is judged.  By intervals that somebody chose, "inside
        an unjustified tolerance" or "outside an unjustified tolerance".
    passed
        Whether the image is inside, with or without the warning.
    outside
        Pixels (H, W) outside their interval in any channel.
    excess
        How far outside (H, W), in parts of 1, the worst channel's; 0 inside, +inf where it is no number.
    judged
        Pixels (H, W) that were looked at: all that either image draws on, but for those left out.
    left_out
        Pixels (H, W) of the mask.
    worst
        The number that lies farthest outside, None if none does.
    share_ambiguous
        Share of the drawn pixels that hang on a comparison.
    recognised
        What the image seems to be, if it would be inside when read otherwise: upside down, say.
    message
        The verdict in words.
    candidate, nominal
        The canvas that was judged, as nearly as the image tells it, and what `emulate` draws, in the canvas's
        numbers (H, W, 3 or 4); equal at pixels left out.
    """

    status: str
    passed: bool
    outside: Booleans
    excess: Floats
    judged: Booleans
    left_out: Booleans
    worst: Worst | None
    share_ambiguous: float
    recognised: str
    message: str
    candidate: Floats
    nominal: Floats

    def __bool__(self) -> bool:
        """Return whether the image passed, so that `assert check(...)` says what it looks like."""
        return self.passed

    def __str__(self) -> str:
        """Return the message."""
        return self.message

    @cached_property
    def metrics(self) -> Comparison:
        """How far the image is from the nominal one; NaN counts as 0, numbers are held to +-1e6.

        They judge nothing: what is allowed differs from pixel to pixel.
        """
        numbers = np.clip(np.nan_to_num(self.candidate), -1e6, 1e6)
        return compare(numbers, self.nominal, encoding="srgb")

    def as_dict(self) -> dict[str, Any]:
        """Return the verdict as plain data for JSON; the excess of what is no number is null."""
        found = self.worst
        height, width = self.outside.shape
        return {
            "status": self.status,
            "passed": self.passed,
            "message": self.message,
            "width": width,
            "height": height,
            "judged": int(np.count_nonzero(self.judged)),
            "outside": int(np.count_nonzero(self.outside)),
            "left_out": int(np.count_nonzero(self.left_out)),
            "share_ambiguous": self.share_ambiguous,
            "recognised": self.recognised,
            "worst": None if found is None else {name: _plain(value) for name, value in vars(found).items()},
            "metrics": self.metrics.as_dict(),
        }


def check(
    candidate: ImageSource,
    acceptance: Acceptance,
    *,
    alpha: str | None = None,
    encoding: str | None = None,
    mask: ImageSource | None = None,
    cause: str = "",
    max_bytes: int = DEFAULT_MAX_BYTES,
) -> Verdict:
    """Return whether an image lies inside the acceptance intervals of every pixel.

    It is held against them in its own numbers: what was done to the canvas on the way into the file is done
    to the intervals, and rounded outward, so that no correct image is lost to rounding.  Pixels that neither
    image draws on hold the clear colour in both and are not counted.

    Parameters
    ----------
    candidate
        RGBA or RGB (H, W, 4 or 3), row 0 at the top, of uint8, uint16 or floats; or a .png, .npy, .npz or
        .exr file.
    acceptance
        From `accept` or `load_acceptance`.
    alpha
        "premultiplied" or "straight": how the image holds its colours; "ignored": its alpha is not the
        canvas's, and not looked at.  Default: as on the canvas, "ignored" for RGB.  What a browser saves as
        PNG is straight, what `readPixels` reads is as on the canvas.
    encoding
        What the colours were encoded by after they were on the canvas: "none" (default), "srgb" or
        "gamma2.2".
    mask
        Pixels to leave out, such as a compass or a text drawn on top: those that are not 0 in an array (H, W)
        or an image.
    cause
        What to say of the likely cause, after the verdict.
    max_bytes
        The most memory that a file may take.

    Raises
    ------
    SceneError
        If the image has another size, or is none.
    FormatError
        If a file is no image.

    Examples
    --------
    >>> import volref as vr
    >>> grey = np.full((2, 2, 4), 100, np.uint8)
    >>> chosen = vr.Acceptance.unjustified(grey, 2 / 255)
    >>> vr.check(grey + 2, chosen).passed
    True
    >>> print(vr.check(np.array([[[100, 100, 105, 100]] * 2] * 2, np.uint8), chosen))
    outside an unjustified tolerance: 4 of 4 drawn pixels lie outside; the worst is pixel (0, 0), blue \
105/255, 3/255 above what is accepted, 98/255 to 102/255.
    """
    image = read_candidate(candidate, max_bytes)
    height, width = acceptance.lo.shape[:2]
    _check_size(image, width, height)
    left_out = read_mask(mask, height, width)
    asked = delivery_of(image, acceptance.pipeline, alpha, encoding)
    found = judged(image, acceptance, asked, left_out)
    drawn = (acceptance.drawn | found.outside) & ~left_out
    status = _status(image, acceptance, asked, found)
    hint = recognised(image, acceptance, asked, left_out, found.count) if status == OUTSIDE else ""
    far = worst(found, image)
    sentences = (
        _head(status, found, far, drawn, acceptance),
        FILTERS if status == LOW_QUALITY else "",
        hint,
        acceptance.advice if status == NOT_COMPARABLE else "",
        cause,
    )
    shown, nominal = _shown(image, acceptance, asked, left_out)
    return Verdict(
        status=status if acceptance.justified else f"{status} {UNJUSTIFIED}",
        passed=status in (INSIDE, LOW_QUALITY),
        outside=found.outside,
        excess=found.excess,
        judged=drawn,
        left_out=left_out,
        worst=far,
        share_ambiguous=acceptance.share_ambiguous,
        recognised=hint,
        message=_paragraph(sentences),
        candidate=shown,
        nominal=nominal,
    )


def _check_size(image: Candidate, width: int, height: int) -> None:
    """Refuse an image of another size, with what the size tells."""
    down, across = image.numbers.shape[:2]
    if (across, down) == (width, height):
        return
    message = f"candidate must be {width} x {height} pixels as the scene, got {across} x {down}; "
    ratio = across / width
    if down == ratio * height and (
        ratio.is_integer() or (1 / ratio).is_integer() or (2 * ratio).is_integer()
    ):
        cure = f"that is a device pixel ratio of {ratio:g}: set the canvas's width and height without it, or "
        raise SceneError(message + cure + f"accept the scene at {across} x {down}")
    swapped = (across, down) == (height, width)
    cure = "its axes are swapped: transpose it" if swapped else "draw the scene at its own size"
    raise SceneError(message + cure)


def _status(image: Candidate, acceptance: Acceptance, asked: Delivery, found: Judgement) -> str:
    if found.left_out.all():
        return NOT_COMPARABLE
    if found.count == 0:
        return NOT_COMPARABLE if acceptance.advice else INSIDE
    if acceptance.low_quality is None:
        return OUTSIDE
    coarse = judged(image, acceptance.low_quality(), asked, found.left_out)
    return OUTSIDE if coarse.count else LOW_QUALITY


def _head(status: str, found: Judgement, far: Worst | None, drawn: Booleans, acceptance: Acceptance) -> str:
    """Return the verdict in one sentence."""
    total = int(np.count_nonzero(drawn))
    word = status if acceptance.justified else f"{status} {UNJUSTIFIED}"
    parts = [_counts(found, far, total)]
    if far is not None:
        parts.append(_worst_words(far))
    if acceptance.ambiguous.any():
        share = acceptance.share_ambiguous
        parts.append(f"{share:.1%} of what is drawn hangs on a comparison and may differ by a sample")
    hidden = int(np.count_nonzero(found.left_out))
    if hidden:
        parts.append(f"{hidden} {_pixels(hidden)} left out by the mask")
    return f"{word}: {'; '.join(parts)}"


def _paragraph(sentences: tuple[str, ...]) -> str:
    """Return sentences one after the other; the first begins with the status, a word to search for."""
    first, *others = [text.rstrip(".") for text in sentences if text]
    return " ".join(f"{text}." for text in (first, *(text[0].upper() + text[1:] for text in others)))


def _counts(found: Judgement, far: Worst | None, total: int) -> str:
    if found.left_out.all():
        return "the mask leaves no pixel to judge"
    if far is None:
        return f"all {total} drawn pixels lie inside" if total else "nothing is to be drawn, and nothing is"
    return f"{found.count} of {total} drawn pixels lie outside"


def _worst_words(far: Worst) -> str:
    at = f"the worst is pixel ({far.x}, {far.y}), {far.channel} "
    if not math.isfinite(far.value):
        return at + f"{far.value}, which is no number"
    side = "above" if far.value > far.hi else "below"
    interval = _level(far.lo) if far.lo == far.hi else f"{_level(far.lo)} to {_level(far.hi)}"
    return at + f"{_level(far.value)}, {_level(far.excess)} {side} what is accepted, {interval}"


def _level(value: float) -> str:
    return f"{round(255 * value, 3):g}/255"


def _pixels(count: int) -> str:
    return "pixel is" if count == 1 else "pixels are"


def _shown(
    image: Candidate, acceptance: Acceptance, asked: Delivery, left_out: Booleans
) -> tuple[Floats, Floats]:
    """Return the canvas that the candidate shows and the nominal one, in as many channels."""
    with np.errstate(invalid="ignore"):  # a colour of 0 times an alpha that is infinite
        numbers = canvas_numbers(image, asked, canvas_alpha(acceptance.pipeline))
    nominal = acceptance.nominal[..., : numbers.shape[-1]]
    return np.where(left_out[..., None], nominal, numbers), nominal


def _plain(value: object) -> object:
    return None if isinstance(value, float) and not math.isfinite(value) else value
