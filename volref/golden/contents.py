"""The files of a bundle: their names, sizes and SHA-256, written down and held to it.

A bundle may come from a stranger: names are checked before any file is opened, sizes before any is read, and
what a file holds before any number in it is used.
"""

import hashlib
import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from volref.errors import FormatError
from volref.io.guard import Foreign, check_memory, one_line, path_inside

MANIFEST = "manifest.json"

MOST_FILES, LONGEST_PATH = 10_000, 200

# Letters that mean the same on every file system and in every URL; no part begins with a dot.
_PART = r"[A-Za-z0-9_-][A-Za-z0-9_.-]*"
_PATH = re.compile(rf"{_PART}(/{_PART})*")


def listed_files(folder: Path) -> list[dict[str, Any]]:
    """Return path, bytes and SHA-256 of every file in a folder but for the manifest, by path.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as here:
    ...     _ = (Path(here) / "a.txt").write_text("abc")
    ...     listed_files(Path(here))
    [{'path': 'a.txt', 'bytes': 3, 'sha256': 'ba7816bf...'}]
    """
    paths = {file.relative_to(folder).as_posix(): file for file in folder.rglob("*") if file.is_file()}
    return [
        {"path": path, "bytes": file.stat().st_size, "sha256": sha256_of(file)}
        for path, file in sorted(paths.items())
        if path != MANIFEST
    ]


def sha256_of(file: Path) -> str:
    """Return the SHA-256 of what a file holds, as hexadecimal digits."""
    with file.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def check_path(where: str, path: str) -> None:
    """Refuse a path that is no plain one within a bundle.

    Raises
    ------
    FormatError
        If it is absolute, leads out, or has letters beyond A-Z a-z 0-9 . _ - and /.

    Examples
    --------
    >>> check_path("files[0].path", "expected/lo.npy")
    >>> check_path("files[0].path", "../lo.npy")
    Traceback (most recent call last):
    volref.errors.FormatError: manifest.json: files[0].path must be a plain path inside the bundle, got ...
    """
    if len(path) <= LONGEST_PATH and _PATH.fullmatch(path):
        return
    message = f"{MANIFEST}: {where} must be a plain path inside the bundle, got {one_line(path)!r}; "
    raise FormatError(message + "use letters, digits, . _ - and /, no part with a dot in front")


def check_name(file: Path, name: str) -> None:
    """Refuse a name that could not be a folder's.

    Raises
    ------
    FormatError
        If it has letters beyond A-Z a-z 0-9 . _ - or begins with a dot.
    """
    if len(name) <= LONGEST_PATH and re.fullmatch(_PART, name):
        return
    message = f"{file.name}: name must be of letters, digits, . _ and -, got {one_line(name)!r}; "
    raise FormatError(message + "rename it")


def checked_files(folder: Path, entries: Foreign, max_bytes: int) -> dict[str, Path]:
    """Return the files of a manifest by path, after checking that they hold what it says.

    Raises
    ------
    FormatError
        If a path leads out of the folder or comes twice, a file is missing or is not the one that was
        listed, or they would take more than `max_bytes` together.
    """
    if len(entries) > MOST_FILES:
        message = f"{MANIFEST}: files must have at most {MOST_FILES} items, got {len(entries)}; split it"
        raise FormatError(message)
    check_memory(folder / MANIFEST, sum(entry["bytes"] for entry in entries), max_bytes, "all files")
    files: dict[str, Path] = {}
    for number, entry in enumerate(entries):
        path = entry["path"]
        check_path(f"files[{number}].path", path)
        if path.lower() in {known.lower() for known in files} or path == MANIFEST:
            message = f"{MANIFEST}: files must list each file once, got {path!r} again; make the bundle again"
            raise FormatError(message)
        files[path] = path_inside(folder / MANIFEST, path)
        _check_file(path, files[path], entry)
    return files


def check_listed(paths: Iterable[str], files: Mapping[str, Path]) -> None:
    """Refuse paths that are not among the files of a bundle.

    Raises
    ------
    FormatError
        If one is not.
    """
    for path in paths:
        if path not in files:
            message = f"{MANIFEST}: files must list every file that is named, got none for "
            raise FormatError(message + f"{one_line(path)!r}; make the bundle again")


def _check_file(path: str, file: Path, entry: Mapping[str, Any]) -> None:
    """Refuse a file that is not there, or is not the one that was listed."""
    got = None
    if not file.is_file():
        got = "no such file"
    elif file.stat().st_size != entry["bytes"]:
        got = f"{file.stat().st_size} bytes in place of {entry['bytes']}"
    elif sha256_of(file) != entry["sha256"]:
        got = "another SHA-256"
    if got is not None:
        message = f"{path} must be the file that the manifest lists, got {got}; "
        raise FormatError(message + "make the bundle again, or fetch it again")
