"""Stage 3 of a radar: the value of its field at world points, by interpolation in polar coordinates.

n points; S sweeps; M azimuths at which some sweep has a radial; K radials of all sweeps, one after the other.

The order is that of Congote et al., Volume Ray Casting in WebGL (2012), section 4: search over the
elevations, then interpolation within each of the two sweeps around the point, along range and azimuth,
then between the two.  Each sweep's elevation is that of its own radials at the point's azimuth.

    sweep s + 1   a---b          along range: a to b and c to d; along azimuth: the two results;
                 c---d           the same in sweep s; along elevation: the two results of that
    point       x

What contributes with weight 0 does not count: on a sweep only that sweep matters, at the centre of a gate
only that gate.
"""

from dataclasses import dataclass
from weakref import WeakKeyDictionary

import numpy as np

from volref.arrays import Booleans, Floats, Indices, Integers, Numbers
from volref.scene.beams import beam_of_world
from volref.scene.radar import RadarVolume
from volref.scene.sweep import Sweep

# A point this near to a gate's centre, a radial or a sweep (in gates, shares and degrees) lies on it: its
# polar coordinates are rounded in the 12th digit.
ON = 1e-9

# Radials farther apart than this times their sweep's median have nothing between them: one is missing.
WIDEST_GAP = 1.75


@dataclass(frozen=True, eq=False)
class RadarTable:
    """A radar laid out for look-ups.

    knots (M,): all azimuths, degrees.  radial (M, S): the radial of sweep s at or before knot m.
    Of the radials (K,): azimuth, elevation (degrees), `share`, 1 / the angle to the next one (0 if too
    wide), `following`, the next one of the same sweep, and `start`, its first gate in `gates`.
    Of the sweeps (S,): first_gate, gate_spacing (m), last, the index of the last gate, and `level`,
    the elevation if all sweeps have one elevation each, else None.
    gates: all values, NaN where a gate has no data.
    """

    beam: str
    origin: tuple[float, float, float]
    bounds: tuple[float, float]
    knots: Floats
    radial: Integers
    azimuth: Floats
    elevation: Floats
    share: Floats
    following: Indices
    start: Indices
    first_gate: Floats
    gate_spacing: Floats
    last: Indices
    level: Floats | None
    gates: Numbers


_kept: WeakKeyDictionary[RadarVolume, RadarTable] = WeakKeyDictionary()


def radar_table(radar: RadarVolume) -> RadarTable:
    """Return the look-up form of a radar, made once for each."""
    if radar not in _kept:
        _kept[radar] = _new_table(radar)
    return _kept[radar]


def _new_table(radar: RadarVolume) -> RadarTable:
    sweeps = radar.sweeps
    counts = [len(sweep.azimuths) for sweep in sweeps]
    first = np.concatenate(([0], np.cumsum(counts)))
    knots = np.unique(np.concatenate([sweep.azimuths for sweep in sweeps]))
    gates = [sweep.values.shape[1] for sweep in sweeps]
    lengths = np.repeat(gates, counts)
    # Before a sweep's first radial comes its last one: index -1.
    radial = [
        first[s] + (np.searchsorted(sweep.azimuths, knots, side="right") - 1) % counts[s]
        for s, sweep in enumerate(sweeps)
    ]
    level = all(np.ptp(sweep.elevations) == 0 for sweep in sweeps)
    return RadarTable(
        beam=radar.beam,
        origin=radar.origin,
        bounds=radar.value_bounds,
        knots=knots,
        radial=np.stack(radial, axis=1),
        azimuth=np.concatenate([sweep.azimuths for sweep in sweeps]),
        elevation=np.concatenate([sweep.elevations for sweep in sweeps]),
        share=np.concatenate([_share_of_radials(sweep) for sweep in sweeps]),
        following=np.concatenate([first[s] + np.roll(np.arange(n), -1) for s, n in enumerate(counts)]),
        start=np.concatenate(([0], np.cumsum(lengths)[:-1])).astype(np.intp),
        first_gate=np.array([sweep.first_gate for sweep in sweeps]),
        gate_spacing=np.array([sweep.gate_spacing for sweep in sweeps]),
        last=np.array(gates, dtype=np.intp) - 1,
        level=np.array([sweep.elevations[0] for sweep in sweeps]) if level else None,
        gates=_joined_gates(radar),
    )


def _share_of_radials(sweep: Sweep) -> Floats:
    """Return 1 / the angle (R,) from each radial to the next, 0 where that is too wide to look across."""
    angle = np.diff(sweep.azimuths, append=sweep.azimuths[0] + 360.0)
    return np.where(angle > WIDEST_GAP * np.median(angle), 0.0, 1 / angle)


def _joined_gates(radar: RadarVolume) -> Numbers:
    joined = np.concatenate([sweep.values.reshape(-1) for sweep in radar.sweeps])
    joined[np.isneginf(joined)] = np.nan if radar.no_echo is None else radar.no_echo
    return joined


def polar_lookup(table: RadarTable, points: Floats) -> tuple[Floats, Booleans]:
    """Return the value (n,) at world points (3, n), NaN where there is nothing, and where there is something.

    The values lie within the radar's `value_bounds`; the error of the interpolation is a few ulp of the
    larger of these.
    """
    x, y, z = (points[axis] - table.origin[axis] for axis in range(3))
    if table.beam != "straight":
        values = beam_lookup(table, *beam_of_world(x, y, z, table.beam))
        return values, ~np.isnan(values)
    values = np.full(len(x), np.nan)
    near = _perhaps_seen(table, x, y, z)
    if near.size:
        values[near] = _values_at(table, *beam_of_world(x[near], y[near], z[near], table.beam))
    return values, ~np.isnan(values)


def beam_lookup(table: RadarTable, slant: Floats, azimuth: Floats, elevation: Floats) -> Floats:
    """Return the value (n,) at slant ranges (m), azimuths (0 to 360) and elevations (degrees), else NaN."""
    near = np.flatnonzero(_within_reach(table, slant, elevation))
    if near.size == len(slant):
        return _values_at(table, slant, azimuth, elevation)
    values = np.full(len(slant), np.nan)
    if near.size:
        values[near] = _values_at(table, slant[near], azimuth[near], elevation[near])
    return values


def sweep_lookup(
    table: RadarTable, sweep: int, slant: Floats, azimuth: Floats, *, nearest: bool = False
) -> Floats:
    """Return the value (n,) on one sweep at slant ranges and azimuths (0 to 360), NaN if there is none.

    nearest: that of the gate around the point, as it was measured, in place of the interpolated one.
    """
    azimuth, knot = _folded(table, azimuth)
    return _in_sweep(table, np.full(len(slant), sweep), knot, slant, azimuth, nearest=nearest)[0]


def sweep_elevation(table: RadarTable, sweep: int, azimuth: Floats) -> Floats:
    """Return the elevation (n,) of one sweep at azimuths (0 to 360), degrees."""
    azimuth, knot = _folded(table, azimuth)
    return _around(table, table.radial[knot, sweep], azimuth)[2]


def _folded(table: RadarTable, azimuth: Floats) -> tuple[Floats, Indices]:
    """Return azimuths (n,) below 360, and the knot at or before each, -1 for the last."""
    azimuth = np.where(azimuth > 360.0 - ON, 0.0, azimuth)
    return azimuth, np.searchsorted(table.knots, azimuth + ON, side="right") - 1


def _perhaps_seen(table: RadarTable, x: Floats, y: Floats, z: Floats) -> Indices:
    """Return which points are not beyond all sweeps of straight beams; angles cost more than all the rest."""
    slant = np.sqrt(x * x + y * y + z * z)
    low, high = np.sin(np.radians((table.elevation.min() - ON, table.elevation.max() + ON)))
    # The slack covers the rounding of slant and sines; what it lets through is looked at again.
    slack = 1e-12 * slant
    inside = slant <= (1 + 1e-12) * _ends(table).max()
    inside &= z >= low * slant - slack
    inside &= z <= high * slant + slack
    return np.flatnonzero(inside)


def _ends(table: RadarTable) -> Floats:
    """Return where the sweeps (S,) end, metres."""
    return np.asarray(table.first_gate + (table.last + 0.5 + ON) * table.gate_spacing)


def _within_reach(table: RadarTable, slant: Floats, elevation: Floats) -> Booleans:
    """Leave out the points (n,) that lie beyond all sweeps."""
    inside = slant <= _ends(table).max()
    inside &= elevation >= table.elevation.min() - ON
    inside &= elevation <= table.elevation.max() + ON
    return np.asarray(inside)


def _values_at(table: RadarTable, slant: Floats, azimuth: Floats, elevation: Floats) -> Floats:
    azimuth, knot = _folded(table, azimuth)
    low = _sweeps_below(table, knot, azimuth, elevation)
    high = np.minimum(low + 1, len(table.last) - 1)
    below = low < 0
    np.maximum(low, 0, out=low)
    values, tilt = _in_sweep(table, low, knot, slant, azimuth)
    upper, upper_tilt = _in_sweep(table, high, knot, slant, azimuth)
    rise = upper_tilt - tilt
    share = (elevation - tilt) / np.where(rise > 0, rise, 1.0)
    # Above the highest sweep there is no other: the point is seen only if it lies on that one.
    below |= (low == high) & (elevation > tilt + ON)
    share[(np.abs(elevation - tilt) <= ON) | (low == high)] = 0.0
    values = np.clip(_between(values, upper, share), *table.bounds)
    values[below] = np.nan
    return values


def _sweeps_below(table: RadarTable, knot: Indices, azimuth: Floats, elevation: Floats) -> Indices:
    """Return the index (n,) of the highest sweep that is not above the point, -1 if there is none."""
    if table.level is not None:
        return np.searchsorted(table.level, elevation + ON, side="right") - 1
    below = np.full(len(knot), -1, dtype=np.intp)
    for s in range(len(table.last)):
        _, _, tilt = _around(table, table.radial[knot, s], azimuth)
        below += tilt <= elevation + ON
    return below


def _around(table: RadarTable, radial: Indices, azimuth: Floats) -> tuple[Indices, Floats, Floats]:
    """Return the radial after `radial`, the share of the way to it, and the elevation there.

    The share is NaN between radials that are too far apart.
    """
    after = table.following[radial]
    turn = azimuth - table.azimuth[radial]
    turn[turn < -ON] += 360.0
    np.maximum(turn, 0.0, out=turn)
    share = turn * table.share[radial]
    share[share < ON] = 0.0
    share[share > 1 - ON] = 1.0
    tilt = table.elevation[radial]
    tilt = tilt + share * (table.elevation[after] - tilt)
    across = (table.share[radial] == 0) & (turn > ON)
    share[across] = np.nan
    return after, share, tilt


def _in_sweep(
    table: RadarTable,
    sweep: Indices,
    knot: Indices,
    slant: Floats,
    azimuth: Floats,
    *,
    nearest: bool = False,
) -> tuple[Floats, Floats]:
    """Return the value (n,) on each point's sweep at its range and azimuth, and the elevation there."""
    before = table.radial[knot, sweep]
    after, share, tilt = _around(table, before, azimuth)
    last = table.last[sweep]
    gate = (slant - table.first_gate[sweep]) / table.gate_spacing[sweep]
    outside = (gate < -0.5 - ON) | (gate > last + 0.5 + ON)
    centre = np.rint(gate)
    gate = np.where(nearest | (np.abs(gate - centre) < ON), centre, gate)
    gate = np.clip(gate, 0, last)
    lower = gate.astype(np.intp)
    part = gate - lower
    upper = np.minimum(lower + 1, last)
    along = [
        _between(
            table.gates[table.start[radial] + lower].astype(np.float64),
            table.gates[table.start[radial] + upper].astype(np.float64),
            part,
        )
        for radial in (before, after)
    ]
    values = _between(along[0], along[1], np.rint(share) if nearest else share)
    values[outside] = np.nan
    return values, tilt


def _between(first: Floats, second: Floats, share: Floats) -> Floats:
    """Return first + share (second - first); at share 0 and 1 the other one does not matter, NaN or not."""
    values = first + share * (second - first)
    np.copyto(values, first, where=share == 0)
    np.copyto(values, second, where=share == 1)
    return values


def printed_spherical(points: Floats) -> tuple[Floats, Floats, Floats]:
    """Return r, phi, theta of texture points (3, n) in 0...1 by Congote et al. (2012), eq. 18-20, as printed.

        r = |p - 1/2|      phi = arctan(y, x) + pi      theta = arccos(z / phi)

    Only r is counted from the centre, and theta divides by an angle; `centred_spherical` puts both right.
    theta is NaN where |z| > phi, which no point in 0...1 reaches.
    """
    x, y, z = points
    phi = np.arctan2(y, x) + np.pi
    with np.errstate(invalid="ignore"):
        theta = np.arccos(z / phi)
    return np.asarray(np.sqrt(((points - 0.5) ** 2).sum(axis=0))), phi, theta


def centred_spherical(points: Floats) -> tuple[Floats, Floats, Floats]:
    """Return r, phi, theta of texture points (3, n) in 0...1 by the same equations put right.

        q = p - 1/2      r = |q|      phi = arctan(qy, qx) + pi      theta = arccos(qz / r)

    phi runs anticlockwise from the west, theta down from the zenith, both in radians:
    azimuth = 3 pi / 2 - phi (mod 2 pi) and elevation = pi / 2 - theta.  At the centre theta is pi / 2.

    Examples
    --------
    >>> north_east = np.array([[0.6], [0.6], [0.5]])
    >>> r, phi, theta = centred_spherical(north_east)
    >>> (np.degrees(3 * np.pi / 2 - phi) % 360).round(9).item(), (90 - np.degrees(theta)).round(9).item()
    (45.0, 0.0)
    """
    x, y, z = points - 0.5
    r = np.sqrt(x * x + y * y + z * z)
    return r, np.arctan2(y, x) + np.pi, np.arccos(np.divide(z, r, out=np.zeros_like(r), where=r > 0))
