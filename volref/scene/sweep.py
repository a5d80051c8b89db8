"""One sweep of a weather radar: the gates on a cone, in polar coordinates.

Gate j of a radial is measured at its middle, first_gate + j gate_spacing from the antenna, and reaches half a
gate to both sides.  With first_gate 125 and spacing 250:

    |--0--|--1--|--2--|    centres at 125, 375, 625 m
    0    250   500   750   what is seen: 0 to 750 m, constant beyond the outer centres

A gate without data (never measured, blocked, folded) is not a gate without echo (measured, nothing there).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from volref.arrays import Floats, Numbers, float_array, number, plain_array, set_fields
from volref.errors import SceneError
from volref.scene.beams import LARGEST_RANGE


@dataclass(frozen=True, eq=False, init=False)
class Sweep:
    """One turn of the antenna: R radials of G gates.

    Parameters
    ----------
    azimuths
        Directions (R,) of the radials' centres, degrees clockwise from north, in any order.  Kept sorted
        in 0 to 360; of radials with one azimuth the first is kept.
    elevations
        Degrees above the horizon, one number or one per radial (R,).
    values
        Array (R, G) of float32 or float64.  NaN: no data.  -inf: measured, no echo.
    first_gate
        Distance of the centre of gate 0 from the antenna, metres.
    gate_spacing
        Distance between the centres of neighbouring gates, metres.

    Raises
    ------
    SceneError
        If a field breaks one of these rules.

    Examples
    --------
    >>> sweep = Sweep((270, 90), 0.5, np.array([[1.0, -np.inf], [2.0, np.nan]]), 125, 250)
    >>> sweep.azimuths.tolist(), sweep.values.tolist(), sweep.last_range
    ([90.0, 270.0], [[2.0, nan], [1.0, -inf]], 500.0)
    """

    azimuths: Floats
    elevations: Floats
    values: Numbers
    first_gate: float
    gate_spacing: float

    def __init__(
        self,
        azimuths: ArrayLike,
        elevations: ArrayLike,
        values: Numbers,
        first_gate: float,
        gate_spacing: float,
    ) -> None:
        gates = _checked_gates(values)
        radials = len(gates)
        turned = float_array("sweep.azimuths", azimuths, (radials,), limit=1e6) % 360.0
        turned[turned >= 360.0] = 0.0
        tilts = (
            np.broadcast_to(np.asarray(elevations), (radials,)) if np.ndim(elevations) == 0 else elevations
        )
        tilted = float_array("sweep.elevations", tilts, (radials,), limit=90.0)
        azimuth, order = np.unique(turned, return_index=True)
        spacing = number("sweep.gate_spacing", gate_spacing, low=1e-3, high=LARGEST_RANGE)
        set_fields(
            self,
            azimuths=_frozen(azimuth),
            elevations=_frozen(tilted[order]),
            values=_frozen(gates[order]),
            first_gate=number("sweep.first_gate", first_gate, low=-spacing, high=LARGEST_RANGE),
            gate_spacing=spacing,
        )
        if self.last_range <= 0 or self.last_range > LARGEST_RANGE:
            message = f"sweep.values must end between 0 and {LARGEST_RANGE:g} m, got {self.last_range:g} m; "
            raise SceneError(message + "give first_gate and gate_spacing in metres")

    @classmethod
    def from_codes(
        cls,
        codes: Numbers,
        gain: float,
        offset: float,
        azimuths: ArrayLike,
        elevations: ArrayLike,
        first_gate: float,
        gate_spacing: float,
        *,
        undetect: float | None = None,
        nodata: float | Sequence[float] | None = None,
    ) -> "Sweep":
        """Sweep of coded gates (R, G): value = gain code + offset.

        undetect: the code of a gate without echo.  nodata: the code, or codes, of a gate without data (a
        folded echo, whose place is not known, is one); it comes first where both are the same number.

        Examples
        --------
        >>> codes = np.array([[0, 84, 255]], np.uint8)
        >>> Sweep.from_codes(codes, 0.5, -32, [0], 0.5, 125, 250, undetect=0, nodata=255).values.tolist()
        [[-inf, 10.0, nan]]
        """
        array = plain_array("sweep.codes", codes)
        if array.dtype.kind not in "iuf":
            message = f"sweep.codes must be integers or real numbers, got {array.dtype}; convert them"
            raise SceneError(message)
        scale, shift = number("sweep.gain", gain), number("sweep.offset", offset)
        with np.errstate(over="ignore", invalid="ignore"):
            values = np.asarray(array.astype(np.float64) * scale + shift)
        if undetect is not None:
            values[array == undetect] = -np.inf
        if nodata is not None:
            values[np.isin(array, np.atleast_1d(np.asarray(nodata)))] = np.nan
        # Codes of half decibels are exact in float32, at half the memory.
        narrow = values.astype(np.float32) if array.dtype.itemsize <= 2 else values
        exact = np.array_equal(narrow, values, equal_nan=True)
        return cls(azimuths, elevations, narrow if exact else values, first_gate, gate_spacing)

    @cached_property
    def elevation(self) -> float:
        """Median of the radials' elevations: a few radials at the start may still be on their way."""
        return float(np.median(self.elevations))

    @property
    def last_range(self) -> float:
        """Where the last gate ends, half a gate beyond its centre, metres."""
        return self.first_gate + (int(self.values.shape[1]) - 0.5) * self.gate_spacing


def _checked_gates(values: Numbers) -> Numbers:
    array = plain_array("sweep.values", values).view(np.ndarray)
    if array.ndim != 2 or min(array.shape) < 1:
        message = f"sweep.values must have shape (radials, gates), each at least 1, got {array.shape}; "
        raise SceneError(message + "give one sweep, radials first")
    if array.dtype not in (np.float32, np.float64):
        message = f"sweep.values must be float32 or float64, got {array.dtype}; "
        raise SceneError(message + "use Sweep.from_codes for codes")
    found = array[np.isfinite(array)]
    if np.isposinf(array).any() or (found.size and float(np.abs(found).max()) > 1e300):
        message = "sweep.values must be below 1e300, NaN (no data) or -inf (no echo), got a larger one; "
        raise SceneError(message + "replace it")
    return array


def _frozen(array: Numbers) -> Numbers:
    array.flags.writeable = False
    return array
