"""What a case of the stability study is, and how its numbers are judged."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from volref.arrays import Floats

# One unit in the last place of 1 in float64: a single rounding is off by at most half of it.
EPS = float(np.finfo(np.float64).eps)

ERRORS = ("absolute", "relative")


@dataclass(frozen=True, eq=False)
class Answer:
    """What volref returned, and how far off it may be.

    Parameters
    ----------
    who
        "volref" for a single function, else the method of `volref.render`.
    value
        The numbers, of the shape of the reference.
    limit
        The largest error allowed; with a certificate, the largest certificate allowed.
    certificate
        A bound that came with the numbers, of the shape of `value`: each error must be within it.
    """

    who: str
    value: Floats
    limit: float
    certificate: Floats | None = None


@dataclass(frozen=True, eq=False)
class Measured:
    """The numbers of a case: the truth, the textbook formula's, and volref's answers, all of one shape."""

    reference: Floats
    textbook: Floats
    answers: tuple[Answer, ...]


@dataclass(frozen=True)
class Case:
    """A hard input, the truth about it, and how far off volref may be.

    Parameters
    ----------
    name
        Words with hyphens; unique.
    family
        The heading under which it stands.
    question
        What is asked, in plain words.
    reference
        Where the truth comes from: the formula in words, and its source.
    textbook
        What the obvious formula does.
    reason
        Why the limit is what it is.
    measure
        Computes all three.
    error
        "absolute" or "relative" (to the reference).
    """

    name: str
    family: str
    question: str
    reference: str
    textbook: str
    reason: str
    measure: Callable[[], Measured]
    error: str = "absolute"


def measured(reference: ArrayLike, textbook: ArrayLike, volref: ArrayLike, limit: float) -> Measured:
    """Return the numbers of a case that a single function of volref answers."""
    answer = Answer("volref", _floats(volref), limit)
    return Measured(_floats(reference), _floats(textbook), (answer,))


def errors(value: Floats, reference: Floats, error: str) -> Floats:
    """Return how far each number is from the reference, infinite where it is NaN or infinite.

    Examples
    --------
    >>> errors(np.array([1.5, np.nan, 0.0]), np.array([1.0, 1.0, 0.0]), "relative").tolist()
    [0.5, inf, 0.0]
    """
    with np.errstate(all="ignore"):
        off = np.abs(value - reference)
        if error == "relative":
            off = np.where(off == 0, 0.0, off / np.abs(reference))
    return np.where(np.isfinite(value) & np.isfinite(off), off, np.inf)


def _floats(numbers: ArrayLike) -> Floats:
    return np.atleast_1d(np.asarray(numbers, dtype=np.float64))
