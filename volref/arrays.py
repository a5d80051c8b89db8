"""Array names with their element types, and the checks made where data enters.

Everything inside volref trusts what passed here: a record checks its own fields when it is built,
with these functions, and no stage checks them again.
"""

import math
import operator
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from volref.errors import SceneError

Floats: TypeAlias = NDArray[np.float64]
Integers: TypeAlias = NDArray[np.int64]
Indices: TypeAlias = NDArray[np.intp]
Booleans: TypeAlias = NDArray[np.bool_]
Bytes: TypeAlias = NDArray[np.uint8]
Numbers: TypeAlias = NDArray[Any]

Vector: TypeAlias = tuple[float, float, float]

# World coordinates and lengths lie within these: their products of up to four factors stay finite.
LARGEST_LENGTH = 1e60
LEAST_LENGTH = 1e-60

# A shape rule is a tuple of lengths in which a name such as "V" stands for any length.
ShapeRule: TypeAlias = tuple[int | str, ...]


def set_fields(record: object, **fields: object) -> None:
    """Set the checked fields of a frozen record from within its `__init__`."""
    for name, value in fields.items():
        object.__setattr__(record, name, value)


def plain_array(name: str, value: ArrayLike | None) -> Numbers:
    """Return `value` as an array of one shape, without a copy where it is one already.

    Raises
    ------
    SceneError
        If it is ragged, or a masked array: what its masked elements are worth is for the caller to say.
    """
    if isinstance(value, np.ma.MaskedArray):
        message = f"{name} must be a plain array, got a masked one; say what the masked elements are worth "
        raise SceneError(message + "with .filled(VALUE)")
    try:
        return np.asanyarray(value)
    except ValueError as error:
        message = f"{name} must be an array, got rows of different lengths; give every row the same length"
        raise SceneError(message) from error


def float_array(name: str, value: ArrayLike | None, shape: ShapeRule, *, limit: float = math.inf) -> Floats:
    """Return a read-only float64 copy of `value` after checking its shape and that it is finite.

    Raises
    ------
    SceneError
        If `value` is not numbers, has another shape than `shape`, holds NaN or infinity, or a number beyond
        `limit` on either side of 0.

    Examples
    --------
    >>> float_array("camera.eye", (1, 2, 3), (3,))
    array([1., 2., 3.])
    >>> float_array("camera.eye", (1, 2), (3,))
    Traceback (most recent call last):
    volref.errors.SceneError: camera.eye must have shape (3), got (2); give 3 numbers
    """
    try:
        array = np.array(plain_array(name, value), dtype=np.float64, order="C")
    except SceneError:
        raise
    except (TypeError, ValueError, OverflowError) as error:
        message = f"{name} must be numbers of shape {_spell(shape)}, got {type(value).__name__}; "
        raise SceneError(message + "give a list or an array of numbers") from error
    if not _shape_fits(array.shape, shape):
        cure = f"give {shape[0]} numbers" if len(shape) == 1 else "reshape it"
        message = f"{name} must have shape {_spell(shape)}, got {_spell(array.shape)}; {cure}"
        raise SceneError(message)
    finite = np.isfinite(array)
    if not finite.all():
        where = tuple(int(i) for i in np.argwhere(~finite)[0])
        message = f"{name} must be finite, got {array[where]} at index {_spell(where)}; "
        raise SceneError(message + "remove or replace it")
    if array.size and np.abs(array).max() > limit:
        message = f"{name} must lie within {limit:g} of 0, got {np.abs(array).max():g}; "
        raise SceneError(message + "rescale it")
    array.flags.writeable = False
    return array


def number(
    name: str, value: object, *, above: float = -math.inf, low: float = -math.inf, high: float = math.inf
) -> float:
    """Return `value` as a finite float with `above` < value, `low` <= value <= `high`.

    Raises
    ------
    SceneError
        If `value` is not one finite number, or lies outside the stated range.

    Examples
    --------
    >>> number("camera.near", 0.1, above=0)
    0.1
    >>> number("camera.near", 0, above=0)
    Traceback (most recent call last):
    volref.errors.SceneError: camera.near must be above 0, got 0; give a larger number
    """
    try:
        result = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError) as error:
        message = f"{name} must be a number, got {_short(value)}; give one finite number"
        raise SceneError(message) from error
    if not math.isfinite(result):
        message = f"{name} must be finite, got {result}; give one finite number"
        raise SceneError(message)
    if result <= above:
        message = f"{name} must be above {above:g}, got {result:g}; give a larger number"
        raise SceneError(message)
    if result < low:
        message = f"{name} must be at least {low:g}, got {result:g}; give a larger number"
        raise SceneError(message)
    if result > high:
        message = f"{name} must be at most {high:g}, got {result:g}; give a smaller number"
        raise SceneError(message)
    return result


def whole_number(name: str, value: object, *, low: int, high: int) -> int:
    """Return `value` as an int with `low` <= value <= `high`.

    Raises
    ------
    SceneError
        If `value` is not a whole number in that range.

    Examples
    --------
    >>> whole_number("scene.width", 0, low=1, high=65536)
    Traceback (most recent call last):
    volref.errors.SceneError: scene.width must be a whole number from 1 to 65536, got 0; change it
    """
    try:
        result = operator.index(value)  # type: ignore[arg-type]
    except TypeError:
        result = None
    if result is None or isinstance(value, bool) or not low <= result <= high:
        message = f"{name} must be a whole number from {low} to {high}, got {_short(value)}; change it"
        raise SceneError(message)
    return result


def one_of(name: str, value: object, choices: tuple[str, ...]) -> str:
    """Return `value` if it is one of the words in `choices`.

    Raises
    ------
    SceneError
        If it is not.

    Examples
    --------
    >>> one_of("volume.centering", "vertex", ("cell", "node"))
    Traceback (most recent call last):
    volref.errors.SceneError: volume.centering must be 'cell' or 'node', got 'vertex'; choose one
    """
    if not isinstance(value, str) or value not in choices:
        rule = " or ".join(repr(choice) for choice in choices)
        message = f"{name} must be {rule}, got {_short(value)}; choose one"
        raise SceneError(message)
    return value


def _short(value: object) -> str:
    """Return how a value is written, cut where nobody reads on."""
    words = f"10^{len(str(value)) - 1}" if _is_huge(value) else repr(value)
    return words if len(words) <= 60 else words[:57] + "..."


def _is_huge(value: object) -> bool:
    return isinstance(value, int) and abs(value) >= 10**18


def _shape_fits(shape: tuple[int, ...], rule: ShapeRule) -> bool:
    return len(shape) == len(rule) and all(
        isinstance(want, str) or have == want for have, want in zip(shape, rule, strict=True)
    )


def _spell(shape: ShapeRule | tuple[int, ...]) -> str:
    return "(" + ", ".join(str(length) for length in shape) + ")"
