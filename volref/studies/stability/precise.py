"""Arithmetic with 400 digits from the standard library, for references.

400 digits hold 1 - exp(-x) for x = 1e-300 with a hundred digits to spare.
"""

from collections.abc import Sequence
from decimal import MAX_EMAX, MIN_EMIN, Context, Decimal, localcontext

import numpy as np

from volref.arrays import Floats

_PRECISE = Context(prec=400, Emin=MIN_EMIN, Emax=MAX_EMAX)


def opacity_of_depth(depth: float | Decimal) -> float:
    """Return 1 - exp(-depth), correctly rounded.

    Examples
    --------
    >>> opacity_of_depth(1e-300), opacity_of_depth(1e300)
    (1e-300, 1.0)
    """
    with localcontext(_PRECISE):
        return float(1 - (-Decimal(depth)).exp())


def opacity_of_ratio(opacity: float | Decimal, ratio: float) -> float:
    """Return 1 - (1 - opacity)^ratio, correctly rounded: the opacity of `ratio` unit distances.

    Examples
    --------
    >>> opacity_of_ratio(0.5, 2.0), opacity_of_ratio(1e-17, 2.0)
    (0.75, 2e-17)
    """
    with localcontext(_PRECISE):
        return float(1 - ((1 - Decimal(opacity)).ln() * Decimal(ratio)).exp())


def line(x: float, x0: float, x1: float, y0: float, y1: float) -> Decimal:
    """Return the value at x of the line from (x0, y0) to (x1, y1).

    Examples
    --------
    >>> float(line(0.5, 0.0, 1.0, 1.0, 2.0))
    1.5
    """
    with localcontext(_PRECISE):
        share = (Decimal(x) - Decimal(x0)) / (Decimal(x1) - Decimal(x0))
        return Decimal(y0) + share * (Decimal(y1) - Decimal(y0))


def along_ray(origin: float, direction: float, distances: Sequence[float]) -> Floats:
    """Return origin + direction * distance for each of the distances, each correctly rounded.

    Examples
    --------
    >>> along_ray(1.0, 0.5, [2.0, 4.0]).tolist()
    [2.0, 3.0]
    """
    with localcontext(_PRECISE):
        start, step = Decimal(origin), Decimal(direction)
        return np.array([float(start + step * Decimal(distance)) for distance in distances])
