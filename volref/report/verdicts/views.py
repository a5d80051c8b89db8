"""Pictures that say where an image differs from what it should be, and in which direction.

A picture is uint8 RGB (h, w, 3).  The page's script paints the same from the same numbers and colours, for
any channel and scale; these are what is seen without it.
"""

import json

import numpy as np

from volref.arrays import Booleans, Bytes, Floats
from volref.image import bytes_from_unit
from volref.report.pictures import LEVEL, NEUTRAL, VIRIDIS

# Differences of one sign and the other: brightness says how much, so that it can be read in grey.
SIGNED = np.array([(150, 205, 255), (35, 105, 205), (16, 17, 20), (200, 95, 20), (255, 205, 120)])

# Below, above, and both in different channels; what is inside shows the image in a grey darker than these.
# A pixel just outside has LEAST_SHADE of the colour, one FULL_EXCESS / 255 outside all of it.
BELOW, ABOVE, BOTH = (70, 155, 255), (255, 150, 40), (235, 95, 215)
INSIDE_SHARE = 0.4
LEAST_SHADE, FULL_EXCESS = 0.5, 31

AMBIGUOUS, PLAIN, NOTHING = (250, 210, 60), (70, 74, 84), (16, 17, 20)

# Differences that end the scale, in 1/255.
SCALES = (255, 64, 16, 4, 1)


def shown(rgba: Floats) -> Bytes:
    """Return the colours of a canvas (h, w, 4) as they are, over black.

    Examples
    --------
    >>> shown(np.array([[[0.2, 0.4, 1.0, 0.5]]])).tolist()
    [[[51, 102, 255]]]
    """
    return bytes_from_unit(np.nan_to_num(rgba[..., :3], nan=0.0))


def difference_of(candidate: Floats, nominal: Floats) -> Floats:
    """Return candidate - nominal (h, w) in 1/255, of the channel where it is largest; NaN counts as 255.

    Of channels that differ equally, to a millionth of 1/255, it is the first.
    """
    with np.errstate(invalid="ignore"):
        apart = np.nan_to_num((candidate - nominal) / LEVEL, nan=255.0, posinf=255.0, neginf=-255.0)
    channel = np.abs(apart).round(6).argmax(axis=-1)
    return np.asarray(np.take_along_axis(apart, channel[..., None], axis=-1)[..., 0])


def scale_of(difference: Floats) -> int:
    """Return the shortest scale that holds all differences.

    Examples
    --------
    >>> scale_of(np.array([0.2, -3.0])), scale_of(np.array([300.0]))
    (4, 255)
    """
    largest = float(np.abs(difference).max(initial=0.0))
    return next((scale for scale in reversed(SCALES) if largest <= scale), SCALES[0])


def difference_picture(difference: Floats, scale: int) -> Bytes:
    """Return differences (h, w) in 1/255 as colours: blue is too dark, orange too bright, black equal.

    Examples
    --------
    >>> difference_picture(np.array([[-300.0, 0.0, 16.0]]), 16).tolist()
    [[[150, 205, 255], [16, 17, 20], [255, 205, 120]]]
    """
    places = np.linspace(-1.0, 1.0, len(SIGNED))
    channels = [np.interp(difference / scale, places, SIGNED[:, k] / 255) for k in range(3)]
    return bytes_from_unit(np.stack(channels, axis=-1))


def interval_picture(candidate: Floats, lo: Floats, hi: Floats, outside: Booleans) -> Bytes:
    """Return the image in grey with pixels that are `outside` (h, w) in colours: below, above, or both.

    Examples
    --------
    >>> grey = np.full((1, 3, 4), 0.5)
    >>> grey[0, 1, 0], grey[0, 2, 0] = 0.3, np.nan
    >>> lo, hi = np.full((1, 3, 4), 0.4), np.full((1, 3, 4), 0.6)
    >>> interval_picture(grey, lo, hi, grey[..., 0] != 0.5).tolist()
    [[[51, 51, 51], [68, 151, 248], [235, 95, 215]]]
    """
    # A NaN is not at least lo and not at most hi: both.  So is what only rounding on the way puts outside.
    below = outside & ~(candidate >= lo).all(axis=-1)
    above = outside & ~(candidate <= hi).all(axis=-1)
    neither = outside & ~below & ~above
    below, above = below | neither, above | neither
    grey = np.clip(np.nan_to_num(candidate[..., :3]), 0, 1).mean(axis=-1) * INSIDE_SHARE
    picture = np.repeat(bytes_from_unit(grey)[..., None], 3, axis=-1)
    shade = _shade(candidate, lo, hi)
    for mask, color in ((below, BELOW), (above, ABOVE), (below & above, BOTH)):
        picture[mask] = np.rint(shade[mask][:, None] * color)
    return picture


def _shade(candidate: Floats, lo: Floats, hi: Floats) -> Floats:
    """Return how bright pixels (h, w) are painted that are outside: more by the logarithm of how far."""
    with np.errstate(invalid="ignore"):
        beyond = np.maximum(np.maximum(lo - candidate, candidate - hi), 0) / LEVEL
    excess = np.nan_to_num(beyond.max(axis=-1), nan=np.inf, posinf=np.inf)
    part = np.log1p(np.minimum(excess, FULL_EXCESS)) / np.log1p(FULL_EXCESS)
    return np.asarray(LEAST_SHADE + (1 - LEAST_SHADE) * part)


def chips() -> str:
    """Return the style of the squares in legends."""
    inside = tuple(round(INSIDE_SHARE * 128) for _ in range(3))
    colors = {"below": BELOW, "above": ABOVE, "both": BOTH, "inside": inside}
    colors |= {"ambiguous": AMBIGUOUS, "plain": PLAIN, "nothing": NOTHING}
    return "".join(
        f".chip.{name} {{ background: rgb({r} {g} {b}); }}\n" for name, (r, g, b) in colors.items()
    )


def palette() -> str:
    """Return the colours and scales of these pictures as JSON, for the page's script."""
    return json.dumps(
        {
            "viridis": VIRIDIS.tolist(),
            "signed": SIGNED.tolist(),
            "below": BELOW,
            "above": ABOVE,
            "both": BOTH,
            "insideShare": INSIDE_SHARE,
            "leastShade": LEAST_SHADE,
            "fullExcess": FULL_EXCESS,
            "ambiguous": AMBIGUOUS,
            "plain": PLAIN,
            "nothing": NOTHING,
            "neutral": NEUTRAL,
            "scales": SCALES,
        }
    )
