"""Numbers as pictures: a colour map, maps of distance and of error, and PNG bytes.

H, W the image.  A map is uint8 RGB (H, W, 3).  Its legend is a strip of the same colours with its ends and
ticks in words.
"""

import io
import math
from dataclasses import dataclass

import numpy as np

from volref.arrays import Booleans, Bytes, Floats
from volref.image import bytes_from_unit

# Nine colours of "viridis" (van der Walt and Smith 2015, released as CC0), at equal distances: its lightness
# rises evenly, so it can be read in grey and with any colour vision.
VIRIDIS = np.array(
    [
        (68, 1, 84),
        (71, 44, 122),
        (59, 81, 139),
        (44, 113, 142),
        (33, 144, 141),
        (39, 173, 129),
        (92, 200, 99),
        (170, 220, 50),
        (253, 231, 37),
    ]
)

# No colour of the map: there is no number here.
NEUTRAL = (128, 128, 132)

# Powers of ten that an error map spans.
DECADES = 4

# An 8-bit level: errors are told in these.
LEVEL = 1 / 255


@dataclass(frozen=True, eq=False)
class ColoredMap:
    """A map and how to read it.

    colors (H, W, 3): the picture.
    ticks: places on the scale, from 0 (its first colour) to 1, and what stands there.
    unit: the unit of the ticks.
    neutral: what a pixel in the neutral tone means, or "" if there is none.
    """

    colors: Bytes
    ticks: tuple[tuple[float, str], ...]
    unit: str
    neutral: str


def color_map(fraction: Floats) -> Bytes:
    """Return the colours (..., 3) of fractions, from dark violet at 0 over green to yellow at 1, clipped.

    Examples
    --------
    >>> color_map(np.array([-1.0, 0.0, 0.5, 1.0])).tolist()
    [[68, 1, 84], [68, 1, 84], [33, 144, 141], [253, 231, 37]]
    """
    places = np.linspace(0.0, 1.0, len(VIRIDIS))
    channels = [np.interp(fraction, places, VIRIDIS[:, k] / 255) for k in range(3)]
    return bytes_from_unit(np.stack(channels, axis=-1))


def distance_map(distance: Floats, unit: str = "world units") -> ColoredMap:
    """Return the map of the distances (H, W) to the first surface: near is yellow, +inf is neutral.

    Examples
    --------
    >>> near_and_far = distance_map(np.array([[2.0, 4.0, np.inf]]), "mm")
    >>> near_and_far.colors[0].tolist(), near_and_far.ticks
    ([[253, 231, 37], [68, 1, 84], [128, 128, 132]], ((0.0, '4'), (0.5, '3'), (1.0, '2')))
    """
    hit = np.isfinite(distance)
    near, far = (float(distance[hit].min()), float(distance[hit].max())) if hit.any() else (0.0, 0.0)
    spread = far - near
    fraction = (far - np.where(hit, distance, far)) / spread if spread > 0 else np.ones(distance.shape)
    ends = ((0.0, far), (0.5, (near + far) / 2), (1.0, near)) if spread > 0 else ((1.0, near),)
    ticks = tuple((place, f"{value:.4g}") for place, value in ends) if hit.any() else ()
    return ColoredMap(_painted(fraction, hit), ticks, unit, "" if hit.all() else "no surface")


def error_map(bound: Floats) -> ColoredMap:
    """Return the map of the errors (H, W) of an image, in 8-bit levels on a logarithmic scale.

    The scale ends at the power of ten at or above the largest error and spans four decades; smaller errors
    take its first colour, 0 is neutral.

    Examples
    --------
    >>> levels = error_map(np.array([[0.0, 1e-9, 0.01, 1.0]]) / 255)
    >>> levels.colors[0].tolist()
    [[128, 128, 132], [68, 1, 84], [33, 144, 141], [253, 231, 37]]
    >>> [word for _, word in levels.ticks]
    ['0.0001', '0.001', '0.01', '0.1', '1']
    """
    seen = bound > 0
    if not seen.any():
        return ColoredMap(_painted(np.zeros(bound.shape), seen), (), "levels of 1/255", "error 0")
    top = math.ceil(math.log10(float(bound.max()) / LEVEL))
    exponent = np.log10(np.where(seen, bound, 1.0) / LEVEL)
    decades = range(DECADES + 1)
    ticks = tuple((k / DECADES, f"{10.0 ** (top - DECADES + k):g}") for k in decades)
    colors = _painted((exponent - top + DECADES) / DECADES, seen)
    return ColoredMap(colors, ticks, "levels of 1/255", "" if seen.all() else "error 0")


def with_legend(picture: ColoredMap) -> Bytes:
    """Return the map with its legend drawn below it (H + strip, W, 3), for a file that stands alone."""
    from PIL import Image, ImageDraw, ImageFont

    width = picture.colors.shape[1]
    size = max(8, min(14, width // 34))
    font = ImageFont.load_default(size)
    margin, bar = size, size
    strip = Image.new("RGB", (width, bar + 4 * size + margin), (24, 25, 28))
    draw = ImageDraw.Draw(strip)
    if picture.ticks:
        scale = color_map(np.linspace(0.0, 1.0, max(width - 2 * margin, 1)))
        strip.paste(Image.fromarray(np.repeat(scale[None], bar, axis=0)), (margin, size // 2))
    for place, word in picture.ticks:
        x = margin + place * (width - 2 * margin)
        length = draw.textlength(word, font=font)
        x = min(max(x - length / 2, margin), width - margin - length)
        draw.text((x, 2 * size), word, fill=(236, 236, 236), font=font)
    draw.text((margin, 3.5 * size), _key(picture), fill=(190, 190, 194), font=font)
    return np.concatenate([picture.colors, np.asarray(strip)])


def png_bytes(codes: Bytes) -> bytes:
    """Return a PNG file of codes (H, W, 3) or (H, W, 4) as bytes."""
    from PIL import Image

    buffer = io.BytesIO()
    Image.fromarray(np.ascontiguousarray(codes)).save(buffer, format="PNG", optimize=True)
    return buffer.getvalue()


def _painted(fraction: Floats, valid: Booleans) -> Bytes:
    colors = color_map(fraction)
    colors[~valid] = NEUTRAL
    return colors


def _key(picture: ColoredMap) -> str:
    words = [picture.unit] if picture.ticks else []
    return ", ".join([*words, f"grey: {picture.neutral}"] if picture.neutral else words)
