"""volref's own JSON of transfer functions; the schema is `#/$defs/transfer` of the scene's.

    {"format": "volref-transfer", "format_version": 1,
     "units": "HU", "unit_distance": 1.0, "interpolation": "opacity",
     "values": [-500, 200, 1000], "colors": [[0, 0, 0], [1, 0.8, 0.6], [1, 1, 1]], "opacity": [0, 0.2, 0.9],
     "gradient_opacity": [[0, 50], [0, 1]]}

"extinction" may stand in place of "opacity".  With "domain": [a, b] the values are fractions of it, and
knot v lies at a + (b - a) v.  "units" is for the reader.  A table of value and gradient magnitude:

    {"value_domain": [0, 255], "magnitude_domain": [0, 80], "rgba": [[[r, g, b, a], ...], ...]}

with rows by magnitude; in place of "rgba" a "rgba_file" may name a .npy file beside the document.
"""

from pathlib import Path
from typing import Any

import numpy as np

from volref.arrays import float_array
from volref.errors import FormatError
from volref.io.guard import Foreign, path_inside
from volref.io.npy import read_npy
from volref.io.transfer_table import LARGEST_TABLE_BYTES
from volref.scene.transfer import TransferFunction
from volref.scene.transfer2d import AnyTransfer, TransferFunction2D


def transfer_of_document(
    document: Foreign, file: Path | None = None, *, allow_outside: bool | None = None
) -> AnyTransfer:
    """Return the transfer function in a checked JSON object.

    Parameters
    ----------
    file
        The file that the object is from, in whose folder "rgba_file" is looked for.
    allow_outside
        True lets "rgba_file" lead out of that folder; None offers no such choice.
    """
    length, units = document.get("unit_distance", 1.0), document.get("units", "")
    if "value_domain" in document:
        rgba = _table(document, file, allow_outside=allow_outside)
        domains = document["value_domain"], document["magnitude_domain"]
        return TransferFunction2D(rgba, *domains, length, units=units)
    values = float_array("transfer.values", document["values"], ("K",))
    if "domain" in document:
        first, last = float_array("transfer.domain", document["domain"], (2,)).tolist()
        values = first + (last - first) * values
    more = {"gradient_opacity": document.get("gradient_opacity"), "units": units}
    if "extinction" in document:
        return TransferFunction(
            values, document["colors"], document["extinction"], unit_distance=length, **more
        )
    return TransferFunction.from_opacity(
        values,
        document["colors"],
        document["opacity"],
        length,
        interpolation=document.get("interpolation", "opacity"),
        **more,
    )


def document_of_transfer(transfer: AnyTransfer) -> dict[str, Any]:
    """Return the JSON object that `transfer_of_document` reads."""
    if isinstance(transfer, TransferFunction2D):
        return document_of_domains(transfer) | {"rgba": transfer.rgba.tolist()}
    document: dict[str, Any] = {"units": transfer.units} if transfer.units else {}
    document |= {"values": transfer.values.tolist(), "colors": transfer.colors.tolist()}
    if transfer.extinction is not None:
        document["extinction"] = transfer.extinction.tolist()
    if transfer.opacity is not None:
        document["opacity"] = transfer.opacity.tolist()
    if transfer.gradient_opacity is not None:
        document["gradient_opacity"] = [column.tolist() for column in transfer.gradient_opacity]
    return document | {"unit_distance": transfer.unit_distance, "interpolation": transfer.interpolation}


def document_of_domains(transfer: TransferFunction2D) -> dict[str, Any]:
    """Return all of a two-dimensional table but its entries, as JSON."""
    return ({"units": transfer.units} if transfer.units else {}) | {
        "value_domain": list(transfer.value_domain),
        "magnitude_domain": list(transfer.magnitude_domain),
        "unit_distance": transfer.unit_distance,
    }


def _table(document: Foreign, file: Path | None, *, allow_outside: bool | None) -> Foreign:
    if "rgba_file" not in document:
        return document["rgba"]
    if file is None:
        message = "transfer.rgba_file must lie beside a file, got a document by itself; give rgba instead"
        raise FormatError(message)
    named = path_inside(file, document["rgba_file"], allow_outside=allow_outside)
    return np.asarray(read_npy(named, LARGEST_TABLE_BYTES))
