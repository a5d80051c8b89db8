"""Digests of contents: equal numbers have equal digests, whatever packed them.

The SHA-256 of a compressed file follows from the compressor too, and a header from who wrote it.  A digest
is that of the numbers: type, shape and bytes of each array, least byte first, in C order.
"""

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from volref.arrays import Numbers
from volref.errors import FormatError
from volref.io.guard import DEFAULT_MAX_BYTES, Foreign, read_json
from volref.io.npy import npz_headers, read_npy, read_npz

# What an interval consists of.
INTERVAL = ("lo", "hi", "raw_lo", "raw_hi", "ambiguous", "drawn")


def digest_of_array(array: Numbers) -> str:
    """Return the digest of an array.

    Examples
    --------
    >>> one = digest_of_array(np.zeros((2, 3), ">f8"))
    >>> one == digest_of_array(np.zeros((2, 3), "<f8", order="F")), one == digest_of_array(np.zeros((3, 2)))
    (True, False)
    """
    plain = np.ascontiguousarray(array, array.dtype.newbyteorder("<"))
    head = f"{plain.dtype.str} {plain.shape}".replace("|", "").encode()
    return hashlib.sha256(head + b"\n" + plain.tobytes()).hexdigest()


def digest_of_parts(parts: Mapping[str, str]) -> str:
    """Return the digest of named digests or texts, by name."""
    return digest_of_document(dict(parts))


def digest_of_document(document: object) -> str:
    """Return the digest of plain data: of its JSON with sorted keys.

    Examples
    --------
    >>> digest_of_document({"a": 1, "b": 2}) == digest_of_document({"b": 2, "a": 1})
    True
    """
    text = json.dumps(document, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()


def digest_of_file(file: Path, max_bytes: int = DEFAULT_MAX_BYTES) -> str:
    """Return the digest of what a .npy, .npz or .json file holds; of another file, of its bytes.

    Raises
    ------
    FormatError
        If it cannot be read.
    """
    suffix = file.suffix.lower()
    if suffix == ".npy":
        return digest_of_array(read_npy(file, max_bytes))
    if suffix == ".npz":
        arrays = read_npz(file, tuple(npz_headers(file)), max_bytes)
        return digest_of_parts({name: digest_of_array(array) for name, array in arrays.items()})
    if suffix == ".json":
        return digest_of_document(read_json(file))
    try:
        return hashlib.sha256(file.read_bytes()).hexdigest()
    except OSError as error:
        message = f"{file.name} must be a file that can be read, got {error.strerror}; check the path"
        raise FormatError(message) from error


def digest_of_files(folder: Path, paths: list[str]) -> str:
    """Return the digest of what files of a folder hold, pictures (.png) left out: those are for people."""
    return digest_of_parts({p: digest_of_file(folder / p) for p in paths if not p.endswith(".png")})


def digests_of(folder: Path, document: Foreign) -> dict[str, str | None]:
    """Return the digests of the parts of a bundle; of the interval None where there is none."""
    expected = document["expected"]
    ends = [expected[key] for key in INTERVAL if key in expected]
    inputs = sorted(file.relative_to(folder).as_posix() for file in (folder / "inputs").iterdir())
    return {
        "scene": digest_of_files(folder, sorted(file.name for file in folder.glob("scene.*"))),
        "inputs": digest_of_files(folder, inputs),
        "nominal": digest_of_files(folder, [expected["nominal"]]),
        "passes": digest_of_files(folder, [entry["path"] for entry in document["passes"]]),
        "interval": digest_of_files(folder, ends) if ends else None,
    }
