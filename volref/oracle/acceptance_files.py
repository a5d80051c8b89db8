"""Acceptance intervals in .npz files: a document and arrays, of strangers too.

document                  JSON as bytes: format, version, program, device, causes ...
lo hi nominal             (H, W, 4)
raw_lo raw_hi             (H, W, 4)
ambiguous drawn           (H, W), bool
cause_0 cause_1 ...       (H, W), in the order of the document's "causes"
low_lo low_hi             (H, W, 4), where the intervals with filters of 4 bits are known
"""

import dataclasses
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from volref.arrays import Numbers, whole_number
from volref.emulation.files.documents import LARGEST_BYTES, device_from_dict
from volref.emulation.pipeline import Pipeline
from volref.emulation.switches import check_head
from volref.errors import FormatError, SceneError
from volref.io.guard import (
    DEFAULT_MAX_BYTES,
    check_memory,
    existing_file,
    one_line,
    parse_json,
    spell_bytes,
    wrapped,
)
from volref.io.npy import ArrayHeader, npz_headers, read_npz, write_npz
from volref.oracle.acceptance import Acceptance

FORMAT = "volref-acceptance"
FORMAT_VERSION = 1

IMAGES = ("lo", "hi", "nominal", "raw_lo", "raw_hi")
MARKS = ("ambiguous", "drawn")
COARSE = ("low_lo", "low_hi")
KEYS = ("pipeline", "device", "frames", "seconds", "advice", "causes", "justified")

# There are some ten.
MOST_CAUSES = 100


def save_acceptance(acceptance: Acceptance, path: str | Path, *, overwrite: bool = False) -> None:
    """Write acceptance intervals to a .npz file, with those of low-quality filters where they can be had.

    Raises
    ------
    FormatError
        If the file exists and `overwrite` is False.
    """
    document = {
        "format": FORMAT,
        "version": FORMAT_VERSION,
        "pipeline": acceptance.pipeline.as_dict(),
        "device": json.loads(acceptance.device.to_json()),
        "causes": list(acceptance.causes),
        **{name: getattr(acceptance, name) for name in ("frames", "seconds", "advice", "justified")},
    }
    arrays: dict[str, Numbers] = {"document": np.frombuffer(json.dumps(document).encode(), np.uint8)}
    arrays |= {name: getattr(acceptance, name) for name in (*IMAGES, *MARKS)}
    arrays |= {f"cause_{i}": width for i, width in enumerate(acceptance.causes.values())}
    if acceptance.low_quality is not None:
        coarse = acceptance.low_quality()
        arrays |= {"low_lo": coarse.lo, "low_hi": coarse.hi}
    write_npz(path, arrays, overwrite=overwrite)


def load_acceptance(path: str | Path, *, max_bytes: int = DEFAULT_MAX_BYTES) -> Acceptance:
    """Return the acceptance intervals in a file that `save_acceptance` wrote.

    Raises
    ------
    FormatError
        If it is no such file, or takes more than `max_bytes`.
    """
    file = existing_file(path)
    headers = npz_headers(file)
    document = _document(file, headers)
    causes = document.pop("causes")
    names = (*IMAGES, *MARKS, *(f"cause_{i}" for i in range(len(causes))))
    names += tuple(name for name in COARSE if name in headers)
    _check_arrays(file, headers, names, max_bytes)
    arrays = read_npz(file, names, max_bytes)
    _check_numbers(file, arrays)
    widths = {cause: arrays.pop(f"cause_{i}") for i, cause in enumerate(causes)}
    coarse = [arrays.pop(name) for name in COARSE if name in arrays]
    found = Acceptance(**{**document, **arrays}, causes=widths)
    if not coarse:
        return found
    lo, hi = coarse
    lower = dataclasses.replace(found, lo=lo, hi=hi, raw_lo=lo, raw_hi=hi)
    return dataclasses.replace(found, low_quality=lambda: lower)


def _document(file: Path, headers: Mapping[str, ArrayHeader]) -> dict[str, Any]:
    """Return the fields that are no arrays, checked."""
    header = headers.get("document")
    if header is None or len(header.shape) != 1 or header.dtype != np.uint8:
        message = f"{file.name} must hold acceptance intervals, got a .npz without their document; "
        raise FormatError(message + "write it with volref accept -o")
    if header.data_bytes > LARGEST_BYTES:
        message = f"{file.name}: document must have at most {spell_bytes(LARGEST_BYTES)}, got "
        raise FormatError(message + f"{spell_bytes(header.data_bytes)}; write the file again")
    text = read_npz(file, ("document",), LARGEST_BYTES)["document"].tobytes()
    with wrapped(file, "JSON document", "write the file again"):
        document = parse_json(text.decode("utf-8"))
    try:
        return _fields(document)
    except SceneError as error:
        sentence, _, cure = str(error).rpartition("; ")
        message = f"{file.name}: {one_line(sentence)}; {one_line(cure)}"
        raise FormatError(message) from error


def _fields(document: object) -> dict[str, Any]:
    if not isinstance(document, dict):
        message = f"acceptance must be an object, got {type(document).__name__}; write the file again"
        raise SceneError(message)
    fields = dict(document)
    check_head("acceptance", fields, FORMAT, FORMAT_VERSION)
    if set(fields) != set(KEYS):
        message = f"acceptance must have the keys {', '.join(KEYS)}, got {', '.join(map(str, fields))}; "
        raise SceneError(message + "write the file again")
    kinds: dict[str, type | tuple[type, ...]] = {
        "seconds": (int, float),
        "advice": str,
        "justified": bool,
        "causes": list,
    }
    for name, kind in kinds.items():
        if not isinstance(fields[name], kind):
            message = f"acceptance.{name} must be of another kind, got {fields[name]!r}; write the file again"
            raise SceneError(message)
    causes = fields["causes"]
    texts = all(isinstance(cause, str) for cause in causes)
    if not texts or len(set(causes)) < len(causes) or len(causes) > MOST_CAUSES:
        message = f"acceptance.causes must be at most {MOST_CAUSES} names, each once, got {len(causes)}; "
        raise SceneError(message + "write the file again")
    fields["frames"] = whole_number("acceptance.frames", fields["frames"], low=1, high=2**31)
    fields["pipeline"] = Pipeline.from_dict(fields["pipeline"])
    fields["device"] = device_from_dict(fields["device"])
    return fields


def _check_arrays(
    file: Path, headers: Mapping[str, ArrayHeader], names: tuple[str, ...], max_bytes: int
) -> None:
    """Refuse arrays that are missing, or of other shapes and types, before any is read."""
    missing = [name for name in (*names, *COARSE) if name not in headers]
    if missing and missing != list(COARSE):
        message = f"{file.name} must hold the array {missing[0]!r}, got none; write the file again"
        raise FormatError(message)
    size = headers["lo"].shape[:2]
    for name in names:
        header, image = headers[name], name in (*IMAGES, *COARSE)
        shape = (*size, 4) if image else size
        kind = np.bool_ if name in MARKS else np.float64
        if header.shape != shape or len(size) != 2 or 0 in size or header.dtype != kind:
            message = f"{file.name}: {name} must be {np.dtype(kind)} for an image of one size, got "
            raise FormatError(message + f"{header.description}; write the file again")
    total = sum(headers[name].data_bytes for name in names)
    check_memory(file, total, max_bytes, f"{len(names)} arrays")


def _check_numbers(file: Path, arrays: Mapping[str, Numbers]) -> None:
    """Refuse intervals without a number between their ends; NaN would let everything pass."""
    for low, high in (("lo", "hi"), ("raw_lo", "raw_hi"), COARSE):
        if low in arrays and not (arrays[low] <= arrays[high]).all():
            message = f"{file.name}: {low} must be at most {high} everywhere, got other numbers; "
            raise FormatError(message + "write the file again")
    if not np.isfinite(arrays["nominal"]).all():
        message = f"{file.name}: nominal must be finite, got NaN or infinity; write the file again"
        raise FormatError(message)
