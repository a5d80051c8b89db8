"""Weather radar: what an antenna measured on a stack of cones.

World: metres, x east, y north, z up; how beams run through it is told in `volref.scene.beams`.
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
    Vector,
    float_array,
    number,
    one_of,
    set_fields,
)
from volref.errors import SceneError
from volref.scene.beams import BEAMS, lowest_point, widest_ring, world_of_beam
from volref.scene.sweep import Sweep

# Reflectivity of clear air, as most radars code it.
CLEAR_DBZ = -32.0

# Sweeps closer than this (degrees) are one elevation scanned twice: antennas point no better than that.
SAME_ELEVATION = 0.05

# The search table has sweeps times radials entries.
MOST_SWEEPS = 200
MOST_ENTRIES = 2**24


@dataclass(frozen=True, eq=False, init=False)
class RadarVolume:
    """A scalar field given on the cones of a radar, interpolated along range, azimuth and elevation.

    There is something to see between the lowest and the highest sweep, from the first to the last gate of
    both sweeps around a point.  Nothing is seen above (the cone of silence), below and beyond them, nor
    where a gate that contributes to the value has no data.

    Of its own it knows `value_bounds`, the least and greatest value, that of no echo among them: every
    interpolated value lies between.

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
    value_bounds: tuple[float, float]
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
        least, greatest, silent = _found_values(kept)
        if no_echo is not None:
            no_echo = number("radar.no_echo", no_echo, low=-1e300, high=1e300)
        elif units == "dBZ":
            no_echo = min(CLEAR_DBZ, least)
        if silent and no_echo is not None:
            least, greatest = min(least, no_echo), max(greatest, no_echo)
        if least > greatest:
            message = "radar.sweeps must hold a gate with data, got none; check the codes for no data"
            raise SceneError(message)
        set_fields(
            self,
            sweeps=kept,
            no_echo=no_echo,
            beam=one_of("radar.beam", beam, BEAMS),
            origin=tuple(float_array("radar.origin", origin, (3,), limit=LARGEST_LENGTH).tolist()),
            site=None if site is None else _checked_site(site),
            time=None if time is None else _checked_time(time),
            quantity=_word("radar.quantity", quantity),
            units=_word("radar.units", units),
            value_bounds=(least, greatest),
            dropped=dropped,
        )

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


def _found_values(sweeps: tuple[Sweep, ...]) -> tuple[float, float, bool]:
    """Return the least and greatest finite value (inf, -inf: none) and whether a gate has no echo."""
    low, high, silent = np.inf, -np.inf, False
    for sweep in sweeps:
        found = sweep.values[np.isfinite(sweep.values)]
        if found.size:
            low, high = min(low, float(found.min())), max(high, float(found.max()))
        silent = silent or bool(np.isneginf(sweep.values).any())
    return low, high, silent


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
