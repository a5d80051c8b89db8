"""Folders that appear whole or not at all, as `atomic` has it for files.

A folder is made beside its place as `.NAME.HEX.part` and renamed when all of it is there; its files reach the
disk if `atomic_path` writes them.  With
`overwrite` the old one moves to `.NAME.HEX.old` first, and is removed after the rename; whoever comes next
puts it back if a crash fell between the two.
"""

import contextlib
import os
import re
import shutil
import time
import uuid
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from volref.errors import FormatError
from volref.io.guard import one_line

# Seconds after which a `.part` that nothing was written to is taken for one whose maker was killed.
STALE_SECONDS = 24 * 3600.0

# How often others that replace the same folder may come in between.
MOST_TRIES = 100


@contextmanager
def atomic_folder(
    path: str | Path, *, overwrite: bool = False, replaceable: Callable[[Path], bool] = lambda _: True
) -> Iterator[Path]:
    """Yield a new folder beside `path`; rename it to `path` when the block ends well, else remove it.

    Of several that make one folder at a time, one gets its place, and the others the error of a folder that
    is there; with `overwrite` the last one's stays.

    Parameters
    ----------
    overwrite
        Whether a folder that is there is replaced.
    replaceable
        Whether a folder is of the kind that may be: of a mistyped name nothing is lost.

    Raises
    ------
    FormatError
        If `path` exists and `overwrite` is False, it is not replaceable, or it cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as here:
    ...     with atomic_folder(Path(here) / "golden") as part:
    ...         _ = (part / "a.txt").write_text("whole")
    ...     sorted(str(file.relative_to(here)) for file in Path(here).rglob("*"))
    ['golden', 'golden/a.txt']
    """
    target = Path(path)
    with _explained(target):
        target.parent.mkdir(parents=True, exist_ok=True)
        _tidy(target)
    _check_place(target, replaceable, overwrite=overwrite)
    part = _sibling(target, "part")
    try:
        with _explained(target):
            part.mkdir()
        yield part
        with _explained(target):
            _move(part, target, replaceable, overwrite=overwrite)
    finally:
        shutil.rmtree(part, ignore_errors=True)


def _check_place(target: Path, replaceable: Callable[[Path], bool], *, overwrite: bool) -> None:
    if not os.path.lexists(target):
        return
    if not target.is_dir() or target.is_symlink():
        message = f"{target} must be a folder that does not exist yet, got a file or a link; "
        raise FormatError(message + "choose another name")
    if not overwrite:
        message = f"{target} must not exist yet, got a folder that does; "
        raise FormatError(message + "choose another name, or pass overwrite=True (--force)")
    if any(target.iterdir()) and not replaceable(target):
        message = f"{target} must be a folder that this may replace, got one with other things in it; "
        raise FormatError(message + "choose another name, or remove it yourself")


def _move(part: Path, target: Path, replaceable: Callable[[Path], bool], *, overwrite: bool) -> None:
    """Rename `part` to `target`; a folder that is there meanwhile is refused or replaced."""
    for _ in range(MOST_TRIES):
        _check_place(target, replaceable, overwrite=overwrite)
        old = _sibling(target, "old")
        if overwrite:
            with contextlib.suppress(FileNotFoundError):
                target.rename(old)
        try:
            part.rename(target)
        except OSError:
            if not target.is_dir():
                raise
            continue  # another one came in between
        finally:
            if not os.path.lexists(target) and old.exists():
                old.rename(target)
            shutil.rmtree(old, ignore_errors=True)
        return
    message = f"{target} must not be replaced by others all the time, got that {MOST_TRIES} times over; "
    raise FormatError(message + "let one process write it")


def _tidy(target: Path) -> None:
    """Put back what a crash between two renames left, and remove what a killed maker left long ago."""
    pattern = re.compile(re.escape(f".{target.name}.") + r"[0-9a-f]{32}\.(part|old)")
    for entry in target.parent.iterdir():
        kind = pattern.fullmatch(entry.name)
        with contextlib.suppress(OSError):
            if kind and kind[1] == "old" and not os.path.lexists(target):
                entry.rename(target)
            elif kind and time.time() - entry.stat().st_mtime > STALE_SECONDS:
                shutil.rmtree(entry, ignore_errors=True)


def _sibling(target: Path, kind: str) -> Path:
    return target.with_name(f".{target.name}.{uuid.uuid4().hex}.{kind}")


@contextmanager
def _explained(target: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        message = f"{target} must be a folder that can be written, got {one_line(error)}; "
        raise FormatError(message + "choose a place that exists and has room") from error
