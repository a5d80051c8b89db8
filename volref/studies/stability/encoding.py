"""Cases of what leaves volref: 8-bit codes, packed depths, straight colours."""

import math

import numpy as np

from volref import image
from volref.studies.stability import textbook
from volref.studies.stability.case import EPS, Case, Measured, measured

FAMILY = "Encodings"


def _nearly_white() -> Measured:
    unit = np.array([0.999999, 254.9 / 255, 0.5 / 255 + 1e-9])
    return measured([255, 255, 1], np.trunc(unit * 255), image.bytes_from_unit(unit), 0.0)


def _beyond_white() -> Measured:
    unit = np.array([1.004, 1.5, -0.001])
    naive = np.rint(unit * 255).astype(np.int64).astype(np.uint8)
    return measured([255, 255, 0], naive, image.bytes_from_unit(unit), 0.0)


def _clear() -> Measured:
    premultiplied = np.array([[0.0, 0.0, 0.0, 0.0], [5e-324, 0.0, 0.0, 5e-324]])
    with np.errstate(all="ignore"):
        naive = premultiplied[:, 0] / premultiplied[:, 3]
        naive[1] = premultiplied[1, 0] / (premultiplied[1, 3] + 1e-6)
    found = image.straight_from_premultiplied(premultiplied)
    return measured([0.0, 1.0], naive, found[:, 0], 0.0)


def _negative_light() -> Measured:
    light = np.array([-1e-17, -0.5])
    with np.errstate(all="ignore"):
        naive = 1.055 * light ** (1 / 2.4) - 0.055
    return measured([0.0, 0.0], naive, image.encode_srgb(light), 0.0)


def _every_code() -> Measured:
    codes = np.arange(256, dtype=np.uint8)
    there = image.decode_srgb(codes / 255)
    naive = np.rint(255 * there ** (1 / 2.2))
    return measured(codes, naive, image.bytes_from_unit(image.encode_srgb(there)), 0.0)


def _packed() -> Measured:
    unit = np.array([0.0, 0.5, 0.999999, math.nextafter(1.0, 0.0), 1.0])
    found = image.unit_from_bytes24(image.bytes24_from_unit(unit))
    return measured(unit, textbook.pack_fract(unit), found, 0.5 / (2**24 - 1) + EPS)


CASES = (
    Case(
        "nearly-white",
        FAMILY,
        "Which 8-bit codes are 0.999999, 254.9/255 and just over 0.5/255?",
        "the nearest: 255, 255 and 1",
        "truncation",
        "exact: codes",
        _nearly_white,
    ),
    Case(
        "beyond-white",
        FAMILY,
        "And 1.004, 1.5 and -0.001?",
        "the nearest there is: 255, 255 and 0",
        "rounding without clipping, which wraps around",
        "exact: codes",
        _beyond_white,
    ),
    Case(
        "straight-colour-at-alpha-0",
        FAMILY,
        "What is the straight colour of a clear pixel, and of one of alpha 5e-324?",
        "0 by decision; and colour / alpha = 1",
        "colour / alpha, 0 / 0; or with 1e-6 added to alpha against that",
        "exact: a decision, and a quotient of equal numbers",
        _clear,
    ),
    Case(
        "negative-light",
        FAMILY,
        "Which sRGB code is light a little below 0?",
        "0: the nearest that can be shown",
        "the power 1 / 2.4 of a negative number",
        "exact: it is clipped",
        _negative_light,
    ),
    Case(
        "every-srgb-code-and-back",
        FAMILY,
        "Do all 256 sRGB codes come back from linear light?",
        "the codes themselves; IEC 61966-2-1",
        "the power 1 / 2.2 for the encoding",
        "exact: codes",
        _every_code,
    ),
    Case(
        "depth-1-in-24-bits",
        FAMILY,
        "Is a depth of 1 (the far plane) still 1 after three bytes?",
        "the depths themselves",
        "fract(v (1, 256, 65536)), in which 1 becomes 0, the near plane",
        "half a level of 1 / (2^24 - 1): the nearest of 2^24 whole numbers",
        _packed,
    ),
)
