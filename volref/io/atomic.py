"""The one place where volref writes files: all of a file appears at once, or nothing does."""

import os
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from volref.errors import FormatError
from volref.io.guard import one_line


@contextmanager
def atomic_path(path: str | Path, *, overwrite: bool = False) -> Iterator[Path]:
    """Yield a temporary path beside `path`; rename it to `path` when the block ends well, else remove it.

    The temporary file lies in the same folder (a rename across file systems is a copy, which can be
    interrupted), ends in the same suffixes, since writers choose a format by them, and starts with a dot.
    Its data reach the disk before the rename.

    Raises
    ------
    FormatError
        If `path` exists and `overwrite` is False, or its folder cannot be written to.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     with atomic_path(Path(folder) / "a.txt") as temporary:
    ...         _ = temporary.write_text("whole")
    ...     (Path(folder) / "a.txt").read_text()
    'whole'
    """
    target = Path(path)
    check_free(target, overwrite=overwrite)
    temporary = target.with_name(f".{uuid.uuid4().hex}.{target.name}")
    try:
        # Created with the user's own permissions: tempfile would make it private.
        temporary.open("xb").close()
        yield temporary
        with temporary.open("rb+") as file:
            os.fsync(file.fileno())
        check_free(target, overwrite=overwrite)
        temporary.replace(target)
    except OSError as error:
        message = f"{target} must be a file that can be written, got {one_line(error)}; "
        raise FormatError(message + "choose a folder that exists and has room") from error
    finally:
        temporary.unlink(missing_ok=True)


def check_free(path: Path, *, overwrite: bool) -> None:
    """Refuse to write over a file that exists, unless told to.

    Raises
    ------
    FormatError
        If `path` exists and `overwrite` is False.
    """
    if overwrite or not os.path.lexists(path):
        return
    message = f"{path} must not exist yet, got a file that does; "
    raise FormatError(message + "choose another name, or pass overwrite=True (--force)")


def write_text(path: str | Path, text: str, *, overwrite: bool = False) -> None:
    """Write a text file, UTF-8, whole or not at all."""
    with atomic_path(path, overwrite=overwrite) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")
