"""What every reader of radars hands on, and the words it shares with the others."""

from collections.abc import Iterable
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np

from volref.arrays import Numbers
from volref.errors import FormatError
from volref.io.guard import check_memory, nearest, one_line
from volref.scene.sweep import Sweep

# Two GiB hold twenty volumes of the finest operational radars.
RADAR_MAX_BYTES = 2**31

# Units of quantities by their names in ODIM_H5 2.4, table 16, and the names that CfRadial files use.
REFLECTIVITIES = ("DBZH", "DBZV", "TH", "TV", "DBZ", "DBTH", "DBTV", "reflectivity", "REF")
UNITS = dict.fromkeys(REFLECTIVITIES, "dBZ") | {
    "VRADH": "m/s",
    "VRADV": "m/s",
    "VRAD": "m/s",
    "WRADH": "m/s",
    "WRADV": "m/s",
    "WRAD": "m/s",
    "ZDR": "dB",
    "PHIDP": "degrees",
    "KDP": "degrees/km",
}


@dataclass(frozen=True)
class Wish:
    """What is wanted of a file: a quantity, at most so much memory, and which of several volumes.

    own_elevations: each radial's own, not one for the sweep.  fill_is_no_echo: what a lone fill value means.
    """

    quantity: str
    max_bytes: int
    time: int | None = None
    own_elevations: bool = True
    fill_is_no_echo: bool = False


@dataclass(frozen=True)
class Contents:
    """Sweeps in the order of the file, and what it says besides, in the words of `RadarVolume`."""

    sweeps: list[Sweep]
    said: dict[str, Any] = field(default_factory=dict)


def check_gates(file: Path, shapes: list[tuple[int, ...]], max_bytes: int) -> None:
    """Refuse a file whose gates, 8 bytes each, would take too much memory.

    Raises
    ------
    FormatError
        If they would.
    """
    gates = sum(shape[0] * shape[1] for shape in shapes)
    check_memory(file, 8 * gates, max_bytes, f"{gates} gates in {len(shapes)} sweeps")


def missing_quantity(file: Path, quantity: str, found: list[str]) -> FormatError:
    """Return the error of a file that holds other quantities than the one wanted."""
    held = ", ".join(one_line(name) for name in sorted(set(found))[:12]) or "none"
    message = f"{file.name} must hold the quantity {one_line(quantity)!r}, got {held}; "
    return FormatError(
        message + ("pass quantity=, " + nearest(quantity, found) if found else "check the file")
    )


def iso_time(date: str, time: str) -> str | None:
    """Return date and time of day, 20110610 and 114002, in ISO 8601; None if they are none.

    Examples
    --------
    >>> iso_time("20110610", "114002")
    '2011-06-10T11:40:02+00:00'
    """
    try:
        return datetime.strptime(f"{date} {time}+0000", "%Y%m%d %H%M%S%z").isoformat()
    except ValueError:
        return None


def floor_of(scales: Iterable[tuple[np.dtype[Any], float, float]], units: str) -> float | None:
    """Return what a gate without echo is worth: the least value of code 0, below what the radar can tell.

    scales: the codes' type, gain and offset of each sweep.  None where codes are no whole numbers from 0 on,
    or the quantity has no floor.
    """
    known = [offset for dtype, gain, offset in scales if dtype.kind == "u" and gain > 0]
    return min(known) if known and units == "dBZ" else None


def even_steps(file: Path, name: str, ranges: Numbers) -> tuple[float, float]:
    """Return the first and the step of evenly spaced ranges (G,).

    Raises
    ------
    FormatError
        If they are not even to a hundredth of a step.
    """
    centres = np.ravel(ranges).astype(np.float64)
    steps = np.diff(centres)
    if steps.size and steps[0] > 0 and np.abs(steps - steps.mean()).max() <= 0.01 * steps.mean():
        return float(centres[0]), float(steps.mean())
    message = f"{file.name} must hold {name} in even steps, at least 2 gates, got "
    raise FormatError(message + f"{one_line(str(centres[:4].tolist()))}; resample the gates to one spacing")
