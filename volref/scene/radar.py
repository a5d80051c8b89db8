"""Weather radar: sweeps of an antenna, each on a cone, in polar coordinates.

World: metres, x east, y north, z up.  Gate j of a radial is measured at its middle, first_gate + j
gate_spacing from the antenna, and reaches half a gate to both sides.  With first_gate 125 and spacing 250:

    |--0--|--1--|--2--|    centres at 125, 375, 625 m
    0    250   500   750   what is seen: 0 to 750 m, constant beyond the outer centres

A gate without data (never measured, blocked, folded) is not a gate without echo (measured, nothing there).
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from volref.arrays import (
    LARGEST_LENGTH,
    Floats,
    Numbers,
    Vector,
    float_array,
    number,
    one_of,
    plain_array,
    set_fields,
)
from volref.errors import SceneError
from volref.scene.beams import BEAMS, LARGEST_RANGE, lowest_point, widest_ring, world_of_beam

# Reflectivity of clear air, as most radars code it.
CLEAR_DBZ = -32.0

# Sweeps closer than this (degrees) are one elevation scanned twice: antennas point no better than that.
SAME_ELEVATION = 0.05

# The search table has sweeps times radials entries.
MOST_SWEEPS = 200
MOST_ENTRIES = 2**24


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


@dataclass(frozen=True, eq=False, init=False)
class RadarVolume:
    """A scalar field given on the cones of a radar, interpolated along range, azimuth and elevation.

    There is something to see between the lowest and the highest sweep, from the first to the last gate of
    both sweeps around a point.  Nothing is seen above (the cone of silence), below and beyond them, nor
    where a gate that contributes to the value has no data.

    Parameters
    ----------
    sweeps
        Kept sorted by elevation.  Of several at one elevation (split cuts; within 0.05 degrees) the one
        given first is kept; `dropped` holds the places of the others in the list given.
    no_echo
        What a gate without echo is worth when it is interpolated.  None: the lower of -32 and the least
        value if `units` is "dBZ"; else such gates have no data, for a velocity has no floor.
    beam
        "straight" or "4/3-earth", see `volref.scene.beams`.
    origin
        World position (x, y, z) of the antenna, metres.
    site
        Latitude, longitude (degrees) and height (m) of the antenna, or None.
    time
        When it was measured, ISO 8601, or None.
    quantity, units
        What was measured, in ODIM's words, as "DBZH" and "dBZ".

    Raises
    ------
    SceneError
        If a field breaks one of these rules.

    Examples
    --------
    >>> sweeps = [Sweep([0], e, np.array([[-np.inf, 10.0]]), 500, 1000) for e in (5, 0)]
    >>> radar = RadarVolume(sweeps)
    >>> [sweep.elevation for sweep in radar.sweeps], radar.value_bounds, radar.gate_length
    ([0.0, 5.0], (-32.0, 10.0), 1000.0)
    """

    sweeps: tuple[Sweep, ...]
    no_echo: float | None
    beam: str
    origin: Vector
    site: Vector | None
    time: str | None
    quantity: str
    units: str
    dropped: tuple[int, ...]

    def __init__(
        self,
        sweeps: Sequence[Sweep],
        *,
        no_echo: float | None = None,
        beam: str = "straight",
        origin: ArrayLike = (0.0, 0.0, 0.0),
        site: ArrayLike | None = None,
        time: str | None = None,
        quantity: str = "DBZH",
        units: str = "dBZ",
    ) -> None:
        kept, dropped = _sorted_sweeps(sweeps)
        set_fields(
            self,
            sweeps=kept,
            no_echo=None if no_echo is None else number("radar.no_echo", no_echo, low=-1e300, high=1e300),
            beam=one_of("radar.beam", beam, BEAMS),
            origin=tuple(float_array("radar.origin", origin, (3,), limit=LARGEST_LENGTH).tolist()),
            site=None if site is None else _checked_site(site),
            time=None if time is None else _checked_time(time),
            quantity=_word("radar.quantity", quantity),
            units=_word("radar.units", units),
            dropped=dropped,
        )
        bounds, silent = _found_bounds(kept)
        if no_echo is None and units == "dBZ":
            set_fields(self, no_echo=min(CLEAR_DBZ, bounds[0]))
        if silent and self.no_echo is not None:
            bounds = min(bounds[0], self.no_echo), max(bounds[1], self.no_echo)
        if bounds[0] > bounds[1]:
            message = "radar.sweeps must hold a gate with data, got none; check the codes for no data"
            raise SceneError(message)
        set_fields(self, _bounds=bounds)

    @property
    def value_bounds(self) -> tuple[float, float]:
        """Least and greatest value, that of no echo among them; every interpolated value lies between."""
        bounds: tuple[float, float] = self.__dict__["_bounds"]
        return bounds

    @cached_property
    def gate_length(self) -> float:
        """Least distance between neighbouring gates, metres: what a step along a viewing ray goes by."""
        return min(sweep.gate_spacing for sweep in self.sweeps)

    @cached_property
    def box(self) -> tuple[Floats, Floats]:
        """Lowest and highest corner (3,) of the world box around all that can be seen."""
        farthest = max(sweep.last_range for sweep in self.sweeps)
        places = [_outermost(sweep, self.beam) for sweep in self.sweeps]
        reach = max(float(y.max()) for _, y, _ in places)
        if self.sweeps[0].elevations.min() < 0:
            # The widest ring may lie between two sweeps, at the horizon or a little below.
            reach = max(reach, widest_ring(farthest, self.beam))
        # A part in 10^9 more: the points on the outermost cone are rounded.
        slack = 1e-9 * farthest
        low = min(float(z.min()) for _, _, z in places) - slack
        high = max(float(z.max()) for _, _, z in places) + slack
        side = reach + slack
        antenna = np.array(self.origin)
        return antenna + np.array((-side, -side, low)), antenna + np.array((side, side, high))


def _outermost(sweep: Sweep, beam: str) -> tuple[Floats, Floats, Floats]:
    """Return points (3, E) on a sweep's radials, turned to the north, among them the farthest and lowest."""
    tilts = np.unique(sweep.elevations)
    first = max(sweep.first_gate - 0.5 * sweep.gate_spacing, 0.0)
    lowest = np.clip(lowest_point(tilts), first, sweep.last_range)
    ranges = np.stack((np.full_like(tilts, first), lowest, np.full_like(tilts, sweep.last_range)))
    return world_of_beam(ranges, np.array(0.0), tilts, beam)


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


def _sorted_sweeps(sweeps: Sequence[Sweep]) -> tuple[tuple[Sweep, ...], tuple[int, ...]]:
    """Return the sweeps to keep, from the lowest up, and the places of the others."""
    given = tuple(sweeps) if isinstance(sweeps, Sequence) else ()
    if not given or len(given) > MOST_SWEEPS or not all(isinstance(sweep, Sweep) for sweep in given):
        message = f"radar.sweeps must be 1 to {MOST_SWEEPS} sweeps, got "
        got = f"{len(given)}" if isinstance(sweeps, Sequence) else type(sweeps).__name__
        raise SceneError(message + f"{got}; give a list of vr.Sweep")
    kept: list[int] = []
    for i in sorted(range(len(given)), key=lambda i: given[i].elevation):
        if kept and given[i].elevation - given[kept[-1]].elevation < SAME_ELEVATION:
            kept[-1] = min(kept[-1], i)
        else:
            kept.append(i)
    for low, high in itertools.pairwise(kept):
        _refuse_crossing(given[low], given[high])
    radials = sum(len(given[i].azimuths) for i in kept)
    if radials * len(kept) > MOST_ENTRIES:
        message = f"radar.sweeps must have sweeps x radials of at most {MOST_ENTRIES}, got {len(kept)} x "
        raise SceneError(message + f"{radials}; give fewer sweeps")
    return tuple(given[i] for i in kept), tuple(i for i in range(len(given)) if i not in kept)


def _refuse_crossing(low: Sweep, high: Sweep) -> None:
    at = np.union1d(low.azimuths, high.azimuths)
    below, above = (np.interp(at, sweep.azimuths, sweep.elevations, period=360.0) for sweep in (low, high))
    if (below < above).all():
        return
    k = int((above - below).argmin())
    message = f"radar.sweeps must not cross, got {below[k]:g} and {above[k]:g} degrees at azimuth {at[k]:g} "
    message += f"of the sweeps at {low.elevation:g} and {high.elevation:g}; "
    raise SceneError(message + "give each sweep one elevation, or leave out the radials on their way")


def _found_bounds(sweeps: tuple[Sweep, ...]) -> tuple[tuple[float, float], bool]:
    """Return the least and greatest finite value (inf, -inf: none) and whether a gate has no echo."""
    low, high, silent = np.inf, -np.inf, False
    for sweep in sweeps:
        found = sweep.values[np.isfinite(sweep.values)]
        if found.size:
            low, high = min(low, float(found.min())), max(high, float(found.max()))
        silent = silent or bool(np.isneginf(sweep.values).any())
    return (low, high), silent


def _checked_site(site: ArrayLike) -> Vector:
    latitude, longitude, height = float_array("radar.site", site, (3,), limit=LARGEST_LENGTH).tolist()
    return (
        number("radar.site latitude", latitude, low=-90, high=90),
        number("radar.site longitude", longitude, low=-360, high=360),
        height,
    )


def _checked_time(time: str) -> str:
    try:
        datetime.fromisoformat(time)
    except (TypeError, ValueError) as error:
        message = f"radar.time must be a date and time in ISO 8601, got {str(time)[:60]!r}; "
        raise SceneError(message + "write it as in '2011-06-10T11:40:00+00:00'") from error
    return time


def _word(name: str, value: object) -> str:
    if isinstance(value, str) and value.isprintable() and len(value) <= 60:
        return value
    message = f"{name} must be a short word, got {str(value)[:60]!r}; name it as in 'DBZH' and 'dBZ'"
    raise SceneError(message)


def _frozen(array: Numbers) -> Numbers:
    array.flags.writeable = False
    return array
