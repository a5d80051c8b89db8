"""The numbers of a case, packed for the page's script: every number that it shows is one of these.

H, W the image; h, w what the page shows of it; N = h w.  A number is stored as a whole number of 1/255, or
of 1/(255 256) where some number is no multiple of 1/255.  Fields follow each other, each as planes of bytes
(bytes, 4, N), the lowest first: the nominal image as differences from pixel to pixel, the others as
differences from the nominal, all modulo 256 or 2^32.  Then, one plane each: marks (N), the two bytes of the
interval's width (N), and, of an image that is reduced, where in its block the pixel lies (y, then x).  All of
it is deflated: a browser undoes that exactly, which it does not promise of the pixels of an image.
"""

import base64
import zlib
from dataclasses import dataclass

import numpy as np

from volref.arrays import Booleans, Floats, Integers, Numbers
from volref.report.verdicts.cases import Case

FIELDS = ("nominal", "candidate", "lo", "hi")

# Parts of 1/255 that a number is rounded to if it is no multiple of 1/255 itself.
PARTS = 256

# Beyond these a number is shown as an infinity, and NaN has a code of its own.
MOST = 2**30
NAN_CODE = -(2**31)

# Bits of a pixel's mark.
OUTSIDE, AMBIGUOUS, DRAWN, LEFT_OUT = 1, 2, 4, 8

# A width of 10^(code / WIDTH_STEPS - WIDTH_DECADES) levels has the code; none has 0.
WIDTH_STEPS, WIDTH_DECADES = 8000, 4


@dataclass(frozen=True, eq=False)
class Sample:
    """Which pixels (h, w) of an image the page shows: of every block of factor x factor its worst one."""

    rows: Integers
    columns: Integers
    factor: int

    def __call__(self, image: Numbers) -> Numbers:
        """Return these pixels of an image (H, W) or (H, W, C)."""
        return np.asarray(image[self.rows, self.columns])


def sample_of(excess: Floats, most: int) -> Sample:
    """Return at most about `most` pixels of an image, of each block the one that is most outside.

    Where none is outside it is the one in the middle.  Every pixel shown is a pixel of the image, so that
    numbers are true, and no block with a pixel outside looks as if it were inside.

    Examples
    --------
    >>> excess = np.zeros((4, 4))
    >>> excess[0, 3] = 1
    >>> sample = sample_of(excess, 4)
    >>> sample.factor, sample.rows.tolist(), sample.columns.tolist()
    (2, [[1, 0], [3, 3]], [[1, 3], [1, 3]])
    """
    height, width = excess.shape
    factor = 1
    while -(-height // factor) * -(-width // factor) > most:
        factor += 1
    high, wide = -(-height // factor), -(-width // factor)
    rank = np.full((high * factor, wide * factor), -1.0)
    rank[:height, :width] = np.nan_to_num(excess, nan=np.inf, posinf=np.inf)
    rank = rank.reshape(high, factor, wide, factor).swapaxes(1, 2).reshape(high, wide, -1)
    middle = factor // 2 * (factor + 1)
    best = np.where(rank.max(axis=-1) > 0, rank.argmax(axis=-1), middle)
    rows = np.arange(high)[:, None] * factor + best // factor
    columns = np.arange(wide)[None, :] * factor + best % factor
    # The middle of a block that the border cuts may lie beyond it.
    return Sample(np.minimum(rows, height - 1), np.minimum(columns, width - 1), factor)


def packed(case: Case, sample: Sample) -> tuple[dict[str, str], str]:
    """Return what the script must know to read the numbers of a case, by name, and the numbers as base64."""
    images = fields_of(case, sample)
    parts = 1 if all(_is_whole(image) for image in images.values()) else PARTS
    codes = {name: codes_of(image, parts) for name, image in images.items()}
    kind = np.uint8 if parts == 1 else np.dtype("<u4")
    nominal = codes["nominal"].reshape(-1, 4).T
    blocks = [np.diff(nominal, axis=1, prepend=0)]
    blocks += [codes[name].reshape(-1, 4).T - nominal for name in images if name != "nominal"]
    planes = [_planes(block, kind) for block in blocks]
    planes += [marks_of(case, sample).tobytes(), _planes(width_codes(sample(case.acceptance.width)), "<u2")]
    if sample.factor > 1:
        planes += [
            (place % sample.factor).astype(np.uint8).tobytes() for place in (sample.rows, sample.columns)
        ]
    height, width = sample.rows.shape
    about = {
        "width": str(width),
        "height": str(height),
        "factor": str(sample.factor),
        "parts": str(parts),
        "fields": " ".join(images),
    }
    return about, base64.b64encode(zlib.compress(b"".join(planes), 9)).decode("ascii")


def fields_of(case: Case, sample: Sample) -> dict[str, Floats]:
    """Return the images (h, w, 4) that the page has numbers of, the nominal first."""
    acceptance = case.acceptance
    images = dict(
        zip(FIELDS, (acceptance.nominal, case.candidate, acceptance.lo, acceptance.hi), strict=True)
    )
    if case.counterfactual is not None:
        images["counterfactual"] = case.counterfactual
    return {name: sample(image) for name, image in images.items()}


def codes_of(image: Floats, parts: int) -> Integers:
    """Return the whole numbers of 1/(255 parts) nearest to numbers of an image.

    Examples
    --------
    >>> codes_of(np.array([1.0, 0.5, np.inf, np.nan]), 256).tolist()
    [65280, 32640, 1073741824, -2147483648]
    """
    with np.errstate(invalid="ignore", over="ignore"):
        scaled = np.clip(np.rint(image * 255.0 * parts), -MOST, MOST)
    return np.where(np.isnan(scaled), NAN_CODE, np.nan_to_num(scaled)).astype(np.int64)


def marks_of(case: Case, sample: Sample) -> Numbers:
    """Return which of the pixels (h, w) are outside, ambiguous, drawn at all, and left out, as bits."""
    marks: tuple[tuple[int, Booleans], ...] = (
        (OUTSIDE, case.verdict.outside),
        (AMBIGUOUS, case.acceptance.ambiguous),
        (DRAWN, case.acceptance.drawn),
        (LEFT_OUT, case.verdict.left_out),
    )
    return np.asarray(sum(bit * sample(mask).astype(np.uint8) for bit, mask in marks), np.uint8)


def width_codes(width: Floats) -> Integers:
    """Return the codes (h, w) of widths of intervals.

    Examples
    --------
    >>> width_codes(np.array([0, 1e-4, 1, 100]) / 255).tolist()
    [0, 1, 32000, 48000]
    """
    levels = np.maximum(width * 255.0, 1e-9)
    codes = np.rint(WIDTH_STEPS * (np.log10(levels) + WIDTH_DECADES))
    return np.where(width > 0, np.clip(codes, 1, 65535), 0).astype(np.int64)


def _is_whole(image: Floats) -> bool:
    """Return whether all numbers are k/255 for k of a byte; the product is off by 2^-44 at most."""
    with np.errstate(invalid="ignore"):
        scaled = image * 255.0
        whole = np.abs(scaled - np.rint(scaled)) < 1e-9
        return bool((whole & (scaled > -0.5) & (scaled < 255.5)).all())


def _planes(numbers: Integers, kind: np.typing.DTypeLike) -> bytes:
    """Return all lowest bytes, then all second bytes, and so on."""
    wrapped = np.ascontiguousarray(numbers).astype(kind)
    return np.ascontiguousarray(wrapped.reshape(-1).view(np.uint8).reshape(-1, wrapped.itemsize).T).tobytes()
