"""Other ways to read an image that lies outside: upside down, colours divided by alpha, decoded.

A reading is a turn of the pixels, an order of the channels and a delivery.  Those that differ from the one
asked for in one or two ways are tried, fewer first; the one that leaves the fewest pixels outside is named,
if these are none or next to none.
"""

import dataclasses
from collections.abc import Iterator
from itertools import product
from typing import NamedTuple

import numpy as np

from volref.arrays import Booleans, Floats
from volref.oracle.acceptance import Acceptance
from volref.oracle.candidate import Candidate
from volref.oracle.delivery import ALPHAS, DECODED, DIRECT, ENCODED_TARGET, Delivery
from volref.oracle.judging import judged

# The axes along which the pixels of an image are reversed, and what that makes of it.
TURNS = {(): "", (0,): "upside down", (1,): "mirrored left to right", (0, 1): "turned by 180 degrees"}

ALPHA_WORDS = {
    "premultiplied": "premultiplied",
    "straight": "straight, its colours divided by alpha",
    "ignored": "without the canvas's alpha",
}
ENCODING_WORDS = {
    "none": "not encoded",
    "srgb": "encoded as sRGB",
    "gamma2.2": "encoded with gamma 2.2",
    ENCODED_TARGET: "encoded as sRGB after its colours were multiplied by alpha",
    DECODED: "decoded from sRGB",
}

MOST_CHANGES = 2

# A reading that leaves this share of the pixels outside is named: what remains is another matter.
REMAINDER = 1 / 20

# Most readings are ruled out by some rows of a large image, of about so many pixels.
ENOUGH_PIXELS = 16384


class Reading(NamedTuple):
    """A way to read an image.

    turn: axes along which its pixels are reversed.
    swapped: whether red and blue change places.
    delivery: how it holds the canvas.
    """

    turn: tuple[int, ...]
    swapped: bool
    delivery: Delivery

    def changes(self, asked: Delivery) -> list[str]:
        """Return what the image is if it is to be read so, beside what it is said to be."""
        words = [TURNS[self.turn]] if self.turn else []
        words += ["BGR, not RGB"] if self.swapped else []
        words += [ALPHA_WORDS[self.delivery.alpha]] if self.delivery.alpha != asked.alpha else []
        return words + (
            [ENCODING_WORDS[self.delivery.encoding]] if self.delivery.encoding != asked.encoding else []
        )


def recognised(
    candidate: Candidate, acceptance: Acceptance, asked: Delivery, left_out: Booleans, outside: int
) -> str:
    """Return what an image seems to be of which so many pixels are `outside`; "" if no reading helps."""
    best, least = None, int(outside * REMAINDER) + 1
    whole = (candidate, acceptance, left_out)
    some = _some_rows(*whole)
    for reading in sorted(_readings(candidate, asked), key=lambda one: len(one.changes(asked))):
        # What is too many in some rows is too many in all.
        if some is not None and _count(*some, reading) >= least:
            continue
        count = _count(*whole, reading)
        if count < least:
            best, least = reading, count
        if least == 0:
            break
    if best is None:
        return ""
    rest = "every pixel lies" if least == 0 else f"all but {least} pixels lie"
    words = " and ".join(best.changes(asked))
    return f"the image seems to be {words}: read so, {rest} inside{_option(best.delivery, asked)}"


def _readings(candidate: Candidate, asked: Delivery) -> Iterator[Reading]:
    """Yield the readings that differ from the one asked for in one or two ways."""
    alphas = ALPHAS if candidate.has_alpha else ("ignored",)
    deliveries = [Delivery(alpha, encoding) for alpha in alphas for encoding in ENCODING_WORDS]
    for delivery, swapped, turn in product(deliveries, (False, True), TURNS):
        reading = Reading(turn, swapped, delivery)
        if 1 <= len(reading.changes(asked)) <= MOST_CHANGES:
            yield reading


def _count(candidate: Candidate, acceptance: Acceptance, left_out: Booleans, reading: Reading) -> int:
    """Return how many pixels a reading leaves outside."""
    mask = np.asarray(np.flip(left_out, reading.turn))
    return judged(_turned(candidate, reading), acceptance, reading.delivery, mask).count


def _some_rows(
    candidate: Candidate, acceptance: Acceptance, left_out: Booleans
) -> tuple[Candidate, Acceptance, Booleans] | None:
    """Return some rows of all, which keep their order upside down; None where that saves nothing.

    Not of floats: whether those are codes of the canvas is a matter of all of them.
    """
    height, width = left_out.shape
    step = -(-height * width // ENOUGH_PIXELS)
    if step < 2 or candidate.levels is None:
        return None
    above = np.arange(0, height, 2 * step)
    rows = np.union1d(above, height - 1 - above)
    fewer = dataclasses.replace(acceptance, lo=acceptance.lo[rows], hi=acceptance.hi[rows])
    return dataclasses.replace(candidate, numbers=candidate.numbers[rows]), fewer, left_out[rows]


def _turned(candidate: Candidate, reading: Reading) -> Candidate:
    numbers: Floats = np.flip(candidate.numbers, reading.turn)
    if reading.swapped:
        numbers = numbers[..., [2, 1, 0, *range(3, numbers.shape[-1])]]
    return dataclasses.replace(candidate, numbers=numbers)


def _option(delivery: Delivery, asked: Delivery) -> str:
    """Return how to have an image judged by that delivery."""
    pairs = (
        ("alpha", delivery.alpha, asked.alpha),
        ("encoding", delivery.encoding, asked.encoding),
    )
    given = [f"{name}={now!r}" for name, now, before in pairs if now not in (before, *DIRECT)]
    return f" (pass {', '.join(given)} if that is meant)" if given else ""
