"""`inputs/`: what a GPU program uploads, as it uploads it."""

from pathlib import Path
from typing import Any

import numpy as np

from volref.arrays import Numbers
from volref.emulation.textures.uploads import uploads_of
from volref.io.atomic import write_text
from volref.io.npy import write_npy
from volref.io.png import write_png
from volref.oracle.faults.fault import Subject
from volref.scene.mesh import Mesh


def write_inputs(folder: Path, subject: Subject) -> dict[str, Any]:
    """Write what a program uploads to `inputs/` of a folder; return the manifest's "uploads"."""
    (folder / "inputs").mkdir()
    uploads = uploads_of(subject.scene, subject.pipeline)
    of_volume = "atlas" if subject.pipeline.volume.layout == "atlas" else "volume"
    document: dict[str, Any] = {
        "layout": subject.pipeline.volume.layout,
        "domain": [float(end) for end in uploads.domain],
        "size": [int(n) for n in uploads.size],
        "tiles": [int(n) for n in uploads.tiles],
        "jitter": None,
        "meshes": [_write_mesh(folder, k, mesh) for k, mesh in enumerate(subject.scene.meshes)],
    }
    for key, stem, texels in (("volume", of_volume, uploads.volume), ("table", "transfer", uploads.table)):
        document[key] = write_array(folder, f"inputs/{stem}.npy", texels)
        if _is_picture(texels):
            picture = f"inputs/{stem}.png"
            write_png(folder / picture, texels[..., 0] if texels.shape[-1] == 1 else texels)
            document[f"{key}_picture"] = picture
    if subject.jitter is not None:
        document["jitter"] = write_array(folder, "inputs/jitter.npy", np.asarray(subject.jitter, np.float64))
    return document


def write_array(folder: Path, path: str, array: Numbers) -> str:
    """Write an array in C order, least byte first; return its path."""
    write_npy(folder / path, plain(array))
    return path


def plain(array: Numbers) -> Numbers:
    """Return an array in C order, least byte first.

    Examples
    --------
    >>> plain(np.zeros((2, 2), ">f8", order="F")).dtype.str
    '<f8'
    """
    return np.ascontiguousarray(array, array.dtype.newbyteorder("<"))


def ply_text(mesh: Mesh) -> str:
    """Return vertices and faces as an ASCII PLY; its digits give the same float64 again.

    Examples
    --------
    >>> mesh = Mesh([(0.1, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)])
    >>> ply_text(mesh).splitlines()[-4:]
    ['0.1 0.0 0.0', '1.0 0.0 0.0', '0.0 1.0 0.0', '3 0 1 2']
    """
    head = ["ply", "format ascii 1.0", f"element vertex {len(mesh.vertices)}"]
    head += [f"property double {axis}" for axis in "xyz"]
    head += [f"element face {len(mesh.faces)}", "property list uchar uint vertex_indices", "end_header"]
    points = [" ".join(map(repr, point)) for point in mesh.vertices.tolist()]
    corners = [" ".join(map(str, (3, *face))) for face in mesh.faces.tolist()]
    return "\n".join([*head, *points, *corners]) + "\n"


def _write_mesh(folder: Path, number: int, mesh: Mesh) -> dict[str, str]:
    stem = f"inputs/mesh_{number}"
    write_text(folder / f"{stem}.ply", ply_text(mesh))
    parts: dict[str, Numbers | None] = {
        "vertices": mesh.vertices,
        "faces": mesh.faces.astype(np.uint32),
        "colors": np.atleast_2d(mesh.colors),
        "uv": mesh.uv,
        "texture": mesh.texture,
    }
    written = {
        name: write_array(folder, f"{stem}.{name}.npy", part)
        for name, part in parts.items()
        if part is not None
    }
    return written | {"model": f"{stem}.ply", "coloring": mesh.coloring}


def _is_picture(texels: Numbers) -> bool:
    """Whether a PNG can hold the same bytes."""
    return texels.ndim == 3 and texels.dtype == np.uint8 and texels.shape[-1] in (1, 3, 4)
