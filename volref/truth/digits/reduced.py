"""The modes that reduce a ray to one value, to as many digits as are asked for.

Cells and cubics are exact fractions; turning points, roots and the table are mpmath numbers.  It shares no
code with the integrators.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise

from volref.scene.plane import Plane
from volref.scene.scene import Scene
from volref.scene.transfer import TransferFunction
from volref.scene.volume import Volume
from volref.truth.digits.lattice import (
    Cubic,
    Point,
    cells_along,
    corner_samples,
    cubic_in_cell,
    exact_point,
    exact_span,
)
from volref.truth.digits.pieces import evaluate, meeting, turning_points
from volref.truth.digits.table import Context, Number, exact_table

# A point up to this many indices outside the volume's faces counts as inside of a slice.
EDGE = Fraction(1, 2**40)


@dataclass(frozen=True)
class FloatRay:
    """A float64 ray in index space, and in the world, that ends at `distance` before the colour `behind`."""

    origin: Sequence[float]
    direction: Sequence[float]
    world_origin: Sequence[float]
    world_direction: Sequence[float]
    distance: float
    behind: Sequence[float]


def reduced_rgba(mp: Context, scene: Scene, ray: FloatRay) -> tuple[Number, ...]:
    """Return the rgba of a ray in the mode of its scene, which is not "composite"."""
    volume, transfer = scene.gridded
    place = volume, ray.origin, ray.direction
    behind = tuple(map(mp.mpf, ray.behind))
    if scene.isovalue is not None:
        t = first_meeting(mp, scene.isovalue, *place, distance=ray.distance)
        table = exact_table(mp, transfer)
        color = table.intervals[table.interval_of(scene.isovalue)].color_at(mp.mpf(scene.isovalue))
        return behind if t is None else (*color, mp.one)
    if scene.slice_plane is not None:
        value = value_on_plane(mp, scene.slice_plane, volume, ray)
    else:
        value = reduced_value(mp, scene.mode, *place, distance=ray.distance)
    return behind if value is None else layer(mp, transfer, value, ray.behind)


def value_on_plane(mp: Context, plane: Plane, volume: Volume, ray: FloatRay) -> Number | None:
    """Return the value at the point of the ray in index space whose t is that of the plane in the world.

    None where the ray has no such point within the volume and before its end.

    Examples
    --------
    >>> import numpy as np
    >>> from mpmath import mp
    >>> volume = Volume(np.array([0.0, 4.0]).reshape(1, 1, 2))
    >>> ray = FloatRay(*[(-1, 0, 0), (1, 0, 0)] * 2, 9.0, (0, 0, 0, 0))
    >>> float(value_on_plane(mp, Plane((0.75, 0, 0), (1, 0, 0)), volume, ray))
    3.0
    """
    point, normal = exact_point(plane.point.tolist()), exact_point(plane.normal.tolist())
    origin, direction = exact_point(ray.world_origin), exact_point(ray.world_direction)
    along = sum((n * d for n, d in zip(normal, direction, strict=True)), Fraction(0))
    if along == 0:
        return None
    t = sum((n * (p - o) for n, p, o in zip(normal, point, origin, strict=True)), Fraction(0)) / along
    if t < 0 or t > ray.distance:
        return None
    place = [o + t * d for o, d in zip(exact_point(ray.origin), exact_point(ray.direction), strict=True)]
    low, high = (exact_point(corner.tolist()) for corner in volume.index_bounds)
    if any(not a - EDGE <= p <= b + EDGE for a, p, b in zip(low, place, high, strict=True)):
        return None
    x, y, z = (min(max(p, a), b) for a, p, b in zip(low, place, high, strict=True))
    cell = math.floor(x), math.floor(y), math.floor(z)
    still = Fraction(0), Fraction(0), Fraction(0)
    samples = corner_samples(volume.values, cell)
    return _rounded(mp, cubic_in_cell(samples, cell, (x, y, z), still, Fraction(0), Fraction(1))[0])


def reduced_value(
    mp: Context,
    mode: str,
    volume: Volume,
    origin: Sequence[float],
    direction: Sequence[float],
    begin: float = 0.0,
    distance: float = math.inf,
) -> Number | None:
    """Return the greatest ("mip"), least ("minip") or mean ("average") value of the ray in index space.

    It begins at `begin` and ends at `distance`, or where it leaves the volume; None where nothing is between.

    Examples
    --------
    >>> import numpy as np
    >>> from mpmath import mp
    >>> volume = Volume(np.array([0.0, 4.0]).reshape(1, 1, 2), centering="cell")
    >>> ray = (-1, 0, 0), (1, 0, 0)
    >>> [float(reduced_value(mp, mode, volume, *ray)) for mode in ("mip", "minip", "average")]
    [4.0, 0.0, 2.0]
    """
    cells = list(_cells(volume, exact_point(origin), exact_point(direction), begin, distance))
    if not cells:
        return None
    if mode == "average":
        total, length = Fraction(0), Fraction(0)
        for t0, t1, (c0, c1, c2, c3) in cells:
            total += (t1 - t0) * (c0 + c1 / 2 + c2 / 3 + c3 / 4)
            length += t1 - t0
        return _rounded(mp, total / length)
    low, high = volume.value_bounds
    values = (
        evaluate(rounded, u)
        for _, _, cubic in cells
        for rounded in [[_rounded(mp, c) for c in cubic]]
        for u in (mp.zero, *turning_points(mp, rounded), mp.one)
    )
    # Interpolated values are means, which rounding must not put on the other side of a jump.
    return min(max(values), mp.mpf(high)) if mode == "mip" else max(min(values), mp.mpf(low))


def first_meeting(
    mp: Context,
    isovalue: float,
    volume: Volume,
    origin: Sequence[float],
    direction: Sequence[float],
    begin: float = 0.0,
    distance: float = math.inf,
) -> Number | None:
    """Return the t at which the ray in index space first meets `isovalue`, or None.

    Examples
    --------
    >>> import numpy as np
    >>> from mpmath import mp
    >>> volume = Volume(np.array([0.0, 4.0]).reshape(1, 1, 2))
    >>> float(first_meeting(mp, 1.0, volume, (-1, 0, 0), (1, 0, 0)))
    1.25
    """
    for t0, t1, cubic in _cells(volume, exact_point(origin), exact_point(direction), begin, distance):
        shifted = [_rounded(mp, c) for c in (cubic[0] - Fraction(isovalue), *cubic[1:])]
        for a, b in pairwise([mp.zero, *turning_points(mp, shifted), mp.one]):
            first, last = evaluate(shifted, a), evaluate(shifted, b)
            if first == 0 or first * last <= 0:
                u = a if first == 0 else b if last == 0 else meeting(mp, shifted, mp.zero, a, b)
                return _rounded(mp, t0) + u * _rounded(mp, t1 - t0)
    return None


def layer(
    mp: Context, transfer: TransferFunction, value: Number, behind: Sequence[float]
) -> tuple[Number, ...]:
    """Return the rgba of a layer of `value` one unit distance thick over `behind`.

    Examples
    --------
    >>> from mpmath import mp
    >>> table = TransferFunction([0, 2], [(0, 0, 0), (1, 1, 1)], opacity=[0, 1])
    >>> [float(c) for c in layer(mp, table, mp.mpf(1), (1, 0, 0, 1))]
    [0.75, 0.25, 0.25, 1.0]
    """
    table = exact_table(mp, transfer)
    interval = table.intervals[table.interval_of(value)]
    opacity = interval.strength_at(value)
    if table.unit_distance is None:
        opacity = -mp.expm1(-opacity * mp.mpf(transfer.unit_distance))
    color = (*interval.color_at(value), 1)
    return tuple((1 - opacity) * b + opacity * c for b, c in zip(behind, color, strict=True))


def _cells(
    volume: Volume, origin: Point, direction: Point, begin: float, distance: float
) -> Iterator[tuple[Fraction, Fraction, Cubic]]:
    """Yield t at both ends and the exact cubic of the cells of a ray, in order."""
    low, high = (exact_point(corner.tolist()) for corner in volume.index_bounds)
    span = exact_span(origin, direction, low, high, distance)
    if span is None or max(span[0], Fraction(begin)) >= span[1]:
        return
    for t0, t1, cell in cells_along(origin, direction, (max(span[0], Fraction(begin)), span[1])):
        samples = corner_samples(volume.values, cell)
        yield t0, t1, cubic_in_cell(samples, cell, origin, direction, t0, t1)


def _rounded(mp: Context, exact: Fraction) -> Number:
    return mp.mpf(exact.numerator) / exact.denominator
