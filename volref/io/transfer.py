"""Transfer functions from files: volref's own JSON, or a lookup table as .npy or PNG.

    {"format": "volref-transfer", "format_version": 1,
     "units": "HU", "unit_distance": 1.0, "interpolation": "opacity",
     "values": [-500, 200, 1000], "colors": [[0, 0, 0], [1, 0.8, 0.6], [1, 1, 1]], "opacity": [0, 0.2, 0.9]}

"extinction" may stand in place of "opacity".  With "domain": [a, b] the values are fractions of it, and
knot v lies at a + (b - a) v.  "units" is for the reader.  The schema is `#/$defs/transfer` of the scene's.
"""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from volref.arrays import Numbers, float_array
from volref.errors import FormatError
from volref.io.atomic import write_text
from volref.io.documents import FORMAT_VERSION, check_document, check_format
from volref.io.guard import Foreign, existing_file, one_line, read_json
from volref.io.npy import read_npy
from volref.io.png import read_png
from volref.scene.transfer import TransferFunction

FORMAT = "volref-transfer"
LARGEST_TABLE_BYTES = 2**28


def load_transfer(
    path: str | Path,
    *,
    domain: Sequence[float] | None = None,
    unit_distance: float | None = None,
    texel_centers: bool | None = None,
    interpolation: str | None = None,
) -> TransferFunction:
    """Transfer function in a file: .json, or a lookup table of straight RGBA as .npy (n, 4) or PNG.

    A table needs `domain`, the values (first, last) it spreads over; `unit_distance` (default 1),
    `texel_centers` (default True) and `interpolation` (default "opacity") are as in
    `TransferFunction.from_lut`.  A PNG has one row of pixels, or equal rows.  A JSON file states all that
    itself, and takes none of them.

    Raises
    ------
    FormatError
        If the file is no transfer function, or a JSON file is given what it states itself.
    SceneError
        If the transfer function breaks a rule.
    """
    file = existing_file(path)
    suffix = file.suffix.lower()
    if suffix == ".json":
        _refuse_options(
            file,
            domain=domain,
            unit_distance=unit_distance,
            texel_centers=texel_centers,
            interpolation=interpolation,
        )
        document = read_json(file)
        check_format(file, document, FORMAT)
        check_document(file, document, "transfer")
        return transfer_of_document(document)
    if suffix not in (".npy", ".png"):
        message = f"{one_line(file.name)} must end in .json, .npy or .png, got {file.suffix!r}; convert it"
        raise FormatError(message)
    if domain is None:
        message = f"{file.name} must be given a domain, got none; pass domain=(first value, last value)"
        raise FormatError(message)
    table = read_npy(file, LARGEST_TABLE_BYTES) if suffix == ".npy" else _table_of_png(file)
    first, last = float_array("transfer.domain", domain, (2,)).tolist()
    return TransferFunction.from_lut(
        np.asarray(table),
        (first, last),
        1.0 if unit_distance is None else unit_distance,
        texel_centers=True if texel_centers is None else texel_centers,
        interpolation="opacity" if interpolation is None else interpolation,
    )


def save_transfer(
    transfer: TransferFunction, path: str | Path, *, units: str = "", overwrite: bool = False
) -> None:
    """Write a transfer function as JSON; reading it back gives the same numbers, bit for bit.

    Raises
    ------
    FormatError
        If the file exists and `overwrite` is False.
    """
    document: dict[str, Any] = {"format": FORMAT, "format_version": FORMAT_VERSION}
    document |= {"units": units} if units else {}
    document |= document_of_transfer(transfer)
    write_text(path, json.dumps(document, indent=1, allow_nan=False) + "\n", overwrite=overwrite)


def transfer_of_document(document: Foreign) -> TransferFunction:
    """Return the transfer function in a checked JSON object."""
    values = float_array("transfer.values", document["values"], ("K",))
    if "domain" in document:
        first, last = float_array("transfer.domain", document["domain"], (2,)).tolist()
        values = first + (last - first) * values
    length = document.get("unit_distance", 1.0)
    if "extinction" in document:
        return TransferFunction(values, document["colors"], document["extinction"], unit_distance=length)
    return TransferFunction.from_opacity(
        values,
        document["colors"],
        document["opacity"],
        length,
        interpolation=document.get("interpolation", "opacity"),
    )


def document_of_transfer(transfer: TransferFunction) -> dict[str, Any]:
    """Return the JSON object that `transfer_of_document` reads."""
    document: dict[str, Any] = {"values": transfer.values.tolist(), "colors": transfer.colors.tolist()}
    if transfer.extinction is not None:
        document["extinction"] = transfer.extinction.tolist()
    if transfer.opacity is not None:
        document["opacity"] = transfer.opacity.tolist()
    return document | {"unit_distance": transfer.unit_distance, "interpolation": transfer.interpolation}


def _refuse_options(file: Path, **options: object) -> None:
    """Refuse what only a table takes: a JSON file that a caller believes to have changed would mislead."""
    for name, value in options.items():
        if value is not None:
            message = f"{file.name} must be loaded without {name}, which is for tables, got "
            raise FormatError(message + f"{one_line(repr(value))}; change the file, which states all itself")


def _table_of_png(file: Path) -> Numbers:
    codes = read_png(file, LARGEST_TABLE_BYTES)
    if codes.ndim != 3 or (codes != codes[:1]).any():
        message = (
            f"{file.name} must hold one row of 8-bit RGBA pixels, or equal rows, got shape {codes.shape}"
        )
        raise FormatError(message + " with rows that differ; crop it to one row")
    return np.asarray(codes[0])
