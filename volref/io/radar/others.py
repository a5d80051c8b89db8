"""Radar formats that xradar reads (extra `radar`): CfRadial, NEXRAD Level II, IRIS, Rainbow, GAMIC and more.

xradar is asked for codes, not for values: decoded, a gate without echo and one without data are both NaN.
"""

from pathlib import Path
from typing import Any

import numpy as np

from volref.errors import FormatError
from volref.io.guard import Foreign, check_memory, extra, one_line, wrapped
from volref.io.radar.contents import (
    UNITS,
    Contents,
    Wish,
    check_gates,
    even_steps,
    floor_of,
    missing_quantity,
)
from volref.scene.radar import MOST_SWEEPS
from volref.scene.sweep import Sweep

# What xradar calls the formats it reads, each opened by open_<name>_datatree.
FORMATS = ("cfradial1", "cfradial2", "datamet", "furuno", "gamic", "iris", "nexradlevel2", "rainbow", "uf")

# A radar sends its next pulse before an echo from beyond this could return: 150000 / 600 km/s = 250 Hz.
FARTHEST_ECHO = 600_000.0

# NEXRAD's two codes without a value (ICD 2620002, table III-A): below threshold, and range folded.
NEXRAD_NO_ECHO, NEXRAD_FOLDED = 0, 1


def read_by_xradar(file: Path, name: str, wish: Wish) -> Contents:
    """Return the sweeps of one quantity in a file of a format of `FORMATS`; sweeps without it are left out.

    Raises
    ------
    FormatError
        If xradar is not installed, cannot read the file, or reads more gates than can be.
    SceneError
        If a sweep breaks a rule of `Sweep`.
    """
    # Before xradar: it may read a file whole to find its parts.
    check_memory(file, file.stat().st_size, wish.max_bytes, "the file")
    xradar = extra("xradar", "radar", "xradar")
    opener = getattr(xradar.io, f"open_{name}_datatree", None)
    if opener is None:
        message = f"xradar must know the format {name!r}, got a version that does not; install a newer one"
        raise FormatError(message)
    with wrapped(file, f"{name} file", "check the file, or pass kind= of another"):
        tree = opener(str(file), mask_and_scale=False)
        try:
            return contents_of_tree(file, tree, name, wish)
        finally:
            tree.close()


def contents_of_tree(file: Path, tree: Foreign, name: str, wish: Wish) -> Contents:
    """Return the sweeps of one quantity in what xradar opened: children sweep_0, sweep_1 ... of a tree."""
    groups = [tree[child].to_dataset() for child in tree.children if child.startswith("sweep")]
    found = [str(key) for group in groups for key in group.data_vars if group[key].ndim == 2]
    groups = [group for group in groups if wish.quantity in group.data_vars]
    if not groups:
        raise missing_quantity(file, wish.quantity, found)
    if len(groups) > MOST_SWEEPS:
        message = f"{file.name} must hold at most {MOST_SWEEPS} sweeps, got {len(groups)}; split it"
        raise FormatError(message)
    check_gates(file, [tuple(group[wish.quantity].shape) for group in groups], wish.max_bytes)
    sweeps = [_sweep_of(file, group, name, wish) for group in groups]
    return Contents(sweeps, _said(tree, [group[wish.quantity] for group in groups], wish.quantity))


def _sweep_of(file: Path, group: Foreign, name: str, wish: Wish) -> Sweep:
    gates = group[wish.quantity]
    first, spacing = even_steps(file, "range", np.asarray(group["range"].values))
    farthest = first + (gates.sizes["range"] - 0.5) * spacing
    if farthest > FARTHEST_ECHO:
        message = (
            f"{file.name} must hold gates within {FARTHEST_ECHO / 1e3:g} km, got {farthest / 1e3:.0f} km"
        )
        message += " by xradar, which misreads some older NEXRAD files; "
        raise FormatError(message + "read it with arm-pyart and save its sweeps as .npz")
    across = next(axis for axis in gates.dims if axis != "range")
    elevations = np.ravel(group["elevation"].values)
    return Sweep.from_codes(
        np.asarray(gates.transpose(across, "range").values),
        _scale(gates, "scale_factor", 1.0),
        _scale(gates, "add_offset", 0.0),
        np.ravel(group["azimuth"].values),
        elevations if wish.own_elevations else float(np.median(elevations)),
        first,
        spacing,
        **_codes_without_value(gates, name, fill_is_no_echo=wish.fill_is_no_echo),
    )


def _codes_without_value(gates: Foreign, name: str, *, fill_is_no_echo: bool) -> dict[str, Any]:
    """Return the codes for no echo and no data, by the format's own words for them."""
    if name == "nexradlevel2":
        return {"undetect": NEXRAD_NO_ECHO, "nodata": NEXRAD_FOLDED}
    said = {**gates.encoding, **gates.attrs}
    fill = [float(said[key]) for key in ("_FillValue", "missing_value") if said.get(key) is not None]
    if "_Undetect" in said:
        return {"undetect": float(said["_Undetect"]), "nodata": fill}
    if fill_is_no_echo and fill:
        return {"undetect": fill[0]}
    return {"nodata": fill}


def _scale(gates: Foreign, key: str, default: float) -> float:
    return float(gates.attrs.get(key, gates.encoding.get(key, default)))


def _said(tree: Foreign, gates: list[Foreign], quantity: str) -> dict[str, Any]:
    units = UNITS.get(quantity) or one_line(str(gates[0].attrs.get("units", "")))[:60]
    scales = [(g.dtype, _scale(g, "scale_factor", 1.0), _scale(g, "add_offset", 0.0)) for g in gates]
    site = [
        float(np.ravel(tree[key].values)[0]) for key in ("latitude", "longitude", "altitude") if key in tree
    ]
    time = str(np.ravel(tree["time_coverage_start"].values)[0]) if "time_coverage_start" in tree else ""
    return {
        "quantity": quantity,
        "units": units,
        "no_echo": floor_of(scales, units),
        # Old NEXRAD files have no place, which xradar states as 0, 0, 0.
        "site": site if len(site) == 3 and any(site) else None,
        "time": time.strip() or None,
    }
