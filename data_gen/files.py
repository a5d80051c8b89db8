"""Items as files: what volref reads comes from volref's own writers, so it loads with its placement."""

import io
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from data_gen.catalogue import Entry, Item
from volref.arrays import Floats, Integers
from volref.image import bytes_from_unit
from volref.io import atomic_path, save_transfer, save_volume
from volref.io.atomic import check_free
from volref.phantoms.storms import CLEAR_DBZ, PolarScan, codes_from_dbz
from volref.scene import Mesh, TransferFunction, Volume


def names_of(stem: str, item: Item) -> tuple[str, ...]:
    """Return the names of the files of one item.

    Volume: STEM.npy, array (nz, ny, nx), and STEM.npy.json.  Radar: STEM.npz and STEM.npz.json.  Mesh:
    STEM.ply, or with a texture STEM.obj, .mtl and .png.  Transfer function: STEM.json.  And for each
    STEM.about.json: what it is, that it is made up, and its seed.

    Examples
    --------
    >>> names_of("tiny", Volume(np.zeros((2, 2, 2))))
    ('tiny.about.json', 'tiny.npy', 'tiny.npy.json')
    """
    if isinstance(item, Volume):
        suffixes: tuple[str, ...] = (".npy", ".npy.json")
    elif isinstance(item, PolarScan):
        suffixes = (".npz", ".npz.json")
    elif isinstance(item, TransferFunction):
        suffixes = (".json",)
    else:
        suffixes = (".ply",) if item.texture is None else (".obj", ".mtl", ".png")
    return tuple(stem + suffix for suffix in (".about.json", *suffixes))


def write_items(
    folder: Path, items: dict[str, tuple[Entry, Item]], seed: int, *, force: bool
) -> Iterator[Path]:
    """Write items by stem, each file whole or not at all, and yield the paths.

    Raises
    ------
    FormatError
        If one of the files is there already and `force` is not given; then nothing is written.
    """
    for stem, (_, item) in items.items():
        for name in names_of(stem, item):
            check_free(folder / name, overwrite=force)
    folder.mkdir(parents=True, exist_ok=True)
    for stem, (entry, item) in items.items():
        about = {"about": entry.about, "made_up": True, "seed": seed if entry.seeded else None}
        _write(folder / f"{stem}.about.json", _json(about), force=force)
        _write_item(folder, stem, item, force=force)
        yield from (folder / name for name in names_of(stem, item))


def _write_item(folder: Path, stem: str, item: Item, *, force: bool) -> None:
    if isinstance(item, Volume):
        save_volume(item, folder / f"{stem}.npy", overwrite=force)
    elif isinstance(item, TransferFunction):
        save_transfer(item, folder / f"{stem}.json", overwrite=force)
    else:
        parts = _polar(stem, item) if isinstance(item, PolarScan) else _mesh(stem, item)
        for name, content in parts.items():
            _write(folder / name, content, force=force)


def _write(path: Path, content: bytes, *, force: bool) -> None:
    with atomic_path(path, overwrite=force) as temporary:
        temporary.write_bytes(content)


def ply_text(vertices: Floats, faces: Integers) -> str:
    """Return an ASCII PLY; coordinates are written so that reading them back gives the same float64.

    Examples
    --------
    >>> print(ply_text(np.array([(0.1, 0, 0), (1, 0, 0), (0, 1, 0)]), np.array([(0, 1, 2)])).splitlines()[-4])
    0.1 0.0 0.0
    """
    head = ["ply", "format ascii 1.0", "comment made up by volref", f"element vertex {len(vertices)}"]
    head += [f"property double {axis}" for axis in "xyz"]
    head += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header"]
    points = [" ".join(map(repr, point)) for point in vertices.tolist()]
    corners = [" ".join(map(str, (3, *face))) for face in faces.tolist()]
    return "\n".join([*head, *points, *corners]) + "\n"


def _mesh(stem: str, mesh: Mesh) -> dict[str, bytes]:
    if mesh.texture is not None:
        return _textured_obj(stem, mesh)
    return {f"{stem}.ply": ply_text(mesh.vertices, mesh.faces).encode()}


def _textured_obj(stem: str, mesh: Mesh) -> dict[str, bytes]:
    from PIL import Image

    assert mesh.uv is not None
    assert mesh.texture is not None
    lines = ["# made up by volref", f"mtllib {stem}.mtl", f"usemtl {stem}"]
    lines += ["v " + " ".join(map(repr, point)) for point in mesh.vertices.tolist()]
    lines += ["vt " + " ".join(map(repr, point)) for point in mesh.uv.tolist()]
    lines += ["f " + " ".join(f"{i + 1}/{i + 1}" for i in face) for face in mesh.faces.tolist()]
    material = f"newmtl {stem}\nKd 1 1 1\nmap_Kd {stem}.png\n"
    picture = io.BytesIO()
    Image.fromarray(bytes_from_unit(mesh.texture)).save(picture, "PNG")
    return {
        f"{stem}.obj": ("\n".join(lines) + "\n").encode(),
        f"{stem}.mtl": material.encode(),
        f"{stem}.png": picture.getvalue(),
    }


def _polar(stem: str, scan: PolarScan) -> dict[str, bytes]:
    record = {
        "order": "sweep, azimuth, gate",
        "dbz": "code * gain + offset, code 0 undetected",
        "gain": 0.5,
        "offset": CLEAR_DBZ,
    }
    return {f"{stem}.npz": _polar_npz(scan), f"{stem}.npz.json": _json(record)}


def _polar_npz(scan: PolarScan) -> bytes:
    buffer = io.BytesIO()  # NumPy dates the members 1980-01-01, so equal scans give equal bytes
    np.savez_compressed(
        buffer,
        elevation_deg=scan.elevation_deg,
        azimuth_deg=scan.azimuth_deg,
        range_m=scan.range_m,
        time_s=scan.time_s,
        codes=codes_from_dbz(scan.dbz),
    )
    return buffer.getvalue()


def _json(record: dict[str, Any]) -> bytes:
    return (json.dumps(record, indent=1) + "\n").encode()
