"""Manifests of older formats, taken over one version at a time.

`MIGRATIONS[n]` makes a manifest of version n + 1 of one of version n.  It may look at the folder: sizes of
files for instance were not written down once.  What it makes is checked as if it had been read.
"""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeAlias

from volref.errors import FormatError
from volref.golden.contents import MANIFEST
from volref.io.guard import Foreign, one_line, path_inside

Migration: TypeAlias = Callable[[dict[str, Any], Path], dict[str, Any]]


def migrated(document: dict[str, Any], folder: Path) -> dict[str, Any]:
    """Return a manifest of any known version as one of the newest.

    Raises
    ------
    FormatError
        If the version is not known, or the manifest is none of that version.
    """
    newest = max(MIGRATIONS) + 1
    version = document.get("format_version")
    if type(version) is not int or not 0 <= version <= newest:
        message = f"{MANIFEST}: format_version must be a version from 0 to {newest}, got "
        raise FormatError(message + f"{one_line(repr(version))}; install a newer volref, or make it again")
    for step in range(version, newest):
        document = MIGRATIONS[step](document, folder) | {"format_version": step + 1}
    return document


def _sizes_of_files(document: dict[str, Any], folder: Path) -> dict[str, Any]:
    """Version 0, of drafts: "files" was {path: sha256} without sizes, "recipe_sha256" was "recipe_hash"."""
    files: Foreign = document.get("files")
    if not isinstance(files, Mapping):
        message = f"{MANIFEST}: files must be an object in format 0, got {type(files).__name__}; "
        raise FormatError(message + "make the bundle again")
    entries = []
    for path, digest in files.items():
        file = path_inside(folder / MANIFEST, path)
        entries.append(
            {"path": path, "bytes": file.stat().st_size if file.is_file() else 0, "sha256": digest}
        )
    taken = {key: value for key, value in document.items() if key != "recipe_hash"}
    return taken | {"files": entries, "recipe_sha256": document.get("recipe_hash")}


MIGRATIONS: dict[int, Migration] = {0: _sizes_of_files}
