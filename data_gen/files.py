"""Items as bytes, the same bytes for the same item, and files that appear whole or not at all."""

import io
import json
import os
from pathlib import Path
from typing import Any

import numpy as np

from data_gen.catalogue import Item
from volref.arrays import Floats, Integers, Numbers
from volref.image import bytes_from_unit
from volref.phantoms.storms import CLEAR_DBZ, PolarScan, codes_from_dbz
from volref.scene import Mesh, TransferFunction, Volume


def files_of(stem: str, item: Item, seed: int | None) -> dict[str, bytes]:
    """Return file names and contents of one item.

    Volume: STEM.npy, array (nz, ny, nx), and STEM.json.  Radar: STEM.npz and STEM.json.  Mesh: STEM.ply, or
    with a texture STEM.obj, .mtl and .png.  Transfer function: STEM.json.

    Examples
    --------
    >>> sorted(files_of("tiny", Volume(np.zeros((2, 2, 2))), None))
    ['tiny.json', 'tiny.npy']
    """
    if isinstance(item, Volume):
        return {f"{stem}.npy": _npy(item.values), f"{stem}.json": _json(_volume_record(stem, item, seed))}
    if isinstance(item, PolarScan):
        return {f"{stem}.npz": _polar_npz(item), f"{stem}.json": _json(_polar_record(stem, item, seed))}
    if isinstance(item, TransferFunction):
        return {f"{stem}.json": _json(_transfer_record(item))}
    if item.texture is None:
        return {f"{stem}.ply": ply_text(item.vertices, item.faces).encode()}
    return _textured_obj(stem, item)


def write_files(folder: Path, contents: dict[str, bytes], *, force: bool) -> list[Path]:
    """Write all files, each under a temporary name that is then renamed; return their paths.

    Raises
    ------
    FileExistsError
        If one is there already and `force` is not given; then nothing is written.
    """
    paths = {name: folder / name for name in contents}
    taken = [path for path in paths.values() if path.exists()]
    if taken and not force:
        message = f"{taken[0]} must not exist yet, got a file; pass --force to replace it"
        raise FileExistsError(message)
    folder.mkdir(parents=True, exist_ok=True)
    for name, path in paths.items():
        partial = folder / f".{name}.{os.getpid()}.partial"
        try:
            partial.write_bytes(contents[name])
            partial.replace(path)
        finally:
            partial.unlink(missing_ok=True)
    return list(paths.values())


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


def _volume_record(stem: str, volume: Volume, seed: int | None) -> dict[str, Any]:
    return {
        "file": f"{stem}.npy",
        "made_up": True,
        "order": "zyx",
        "spacing": list(volume.spacing),
        "origin": list(volume.origin),
        "direction": volume.direction.tolist(),
        "centering": volume.centering,
        "seed": seed,
    }


def _polar_record(stem: str, scan: PolarScan, seed: int | None) -> dict[str, Any]:
    return {
        "file": f"{stem}.npz",
        "made_up": True,
        "order": "sweep, azimuth, gate",
        "dbz": "code * gain + offset, code 0 undetected",
        "gain": 0.5,
        "offset": CLEAR_DBZ,
        "time_s": scan.time_s.tolist(),
        "seed": seed,
    }


def _transfer_record(table: TransferFunction) -> dict[str, Any]:
    assert table.extinction is not None
    return {
        "made_up": True,
        "values": table.values.tolist(),
        "colors": table.colors.tolist(),
        "extinction": table.extinction.tolist(),
    }


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


def _npy(values: Numbers) -> bytes:
    buffer = io.BytesIO()
    np.save(buffer, values, allow_pickle=False)
    return buffer.getvalue()


def _json(record: dict[str, Any]) -> bytes:
    return (json.dumps(record, indent=1) + "\n").encode()
