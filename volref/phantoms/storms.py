"""Moving thunderstorms for weather radar, made up: cells that drift, lean, grow and fade.

World: metres, x east, y north, z up, the radar at the origin.  Azimuth runs clockwise from north, so

    x = r cos(elevation) sin(azimuth)    y = r cos(elevation) cos(azimuth)    z = r sin(elevation)

with r the slant range of a straight beam (no refraction, no curvature of the earth: the two bend the
beam opposite ways).  Gate j of length g spans r = j g to (j + 1) g and is measured at its middle, and
radial k of n likewise:

    |--0--|--1--|--2--|    gate centres at (j + 1/2) g: 125, 375, 625 m for g = 250 m
    0    250   500   750   radial centres at (k + 1/2) 360 / n: 0.5, 1.5 degrees for n = 360
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from volref.arrays import Bytes, Floats, float_array, number, whole_number
from volref.phantoms.grid import Size
from volref.scene import RadarVolume, Sweep, Volume

# Reflectivity of clear air: the floor that keeps the logarithm finite.
CLEAR_DBZ = -32.0

# Elevations of a Dutch operational scan (KNMI, 14 sweeps), degrees.
ELEVATIONS_DEG = (0.3, 0.4, 0.8, 1.1, 2.0, 3.0, 4.5, 6.0, 8.0, 10.0, 12.0, 15.0, 20.0, 25.0)


@dataclass(frozen=True)
class StormCell:
    """One cell: a leaning column of rain, round in plan.

    x, y: ground position at t = 0 (m).  vx, vy: drift (m/s).  radius: its standard deviation in plan at
    t = 0 (m); growth: relative growth of the radius (1/s).  top: height up to which the echo is constant
    (m), above which it fades with the standard deviation `depth` (m).  lean_x, lean_y: shift of the axis
    per metre of height.  peak_dbz: reflectivity in the core at the time `mature` (s); fade: dB lost an
    hour before and after it, rising with the square of the time.
    """

    x: float
    y: float
    vx: float
    vy: float
    radius: float
    growth: float
    top: float
    depth: float
    lean_x: float
    lean_y: float
    peak_dbz: float
    mature: float
    fade: float


@dataclass(frozen=True)
class Storm:
    """Cells whose reflectivity factors add."""

    cells: tuple[StormCell, ...]


@dataclass(frozen=True, eq=False)
class PolarScan:
    """Reflectivity on a radar's grid: S sweeps, A radials, G gates.

    elevation_deg (S,), azimuth_deg (A,), range_m (G,): centres.  dbz (S, A, G): never below `CLEAR_DBZ`,
    never NaN.  time_s (S,): the time of each sweep.
    """

    elevation_deg: Floats
    azimuth_deg: Floats
    range_m: Floats
    dbz: Floats
    time_s: Floats


def make_storm(
    seed: int = 1,
    *,
    cells: int = 16,
    reach: float = 80_000.0,
    velocity: tuple[float, float] = (9.0, 5.0),
    spread: float = 1.5,
) -> Storm:
    """Return a squall line within about `reach` metres of the radar.

    `cells` strong cells stand in a bowed row and lean forward, as many wide weak ones of steady rain lie
    behind them.

    Every cell drifts with `velocity` (m/s) and a deviation of its own, `spread` m/s in standard deviation;
    with spread 0 the pattern moves as one.
    """
    rng = np.random.default_rng(seed)
    count = whole_number("cells", cells, low=1, high=10_000)
    length = number("reach", reach, above=0)
    speed = math.hypot(*velocity)
    ahead = np.array(velocity) / speed if speed > 0 else np.array((1.0, 0.0))
    along = np.array((-ahead[1], ahead[0]))
    rows = []
    for i in range(2 * count):
        drift = np.array(velocity) + rng.normal(0.0, 1.0, 2) * spread
        place = 1.3 * ((i // 2 + rng.uniform(0.0, 1.0)) / count - 0.5)
        make = _core if i % 2 == 0 else _steady_rain
        rows.append(make(rng, length, place, ahead, along, drift))
    return Storm(tuple(rows))


def _core(
    rng: np.random.Generator, reach: float, place: float, ahead: Floats, along: Floats, drift: Floats
) -> StormCell:
    """Return a narrow, tall, strong cell at `place` (shares of `reach`) along a line that bows ahead."""
    x, y = reach * (place * along + (rng.normal(0.1, 0.04) - 0.5 * place**2) * ahead)
    lean = 0.3 * ahead + rng.normal(0.0, 0.1, 2)
    return StormCell(
        x=float(x),
        y=float(y),
        vx=float(drift[0]),
        vy=float(drift[1]),
        radius=float(reach * rng.uniform(0.012, 0.035)),
        growth=float(rng.uniform(0.0, 1e-4)),
        top=float(rng.uniform(4_000, 9_000)),
        depth=float(rng.uniform(1_200, 2_500)),
        lean_x=float(lean[0]),
        lean_y=float(lean[1]),
        peak_dbz=float(rng.uniform(38, 60)),
        mature=float(rng.uniform(0, 5_400)),
        fade=float(rng.uniform(1, 12)),
    )


def _steady_rain(
    rng: np.random.Generator, reach: float, place: float, ahead: Floats, along: Floats, drift: Floats
) -> StormCell:
    """Return a wide, shallow, weak cell behind the line."""
    x, y = reach * (place * along - (rng.uniform(0.1, 0.45) + 0.5 * place**2) * ahead)
    return StormCell(
        x=float(x),
        y=float(y),
        vx=float(drift[0]),
        vy=float(drift[1]),
        radius=float(reach * rng.uniform(0.04, 0.08)),
        growth=float(rng.uniform(0.0, 5e-5)),
        top=float(rng.uniform(2_000, 4_000)),
        depth=900.0,
        lean_x=0.0,
        lean_y=0.0,
        peak_dbz=float(rng.uniform(14, 27)),
        mature=float(rng.uniform(0, 5_400)),
        fade=1.0,
    )


def reflectivity(storm: Storm, x: Floats, y: Floats, z: Floats, t: float = 0.0) -> Floats:
    """Return the reflectivity in dBZ at world points (m) and time `t` (s); the points broadcast.

        Z = 10^(CLEAR_DBZ / 10) + sum over cells of 10^(peak(t) / 10) exp(-d^2 / 2 - h^2 / 2)
        d = distance from the leaning axis / (radius exp(growth t)),    h = max(z - top, 0) / depth
        peak(t) = peak_dbz - fade ((t - mature) / 3600)^2,    dBZ = 10 log10 Z

    Factors Z (mm^6 / m^3) add because the echoes of drops do; decibels do not.

    Examples
    --------
    >>> still = StormCell(0, 0, 0, 0, 1000, 0, 5000, 1000, 0, 0, 50.0, 0, 0)
    >>> at = np.array([0.0, 1e6])
    >>> reflectivity(Storm((still,)), at, np.zeros(2), np.zeros(2)).round(6).tolist()
    [50.0, -32.0]
    """
    factor = np.full(np.broadcast_shapes(x.shape, y.shape, z.shape), 10 ** (CLEAR_DBZ / 10))
    for cell in storm.cells:
        width = cell.radius * math.exp(cell.growth * t)
        east = (x - (cell.x + cell.vx * t) - cell.lean_x * z) / width
        north = (y - (cell.y + cell.vy * t) - cell.lean_y * z) / width
        above = np.maximum(z - cell.top, 0.0) / cell.depth
        peak = cell.peak_dbz - cell.fade * ((t - cell.mature) / 3600) ** 2
        factor += 10 ** (peak / 10) * np.exp(-(east**2 + north**2 + above**2) / 2)
    return np.asarray(10 * np.log10(factor))


def polar_points(
    elevation_deg: ArrayLike, azimuth_deg: ArrayLike, range_m: ArrayLike
) -> tuple[Floats, Floats, Floats]:
    """Return world x, y, z (m) of straight beams; the three arguments broadcast.

    Examples
    --------
    >>> [p.round(9).item() + 0.0 for p in polar_points(0.0, 90.0, 1000.0)], "east"
    ([1000.0, 0.0, 0.0], 'east')
    >>> [p.round(9).item() + 0.0 for p in polar_points(30.0, 0.0, 1000.0)], "north and up"
    ([0.0, 866.025403784, 500.0], 'north and up')
    """
    elevation, azimuth = np.radians(elevation_deg), np.radians(azimuth_deg)
    slant = np.asarray(range_m, dtype=np.float64)
    ground = slant * np.cos(elevation)
    return ground * np.sin(azimuth), ground * np.cos(azimuth), np.asarray(slant * np.sin(elevation))


def sample_polar(
    storm: Storm,
    t: float = 0.0,
    *,
    elevations_deg: ArrayLike = ELEVATIONS_DEG,
    azimuths: int = 360,
    gates: int = 400,
    gate_length: float = 250.0,
    sweep_seconds: float = 0.0,
) -> PolarScan:
    """Measure a storm on a radar's grid, sweep by sweep; sweep s at time t + s * `sweep_seconds`.

    A real antenna needs minutes from the first sweep to the last; 0 freezes the storm meanwhile.
    """
    elevation = float_array("elevations_deg", elevations_deg, ("S",))
    radials = whole_number("azimuths", azimuths, low=1, high=65536)
    azimuth = _steps(radials, 360 / radials, 0.5)
    count = whole_number("gates", gates, low=1, high=65536)
    slant = _steps(count, number("gate_length", gate_length, above=0), 0.5)
    times = t + _steps(len(elevation), number("sweep_seconds", sweep_seconds, low=0), 0.0)
    dbz = np.empty((len(elevation), len(azimuth), len(slant)))
    for s, (angle, time) in enumerate(zip(elevation, times.tolist(), strict=True)):
        dbz[s] = reflectivity(storm, *polar_points(angle, azimuth[:, None], slant), time)
    return PolarScan(elevation, azimuth, slant, dbz, times)


def radar_of_scan(scan: PolarScan, *, beam: str = "straight") -> RadarVolume:
    """Radar volume of a scan; gates of clear air have no echo.

    Examples
    --------
    >>> radar = radar_of_scan(sample_polar(make_storm(), azimuths=36, gates=40, gate_length=2000))
    >>> len(radar.sweeps), radar.sweeps[0].values.shape, radar.gate_length, radar.no_echo
    (14, (36, 40), 2000.0, -32.0)
    """
    first = float(scan.range_m[0])
    spacing = float(scan.range_m[1]) - first if len(scan.range_m) > 1 else 2 * first
    gates = np.where(scan.dbz > CLEAR_DBZ + 0.5, scan.dbz, -np.inf)
    sweeps = [
        Sweep(scan.azimuth_deg, tilt, values, first, spacing)
        for tilt, values in zip(scan.elevation_deg.tolist(), gates, strict=True)
    ]
    return RadarVolume(sweeps, no_echo=CLEAR_DBZ, beam=beam)


def sample_cartesian(
    storm: Storm,
    t: float = 0.0,
    *,
    size: Size = (96, 96, 24),
    reach: float = 100_000.0,
    ceiling: float = 16_000.0,
    centering: str = "cell",
) -> Volume:
    """Measure a storm on a box from -reach to reach in x and y and from the ground to `ceiling` (dBZ)."""
    counts = (size,) * 3 if isinstance(size, int) else size
    lengths = (2 * reach, 2 * reach, ceiling)
    ends = 0 if centering == "cell" else 1
    spacing = [length / (n - ends) for length, n in zip(lengths, counts, strict=True)]
    inset = 0.5 if centering == "cell" else 0.0
    origin = [low + inset * s for low, s in zip((-reach, -reach, 0.0), spacing, strict=True)]
    x, y, z = (o + _steps(n, s, 0.0) for o, s, n in zip(origin, spacing, counts, strict=True))
    dbz = reflectivity(storm, x[None, None, :], y[None, :, None], z[:, None, None], t)
    return Volume(dbz, spacing, origin, centering=centering)


def _steps(count: int, step: float, start: float) -> Floats:
    """Return (start + k) * step for k = 0 ... count - 1."""
    return np.asarray((np.arange(count, dtype=np.float64) + start) * step)


def codes_from_dbz(dbz: Floats) -> Bytes:
    """Return 8-bit codes, dBZ = code / 2 - 32, as ODIM volumes hold them: 0 undetected, at most 254.

    Examples
    --------
    >>> codes_from_dbz(np.array([-40.0, -32.0, -31.5, 10.0, 200.0])).tolist()
    [0, 0, 1, 84, 254]
    """
    return np.asarray(np.clip(np.rint((dbz - CLEAR_DBZ) * 2), 0, 254)).astype(np.uint8)


def dbz_from_codes(codes: Bytes) -> Floats:
    """Return the dBZ of 8-bit codes; the undetected 0 becomes `CLEAR_DBZ`, so there is no NaN."""
    return codes / 2.0 + CLEAR_DBZ
