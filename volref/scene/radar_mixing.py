"""Two radar volumes of one scan, mixed in time."""

from datetime import datetime

import numpy as np

from volref.arrays import Numbers, number
from volref.errors import SceneError
from volref.scene.radar import RadarVolume
from volref.scene.sweep import Sweep


def between(first: RadarVolume, second: RadarVolume, share: float) -> RadarVolume:
    """Radar volume whose gates are (1 - share) `first` + share `second`.

    Without an echo in one of them a gate takes that one's `no_echo`; without in both it has none.  Without
    data in one that counts it has none.  An echo that moves fades out in one place and in in another: it does
    not move.

    Raises
    ------
    SceneError
        If their gates lie in different places or measure different things, or `share` is not in 0 to 1.

    Examples
    --------
    >>> dry, wet = (RadarVolume([Sweep([0], 1, np.full((1, 1), v), 500, 1000)]) for v in (-np.inf, 8.0))
    >>> between(dry, wet, 0.25).sweeps[0].values.tolist()
    [[-22.0]]
    """
    weight = number("share", share, low=0, high=1)
    _check_alike(first, second)
    if weight == 0:
        return first
    if weight == 1:
        return second
    sweeps = [
        Sweep(
            one.azimuths,
            one.elevations,
            _mixed_gates(one.values, other.values, weight, first.no_echo, second.no_echo),
            one.first_gate,
            one.gate_spacing,
        )
        for one, other in zip(first.sweeps, second.sweeps, strict=True)
    ]
    floors = (first.no_echo, second.no_echo)
    return RadarVolume(
        sweeps,
        no_echo=None if floors[0] is None or floors[1] is None else _mix(floors[0], floors[1], weight),
        beam=first.beam,
        origin=first.origin,
        site=first.site,
        time=_time_between(first.time, second.time, weight),
        quantity=first.quantity,
        units=first.units,
    )


def _mix(first: float, second: float, weight: float) -> float:
    return first + weight * (second - first)


def _mixed_gates(
    first: Numbers, second: Numbers, weight: float, first_floor: float | None, second_floor: float | None
) -> Numbers:
    floors = [np.nan if floor is None else floor for floor in (first_floor, second_floor)]
    silent = [np.isneginf(values) for values in (first, second)]
    known = [
        np.where(quiet, floor, values.astype(np.float64))
        for values, quiet, floor in zip((first, second), silent, floors, strict=True)
    ]
    mixed = known[0] + weight * (known[1] - known[0])
    mixed[silent[0] & silent[1]] = -np.inf
    return mixed


def _check_alike(first: RadarVolume, second: RadarVolume) -> None:
    for name in ("beam", "origin", "quantity", "units"):
        one, other = getattr(first, name), getattr(second, name)
        if one != other:
            message = f"radars must have the same {name} to be mixed, got {one} and {other}; change one"
            raise SceneError(message)
    for i, (one, other) in enumerate(zip(first.sweeps, second.sweeps, strict=False)):
        if not _lie_alike(one, other):
            message = f"radars must have the same gates to be mixed, got others in sweep {i}; "
            raise SceneError(message + "resample both to one grid")
    if len(first.sweeps) != len(second.sweeps):
        message = "radars must have as many sweeps to be mixed, got "
        raise SceneError(message + f"{len(first.sweeps)} and {len(second.sweeps)}; leave some out")


def _lie_alike(first: Sweep, second: Sweep) -> bool:
    return (
        first.values.shape == second.values.shape
        and (first.first_gate, first.gate_spacing) == (second.first_gate, second.gate_spacing)
        and np.array_equal(first.azimuths, second.azimuths)
        and np.array_equal(first.elevations, second.elevations)
    )


def _time_between(first: str | None, second: str | None, weight: float) -> str | None:
    if first is None or second is None:
        return None
    start, end = datetime.fromisoformat(first), datetime.fromisoformat(second)
    if (start.tzinfo is None) != (end.tzinfo is None):
        return None
    return (start + weight * (end - start)).isoformat()
