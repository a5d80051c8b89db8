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

from volref.arrays import Booleans, Floats, Indices, Numbers
from volref.scene.beams import azimuth_of, chord_of_world, elevation_of, widest_ring
from volref.scene.radar import RadarVolume
from volref.scene.radar_blocks import RadarBins
from volref.scene.steps import Steps, steps_of
from volref.scene.sweep import Sweep

# A point this near to a gate's centre, a radial or a sweep (in gates, shares and degrees) lies on it: its
# polar coordinates are rounded in the 12th digit.
ON = 1e-9

# Radials farther apart than this times their sweep's median have nothing between them: one is missing.
WIDEST_GAP = 1.75

# Points that are looked up together: fewer, and NumPy's cost per call shows; more, and they leave the cache.
AT_ONCE = 1 << 15


@dataclass(frozen=True, eq=False)
class RadarTable:
    """A radar laid out for look-ups.

    knots: all M azimuths, degrees.  radial (M + 1) S: the radial of each sweep at or before each knot; the
    first S are those before all knots, the last ones of their sweeps.
    Of the radials (K,): azimuth, elevation (degrees), `share`, 1 / the angle to the next one (0 if too
    wide), `following`, the next one of the same sweep, and `start`, its first gate in `gates`.
    Of the sweeps (S,): first_gate, gate_spacing (m), last, the index of the last gate, and their least and
    greatest elevation, `lowest` and `highest`; `level` if each has only one.
    gates: all values, NaN where a gate has no data.
    reach: what is seen lies no farther from the antenna, along the beam and along the ground.
    """

    beam: str
    origin: tuple[float, float, float]
    bounds: tuple[float, float]
    reach: tuple[float, float]
    knots: Steps
    radial: Indices
    azimuth: Floats
    elevation: Floats
    share: Floats
    following: Indices
    start: Indices
    first_gate: Floats
    gate_spacing: Floats
    last: Indices
    lowest: Steps
    highest: Steps
    level: bool
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
    places = np.append(-1.0, knots)
    radial = [
        first[s] + (np.searchsorted(sweep.azimuths, places, side="right") - 1) % counts[s]
        for s, sweep in enumerate(sweeps)
    ]
    tilts = np.array([(sweep.elevations.min(), sweep.elevations.max()) for sweep in sweeps])
    # A part in 10^9 more than gates reach, for the rounding of what is compared with it.
    farthest = max(sweep.last_range for sweep in sweeps) * (1 + 2 * ON)
    return RadarTable(
        beam=radar.beam,
        origin=radar.origin,
        bounds=radar.value_bounds,
        reach=(farthest, widest_ring(farthest, radar.beam) * (1 + ON)),
        knots=steps_of(knots),
        radial=np.stack(radial, axis=1).ravel().astype(np.intp),
        azimuth=np.concatenate([sweep.azimuths for sweep in sweeps]),
        elevation=np.concatenate([sweep.elevations for sweep in sweeps]),
        share=np.concatenate([_share_of_radials(sweep) for sweep in sweeps]),
        following=np.concatenate([first[s] + np.roll(np.arange(n), -1) for s, n in enumerate(counts)]).astype(
            np.intp
        ),
        start=np.concatenate(([0], np.cumsum(lengths)[:-1])).astype(np.intp),
        first_gate=np.array([sweep.first_gate for sweep in sweeps]),
        gate_spacing=np.array([sweep.gate_spacing for sweep in sweeps]),
        last=np.array(gates, dtype=np.intp) - 1,
        lowest=steps_of(tilts[:, 0]),
        highest=steps_of(tilts[:, 1]),
        level=bool((tilts[:, 0] == tilts[:, 1]).all()),
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


def polar_lookup(table: RadarTable, points: Floats, bins: RadarBins | None = None) -> tuple[Floats, Booleans]:
    """Return the value (n,) at world points (3, n), NaN where there is nothing, and where there is something.

    The values lie within the radar's `value_bounds`; the error of the interpolation is a few ulp of the
    larger of these.  Points in bins that are not flagged count as if there were nothing.
    """
    values = np.full(points.shape[1], np.nan)
    for begin in range(0, len(values), AT_ONCE):
        part = slice(begin, begin + AT_ONCE)
        x, y, z = (points[axis, part] - table.origin[axis] for axis in range(3))
        slant, ground, height = chord_of_world(x, y, z, table.beam)
        near = np.flatnonzero(_perhaps_seen(table, x, y, slant, height))
        if near.size < len(x):
            x, y, slant, ground, height = (array.take(near) for array in (x, y, slant, ground, height))
        values[begin + near] = _values_at(
            table, slant, azimuth_of(x, y), elevation_of(ground, height), bins=bins
        )
    return values, ~np.isnan(values)


def beam_lookup(table: RadarTable, slant: Floats, azimuth: Floats, elevation: Floats) -> Floats:
    """Return the value (n,) at slant ranges (m), azimuths (0 to 360) and elevations (degrees), else NaN."""
    near = slant <= table.reach[0]
    near &= elevation >= table.lowest.numbers[0] - ON
    near &= elevation <= table.highest.numbers[-2] + ON
    values = np.full(len(slant), np.nan)
    for chosen in np.array_split(np.flatnonzero(near), 1 + len(slant) // AT_ONCE):
        values[chosen] = _values_at(table, slant[chosen], azimuth[chosen], elevation[chosen])
    return values


def sweep_lookup(
    table: RadarTable, sweep: int, slant: Floats, azimuth: Floats, *, nearest: bool = False
) -> Floats:
    """Return the value (n,) on one sweep at slant ranges and azimuths (0 to 360), NaN if there is none.

    nearest: that of the gate around the point, as it was measured, in place of the interpolated one.
    """
    azimuth, row = _folded(table, azimuth)
    sweeps = np.full((1, len(slant)), sweep)
    before, after, share, _ = _around(table, row + sweeps, azimuth)
    if nearest:
        before = np.where(np.rint(share) == 1, after, before)
        after, share = before, np.where(np.isnan(share), np.nan, 0.0)
    return np.asarray(_on_sweeps(table, sweeps, (before, after), share, slant, nearest=nearest)[0])


def sweep_elevation(table: RadarTable, sweep: int, azimuth: Floats) -> Floats:
    """Return the elevation (n,) of one sweep at azimuths (0 to 360), degrees."""
    azimuth, row = _folded(table, azimuth)
    return _around(table, row + sweep, azimuth)[3]


def _folded(table: RadarTable, azimuth: Floats) -> tuple[Floats, Indices]:
    """Return azimuths (n,) below 360, and where in `table.radial` those at or before each begin."""
    azimuth = np.where(azimuth > 360.0 - ON, 0.0, azimuth)
    return azimuth, table.knots.count_up_to(azimuth + ON) * len(table.last)


def _perhaps_seen(table: RadarTable, x: Floats, y: Floats, slant: Floats, height: Floats) -> Booleans:
    """Tell which points (n,) are not beyond all sweeps; angles cost more than all the rest."""
    tilts = np.array((table.lowest.numbers[0] - ON, table.highest.numbers[-2] + ON))
    low, high = np.sin(np.radians(np.clip(tilts, -90.0, 90.0)))
    farthest, widest = table.reach
    inside = slant <= farthest
    # The slack covers the rounding of slant and sines; what it lets through is looked at again.
    inside &= height >= (low - 1e-12) * slant
    inside &= height <= (high + 1e-12) * slant
    # Over a round earth the points on its other side have the same chords.
    inside &= np.maximum(np.abs(x), np.abs(y)) <= widest
    return np.asarray(inside)


def _values_at(
    table: RadarTable,
    slant: Floats,
    azimuth: Floats,
    elevation: Floats,
    *,
    bins: RadarBins | None = None,
) -> Floats:
    azimuth, row = _folded(table, azimuth)
    low = _sweeps_below(table, row, azimuth, elevation)
    above = low >= 0
    if bins is not None:
        above &= bins.show(np.maximum(low, 0), slant, azimuth)
    chosen, values = np.flatnonzero(above), np.full(len(slant), np.nan)
    if chosen.size:
        low, row = low.take(chosen), row.take(chosen)
        slant, azimuth, elevation = (array.take(chosen) for array in (slant, azimuth, elevation))
        values[chosen] = _above_sweeps(table, low, row, slant, azimuth, elevation)
    return values


def _above_sweeps(
    table: RadarTable, low: Indices, row: Indices, slant: Floats, azimuth: Floats, elevation: Floats
) -> Floats:
    """Return the value (n,) on or above the sweeps `low` (n,)."""
    sweeps = np.stack((low, np.minimum(low + 1, len(table.last) - 1)))
    before, after, share, tilts = _around(table, row + sweeps, azimuth)
    values = _on_sweeps(table, sweeps, (before, after), share, slant)
    tilt, rise = tilts[0], tilts[1] - tilts[0]
    above = elevation - tilt
    share = above / np.where(rise > 0, rise, 1.0)
    # Above the highest sweep there is no other: the point is seen only if it lies on that one.
    highest = low == len(table.last) - 1
    share[(np.abs(above) <= ON) | highest] = 0.0
    found = values[0] + share * (values[1] - values[0])
    # What contributes with weight 0 may be NaN.
    np.copyto(found, values[0], where=share == 0)
    np.clip(found, *table.bounds, out=found)
    found[highest & (above > ON)] = np.nan
    return np.asarray(found)


def _sweeps_below(table: RadarTable, row: Indices, azimuth: Floats, elevation: Floats) -> Indices:
    """Return the index (n,) of the highest sweep that is not above the point, -1 if there is none."""
    place = elevation + ON
    count = table.highest.count_up_to(place)
    if table.level:
        return count - 1
    # Sweeps do not cross: only those count that are below the point at some azimuths and above at others.
    most = table.lowest.count_up_to(place + ON)
    unsure = np.flatnonzero(count < most)
    while unsure.size:
        _, _, _, tilt = _around(table, row[unsure] + count[unsure], azimuth[unsure])
        unsure = unsure[tilt <= place[unsure]]
        count[unsure] += 1
        unsure = unsure[count[unsure] < most[unsure]]
    return count - 1


def _around(table: RadarTable, at: Indices, azimuth: Floats) -> tuple[Indices, Indices, Floats, Floats]:
    """Return the radials before and after azimuths (n,), the share of the way, and the elevation there.

    at (..., n): where `table.radial` has the one before.  At share 0 and 1 both are the one that counts.  The
    share is NaN between radials that are too far apart.
    """
    before = table.radial.take(at)
    after = table.following.take(before)
    turn = azimuth - table.azimuth.take(before)
    np.add(turn, 360.0, out=turn, where=turn < -ON)
    np.maximum(turn, 0.0, out=turn)
    per_degree = table.share.take(before)
    share = turn * per_degree
    onto = share > 1 - ON
    np.copyto(before, after, where=onto)
    away = share < ON
    np.copyto(after, before, where=away)
    share[onto | away] = 0.0
    tilt = table.elevation.take(before)
    if not table.level:
        tilt += share * (table.elevation.take(after) - tilt)
    np.copyto(share, np.nan, where=away & (per_degree == 0) & (turn > ON))
    return before, after, share, tilt


def _on_sweeps(
    table: RadarTable,
    sweeps: Indices,
    radials: tuple[Indices, Indices],
    share: Floats,
    slant: Floats,
    *,
    nearest: bool = False,
) -> Floats:
    """Return the values (m, n) on m sweeps for each of n points, at their range and between two radials."""
    last = table.last.take(sweeps)
    gate = slant - table.first_gate.take(sweeps)
    gate /= table.gate_spacing.take(sweeps)
    outside = (gate < -0.5 - ON) | (gate > last + (0.5 + ON))
    centre = np.rint(gate)
    np.copyto(gate, centre, where=nearest | (np.abs(gate - centre) < ON))
    np.maximum(gate, 0.0, out=gate)
    np.minimum(gate, last, out=gate)
    lower = gate.astype(np.intp)
    part = gate - lower
    # On a gate's centre the next one does not count.
    upper = lower + (part > 0)
    along = []
    for radial in radials:
        start = table.start.take(radial)
        first = table.gates.take(start + lower).astype(np.float64)
        first += part * (table.gates.take(start + upper) - first)
        along.append(first)
    values = along[0]
    values += share * (along[1] - values)
    values[outside] = np.nan
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
