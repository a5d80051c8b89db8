"""Where output goes: results and JSON to stdout, everything said beside them to stderr."""

import json
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from volref.errors import FormatError

# Endings of the images that commands write.
SUFFIXES = (".png", ".exr", ".npy", ".npz")

# How the command line says what the library's errors say in Python.
CURES = (
    ("pass overwrite=True (--force)", "pass --force"),
    ("pass allow_outside=True", "pass --allow-outside"),
    ("pass max_bytes=", "pass --max-bytes "),
    ("pass step=", "pass --step"),
    ("pass method='march'", "pass --method march"),
    ("pass them or", "pass them with -D or"),
)


def check_targets(targets: list[Path], *, force: bool) -> None:
    """Refuse names of images that could not be written, before the work rather than after it.

    Raises
    ------
    FormatError
        If the ending is no image's, a name comes twice, its folder is not there, or a file has it already.
    """
    from volref.io.atomic import check_free

    for i, target in enumerate(targets):
        if target.suffix.lower() not in SUFFIXES:
            message = f"{target} must end in {', '.join(SUFFIXES)}, got {target.suffix!r}; rename it"
            raise FormatError(message)
        if target in targets[:i]:
            message = f"{target} must be named once, got it twice; give each -o its own name"
            raise FormatError(message)
        if not target.parent.is_dir():
            message = f"{target} must lie in a folder that exists, got {target.parent}; create it first"
            raise FormatError(message)
        check_free(target, overwrite=force)


def print_json(document: object) -> None:
    """Print one JSON document on one line of stdout; numbers that JSON does not have are a bug."""
    print(json.dumps(document, allow_nan=False))


def note(text: str) -> None:
    """Print a remark on stderr."""
    print(f"volref: {text}", file=sys.stderr)


def refuse(message: str) -> None:
    """Print why something cannot be done: one line on stderr, its cure in words of the command line."""
    for python, option in CURES:
        message = message.replace(python, option)
    printable = "".join(letter if letter.isprintable() else " " for letter in message)
    note(" ".join(printable.split()))


def table(document: Mapping[str, Any], indent: int = 0) -> str:
    """Return nested plain data as lines "name  value" for people.

    Examples
    --------
    >>> print(table({"size": [4, 4, 2], "volume": {"dtype": "uint8", "nan": None}}))
    size    4 4 2
    volume
      dtype  uint8
      nan    -
    """
    width = max(map(len, document), default=0)
    lines = []
    for name, value in document.items():
        head = " " * indent + f"{name:<{width}}"
        parts = value if isinstance(value, list) and value and isinstance(value[0], dict) else [value]
        for part in parts:
            if isinstance(part, dict):
                lines += [head.rstrip(), table(part, indent + 2)]
            else:
                lines.append(f"{head}  {_words(part)}")
    return "\n".join(lines)


@contextmanager
def progress(what: str, *, quiet: bool = False) -> Iterator[Callable[[int, int], None] | None]:
    """Yield a callable (done, total) that shows progress on stderr; None where nobody is watching.

    tqdm draws it if it is installed, else one line that is written over again and again.
    """
    if quiet or not sys.stderr.isatty():
        yield None
        return
    try:
        from tqdm import tqdm
    except ImportError:
        with _plain_line(what) as show:
            yield show
        return
    with tqdm(desc=what, leave=False, file=sys.stderr) as bar:

        def show_bar(done: int, total: int) -> None:
            bar.total = total
            bar.update(done - bar.n)

        yield show_bar


@contextmanager
def _plain_line(what: str) -> Iterator[Callable[[int, int], None]]:
    longest = 0

    def show(done: int, total: int) -> None:
        nonlocal longest
        text = f"{what} {done}/{total}"
        longest = max(longest, len(text))
        print(f"\r{text:<{longest}}", end="", file=sys.stderr, flush=True)

    try:
        yield show
    finally:
        print("\r" + " " * longest + "\r", end="", file=sys.stderr, flush=True)


def _words(value: object) -> str:
    if value is None:
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.9g}"
    if isinstance(value, list):
        nested = any(isinstance(part, list) for part in value)
        return ("; " if nested else " ").join(_words(part) for part in value) or "none"
    return str(value)
