"""Make the scene of `volref demo`: `python -m data_gen.demo HEAD.nii.gz WHITE_MATTER.ply OUT`.

The head is the MNI ICBM152 average without the air around it and without its top, so that the white matter
rises out of the volume; no voxel is changed.  Meshes are not lit when volref renders them, so the light is
baked into the colours of the vertices here:

    colour = ramp(cavity (0.08 + 0.25 fill cavity + 0.8 key)) + highlight

in the working space (linear), for one camera.  Everything follows from the two files: equal files give equal
arrays.  Not copied: NOTICE.txt, which must lie beside the result.
"""

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np

from volref.arrays import Floats, Integers, Numbers
from volref.image import bytes_from_unit
from volref.io.atomic import atomic_path, write_text
from volref.io.meshes import load_mesh
from volref.io.npy import write_npz
from volref.io.volumes import load_volume
from volref.scene.volume import Volume

# World millimetres (RAS): the camera turns about TARGET, AZIMUTH from the front to the right.
TARGET = (0.0, -17.0, 4.0)
AZIMUTH, ELEVATION, DISTANCE, FOV_Y = 57.0, 31.0, 420.0, 25.5

# The volume ends above this height; the white matter goes on to 79 mm.
TOP_MM = 42.5

# Air kept around the head, in voxels: enough for the field to reach 0 inside the volume.
MARGIN = 2

# From the T1 value to colour (linear) and extinction per millimetre: a bright rim where the tissue begins,
# dark grooves, grey matter in deep blue, white matter paler.
VALUES = (0, 5, 75, 115, 150, 195, 255)
EXTINCTION = (0, 0, 0.06, 0.045, 0.055, 0.055, 0.055)
COLORS = (
    (0.25, 0.85, 1.0),
    (0.25, 0.85, 1.0),
    (0.13, 0.55, 1.0),
    (0.02, 0.14, 0.45),
    (0.012, 0.09, 0.32),
    (0.05, 0.24, 0.58),
    (0.05, 0.24, 0.58),
)
BACKGROUND = (0.008, 0.009, 0.013, 1.0)

# The surface's colour (linear) in the shade, in half light, and in full light.
RAMP = ((0.10, 0.012, 0.004), (0.85, 0.27, 0.06), (1.0, 0.75, 0.42))


def demo_head(volume: Volume) -> Volume:
    """Return the part of the head up to TOP_MM, with MARGIN voxels of air at its sides and below."""
    occupied = np.argwhere(volume.values > 0)
    low = np.maximum(occupied.min(axis=0) - MARGIN, 0)
    high = np.minimum(occupied.max(axis=0) + MARGIN + 1, volume.values.shape)
    high[0] = int(np.floor((TOP_MM - volume.origin[2]) / volume.spacing[2])) + 1
    values = volume.values[tuple(slice(a, b) for a, b in zip(low, high, strict=True))]
    origin = volume.world_from_index[:3, :3] @ low[::-1] + volume.world_from_index[:3, 3]
    return Volume(np.ascontiguousarray(values), volume.spacing, origin, volume.direction)


def towards_eye() -> Floats:
    """Return the unit vector from TARGET to the camera.

    Examples
    --------
    >>> towards_eye().round(3).tolist()
    [0.719, 0.467, 0.515]
    """
    azimuth, elevation = np.radians(AZIMUTH), np.radians(ELEVATION)
    level = np.cos(elevation)
    return np.array([np.sin(azimuth) * level, np.cos(azimuth) * level, np.sin(elevation)])


def vertex_normals(vertices: Floats, faces: Integers) -> Floats:
    """Return the unit normals (V, 3): the sum of those of the triangles around, weighted by their areas.

    Examples
    --------
    >>> vertex_normals(np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]), np.array([[0, 1, 2]]))[0].tolist()
    [0.0, 0.0, 1.0]
    """
    corners = vertices[faces]
    area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    total = _sum_at(faces.reshape(-1), np.repeat(area, 3, axis=0), len(vertices))
    return total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), np.finfo(np.float64).tiny)


def cavities(vertices: Floats, faces: Integers, normals: Floats) -> Floats:
    """Return for each vertex (V,) how open it lies, 0 in a groove to 1 on a ridge.

    The height over a smoothed copy of the surface, where each vertex has moved towards the mean of its
    neighbours 60 times, through a logistic curve 1.3 mm wide.
    """
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    edges = np.unique(np.sort(edges, axis=1), axis=0)
    ends, others = np.concatenate([edges, edges[:, ::-1]]).T
    count = np.bincount(ends, minlength=len(vertices))[:, None]
    smooth = vertices
    for _ in range(60):
        smooth = 0.3 * smooth + 0.7 * _sum_at(ends, smooth[others], len(vertices)) / count
    height = ((vertices - smooth) * normals).sum(axis=1)
    return 1 / (1 + np.exp(-(height + 1.2) / 1.3))


def baked_colors(vertices: Floats, faces: Integers) -> Floats:
    """Return the linear colours (V, 3) of the surface: a key light from the upper left, and a fill light."""
    eye = towards_eye()
    right = _unit(np.cross((0.0, 0.0, 1.0), eye))
    up = np.cross(eye, right)
    key, fill = _unit(0.45 * eye - 0.55 * right + 0.8 * up), _unit(0.3 * eye + 0.8 * right - 0.3 * up)
    normals = vertex_normals(vertices, faces)
    cavity = cavities(vertices, faces, normals)
    facing = normals @ key
    wrapped = np.clip(0.35 + 0.65 * facing, 0, 1) * np.sqrt(np.clip(facing, 0, 1))
    filled = np.clip(0.5 + 0.5 * (normals @ fill), 0, 1)
    light = np.clip(cavity * (0.08 + 0.25 * filled * cavity + 0.8 * wrapped), 0, 1)
    highlight = cavity * np.clip(normals @ _unit(key + eye), 0, 1) ** 25
    ramp = np.stack([np.interp(light, (0, 0.5, 1), channel) for channel in np.transpose(RAMP)], axis=1)
    return np.clip(ramp * (0.35 + 0.65 * light[:, None] ** 0.6) + 0.25 * highlight[:, None], 0, 1)


def ply_bytes(vertices: Floats, faces: Integers, colors: Floats) -> bytes:
    """Return a binary little-endian PLY file with a colour of 3 bytes per vertex.

    Examples
    --------
    >>> triangle = ply_bytes(np.zeros((3, 3)), np.array([[0, 1, 2]]), np.ones((3, 3)))
    >>> len(triangle.partition(b"end_header" + bytes([10]))[2])  # 3 x (12 + 3) + 13
    58
    """
    points = np.empty(len(vertices), [("position", "<f4", 3), ("color", "u1", 3)])
    points["position"], points["color"] = vertices, bytes_from_unit(colors)
    triangles = np.empty(len(faces), [("count", "u1"), ("corners", "<i4", 3)])
    triangles["count"], triangles["corners"] = 3, faces
    lines = [
        "ply",
        "format binary_little_endian 1.0",
        "comment MNI ICBM152 white matter, Copyright (C) 1993-2009 Louis Collins, MNI; see NOTICE.txt",
        "comment colours are linear light, with the shading of one camera baked in",
        f"element vertex {len(points)}",
        *(f"property float {axis}" for axis in "xyz"),
        *(f"property uchar {name}" for name in ("red", "green", "blue")),
        f"element face {len(triangles)}",
        "property list uchar int vertex_indices",
        "end_header",
    ]
    return "".join(line + "\n" for line in lines).encode("ascii") + points.tobytes() + triangles.tobytes()


def scene_document() -> dict[str, Any]:
    """Return the scene as JSON, with the head in head.npz and the surface in white_matter.ply."""
    eye = np.round(np.array(TARGET) + DISTANCE * towards_eye(), 3)
    return {
        "format": "volref-scene",
        "format_version": 1,
        "width": 512,
        "height": 512,
        "camera": {
            "kind": "perspective",
            "eye": eye.tolist(),
            "target": list(TARGET),
            "up": [0.0, 0.0, 1.0],
            "fov_y": FOV_Y,
            "near": 10.0,
            "far": 1000.0,
        },
        "volume": {"path": "head.npz"},
        "transfer": {
            "units": "T1 intensity",
            "values": list(VALUES),
            "colors": [list(color) for color in COLORS],
            "extinction": list(EXTINCTION),
        },
        "meshes": [{"path": "white_matter.ply"}],
        "background": list(BACKGROUND),
    }


def write_demo(head: Path, white_matter: Path, folder: Path) -> None:
    """Write head.npz, white_matter.ply and scene.json to `folder`, over what is there."""
    volume, mesh = demo_head(load_volume(head)), load_mesh(white_matter)
    arrays: dict[str, Numbers] = {
        "volume": volume.values,
        "spacing": np.array(volume.spacing),
        "origin": np.array(volume.origin),
    }
    write_npz(folder / "head.npz", arrays, overwrite=True)
    with atomic_path(folder / "white_matter.ply", overwrite=True) as temporary:
        temporary.write_bytes(ply_bytes(mesh.vertices, mesh.faces, baked_colors(mesh.vertices, mesh.faces)))
    write_text(folder / "scene.json", json.dumps(scene_document(), indent=1) + "\n", overwrite=True)


def _sum_at(places: Integers, rows: Floats, count: int) -> Floats:
    """Return the sum (count, 3) of the `rows` (N, 3) that go to each place (N,)."""
    return np.stack([np.bincount(places, rows[:, k], count) for k in range(3)], axis=1)


def _unit(vector: Floats) -> Floats:
    return np.asarray(vector / np.linalg.norm(vector))


def main() -> None:
    """Run the command."""
    parser = argparse.ArgumentParser(prog="data_gen.demo", description=__doc__.partition("\n")[0])
    parser.add_argument("head", type=Path, help="tests/data/mri_mni152_t1_1mm.nii.gz")
    parser.add_argument("white_matter", type=Path, help="tests/data/mesh_mni_white_matter.ply")
    parser.add_argument("folder", type=Path, help="volref/demo_data")
    options = parser.parse_args()
    write_demo(options.head, options.white_matter, options.folder)


if __name__ == "__main__":
    main()
