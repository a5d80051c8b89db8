"""What the entries of transfer functions must obey, checked where a record is built."""

from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from volref.arrays import LARGEST_LENGTH, LEAST_LENGTH, Floats, ShapeRule, float_array, number, plain_array
from volref.errors import SceneError

LONGEST_UNITS = 40

# Magnitudes of the gradient, and the factor at each.
GradientOpacity: TypeAlias = tuple[ArrayLike, ArrayLike]


def checked_length(unit_distance: float) -> float:
    """Return a unit distance that the opacity of a table can be meant for."""
    length = number("transfer.unit_distance", unit_distance, above=0, high=LARGEST_LENGTH)
    return number("transfer.unit_distance", length, low=LEAST_LENGTH)


def checked_units(units: object) -> str:
    """Return the name of a unit: one short line of text, or nothing."""
    if isinstance(units, str) and len(units) <= LONGEST_UNITS and (units.isprintable() or not units):
        return units
    message = f"transfer.units must be text of one line, at most {LONGEST_UNITS} characters, got "
    raise SceneError(message + f"{type(units).__name__}; name the unit, such as 'HU'")


def checked_domain(name: str, domain: ArrayLike) -> tuple[float, float]:
    """Return the values at the ends of a table, the first below the last."""
    ends = float_array(name, domain, (2,))
    if not ends[0] < ends[1]:
        message = f"{name} must rise, got {ends.tolist()}; swap or move its ends"
        raise SceneError(message)
    return float(ends[0]), float(ends[1])


def table_of_codes(rgba: ArrayLike, shape: ShapeRule) -> Floats:
    """Return a table as numbers: whole numbers are codes, and are divided by their type's largest one."""
    table = plain_array("transfer.rgba", rgba)
    if table.dtype.kind in "iu":
        table = table / np.iinfo(table.dtype).max
    return float_array("transfer.rgba", table, shape)


def checked_positions(name: str, values: ArrayLike) -> Floats:
    """Return positions of knots: at least one, non-decreasing, none of them more than twice."""
    array = float_array(name, values, ("K",))
    if len(array) == 0:
        message = f"{name} must have at least one knot, got none; give one"
        raise SceneError(message)
    falls = np.flatnonzero(np.diff(array) < 0)
    if len(falls):
        i = int(falls[0]) + 1
        message = f"{name} must not decrease, got {array[i]:g} after {array[i - 1]:g} at index {i}; "
        raise SceneError(message + "sort the table")
    triples = np.flatnonzero(array[2:] == array[:-2])
    if len(triples):
        i = int(triples[0])
        message = f"{name} must hold a value at most twice, got {array[i]:g} at indices "
        raise SceneError(message + f"{i} to {i + 2}; keep the first and the last")
    return array


def checked_factors(gradient_opacity: GradientOpacity) -> tuple[Floats, Floats]:
    """Return magnitudes (G,) of the gradient with their factors (G,) in 0..1."""
    name = "transfer.gradient_opacity"
    if not isinstance(gradient_opacity, tuple | list) or len(gradient_opacity) != 2:
        message = f"{name} must be a pair, got {type(gradient_opacity).__name__}; give (magnitudes, factors)"
        raise SceneError(message)
    magnitudes = checked_positions(f"{name}[0]", gradient_opacity[0])
    return magnitudes, share(f"{name}[1]", gradient_opacity[1], (len(magnitudes),))


def at_least_zero(name: str, value: ArrayLike, shape: ShapeRule) -> Floats:
    """Return numbers of which none is below 0."""
    array = float_array(name, value, shape)
    if (array < 0).any():
        where = tuple(int(i) for i in np.argwhere(array < 0)[0])
        index = where[0] if len(where) == 1 else where
        message = f"{name} must be at least 0, got {array[where]:g} at index {index}; "
        raise SceneError(message + "raise it to 0")
    return array


def share(name: str, value: ArrayLike | None, shape: ShapeRule) -> Floats:
    """Return numbers in 0..1."""
    array = at_least_zero(name, [] if value is None else value, shape)
    if (array > 1).any():
        where = tuple(int(i) for i in np.argwhere(array > 1)[0])
        index = where[0] if len(where) == 1 else where
        message = f"{name} must lie in 0..1, got {array[where]:g} at index {index}; "
        raise SceneError(message + "divide by the largest code, or give extinction instead")
    return array
