"""Opacity by value, by gradient, by both; and when it is looked up."""

from collections.abc import Iterator

import numpy as np

import volref as vr
from data_gen.gallery.scans import CT, STENT, scan, seen_from
from data_gen.gallery.sheets import BLACK, Settings, Tile, tile_of
from volref.arrays import Floats

# Hounsfield units: skin and fat, muscle, contrast and bone, dense bone.
VALUES = (-300.0, -100.0, 60.0, 300.0, 1200.0)
COLORS = ((0.9, 0.65, 0.5), (0.9, 0.7, 0.5), (0.75, 0.2, 0.15), (0.95, 0.85, 0.7), (1.0, 1.0, 0.95))
OPACITY = (0.0, 0.002, 0.015, 0.25, 0.9)

# HU per millimetre: tissues change slowly, borders by some hundred over a voxel.
INSIDE, BORDER = 40.0, 160.0

MATERIAL = vr.Material("phong", ambient=0.3, diffuse=0.8, specular=0.1, two_sided=True)

# World units: many segments to a voxel, for tables with jumps.
CHEST_STEP, WIRE_STEP = 0.45, 0.15


def classified(settings: Settings) -> Iterator[Tile]:
    """Draw the chest with one, then two numbers looked up, and the stent looked up early and late."""
    chest, stent = scan(settings.data / CT), scan(settings.data / STENT)
    camera = seen_from(chest, shown=265)
    for label, transfer in _chest_tables():
        yield _tile(settings, label, chest, transfer, camera, "post", CHEST_STEP)
    camera = seen_from(stent, 180, 10, shown=50)
    for classification in ("post", "pre", "per-slice"):
        yield _tile(settings, f"stent: {classification}", stent, _wires(), camera, classification, WIRE_STEP)


def _tile(
    settings: Settings,
    label: str,
    volume: vr.Volume,
    transfer: vr.TransferFunction | vr.TransferFunction2D,
    camera: vr.Camera,
    classification: str,
    step: float,
) -> Tile:
    side = settings.pixels
    lit = classification == "post" and transfer.units == "HU"
    lamps = [vr.Light.ambient(), vr.Light.headlight()] if lit else []
    scene = vr.Scene(
        volume,
        transfer,
        camera,
        side,
        side,
        lights=lamps,
        material=MATERIAL if lit else None,
        background=BLACK,
        classification=classification,
    )
    return tile_of(label, vr.render(scene, method="march", step=step))


def _chest_tables() -> Iterator[tuple[str, vr.TransferFunction | vr.TransferFunction2D]]:
    yield "value", vr.TransferFunction.from_opacity(VALUES, COLORS, OPACITY, units="HU")
    yield (
        "value, spline",
        vr.TransferFunction.from_spline(VALUES, [*COLORS], [*OPACITY], kind="monotone", units="HU"),
    )
    edges = ([INSIDE, BORDER], [0.0, 1.0])
    yield (
        "value, gradient opacity",
        vr.TransferFunction.from_opacity(VALUES, COLORS, OPACITY, gradient_opacity=edges, units="HU"),
    )
    yield "value and gradient", arches()


def arches() -> vr.TransferFunction2D:
    """Return a table in which the borders of air and tissue, and of tissue and bone, show as arches.

    Across a blurred border from a to b the gradient is greatest at the middle value and 0 at the ends: a
    parabola over value and gradient magnitude (Kindlmann and Durkin 1998).
    """
    values = np.linspace(-1000, 1500, 128, endpoint=False) + 2500 / 256
    magnitudes = (np.linspace(0, 600, 64, endpoint=False) + 600 / 128)[:, None]
    skin = _arch(values, magnitudes, -1000.0, 0.0, 350.0)
    bone = _arch(values, magnitudes, 50.0, 1300.0, 450.0)
    opacity = np.maximum(0.01 * skin, 0.8 * bone)
    colors = np.where((bone > skin)[..., None], (1.0, 0.93, 0.8), (0.45, 0.65, 0.9))
    table = np.concatenate([colors, opacity[..., None]], axis=-1)
    return vr.TransferFunction2D(table, (-1000, 1500), (0, 600), 1.0, units="HU")


def _arch(values: Floats, magnitudes: Floats, low: float, high: float, top: float) -> Floats:
    """Return 1 on the arch from `low` to `high`, falling off with the distance to it."""
    along = np.clip((values - low) / (high - low), 0, 1)
    height = 4 * top * along * (1 - along)
    near = np.exp(-(((magnitudes - height) / (0.25 * top)) ** 2))
    return np.asarray(near * (height > 0.25 * top))


def _wires() -> vr.TransferFunction:
    """Return clear below a third, then red to white: a step, which early look-up smears."""
    return vr.TransferFunction.from_opacity(
        [9, 9, 14, 32],
        [(0.8, 0.25, 0.1), (0.8, 0.25, 0.1), (0.95, 0.8, 0.5), (1, 1, 1)],
        [0.0, 0.6, 0.9, 0.95],
    )
