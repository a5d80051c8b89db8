"""A series in time from files, each read when it is needed."""

from collections.abc import Callable, Sequence
from functools import lru_cache, partial
from pathlib import Path

from numpy.typing import ArrayLike

from volref.arrays import one_of
from volref.errors import FormatError
from volref.io.guard import Foreign, existing_file, one_line
from volref.io.npy import npz_headers
from volref.io.radar.door import holds_radar, load_radar
from volref.io.readers import READERS, suffix_of
from volref.io.volumes import load_volume
from volref.scene.series import Frame, Series

KINDS = ("volume", "radar")

# Volumes of a series that stay in memory: the two that a time lies between.
KEPT = 2

# How radars are called; what they hold is for `load_radar` to find out.
RADAR_SUFFIXES = (".npz", ".h5", ".hdf5", ".hdf", ".nc", ".vol", ".raw", ".uf", ".ar2v", ".gz")


def load_series(
    paths: str | Path | Sequence[str | Path],
    times: ArrayLike | None = None,
    *,
    kind: str | None = None,
    **statement: Foreign,
) -> Series:
    """Series of the volumes in files, which are read when they are needed; the last two stay in memory.

    Parameters
    ----------
    paths
        A folder, whose files are taken in the order of their names: name them frame_01, frame_02 and so on.
        Or a list of paths in order of time.  Or one radar .npz whose `codes` have four axes, time first.
    times
        Seconds, one for each; default 0, 1, 2 ...
    kind
        "volume", read by `volref.load_volume`, or "radar", by `volref.load_radar`; default what the first
        file is.
    statement
        What these are to be told, for every file.

    Raises
    ------
    FormatError
        If there is no such file, or a folder holds files of several formats.
    SceneError
        If the times do not rise, or there are not as many as volumes.
    """
    kind = _kind_of(paths) if kind is None else one_of("kind", kind, KINDS)
    files = _files_in(Path(paths), kind) if isinstance(paths, str | Path) else [Path(path) for path in paths]
    if not files:
        message = "series must have at least one file, got none; name a folder or files"
        raise FormatError(message)
    read: Callable[..., Frame] = load_radar if kind == "radar" else load_volume
    load: Callable[..., Frame] = lru_cache(maxsize=KEPT)(partial(read, **statement))
    loaders: list[Frame | Callable[[], Frame]] = []
    for file in files:
        instants = _instants(file, kind)
        loaders += (
            [partial(load, file)]
            if instants is None
            else [partial(load, file, time=i) for i in range(instants)]
        )
    return Series(loaders, range(len(loaders)) if times is None else times)


def _kind_of(paths: str | Path | Sequence[str | Path]) -> str:
    """Return what the first file is, "volume" where there is none."""
    named = [Path(paths)] if isinstance(paths, str | Path) else [Path(path) for path in paths]
    if len(named) == 1 and named[0].is_dir():
        named = sorted(entry for entry in named[0].iterdir() if entry.name[0] != ".")
    files = [path for path in named if path.is_file() and path.suffix.lower() in RADAR_SUFFIXES]
    return "radar" if files and holds_radar(files[0]) else "volume"


def _files_in(path: Path, kind: str) -> list[Path]:
    """Return the files of a folder that `kind` is read from, in the order of their names; or a file alone."""
    if not path.is_dir():
        return [existing_file(path)]
    known = tuple(READERS) if kind == "volume" else RADAR_SUFFIXES
    files = sorted(entry for entry in path.iterdir() if entry.name[0] != "." and suffix_of(entry) in known)
    suffixes = sorted({suffix_of(file) for file in files})
    if len(suffixes) == 1:
        return files
    if not files:
        message = (
            f"{one_line(path.name)} must hold files of a series, got none that end in {', '.join(known)}; "
        )
        raise FormatError(message + "convert them, or name the files")
    message = f"{one_line(path.name)} must hold files of one format, got {', '.join(suffixes)}; "
    raise FormatError(message + "name the files in place of the folder")


def _instants(file: Path, kind: str) -> int | None:
    """Return how many times a radar file holds, if it has an axis for them."""
    if kind != "radar" or file.suffix.lower() != ".npz":
        return None
    header = npz_headers(file).get("codes")
    return header.shape[0] if header is not None and len(header.shape) == 4 else None
