"""The emission-absorption integral along one ray, to as many digits as are asked for.

    C = integral of c sigma T dt + T(end) B,     T(t) = exp(-integral of sigma from t_near to t)

(Max 1995, eq. 5) over the exact span of a float64 ray, through the exact trilinear field of float64 samples
and the exact piecewise linear table of float64 knots.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import TypeAlias

import numpy as np

from volref.scene.transfer import TransferFunction
from volref.scene.volume import Volume
from volref.truth.digits.lattice import (
    Point,
    cells_along,
    corner_samples,
    cubic_in_cell,
    exact_point,
    exact_span,
)
from volref.truth.digits.pieces import evaluate, monotone_pieces
from volref.truth.digits.series import Medium, Step, edge_step, taylor_step
from volref.truth.digits.table import Context, Number, Table, exact_table

# Digits of the arithmetic beyond those of the result.  Roots that nearly coincide lose half of them.
GUARD_DIGITS = 40

Ray: TypeAlias = tuple[Point, Point]


@dataclass(frozen=True)
class Light:
    """What a ray has gathered: premultiplied `color` (3,), optical `depth`, its `transmittance`.

    `remainder` bounds what has been left out of any channel.
    """

    color: tuple[Number, ...]
    depth: Number
    transmittance: Number
    remainder: Number


@dataclass(frozen=True)
class RayIntegral:
    """The integral along a ray: `rgba` as mpmath numbers, a bound on the error of each, and its `pieces`."""

    rgba: tuple[Number, ...]
    remainder: float
    pieces: int


def ray_integral(
    volume: Volume,
    transfer: TransferFunction,
    origin: Sequence[float],
    direction: Sequence[float],
    distance: float = math.inf,
    behind: Sequence[float] = (0.0, 0.0, 0.0, 0.0),
    digits: int = 30,
) -> RayIntegral:
    """Return the premultiplied RGBA of the ray from `origin` along `direction`, both in index space.

    t counts world units: `direction` is the image of a unit world direction.  The ray ends at `distance`
    (+inf: where it leaves the volume), where the premultiplied RGBA `behind` lies.

    The absolute error of each channel is at most `remainder`, which is about 10^-(digits + 3) times the
    brightest of 1, the table's colours and `behind`; rounding is not in it: it acts GUARD_DIGITS digits
    further down, and where the field touches a jump of the table without crossing it, half as far.

    Examples
    --------
    >>> import numpy as np
    >>> volume = Volume(np.zeros((2, 2, 2)), centering="node")
    >>> transfer = TransferFunction([0], [(1, 1, 1)], [2.0])
    >>> found = ray_integral(volume, transfer, (0.5, 0.5, -1), (0, 0, 1))
    >>> float(found.rgba[3]) == -math.expm1(-2.0), found.pieces
    (True, 1)
    """
    from mpmath import mp

    ray = exact_point(origin), exact_point(direction)
    low, high = volume.index_bounds
    span = exact_span(*ray, exact_point(low.tolist()), exact_point(high.tolist()), distance)
    if span is None:
        return RayIntegral(tuple(map(mp.mpf, behind)), 0.0, 0)
    brightest = max(1.0, float(transfer.colors.max()), *behind)
    tolerance = 10.0 ** -(digits + 5)
    with mp.workdps(digits + GUARD_DIGITS + extra_digits(transfer, float(span[1] - span[0]))):
        table = exact_table(mp, transfer)
        light = Light((mp.zero,) * 3, mp.zero, mp.one, mp.zero)
        count = 0
        for piece in _pieces(mp, volume, table, ray, span):
            if light.transmittance < tolerance:
                break
            medium = Medium(table.intervals[piece.interval], table.unit_distance, brightest, tolerance)
            light = _through_piece(mp, light, medium, piece)
            count += 1
        clear = light.transmittance
        color = [c + clear * b for c, b in zip(light.color, behind[:3], strict=True)]
        remainder = light.remainder + (clear * brightest if clear < tolerance else 0)
        alpha = clear * behind[3] - mp.expm1(-light.depth)
        return RayIntegral((*color, alpha), float(remainder), count)


def extra_digits(transfer: TransferFunction, length: float) -> int:
    """Return how many more digits than usual a table and a ray of `length` ask for.

    Knots that lie close, compared with their size, lose digits of the slope between them; a great optical
    depth is felt through errors of where it begins.

    Examples
    --------
    >>> import numpy as np
    >>> extra_digits(TransferFunction([0, 1], np.ones((2, 3)), [0, 1e300]), 1e6)
    306
    """
    knots = np.unique(transfer.values)
    extinction = transfer.knot_extinction
    if transfer.opacity is not None:
        # The logarithm of what float64 leaves between an opacity and 1 is at least -37.
        extinction = np.minimum(extinction, 37.0 / transfer.unit_distance)
    digits = max(0.0, math.log10(max(extinction.max(), 1.0)) + math.log10(length))
    if len(knots) > 1:
        digits += max(0.0, math.log10(np.abs(knots).max()) - math.log10(np.diff(knots).min()))
    return math.ceil(digits)


@dataclass(frozen=True)
class Piece:
    """The part `start` to `end` of the cubic of a cell, 0..1 long in u and `length` in the world."""

    cubic: tuple[Number, ...]
    start: Number
    end: Number
    length: Number
    interval: int

    def value_about(self, middle: Number, half: Number) -> list[Number]:
        """Return the coefficients of the cubic in z, for u = middle + half z."""
        _, c1, c2, c3 = self.cubic
        return [
            evaluate(self.cubic, middle),
            half * ((3 * c3 * middle + 2 * c2) * middle + c1),
            half * half * (3 * c3 * middle + c2),
            half * half * half * c3,
        ]


def _pieces(
    mp: Context, volume: Volume, table: Table, ray: Ray, span: tuple[Fraction, Fraction]
) -> Iterator[Piece]:
    """Yield the pieces of the ray that are not clear, in order."""
    for t0, t1, cell in cells_along(*ray, span):
        samples = corner_samples(volume.values, cell)
        if table.is_clear(min(samples), max(samples)):
            continue
        exact = cubic_in_cell(samples, cell, *ray, t0, t1)
        cubic, length = tuple(_rounded(mp, c) for c in exact), _rounded(mp, t1 - t0)
        if any(exact[1:]):
            parts = monotone_pieces(mp, cubic, table.knots)
        else:
            parts = iter([(mp.zero, mp.one, table.interval_of(exact[0]))])
        for start, end, interval in parts:
            if not table.intervals[interval].clear:
                yield Piece(cubic, start, end, length, interval)


def _rounded(mp: Context, exact: Fraction) -> Number:
    return mp.mpf(exact.numerator) / exact.denominator


def _through_piece(mp: Context, light: Light, medium: Medium, piece: Piece) -> Light:
    """Return the light after a piece: step by step, each as long as its series allows."""
    interval = medium.interval
    on_a_knot = medium.unit_distance is not None and not any(piece.cubic[1:])
    if interval.opaque or (on_a_knot and interval.strength_at(piece.cubic[0]) == 1):
        front = interval.color_at(evaluate(piece.cubic, piece.start))
        color = [c + light.transmittance * f for c, f in zip(light.color, front, strict=True)]
        return Light(tuple(color), mp.inf, mp.zero, light.remainder)
    place, half = piece.start, piece.end - piece.start
    while place < piece.end and light.transmittance >= medium.tolerance:
        half = min(2 * half, (piece.end - place) / 2)
        step, middle, half = _next_step(mp, medium, piece, place, half, light.depth)
        gained = -mp.expm1(-step.depth)
        light = Light(
            tuple(
                c + light.transmittance * (gained * straight + slope * step.moment)
                for c, straight, slope in zip(
                    light.color, interval.color_at(middle), interval.color_slope, strict=True
                )
            ),
            light.depth + step.depth,
            mp.exp(-light.depth - step.depth),
            light.remainder + light.transmittance * step.remainder,
        )
        place = place + 2 * half
    return light


def _next_step(
    mp: Context, medium: Medium, piece: Piece, place: Number, half: Number, depth_before: Number
) -> tuple[Step, Number, Number]:
    """Return the step from `place` on, the field's value in its middle, and half its length in u.

    It is `half`, or that halved until the series converges, or so short that no series is needed.
    """
    shortest = (piece.end - piece.start) * math.sqrt(medium.tolerance) / 16
    while True:
        value = piece.value_about(place + half, half)
        step = taylor_step(mp, medium, value, half * piece.length, depth_before)
        if step is None and medium.unit_distance is not None and half < shortest:
            step = edge_step(mp, medium, value, half * piece.length)
        if step is not None:
            return step, value[0], half
        half = half / 2
