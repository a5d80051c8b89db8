"""A field that changes in time: volumes, and when each was measured."""

import bisect
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from volref.arrays import Floats, float_array, number, one_of, set_fields
from volref.errors import SceneError
from volref.scene.radar import RadarVolume
from volref.scene.radar_mixing import between
from volref.scene.volume import Volume

INTERPOLATIONS = ("nearest", "linear")

# Some 400 years in seconds: neighbouring float64 are a microsecond apart at most there.
LARGEST_TIME = 2.0**34

Frame: TypeAlias = Volume | RadarVolume


@dataclass(frozen=True, eq=False, init=False)
class Series:
    """Volumes of one field at rising times.

    Parameters
    ----------
    volumes
        Each a `Volume` or a `RadarVolume`, all of one kind, or a function without arguments that returns it
        and is called whenever it is needed: a long series need not be in memory.  See `volref.load_series`.
    times
        When each holds, in seconds, strictly rising.

    Raises
    ------
    SceneError
        If the times do not rise, or there are not as many as volumes.

    Examples
    --------
    >>> dry, wet = Volume(np.zeros((2, 2, 2))), Volume(np.full((2, 2, 2), 8.0))
    >>> series = Series([dry, wet], times=[0, 600])
    >>> float(series.at(150, "linear").values[0, 0, 0]), series.at(150) is dry
    (2.0, True)
    """

    volumes: tuple[Frame | Callable[[], Frame], ...]
    times: Floats

    def __init__(self, volumes: Sequence[Frame | Callable[[], Frame]], times: ArrayLike) -> None:
        if not isinstance(volumes, Sequence) or not volumes:
            message = f"series.volumes must be a list of volumes, got {type(volumes).__name__} "
            raise SceneError(message + "without any; give at least one")
        for i, volume in enumerate(volumes):
            if not callable(volume):
                _check_kind(i, volume)
        rising = float_array("series.times", times, (len(volumes),), limit=LARGEST_TIME)
        if not (np.diff(rising) > 0).all():
            i = int(np.argmin(np.diff(rising) > 0))
            message = f"series.times must rise, got {rising[i]:g} before {rising[i + 1]:g} at index {i}; "
            raise SceneError(message + "sort volumes and times, and leave out doubles")
        set_fields(self, volumes=tuple(volumes), times=rising)

    def at(self, time: float, interpolation: str = "nearest") -> Frame:
        """Return the field at a time between the first and the last.

        "nearest": the volume nearest in time, halfway the earlier one.  "linear": each voxel mixed linearly
        between the two volumes around, in float64, and each gate of radars as
        `volref.scene.radar_mixing.between` has it; at the time of a volume that volume itself.  A pattern
        that moves fades out here and in there under it, and does not move.

        Raises
        ------
        SceneError
            If the time lies outside, or "linear" is asked of volumes that lie in different places.
        """
        one_of("interpolation", interpolation, INTERPOLATIONS)
        moment = self.checked_time(time)
        after = min(bisect.bisect_left(self.times, moment), len(self.times) - 1)
        if self.times[after] == moment:
            return self._volume(after)
        first, second = float(self.times[after - 1]), float(self.times[after])
        if interpolation == "nearest":
            return self._volume(after - (moment - first <= second - moment))
        weight = (moment - first) / (second - first)
        return mixed(self._volume(after - 1), self._volume(after), weight)

    def checked_time(self, time: float) -> float:
        """Return a time after checking that the series spans it."""
        return number("time", time, low=float(self.times[0]), high=float(self.times[-1]))

    def _volume(self, i: int) -> Frame:
        given = self.volumes[i]
        volume = given() if callable(given) else given
        _check_kind(i, volume)
        return volume


def mixed(first: Frame, second: Frame, weight: float) -> Frame:
    """Return the volume of (1 - weight) first + weight second, in float64; radars gate by gate.

    Raises
    ------
    SceneError
        If they have different sizes, lie in different places, or one is a radar and the other is not.

    Examples
    --------
    >>> dark, bright = (Volume(np.full((1, 1, 2), value, np.uint8)) for value in (0, 200))
    >>> mixed(dark, bright, 0.25).values.tolist()
    [[[50.0, 50.0]]]
    """
    if isinstance(first, RadarVolume) and isinstance(second, RadarVolume):
        return between(first, second, weight)
    if isinstance(first, RadarVolume) or isinstance(second, RadarVolume):
        message = "series.volumes must be of one kind to be mixed, got a box and a radar; "
        raise SceneError(message + "use interpolation='nearest'")
    if first.values.shape != second.values.shape or _place(first) != _place(second):
        message = f"series.volumes must lie in one place to be mixed, got {_spelled(first)} and "
        raise SceneError(message + f"{_spelled(second)}; resample them, or use interpolation='nearest'")
    values = first.values * (1.0 - weight) + second.values * float(weight)
    return Volume(
        values.astype(np.float64, copy=False), first.spacing, first.origin, first.direction, first.centering
    )


def _check_kind(i: int, volume: object) -> None:
    if isinstance(volume, Volume | RadarVolume):
        return
    message = f"series.volumes[{i}] must be a volref.Volume or a volref.RadarVolume, got "
    raise SceneError(message + f"{type(volume).__name__}; build or load it first")


def _place(volume: Volume) -> tuple[object, ...]:
    return volume.spacing, volume.origin, volume.direction.tolist(), volume.centering


def _spelled(volume: Volume) -> str:
    size, spacing, origin = (
        " x ".join(f"{n:g}" for n in part) for part in (volume.size, volume.spacing, volume.origin)
    )
    return f"{size} of {spacing} at {origin}"
