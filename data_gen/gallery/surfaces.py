"""Meshes: transparent in a volume, cut open, textured, lit."""

import dataclasses
from collections.abc import Iterator

import numpy as np

import volref as vr
from data_gen.gallery.scans import HEAD, scan, seen_from, towards
from data_gen.gallery.sheets import Settings, Tile, tile_of
from volref.arrays import Floats
from volref.phantoms.meshes import checkerboard

WHITE_MATTER, NUT, TEAPOT = "mesh_mni_white_matter.ply", "mesh_nut.ply", "mesh_teapot_uv.obj"

# Colours are light here, and are encoded as sRGB.
NIGHT = (0.01, 0.012, 0.016, 1.0)
GOLD, GREEN, RED = (0.9, 0.6, 0.2), (0.1, 0.5, 0.35), (0.7, 0.1, 0.05)
PLASTIC = vr.Material("blinn-phong", ambient=0.25, diffuse=0.75, specular=0.35, shininess=40, two_sided=True)


def surfaces(settings: Settings) -> Iterator[Tile]:
    """Draw the white matter as glass in its head, a nut with a cap, and a teapot inside and out."""
    for label, scene in _scenes(settings):
        # Four rays a pixel, but of the volume, where each takes an integration between all layers.
        factor = 1 if scene.volume is not None else 2
        yield tile_of(label, vr.supersample(scene, factor, tolerance=1 / 255), "srgb")


def _scenes(settings: Settings) -> Iterator[tuple[str, vr.Scene]]:
    pixels = settings.pixels
    yield "white matter, glass of opacity 0.5, in the head", _head(settings)
    brain = smooth(vr.load_mesh(settings.data / WHITE_MATTER), (0.9, 0.75, 0.6))
    yield "white matter, opaque, lit", _alone(brain, pixels, 235, 20)
    nut = dataclasses.replace(
        vr.load_mesh(settings.data / NUT), colors=np.array(GOLD), coloring="uniform", lit=True
    )
    yield "nut", _alone(nut, pixels, 30, 35)
    center = _center(nut)
    cut = vr.Plane(center, -towards(30, 0))
    yield "nut, cut by a plane, with its cap", _alone(nut, pixels, 30, 35, [cut])
    teapot = vr.load_mesh(settings.data / TEAPOT)
    tiled = dataclasses.replace(
        teapot, uv=_uv(settings), texture=checkerboard(16, 8), coloring="texture", lit=True
    )
    yield "teapot, textured, lit", _alone(tiled, pixels, 30, 25)
    glazed = dataclasses.replace(
        teapot, colors=np.array(GREEN), coloring="uniform", lit=True, back_color=np.array(RED)
    )
    opened = vr.Plane(_center(teapot), -towards(0, 0))
    yield "teapot, cut open: its back is red", _alone(glazed, pixels, 20, 25, [opened])


def _head(settings: Settings) -> vr.Scene:
    volume = scan(settings.data / HEAD)
    transfer = vr.TransferFunction(
        [20, 70, 130, 255],
        [(0.05, 0.3, 0.7), (0.05, 0.3, 0.7), (0.1, 0.45, 0.9), (0.2, 0.6, 1.0)],
        [0.0, 0.008, 0.012, 0.012],
    )
    glass = smooth(vr.load_mesh(settings.data / WHITE_MATTER), (1.0, 0.55, 0.2))
    return vr.Scene(
        volume,
        transfer,
        seen_from(volume, 40, 25, shown=185),
        settings.pixels,
        settings.pixels,
        meshes=[dataclasses.replace(glass, opacity=0.5)],
        lights=_lamps(40, 25),
        material=dataclasses.replace(PLASTIC, model="unlit"),
        background=NIGHT,
    )


def _alone(
    mesh: vr.Mesh, pixels: int, azimuth: float, elevation: float, clip: list[vr.Plane] | None = None
) -> vr.Scene:
    """Return a scene of one mesh that fills the image."""
    radius = float(np.linalg.norm(mesh.vertices - _center(mesh), axis=1).max())
    eye = _center(mesh) + 6 * radius * towards(azimuth, elevation)
    camera = vr.Camera.look_at(eye, _center(mesh), (0, 0, 1), 19.0, radius, 12 * radius)
    lamps = _lamps(azimuth, elevation)
    return vr.Scene(
        None,
        None,
        camera,
        pixels,
        pixels,
        meshes=[mesh],
        lights=lamps,
        material=PLASTIC,
        background=NIGHT,
        clip=clip or [],
    )


def smooth(mesh: vr.Mesh, color: tuple[float, float, float]) -> vr.Mesh:
    """Return a lit mesh of one colour whose normals are those of trimesh."""
    import trimesh

    normals = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).vertex_normals
    return dataclasses.replace(
        mesh, colors=np.array(color), coloring="uniform", lit=True, normals=np.array(normals, np.float64)
    )


def _uv(settings: Settings) -> Floats:
    """Return the texture coordinates (V, 2) of the teapot, which has no texture and so loads without them."""
    import trimesh

    loaded = trimesh.load_mesh(settings.data / TEAPOT, process=False)
    return np.array(loaded.visual.uv, np.float64)


def _lamps(azimuth: float, elevation: float) -> list[vr.Light]:
    """Return light from above the viewer's left shoulder, and a little from all sides."""
    return [
        vr.Light.ambient((0.5, 0.5, 0.6)),
        vr.Light.directional(-towards(azimuth + 40, elevation + 30), (0.9, 0.87, 0.82)),
        vr.Light.directional(-towards(azimuth - 60, elevation), (0.2, 0.24, 0.3)),
    ]


def _center(mesh: vr.Mesh) -> Floats:
    return np.asarray((mesh.vertices.min(axis=0) + mesh.vertices.max(axis=0)) / 2)
