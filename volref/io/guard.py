"""What every reader does before it trusts a file: is it there, is it small enough, may it be opened.

A file is data from a stranger.  Its header is read first, the memory it asks for is compared with a limit
and with the size of the file, and only then is anything allocated.  Whatever a library raises on the way
becomes a `FormatError` of one sentence.
"""

import difflib
import importlib
import json
import math
import zlib
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path, PureWindowsPath
from types import ModuleType
from typing import Any, TypeAlias

from volref.errors import FormatError, SceneError

# An object of a library that states no types, or of a JSON document already checked.
Foreign: TypeAlias = Any

GIB = 2**30
DEFAULT_MAX_BYTES = 16 * GIB
LARGEST_JSON_BYTES = 2**28

# Deflate's best case: a match of 258 bytes in 2 bits, and a code of one bit for its distance is included
# (zlib, "Technical Details": the limit is 1032 to 1).
DEFLATE_RATIO = 1032
DEFLATE_SLACK = 2**16
# What a chunk may have beyond the samples: files of a few voxels are stored in chunks of usual sizes.
CHUNK_SLACK = 2**25


def existing_file(path: str | Path) -> Path:
    """Return `path` after checking that it is a file with something in it.

    Raises
    ------
    FormatError
        If there is no such file, or it is empty.
    """
    file = Path(path)
    try:
        found = file.stat().st_size if file.is_file() else None
    except (OSError, ValueError) as error:
        message = (
            f"{one_line(str(path))} must be a file that can be read, got {one_line(error)}; check the path"
        )
        raise FormatError(message) from error
    if found is None:
        got = "a folder" if file.is_dir() else "no such file"
        message = f"{one_line(str(path))} must be a file that exists, got {got}; check the path"
        raise FormatError(message)
    if found == 0:
        message = f"{file.name} must hold data, got an empty file; write it again"
        raise FormatError(message)
    return file


def existing_path(path: str | Path) -> Path:
    """Return `path` after checking that it is a folder, or a file with something in it.

    Raises
    ------
    FormatError
        If it is neither.
    """
    with suppress(OSError, ValueError):
        if Path(path).is_dir():
            return Path(path).resolve()
    return existing_file(path)


def path_inside(file: Path, text: str, *, allow_outside: bool | None = None) -> Path:
    """Return the path that `file` names by `text`, links followed, after checking it stays in its folder.

    `allow_outside` is None where the caller offers its user no such choice.

    Raises
    ------
    FormatError
        If the path leads out of the folder and `allow_outside` is not True.
    """
    folder = file.parent
    try:
        target = (folder / text).resolve()
        inside = target.is_relative_to(folder.resolve())
    except (OSError, ValueError, RuntimeError) as error:
        message = f"{file.name}: path must name a file, got {one_line(text)!r} ({one_line(error)}); change it"
        raise FormatError(message) from error
    stated_elsewhere = Path(text).is_absolute() or bool(PureWindowsPath(text).drive)
    if allow_outside or (inside and not stated_elsewhere):
        return target
    message = f"{file.name}: path must stay inside the folder of this file, got {one_line(text)!r}; "
    choice = "" if allow_outside is None else " or pass allow_outside=True"
    raise FormatError(message + "copy the file there and name it relative to this one" + choice)


def check_memory(file: Path, needed: int, max_bytes: int, what: str) -> None:
    """Refuse a file whose contents would take more than `max_bytes` of memory.

    Raises
    ------
    FormatError
        If it would.

    Examples
    --------
    >>> check_memory(Path("head.npy"), 10**12, 2**34, "10000 x 10000 x 10000 uint8")
    Traceback (most recent call last):
    volref.errors.FormatError: head.npy must need at most 16 GiB of memory, got 931.3 GiB ...
    """
    if needed <= max_bytes:
        return
    message = f"{file.name} must need at most {spell_bytes(max_bytes)} of memory, got {spell_bytes(needed)} "
    message += f"({what}); pass max_bytes={needed} to allow it"
    raise FormatError(message)


def check_held(file: Path, needed: int, held: int, what: str) -> None:
    """Refuse a file that does not hold exactly the bytes its header (or its user) says.

    Raises
    ------
    FormatError
        If it holds fewer or more.
    """
    if held == needed:
        return
    state = "is cut short" if held < needed else "holds more than that"
    message = f"{file.name} must hold {needed} bytes ({what}), got {held}; "
    raise FormatError(message + f"the file {state}, so check its size, type and skip")


def check_deflated(file: Path, needed: int, compressed: int, what: str) -> None:
    """Refuse a deflated stream too short to hold `needed` bytes at the best ratio that deflate has.

    Raises
    ------
    FormatError
        If it is too short: the header lies, and nothing needs to be allocated to know it.
    """
    if needed <= DEFLATE_RATIO * compressed + DEFLATE_SLACK:
        return
    message = (
        f"{file.name} must hold {needed} bytes ({what}), got {compressed} compressed bytes, which cannot; "
    )
    raise FormatError(message + "write the file again")


def check_inflated(file: Path, data: bytes, most: int, what: str) -> None:
    """Refuse a zlib or gzip stream that unpacks to more than `most` bytes; nothing of it is kept.

    For libraries that unpack a whole stream before they look at its length.

    Raises
    ------
    FormatError
        If it unpacks to more.
    """
    stream, length = zlib.decompressobj(47), 0
    while data and not stream.eof:
        length += len(stream.decompress(data, 2**20))
        data = stream.unconsumed_tail
        if length > most:
            message = f"{file.name} must unpack to at most {most} bytes at once ({what}), got more; "
            raise FormatError(message + "write the file again")


def check_chunk(file: Path, chunk: int, needed: int) -> None:
    """Refuse chunks (tiles, strips) that would take far more memory to unpack than all samples together.

    Raises
    ------
    FormatError
        If a chunk has more bytes than that.
    """
    if chunk <= 2 * needed + CHUNK_SLACK:
        return
    message = (
        f"{file.name} must be stored in chunks of the size of its {spell_bytes(needed)} of samples, got "
    )
    raise FormatError(message + f"chunks of {spell_bytes(chunk)}; write the file again")


@contextmanager
def wrapped(file: Path, kind: str, cure: str = "write the file again or check its suffix") -> Iterator[None]:
    """Turn whatever a library raises inside this block into a FormatError of one sentence.

    Raises
    ------
    FormatError
        In place of any other exception.  volref's own errors pass unchanged.
    """
    try:
        yield
    except (SceneError, FormatError):
        raise
    except Exception as error:
        message = f"{file.name} must be a readable {kind}, got {one_line(error)}; {cure}"
        raise FormatError(message) from error


def extra(module: str, name: str, package: str) -> ModuleType:
    """Return an optional module.

    Raises
    ------
    FormatError
        If it is not installed; the sentence holds the command that installs it.
    """
    try:
        return importlib.import_module(module)
    except ImportError as error:
        message = f"{package} must be installed to read or write {name} files, got no module {module!r}; "
        raise FormatError(message + f"run: pip install 'volref[{name.lower()}]'") from error


def read_json(path: Path) -> object:
    """Return the document in a JSON file; numbers must be finite and keys may stand only once.

    Whole numbers of 20 digits and more are returned as floats, which is what every rule allows them to be.

    Raises
    ------
    FormatError
        If the file is no such document.
    """
    file = existing_file(path)
    check_memory(file, file.stat().st_size, LARGEST_JSON_BYTES, "JSON text")
    with wrapped(file, "JSON document", "mend it at that place"):
        return parse_json(file.read_text(encoding="utf-8"))


def parse_json(text: str) -> object:
    """Return the document in a JSON text, by the rules of `read_json`.

    Raises
    ------
    ValueError
        If the text is none; `wrapped` makes a FormatError of it.
    """
    return json.loads(
        text,
        parse_constant=_refuse_constant,
        parse_float=_finite_float,
        parse_int=_bounded_int,
        object_pairs_hook=_once,
    )


def nearest(word: str, known: Iterable[str]) -> str:
    """Return a cure for an unknown word: the nearest known one, or all of them.

    Examples
    --------
    >>> nearest("fov_z", ("near", "far", "fov_y"))
    "use 'fov_y'"
    >>> nearest("zzz", ("near", "far"))
    'use one of far, near'
    """
    words = sorted(known)
    close = difflib.get_close_matches(word, words, n=1)
    if close:
        return f"use {close[0]!r}"
    return f"use one of {', '.join(words)}" if words else "remove it"


def one_line(error: BaseException | str) -> str:
    """Return a message as one line without a semicolon, which is the mark before a cure.

    Examples
    --------
    >>> one_line("bad" + chr(10) + "  file; sorry")
    'bad file, sorry'
    """
    text = " ".join("".join(c if c.isprintable() else " " for c in str(error)).split()).replace(";", ",")
    if not text and isinstance(error, BaseException):
        text = type(error).__name__
    return text if len(text) <= 160 else text[:157] + "..."


def spell_bytes(count: int) -> str:
    """Return a byte count for people.

    Examples
    --------
    >>> spell_bytes(2**34), spell_bytes(10)
    ('16 GiB', '10 bytes')
    """
    for name, unit in (("GiB", GIB), ("MiB", 2**20), ("KiB", 2**10)):
        if count >= unit:
            return f"{count / unit:.1f} {name}".replace(".0 ", " ")
    return f"{count} bytes"


def _refuse_constant(text: str) -> float:
    message = f"the number {text}, which JSON does not have"
    raise ValueError(message)


def _finite_float(text: str) -> float:
    value = float(text)
    return value if math.isfinite(value) else _refuse_constant(text)


def _bounded_int(text: str) -> int | float:
    if len(text) < 20:
        return int(text)
    # Not int(text): Python is slow with thousands of digits, and a message would show them all.
    value = float(text)
    if math.isfinite(value):
        return value
    message = f"a whole number of {len(text.removeprefix('-'))} digits, beyond the largest float64"
    raise ValueError(message)


def _once(pairs: list[tuple[str, object]]) -> dict[str, object]:
    document = dict(pairs)
    if len(document) < len(pairs):
        names = [name for name, _ in pairs]
        twice = next(name for name in names if names.count(name) > 1)
        message = f"the key {twice!r} twice"
        raise ValueError(message)
    return document
