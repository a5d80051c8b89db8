"""Radar volumes as .npz: one array for each sweep, readable with NumPy alone.

Of sweep NN = 00, 01 ...:

    values_NN  (R, G)     NaN: no data, -inf: no echo; or
    codes_NN   (R, G)     value = gain code + offset; `undetect` is the code of no echo, `nodata` and
                          `range_folded` those of no data; or all sweeps at once as codes (S, R, G), or
                          (T, S, R, G) at T times
    azimuth_NN (R,)       middles of the radials, degrees; without it they are even, the first one half a step
                          east of north
    elevation_NN (R,)     degrees; without it elangle (S,)
    first_gate_m (S,)     middle of gate 0; or rstart_m, where it begins, or range_m_NN (G,), all middles
    gate_spacing_m (S,)   or rscale_m

Numbers may be given once for all sweeps.  For the whole: site_lat_lon_height (3,), time, quantity, units,
no_echo, beam, origin.
"""

from pathlib import Path
from typing import Any

import numpy as np

from volref.arrays import Numbers
from volref.errors import FormatError
from volref.io.npy import ArrayHeader, npz_headers, read_npz, write_npz
from volref.io.radar.contents import (
    UNITS,
    Contents,
    Wish,
    check_gates,
    even_steps,
    floor_of,
    iso_time,
    missing_quantity,
)
from volref.scene.radar import MOST_SWEEPS, RadarVolume
from volref.scene.sweep import Sweep

NONE_CODES = ("nodata", "range_folded")
CODING = ("gain", "offset", "undetect", *NONE_CODES)
PLACING = ("elangle", "elangle_median", "first_gate_m", "gate_spacing_m", "rstart_m", "rscale_m")
WHOLE = ("site_lat_lon_height", "time", "quantity", "units", "no_echo", "beam", "origin")

# Everything but the gates is a number for each sweep or radial.
LARGEST_SMALL = 2**20


def read_radar_npz(file: Path, wish: Wish) -> Contents:
    """Return the sweeps in a .npz file.

    Raises
    ------
    FormatError
        If it is no such file, holds another quantity, or would take too much memory.
    SceneError
        If a sweep breaks a rule of `Sweep`.
    """
    headers = npz_headers(file)
    small = read_npz(
        file, tuple(name for name in (*CODING, *PLACING, *WHOLE) if name in headers), LARGEST_SMALL
    )
    held = _word(small, "quantity") or "DBZH"
    if held != wish.quantity:
        raise missing_quantity(file, wish.quantity, [held])
    gates = _gates(file, headers, wish)
    sweeps = [_sweep(file, k, values, headers, small, wish) for k, values in enumerate(gates)]
    return Contents(sweeps, _said(file, small, gates, wish))


def write_radar_npz(path: str | Path, radar: RadarVolume, *, overwrite: bool = False) -> None:
    """Write a radar as .npz, whole or not at all; `read_radar_npz` returns the same radar."""
    arrays: dict[str, Numbers] = {
        "first_gate_m": np.array([sweep.first_gate for sweep in radar.sweeps]),
        "gate_spacing_m": np.array([sweep.gate_spacing for sweep in radar.sweeps]),
        "no_echo": np.array(np.nan if radar.no_echo is None else radar.no_echo),
        "beam": np.array(radar.beam),
        "origin": np.array(radar.origin),
        "quantity": np.array(radar.quantity),
        "units": np.array(radar.units),
    }
    if radar.site is not None:
        arrays["site_lat_lon_height"] = np.array(radar.site)
    if radar.time is not None:
        arrays["time"] = np.array(radar.time)
    for k, sweep in enumerate(radar.sweeps):
        arrays[f"values_{k:02d}"] = sweep.values
        arrays[f"azimuth_{k:02d}"] = sweep.azimuths
        arrays[f"elevation_{k:02d}"] = sweep.elevations
    write_npz(path, arrays, overwrite=overwrite)


def _gates(file: Path, headers: dict[str, ArrayHeader], wish: Wish) -> list[Numbers]:
    """Return the values or codes (R, G) of each sweep."""
    names = [f"{word}_{k:02d}" for word in ("values", "codes") for k in range(MOST_SWEEPS)]
    names = [name for name in names if name in headers]
    if not names and "codes" in headers:
        return _sweeps_of_one_array(file, headers["codes"].shape, wish)
    shapes = [headers[name].shape for name in names]
    if not names or any(len(shape) != 2 for shape in shapes):
        message = f"{file.name} must hold values_00, values_01 ... or codes_00, codes_01 ... of (radials, "
        raise FormatError(message + f"gates), got {shapes[:3] or 'none'}; save each sweep as one")
    check_gates(file, shapes, wish.max_bytes)
    found = read_npz(file, tuple(names), wish.max_bytes)
    return [found[name] for name in names]


def _sweeps_of_one_array(file: Path, shape: tuple[int, ...], wish: Wish) -> list[Numbers]:
    times = shape[0] if len(shape) == 4 else None
    if len(shape) not in (3, 4) or shape[-3] > MOST_SWEEPS:
        message = f"{file.name} must hold codes (sweeps, radials, gates) or (times, sweeps, radials, gates), "
        raise FormatError(message + f"got {shape}; give at most {MOST_SWEEPS} sweeps")
    if (times is None) != (wish.time is None) or (times is not None and not 0 <= (wish.time or 0) < times):
        span = "no" if times is None else f"an index time= from 0 to {times - 1}"
        message = f"{file.name} must be asked for {span} time, got {wish.time}; "
        raise FormatError(message + ("leave it out" if times is None else "choose one of its volumes"))
    check_gates(file, [(shape[-2], shape[-1] * shape[-3] * (times or 1))], wish.max_bytes)
    codes = read_npz(file, ("codes",), wish.max_bytes)["codes"]
    return list(codes if wish.time is None else codes[wish.time])


def _sweep(
    file: Path,
    k: int,
    gates: Numbers,
    headers: dict[str, ArrayHeader],
    small: dict[str, Numbers],
    wish: Wish,
) -> Sweep:
    own = {f"{name}_{k:02d}": name for name in ("azimuth", "elevation", "range_m")}
    found = read_npz(file, tuple(name for name in own if name in headers), LARGEST_SMALL)
    said = {own[name]: array for name, array in found.items()}
    radials = len(gates)
    azimuths = said.get("azimuth", (np.arange(radials) + 0.5) * 360.0 / radials)
    elevations = _elevations(file, k, said, small, own=wish.own_elevations)
    first, spacing = _distances(file, k, said, small)
    if f"values_{k:02d}" in headers:
        return Sweep(azimuths, elevations, gates, first, spacing)
    undetect = _number(file, small, "undetect", k, None) if "undetect" in small else None
    nodata = [_number(file, small, name, k, None) for name in NONE_CODES if name in small]
    gain, offset = _number(file, small, "gain", k, 1.0), _number(file, small, "offset", k, 0.0)
    return Sweep.from_codes(
        gates, gain, offset, azimuths, elevations, first, spacing, undetect=undetect, nodata=nodata
    )


def _elevations(
    file: Path, k: int, said: dict[str, Numbers], small: dict[str, Numbers], *, own: bool
) -> Numbers | float:
    if "elevation" in said and own:
        return said["elevation"]
    for name in ("elangle", "elangle_median"):
        if name in small:
            return _number(file, small, name, k, None)
    if "elevation" in said:
        return float(np.median(said["elevation"]))
    message = f"{file.name} must hold elevation_{k:02d} or elangle, got none; save the elevations in degrees"
    raise FormatError(message)


def _distances(
    file: Path, k: int, said: dict[str, Numbers], small: dict[str, Numbers]
) -> tuple[float, float]:
    """Return the middle of gate 0 and the distance from gate to gate."""
    if "range_m" in said:
        return even_steps(file, f"range_m_{k:02d}", said["range_m"])
    name = "gate_spacing_m" if "gate_spacing_m" in small else "rscale_m"
    spacing = _number(file, small, name, k, None)
    if "first_gate_m" in small:
        return _number(file, small, "first_gate_m", k, None), spacing
    return _number(file, small, "rstart_m", k, 0.0) + 0.5 * spacing, spacing


def _number(file: Path, small: dict[str, Numbers], name: str, k: int, default: float | None) -> float:
    """Return a number stated for sweep k, or for all."""
    if name not in small and default is not None:
        return default
    array = np.ravel(small.get(name, np.empty(0)))
    if array.dtype.kind in "iuf" and (array.size == 1 or k < array.size):
        return float(array[k if array.size > 1 else 0])
    message = f"{file.name} must hold {name} as one number or one for each sweep, got {array.size} "
    raise FormatError(message + f"{array.dtype} for sweep {k}; save it")


def _word(small: dict[str, Numbers], name: str, k: int = 0) -> str:
    array = np.ravel(small.get(name, np.empty(0)))
    return str(array[k]) if array.dtype.kind == "U" and k < array.size else ""


def _said(file: Path, small: dict[str, Numbers], gates: list[Numbers], wish: Wish) -> dict[str, Any]:
    time = _word(small, "time", wish.time or 0)
    units = _word(small, "units") or UNITS.get(wish.quantity, "")
    said: dict[str, Any] = {"quantity": wish.quantity, "units": units}
    said["time"] = iso_time(time[:8], time[8:]) if time.isdecimal() else time or None
    said["site"] = small.get("site_lat_lon_height")
    said["no_echo"] = _no_echo(file, small, gates, units)
    if "beam" in small:
        said["beam"] = _word(small, "beam")
    if "origin" in small:
        said["origin"] = small["origin"]
    return said


def _no_echo(file: Path, small: dict[str, Numbers], gates: list[Numbers], units: str) -> float | None:
    if "no_echo" in small:
        stated = _number(file, small, "no_echo", 0, None)
        return None if np.isnan(stated) else stated
    scales = [
        (array.dtype, _number(file, small, "gain", k, 1.0), _number(file, small, "offset", k, 0.0))
        for k, array in enumerate(gates)
    ]
    return floor_of(scales, units)
