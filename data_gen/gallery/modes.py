"""The three scans in every mode."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

import volref as vr
from data_gen.gallery.scans import CT, HEAD, PRESETS, STENT, middle, scan, seen_from
from data_gen.gallery.sheets import BLACK, Settings, Tile, tile_of
from volref.arrays import Vector
from volref.io.guard import Foreign

# A level of 8 bits: what no eye sees.
TOLERANCE = 1 / 255

GREY = [(0.0, 0.0, 0.0), (1.0, 1.0, 1.0)]


@dataclass(frozen=True, eq=False)
class Look:
    """How one scan is shown: its table, its windows of grey by mode, its surface, and from where.

    front: up in the axial slice.  slab: how thick is what the least value is taken of; of a whole scan it is
    that of the air around.
    """

    name: str
    volume: vr.Volume
    transfer: vr.TransferFunction
    windows: dict[str, tuple[float, float]]
    isovalue: float
    surface: Vector
    camera: vr.Camera
    front: Vector
    oblique: Vector
    slab: float


def modes(settings: Settings) -> Iterator[Tile]:
    """Draw each scan in each mode: the integral, the extremes, the mean, a lit surface, two slices."""
    for look in (_chest(settings), _head(settings), _stent(settings)):
        for label, scene in _scenes(look, settings.pixels):
            yield tile_of(f"{look.name}: {label}", vr.render(scene, tolerance=TOLERANCE))


def _scenes(look: Look, pixels: int) -> Iterator[tuple[str, vr.Scene]]:
    def scene(transfer: vr.TransferFunction, **more: Foreign) -> vr.Scene:
        return vr.Scene(look.volume, transfer, look.camera, pixels, pixels, background=BLACK, **more)

    yield "composite", scene(look.transfer)
    yield "mip", scene(_window(look.windows["mip"]), mode="mip")
    yield f"minip of {look.slab:g} mm", scene(_window(look.windows["minip"]), mode="minip", clip=_slab(look))
    yield "average", scene(_window(look.windows["average"]), mode="average")
    painted = vr.TransferFunction([look.isovalue], [look.surface], opacity=[1.0])
    lamps = [vr.Light.ambient(), vr.Light.headlight()]
    yield (
        f"isosurface {look.isovalue:g}",
        scene(painted, mode="isosurface", isovalue=look.isovalue, lights=lamps),
    )
    center = middle(look.volume)
    size = 1.02 * float(np.ptp(look.volume.corners, axis=0).max()) / pixels
    grey = _window(look.windows["slice"])
    for label, normal, up in (
        ("axial slice", (0, 0, -1), look.front),
        ("oblique slice", look.oblique, (0, 0, 1)),
    ):
        yield (
            label,
            vr.oblique_slice(look.volume, grey, center, normal, up, pixels, pixels, size, background=BLACK),
        )


def _slab(look: Look) -> list[vr.Plane]:
    """Return the planes around the middle of the scan, across the view."""
    center, view = middle(look.volume), look.camera.world_from_view[:3, 2]
    return [vr.Plane(center - side * look.slab / 2 * view, side * view) for side in (1.0, -1.0)]


def _window(ends: tuple[float, float]) -> vr.TransferFunction:
    """Return black to white between two values, opaque."""
    return vr.TransferFunction.from_opacity(ends, GREY, [1.0, 1.0])


def _chest(settings: Settings) -> Look:
    volume = scan(settings.data / CT)
    transfer, _ = vr.load_preset(settings.data / PRESETS, "CT-Chest-Contrast-Enhanced", units="HU")
    windows = {
        "mip": (-100.0, 1200.0),
        "minip": (-1024.0, -600.0),
        "average": (-900.0, 100.0),
        "slice": (-1000.0, 400.0),
    }
    return Look(
        "CT",
        volume,
        transfer,
        windows,
        250.0,
        (0.9, 0.82, 0.68),
        seen_from(volume),
        (0, 1, 0),
        (0, 1, -0.15),
        30,
    )


def _head(settings: Settings) -> Look:
    volume = scan(settings.data / HEAD)
    transfer = vr.TransferFunction(
        [20, 60, 120, 180, 235],
        [(0.9, 0.5, 0.4), (0.9, 0.5, 0.4), (0.9, 0.6, 0.5), (0.8, 0.75, 0.7), (1, 1, 0.95)],
        [0.0, 0.02, 0.08, 0.12, 0.2],
    )
    windows = dict.fromkeys(("mip", "slice"), (0.0, 255.0)) | {"minip": (0.0, 255.0), "average": (0.0, 150.0)}
    return Look(
        "MRI",
        volume,
        transfer,
        windows,
        110.0,
        (0.85, 0.7, 0.65),
        seen_from(volume, 40, 15),
        (0, 1, 0),
        (0.6, 1, 0.3),
        6,
    )


def _stent(settings: Settings) -> Look:
    volume = scan(settings.data / STENT)
    transfer = vr.TransferFunction(
        [3, 6, 10, 20, 32],
        [(0.6, 0.1, 0.05), (0.8, 0.3, 0.2), (0.9, 0.75, 0.6), (1, 0.95, 0.8), (1, 1, 1)],
        [0.0, 0.02, 0.1, 1.0, 2.0],
    )
    windows = dict.fromkeys(("mip", "slice"), (0.0, 25.0)) | {"minip": (0.0, 12.0), "average": (0.0, 8.0)}
    return Look(
        "stent",
        volume,
        transfer,
        windows,
        11.0,
        (0.9, 0.85, 0.75),
        seen_from(volume, 180),
        (0, -1, 0),
        (0.3, -1, 0),
        8,
    )
