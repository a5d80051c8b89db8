"""Transfer functions from files: volref's own JSON, tables, and what other programs write.

    .json   volref                       {"format": "volref-transfer", ...}       transfer_json
            ParaView, vtk.js             [{"Name": ..., "RGBPoints": ...}, ...]   transfer_paraview
            3D Slicer up to 5.8          [{"name": ..., "scalarOpacity": ...}]    transfer_slicer
            3D Slicer, .vp.json          {"volumeProperties": ...}                transfer_slicer
            VPT                          [{"position": ..., "size": ...}, ...]    transfer_vpt
    .npy, .png   a lookup table                                                   transfer_table

A JSON file is told by its keys.  Each format takes the options that say what its files leave out; any other
is refused, because a caller would believe to have changed something.
"""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from volref.errors import FormatError
from volref.io.atomic import check_free, write_text
from volref.io.documents import FORMAT_VERSION, check_document, check_format
from volref.io.guard import Foreign, existing_file, nearest, one_line, read_json
from volref.io.npy import write_npy
from volref.io.transfer_json import document_of_domains, document_of_transfer, transfer_of_document
from volref.io.transfer_paraview import transfer_of_map
from volref.io.transfer_slicer import preset_of_properties, preset_of_strings
from volref.io.transfer_table import read_table
from volref.io.transfer_vpt import bumps_of_document, drawn_bumps
from volref.scene.lights import Material
from volref.scene.transfer import TransferFunction
from volref.scene.transfer2d import AnyTransfer, TransferFunction2D
from volref.scene.transfer_checks import checked_domain

FORMAT = "volref-transfer"

# What each kind of file may be told.
OPTIONS = {
    "volref": (),
    "entries": ("domain", "magnitude_domain", "unit_distance", "texel_centers", "interpolation", "units"),
    "entries in rows": ("domain", "magnitude_domain", "unit_distance", "units"),
    "ParaView": ("key", "domain", "unit_distance", "units"),
    "Slicer": ("key", "unit_distance", "mean_spacing", "units"),
    "Slicer .vp.json": ("unit_distance", "mean_spacing", "units"),
    "VPT": ("domain", "magnitude_domain", "unit_distance", "rounded", "blend", "units"),
}


def load_transfer(
    path: str | Path,
    *,
    key: str | None = None,
    domain: Sequence[float] | None = None,
    magnitude_domain: Sequence[float] | None = None,
    unit_distance: float | None = None,
    texel_centers: bool | None = None,
    interpolation: str | None = None,
    mean_spacing: float | None = None,
    rounded: bool | None = None,
    blend: str | None = None,
    units: str | None = None,
) -> AnyTransfer:
    """Transfer function in a file: .json of several programs, or a table of straight RGBA as .npy or PNG.

    A JSON file of volref's own states all itself and takes no option.  Of the others:

    Parameters
    ----------
    key
        ParaView, Slicer: the name of the map or preset, where a file holds several.
    domain
        Values (first, last) that a table spreads over (needed), a ParaView map (default: its own) or the
        bumps of VPT (default (0, 1)).
    magnitude_domain
        Gradient magnitudes (first, last) of the rows of a two-dimensional table (needed), or of VPT's bumps
        (default: 0 to the width of `domain`).
    unit_distance
        The world length for which opacities are meant, default 1 (Slicer's .vp.json: what it says).
    texel_centers, interpolation
        Tables: as in `TransferFunction.from_lut`.
    mean_spacing
        Slicer: the mean of the volume's spacings, per which its gradients are measured; default 1.
    rounded
        VPT: False leaves the canvas unrounded; default True, 8 bits.
    blend
        VPT: "source-alpha" (default) or, as later versions of VPT blend, "premultiplied".
    units
        Unit of the values, for people.

    Raises
    ------
    FormatError
        If the file is no transfer function, or is given what it states itself or has no use for.
    SceneError
        If the transfer function breaks a rule.
    """
    given = _given(
        key=key,
        domain=domain,
        magnitude_domain=magnitude_domain,
        unit_distance=unit_distance,
        texel_centers=texel_centers,
        interpolation=interpolation,
        mean_spacing=mean_spacing,
        rounded=rounded,
        blend=blend,
        units=units,
    )
    file = existing_file(path)
    suffix = file.suffix.lower()
    if suffix in (".npy", ".png"):
        _refuse_others(file, "entries", given)
        return _transfer_of_table(file, given)
    if suffix != ".json":
        message = f"{one_line(file.name)} must end in .json, .npy or .png, got {file.suffix!r}; convert it"
        raise FormatError(message)
    document: Foreign = read_json(file)
    kind = _kind_of(document)
    _refuse_others(file, kind, given)
    if kind == "volref":
        check_format(file, document, FORMAT)
        check_document(file, document, "transfer")
        return transfer_of_document(document, file)
    if kind == "VPT":
        return _transfer_of_bumps(file, document, given)
    if kind == "ParaView":
        entry = _chosen(file, document, "Name", given.get("key"))
        ends = None if "domain" not in given else checked_domain("transfer.domain", given["domain"])
        return transfer_of_map(file, entry, ends, given.get("unit_distance", 1.0), given.get("units", ""))
    return _preset(file, document, kind, given)[0]


def load_preset(
    path: str | Path,
    key: str | None = None,
    *,
    unit_distance: float | None = None,
    mean_spacing: float | None = None,
    units: str | None = None,
) -> tuple[TransferFunction, Material | None]:
    """Transfer function and material of a volume-rendering preset of 3D Slicer; no material: unlit.

    The options are those of `load_transfer`.

    Raises
    ------
    FormatError
        If the file holds no preset, or none of that name.
    SceneError
        If a number breaks a rule.
    """
    given = _given(key=key, unit_distance=unit_distance, mean_spacing=mean_spacing, units=units)
    file = existing_file(path)
    document: Foreign = read_json(file)
    kind = _kind_of(document)
    if not kind.startswith("Slicer"):
        message = f"{one_line(file.name)} must hold presets of Slicer, got another document; "
        raise FormatError(message + "use load_transfer, which reads more")
    _refuse_others(file, kind, given)
    return _preset(file, document, kind, given)


def save_transfer(transfer: AnyTransfer, path: str | Path, *, overwrite: bool = False) -> None:
    """Write a transfer function as JSON; reading it back gives the same numbers, bit for bit.

    The entries of a two-dimensional table go to a .npy file beside it: for `bones.json`, `bones.rgba.npy`.

    Raises
    ------
    FormatError
        If a file exists and `overwrite` is False.
    """
    file = Path(path)
    document: dict[str, Any] = {"format": FORMAT, "format_version": FORMAT_VERSION}
    if isinstance(transfer, TransferFunction2D):
        beside = file.with_name(f"{file.stem}.rgba.npy")
        for name in (file, beside):
            check_free(name, overwrite=overwrite)
        write_npy(beside, transfer.rgba, overwrite=overwrite)
        document |= document_of_domains(transfer) | {"rgba_file": beside.name}
    else:
        document |= document_of_transfer(transfer)
    write_text(file, json.dumps(document, indent=1, allow_nan=False) + "\n", overwrite=overwrite)


def names_of_others(document: Foreign) -> tuple[str, list[str]] | None:
    """Return whose transfer functions a JSON document holds and their names; None if they are volref's own.

    Examples
    --------
    >>> names_of_others([{"Name": "Cool", "RGBPoints": []}, {"Name": "Warm", "RGBPoints": []}])
    ('ParaView', ['Cool', 'Warm'])
    """
    kind = _kind_of(document)
    if kind == "volref":
        return None
    entries = document if isinstance(document, list) and kind != "VPT" else [document]
    entries = [entry for entry in entries if isinstance(entry, dict)]
    names = [entry.get("Name", entry.get("name")) for entry in entries]
    return kind, [str(name) for name in names if name is not None]


def _kind_of(document: Foreign) -> str:
    """Return whose JSON this is; what nobody else writes is for volref's own rules to refuse."""
    first = document[0] if isinstance(document, list) and document else document
    keys = set(first) if isinstance(first, dict) else set()
    if "format" in keys:
        return "volref"
    if "volumeProperties" in keys:
        return "Slicer .vp.json" if isinstance(document, dict) else "volref"
    if keys & {"RGBPoints", "IndexedColors", "ColorSpace"}:
        return "ParaView"
    if keys & {"scalarOpacity", "colorTransfer"}:
        return "Slicer"
    if isinstance(document, list) and {"position", "size", "color"} <= keys:
        return "VPT"
    return "volref"


def _given(**options: object) -> dict[str, Any]:
    """Return the options that were given."""
    return {name: value for name, value in options.items() if value is not None}


def _refuse_others(file: Path, kind: str, given: dict[str, Any]) -> None:
    """Refuse an option that this kind of file has no use for."""
    for name, value in given.items():
        if name not in OPTIONS[kind]:
            takes = f"leave it out, a file of {kind} takes {', '.join(OPTIONS[kind])}"
            cure = takes if OPTIONS[kind] else "change the file, which states all itself"
            message = f"{file.name} must be loaded without {name}, got {one_line(repr(value))}; "
            raise FormatError(message + cure)


def _chosen(file: Path, document: Foreign, name: str, key: str | None) -> Foreign:
    """Return the object of that name in a list, or the only one."""
    entries = document if isinstance(document, list) else [document]
    named = {str(entry.get(name, "")): entry for entry in entries if isinstance(entry, dict)}
    if key is None and len(entries) == 1:
        return entries[0]
    if key is None:
        some = ", ".join(repr(word) for word in list(named)[:3])
        message = f"{file.name} must be given a key, got none for {len(entries)} entries; "
        raise FormatError(message + one_line(f"pass key=NAME, such as {some}"))
    if key not in named:
        message = f"{file.name} must hold what key names, got {one_line(repr(key))}; "
        raise FormatError(message + one_line(nearest(key, named)))
    return named[key]


def _preset(
    file: Path, document: Foreign, kind: str, given: dict[str, Any]
) -> tuple[TransferFunction, Material | None]:
    stated = given.get("unit_distance"), given.get("mean_spacing", 1.0), given.get("units", "")
    if kind == "Slicer":
        return preset_of_strings(file, _chosen(file, document, "name", given.get("key")), *stated)
    return preset_of_properties(file, document, *stated)


def _transfer_of_table(file: Path, given: dict[str, Any]) -> AnyTransfer:
    if "domain" not in given:
        message = f"{file.name} must be given a domain, got none; pass domain=(first value, last value)"
        raise FormatError(message)
    table = read_table(file)
    layout = dict(given)
    ends = checked_domain("transfer.domain", layout.pop("domain"))
    if table.ndim != 3 and "magnitude_domain" not in given:
        return TransferFunction.from_lut(table, ends, **layout)
    if "magnitude_domain" not in given:
        message = f"{file.name} must be given a magnitude_domain, got none for a table of {len(table)} rows; "
        raise FormatError(message + "pass magnitude_domain=(first magnitude, last magnitude)")
    heights = checked_domain("transfer.magnitude_domain", layout.pop("magnitude_domain"))
    _refuse_others(file, "entries in rows", given)
    return TransferFunction2D(table, ends, heights, **layout)


def _transfer_of_bumps(file: Path, document: Foreign, given: dict[str, Any]) -> TransferFunction2D:
    ends = checked_domain("transfer.domain", given.get("domain", (0.0, 1.0)))
    heights = checked_domain(
        "transfer.magnitude_domain", given.get("magnitude_domain", (0.0, ends[1] - ends[0]))
    )
    canvas = drawn_bumps(
        bumps_of_document(file, document),
        rounded=given.get("rounded", True),
        blend=given.get("blend", "source-alpha"),
    )
    length, units = given.get("unit_distance", 1.0), given.get("units", "")
    return TransferFunction2D(canvas, ends, heights, length, units=units)
