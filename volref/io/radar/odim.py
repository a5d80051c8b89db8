"""ODIM_H5 volumes, as European weather services exchange them, through h5py (extra `hdf5`).

The layout (Michelson et al., EUMETNET OPERA weather radar information model for implementation with the HDF5
file format, version 2.4, 2021): group dataset<n> is a sweep, data<m> in it a quantity; attributes stand in
groups called what, where and how beside them, and a group without one takes it from the group above.

    value = gain code + offset      `nodata` and `undetect` are codes of their own
    row k of the data is the k-th radial from north, clockwise; `a1gate` says only which was measured first
    `rstart` is where gate 0 begins, in km up to version 2.3 and in m from 2.4 on; `rscale` is in m
"""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from volref.arrays import Floats
from volref.errors import FormatError
from volref.io.guard import Foreign, check_deflated, extra, one_line, wrapped
from volref.io.radar.contents import (
    UNITS,
    Contents,
    Wish,
    check_gates,
    floor_of,
    iso_time,
    missing_quantity,
)
from volref.scene.radar import MOST_SWEEPS
from volref.scene.sweep import Sweep

# An attribute of one number for each radial, or a list of them in text, is no longer than this.
LARGEST_ATTRIBUTE = 2**20

# Data of this many bytes must be in the file; less may be a fill value that was never written.
MOST_UNWRITTEN = 2**24


def read_odim(file: Path, wish: Wish) -> Contents:
    """Return the sweeps of one quantity in an ODIM_H5 file; sweeps without it are left out.

    Raises
    ------
    FormatError
        If it is no such file, lacks the quantity, or would take too much memory.
    SceneError
        If a sweep breaks a rule of `Sweep`.
    """
    h5py = extra("h5py", "HDF5", "h5py")
    with wrapped(file, "ODIM_H5 file"), h5py.File(file, "r") as root:
        places = _places_of(file, root, wish)
        sweeps = [_read_sweep(place, own_elevations=wish.own_elevations) for place in places]
        return Contents(sweeps, _said(_Place(file, (root,)), places, wish.quantity))


@dataclass(frozen=True)
class _Place:
    """Where to ask: a quantity of a sweep, the sweep, the file (nearest first), and its gates."""

    file: Path
    groups: tuple[Foreign, ...]
    data: Foreign = None

    def said(self, kind: str, name: str) -> Foreign:
        """Return an attribute of the nearest group that states it, None if nobody does."""
        for group in self.groups:
            found = _attribute(self.file, _child(self.file, group, kind), name)
            if found is not None:
                return found
        return None

    def number(self, kind: str, name: str, default: float | None = None) -> float:
        found = self.said(kind, name)
        if found is None and default is not None:
            return default
        try:
            return float(np.ravel(found)[0])
        except (TypeError, ValueError, IndexError) as error:
            message = f"{self.file.name} must state {kind}/{name} of {self.name} as a number, got "
            raise FormatError(message + f"{one_line(repr(found))}; write it again") from error

    def text(self, kind: str, name: str) -> str:
        return _text(self.said(kind, name))

    @property
    def name(self) -> str:
        return one_line(self.groups[0].name)


def _places_of(file: Path, root: Foreign, wish: Wish) -> list[_Place]:
    sweeps = _numbered(file, root, "dataset")
    if not 1 <= len(sweeps) <= MOST_SWEEPS:
        message = f"{file.name} must hold 1 to {MOST_SWEEPS} groups dataset1, dataset2 ..., got "
        raise FormatError(message + f"{len(sweeps)}; give an ODIM_H5 volume (PVOL or SCAN)")
    places, found = [], []
    for sweep in sweeps:
        for group in _numbered(file, sweep, "data"):
            place = _Place(file, (group, sweep, root), _child(file, group, "data"))
            name = place.text("what", "quantity")
            found.append(name)
            if name == wish.quantity:
                _check_data(place)
                places.append(place)
                break
    if not places:
        raise missing_quantity(file, wish.quantity, found)
    check_gates(file, [place.data.shape for place in places], wish.max_bytes)
    for place in places:
        _check_written(place)
    return places


def _check_data(place: _Place) -> None:
    file, data, name = place.file, place.data, place.name
    shape = getattr(data, "shape", None)
    if shape is None or len(shape) != 2 or min(shape) < 1 or data.dtype.kind not in "iuf":
        got = "no data" if shape is None else f"{data.dtype} of shape {shape}"
        message = f"{file.name} must hold {name}/data as numbers (radials, gates), got {got}; write it again"
        raise FormatError(message)
    if data.external or data.is_virtual:
        message = f"{file.name} must hold {name}/data itself, got data in another file; copy it into this one"
        raise FormatError(message)
    stated = (place.number("where", "nrays", shape[0]), place.number("where", "nbins", shape[1]))
    if stated != shape:
        message = f"{file.name} must hold nrays x nbins = {stated[0]:g} x {stated[1]:g} gates in {name}, got "
        raise FormatError(message + f"{shape[0]} x {shape[1]}; write it again")


def _check_written(place: _Place) -> None:
    data = place.data
    if data.nbytes > MOST_UNWRITTEN:
        what = f"{data.shape[0]} x {data.shape[1]} {data.dtype}"
        check_deflated(place.file, data.nbytes, data.id.get_storage_size(), what)


def _read_sweep(place: _Place, *, own_elevations: bool) -> Sweep:
    radials = place.data.shape[0]
    metres = 1.0 if _version(place) >= (2, 4) else 1000.0
    spacing = place.number("where", "rscale")
    begin = place.number("where", "rstart", 0.0) * metres
    none = {name: place.said("what", name) for name in ("undetect", "nodata")}
    codes = {name: place.number("what", name) for name, found in none.items() if found is not None}
    elevations = _elevations(place, radials) if own_elevations else None
    return Sweep.from_codes(
        place.data[()],
        place.number("what", "gain", 1.0),
        place.number("what", "offset", 0.0),
        _azimuths(place, radials),
        place.number("where", "elangle") if elevations is None else elevations,
        begin + 0.5 * spacing,
        spacing,
        **codes,
    )


def _azimuths(place: _Place, radials: int) -> Floats:
    """Return the middles (R,) of the radials, as they were measured, or evenly spaced from north.

    how/startazA, stopazA     arrays; a radial may pass north, and the antenna may turn either way
    how/azangles              the same in older files, as text "0.0:1.0,1.0:2.0,"
    how/astart                where evenly spaced radials start
    """
    start, stop = (_per_radial(place, name, radials) for name in ("startazA", "stopazA"))
    if start is None or stop is None:
        start, stop = _azimuths_in_text(place, radials)
    if start is None or stop is None:
        step = 360.0 / radials
        return place.number("how", "astart", 0.0) + step * (np.arange(radials, dtype=np.float64) + 0.5)
    turn = (stop - start + 180.0) % 360.0 - 180.0
    middle: Floats = start + 0.5 * turn
    return middle


def _azimuths_in_text(place: _Place, radials: int) -> tuple[Floats, Floats] | tuple[None, None]:
    text = place.text("how", "azangles")
    if not text:
        return None, None
    pairs = [[float(angle) for angle in pair.split(":")] for pair in text.split(",") if pair]
    if len(pairs) == radials and {len(pair) for pair in pairs} == {2}:
        both = np.array(pairs)
        return both[:, 0], both[:, 1]
    message = f"{place.file.name} must hold {radials} pairs start:stop in how/azangles of {place.name}, got "
    raise FormatError(message + f"{len(pairs)}; write it again")


def _elevations(place: _Place, radials: int) -> Floats | None:
    """Return the elevation of each radial (R,), None if only that of the sweep is stated."""
    start, stop = (_per_radial(place, name, radials) for name in ("startelA", "stopelA"))
    if start is not None and stop is not None:
        middle: Floats = 0.5 * (start + stop)
        return middle
    return _per_radial(place, "elangles", radials)


def _per_radial(place: _Place, name: str, radials: int) -> Floats | None:
    found = place.said("how", name)
    if found is None:
        return None
    array = np.ravel(found)
    if array.size != radials or array.dtype.kind not in "iuf":
        message = (
            f"{place.file.name} must hold how/{name} as {radials} numbers, got {array.size} {array.dtype}; "
        )
        raise FormatError(message + "write it again")
    return array.astype(np.float64)


def _said(whole: _Place, places: list[_Place], quantity: str) -> dict[str, Any]:
    """Return what holds for all sweeps."""
    units = UNITS.get(quantity, "")
    scales = [(p.data.dtype, p.number("what", "gain", 1.0), p.number("what", "offset", 0.0)) for p in places]
    site = [whole.said("where", name) for name in ("lat", "lon", "height")]
    return {
        "quantity": quantity,
        "units": units,
        "no_echo": floor_of(scales, units),
        "site": None if any(value is None for value in site) else [float(np.ravel(v)[0]) for v in site],
        "time": iso_time(whole.text("what", "date"), whole.text("what", "time")),
    }


def _numbered(file: Path, group: Foreign, word: str) -> list[Foreign]:
    """Return the groups word1, word2 ... in the order of their numbers."""
    names = [name for name in map(str, group) if re.fullmatch(f"{word}[0-9]{{1,6}}", name)]
    children = [_child(file, group, name) for name in sorted(names, key=lambda name: int(name[len(word) :]))]
    return [child for child in children if hasattr(child, "keys")]


def _child(file: Path, group: Foreign, name: str) -> Foreign:
    """Return a child, None if there is none; a link that leads out of the file is refused."""
    link = group.get(name, getlink=True)
    if link is None:
        return None
    if type(link).__name__ == "HardLink":
        return group[name]
    message = f"{file.name} must hold {one_line(name)} itself, got a {type(link).__name__}; "
    raise FormatError(message + "copy the data into the file")


def _attribute(file: Path, group: Foreign, name: str) -> Foreign:
    if group is None or name not in group.attrs:
        return None
    size = group.attrs.get_id(name).get_storage_size()
    if size > LARGEST_ATTRIBUTE:
        message = f"{file.name} must state {name} in at most {LARGEST_ATTRIBUTE} bytes, got {size}; "
        raise FormatError(message + "write it again")
    return group.attrs[name]


def _text(value: Foreign) -> str:
    """Return an attribute as text; services write it as text, as bytes, or as an array of one of them."""
    if isinstance(value, np.ndarray):
        value = value.flat[0] if value.size else ""
    if isinstance(value, bytes):
        value = value.decode("utf-8", "replace")
    return "" if value is None else str(value).rstrip("\0 ")


def _version(place: _Place) -> tuple[int, int]:
    """Return the version of the format, as 2.2 in "ODIM_H5/V2_2"."""
    stated = re.search(r"V(\d+)_(\d+)", _text(_attribute(place.file, place.groups[-1], "Conventions")))
    return (int(stated[1]), int(stated[2])) if stated else (2, 0)
