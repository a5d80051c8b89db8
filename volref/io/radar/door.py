"""Radars from files: one door, by what a file holds."""

from importlib.util import find_spec
from pathlib import Path

from numpy.typing import ArrayLike

from volref.arrays import one_of, whole_number
from volref.errors import FormatError
from volref.io.guard import existing_file, extra, one_line, wrapped
from volref.io.npy import npz_headers
from volref.io.radar.contents import RADAR_MAX_BYTES, Contents, Wish
from volref.io.radar.npz import read_radar_npz, write_radar_npz
from volref.io.radar.odim import read_odim
from volref.io.radar.others import FORMATS, read_by_xradar
from volref.scene.radar import RadarVolume

# How files begin, in bytes; those of HDF5 are looked into.
SIGNATURES = (
    (b"PK", "npz"),
    (b"\x89HDF\r\n\x1a\n", "hdf5"),
    (b"AR2V", "nexradlevel2"),
    (b"ARCHIVE2", "nexradlevel2"),
    (b"CDF", "cfradial1"),
    (b"<volume", "rainbow"),
    (b"\x1b\x00", "iris"),
    (b"UF", "uf"),
)


def load_radar(
    path: str | Path,
    *,
    quantity: str = "DBZH",
    time: int | None = None,
    elevations: str = "radial",
    fill: str = "no data",
    kind: str | None = None,
    no_echo: float | None = None,
    beam: str | None = None,
    origin: ArrayLike | None = None,
    max_bytes: int = RADAR_MAX_BYTES,
) -> RadarVolume:
    """Radar volume in a file, by what the file holds.

    ==============================  ======================================================================
    ODIM_H5                         through h5py (extra `hdf5`)
    .npz                            see `volref.io.radar.npz`
    CfRadial, NEXRAD Level II,      through xradar (extra `radar`)
    IRIS, Rainbow, GAMIC, UF ...
    ==============================  ======================================================================

    Sweeps without the quantity are left out.  What a file does not say is as in `RadarVolume`.

    Parameters
    ----------
    quantity
        What to load, in the file's own words: in ODIM_H5 "DBZH", "TH", "VRADH" ...
    time
        Which volume, where the file holds several.
    elevations
        "radial": each radial's own, where the file has them.  "sweep": one for each sweep.
    fill
        What the fill value means where a format has but one, as CfRadial: "no data" or "no echo".
    kind
        In place of what the first bytes say: "odim", "npz", or one of `volref.io.radar.others.FORMATS`.
    no_echo, beam, origin
        In place of what the file says, see `RadarVolume`.  Where gates are whole numbers, no echo is worth
        the value of code 0, less than the radar can tell.
    max_bytes
        The most memory the gates may take.

    Raises
    ------
    FormatError
        If the file is not what it should be, or lacks the quantity.
    SceneError
        If the radar breaks a rule of `RadarVolume`.
    """
    file = existing_file(path)
    one_of("elevations", elevations, ("radial", "sweep"))
    one_of("fill", fill, ("no data", "no echo"))
    wish = Wish(
        quantity,
        own_elevations=elevations == "radial",
        fill_is_no_echo=fill == "no echo",
        max_bytes=whole_number("max_bytes", max_bytes, low=1, high=2**62),
        time=None if time is None else whole_number("time", time, low=0, high=2**31),
    )
    kind = _kind_of(file) if kind is None else one_of("kind", kind, ("odim", "npz", *FORMATS))
    if kind != "npz" and time is not None:
        message = f"{file.name} must hold one volume, got time={time}; leave time out"
        raise FormatError(message)
    contents = _read(file, kind, wish)
    stated = {"no_echo": no_echo, "beam": beam, "origin": origin}
    stated = {key: value for key, value in stated.items() if value is not None}
    return RadarVolume(contents.sweeps, **{**contents.said, **stated})


def holds_radar(path: str | Path) -> bool:
    """Tell by its beginning, and of .npz and HDF5 by the names inside, whether a file is a radar's.

    HDF5 needs the extra `hdf5`; without it nothing is.

    Raises
    ------
    FormatError
        If the file cannot be read.
    """
    file = existing_file(path)
    with wrapped(file, "file"), file.open("rb") as stream:
        head = stream.read(8)
    kind = next((kind for signature, kind in SIGNATURES if head.startswith(signature)), None)
    if kind == "npz":
        names = set(npz_headers(file))
        return "n_sweeps" in names or any(name.startswith("codes") for name in names)
    if kind == "hdf5":
        return find_spec("h5py") is not None and _kind_of_hdf5(file) != "cfradial1"
    return kind is not None


def _read(file: Path, kind: str, wish: Wish) -> Contents:
    if kind == "odim":
        return read_odim(file, wish)
    if kind == "npz":
        return read_radar_npz(file, wish)
    return read_by_xradar(file, kind, wish)


def save_radar(radar: RadarVolume, path: str | Path, *, overwrite: bool = False) -> None:
    """Write a radar as .npz, from which `load_radar` returns the same.

    Raises
    ------
    FormatError
        If the path does not end in .npz, exists and `overwrite` is False, or cannot be written.
    """
    file = Path(path)
    if file.suffix.lower() != ".npz":
        message = f"{one_line(file.name)} must end in .npz, got {file.suffix!r}; change the name"
        raise FormatError(message)
    write_radar_npz(file, radar, overwrite=overwrite)


def _kind_of(file: Path) -> str:
    with wrapped(file, "file"), file.open("rb") as stream:
        head = stream.read(8)
    for signature, kind in SIGNATURES:
        if head.startswith(signature):
            return _kind_of_hdf5(file) if kind == "hdf5" else kind
    message = f"{file.name} must begin like a radar file, got {one_line(repr(head))}; pass kind="
    raise FormatError(message + ", ".join(("odim", "npz", *FORMATS)) + ", or unpack a compressed file")


def _kind_of_hdf5(file: Path) -> str:
    """Tell the formats that are HDF5 inside by the groups they are made of."""
    h5py = extra("h5py", "HDF5", "h5py")
    with wrapped(file, "HDF5 file"), h5py.File(file, "r") as root:
        # A name that is no UTF-8 comes as bytes.
        names = {str(name) for name in root}
    if "dataset1" in names:
        return "odim"
    if "scan0" in names:
        return "gamic"
    return "cfradial2" if any(name.startswith("sweep_0") for name in names) else "cfradial1"
