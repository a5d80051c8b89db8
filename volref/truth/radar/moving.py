"""Storms in motion, made up from one radar volume: its echoes carried along by a steady wind."""

from collections.abc import Sequence
from datetime import datetime, timedelta

import numpy as np
from numpy.typing import ArrayLike

from volref.arrays import Floats, float_array
from volref.scene.beams import beam_of_world, world_of_beam
from volref.scene.radar import RadarVolume
from volref.scene.sweep import Sweep
from volref.stages.polar import RadarTable, beam_lookup, radar_table, sweep_elevation

# Faster than any storm, m/s, and longer than a year, s.
LARGEST_SPEED = 1_000.0
LARGEST_TIME = 1e8


def moving(radar: RadarVolume, times: Sequence[float], velocity: ArrayLike) -> list[RadarVolume]:
    """Radar volumes at `times` (s) of the echoes of `radar` carried along with `velocity` (m/s).

    The value at a point p at time t is that of `radar` at p - velocity t, measured at the gates of `radar`.
    Where the radar did not look, above and below its sweeps, the value of the outer sweep is taken, so that
    the cone of silence does not drift; beyond its range there are no data.

    Parameters
    ----------
    radar
        The radar volume at time 0.
    times
        When, seconds.
    velocity
        East and north, or east, north and up, m/s.

    Raises
    ------
    SceneError
        If a number is not finite, or too large.
    """
    wind = np.zeros(3)
    given = np.asarray(velocity)
    wind[: given.size] = float_array(
        "velocity", velocity, (2 if given.size == 2 else 3,), limit=LARGEST_SPEED
    )
    moments = float_array("times", times, ("T",), limit=LARGEST_TIME)
    table = radar_table(radar)
    return [_carried(radar, table, time, wind * time) for time in moments.tolist()]


def _carried(radar: RadarVolume, table: RadarTable, time: float, shift: Floats) -> RadarVolume:
    sweeps = radar.sweeps if not shift.any() else tuple(_moved(radar, table, s, shift) for s in radar.sweeps)
    said = None
    if radar.time is not None:
        said = (datetime.fromisoformat(radar.time) + timedelta(seconds=time)).isoformat()
    return RadarVolume(
        sweeps,
        no_echo=radar.no_echo,
        beam=radar.beam,
        origin=radar.origin,
        site=radar.site,
        time=said,
        quantity=radar.quantity,
        units=radar.units,
    )


def _moved(radar: RadarVolume, table: RadarTable, sweep: Sweep, shift: Floats) -> Sweep:
    radials, gates = sweep.values.shape
    slant = np.maximum(sweep.first_gate + np.arange(gates) * sweep.gate_spacing, 0.0)
    values = np.empty((radials, gates))
    # Radial by radial would be slow, all at once would need much memory.
    for first in range(0, radials, 64):
        part = slice(first, first + 64)
        azimuth, elevation = sweep.azimuths[part, None], sweep.elevations[part, None]
        x, y, z = np.broadcast_arrays(*world_of_beam(slant, azimuth, elevation, radar.beam))
        before = beam_of_world(x - shift[0], y - shift[1], z - shift[2], radar.beam)
        values[part] = _held_lookup(table, *(axis.reshape(-1) for axis in before)).reshape(-1, gates)
    if radar.no_echo is not None:
        values[values == radar.no_echo] = -np.inf
    return Sweep(sweep.azimuths, sweep.elevations, values, sweep.first_gate, sweep.gate_spacing)


def _held_lookup(table: RadarTable, slant: Floats, azimuth: Floats, elevation: Floats) -> Floats:
    """Return the values (n,) at points of beams, those above and below all sweeps held to the outer ones."""
    lowest = sweep_elevation(table, 0, azimuth)
    highest = sweep_elevation(table, len(table.last) - 1, azimuth)
    return beam_lookup(table, slant, azimuth, np.clip(elevation, lowest, highest))
