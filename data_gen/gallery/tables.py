"""Tables of other programs on the scans: 3D Slicer's presets, ParaView's colour maps."""

import json
from collections.abc import Iterator

import numpy as np

import volref as vr
from data_gen.gallery.scans import CT, HEAD, MAPS, PRESETS, middle, scan, seen_from
from data_gen.gallery.sheets import BLACK, Settings, Tile, codes_of, tile_of
from volref.stages.classify import classify, lookup_table
from volref.workspace import Workspace

# Millimetres: eleven segments to a slice of the scan.
STEP = 0.45

# The chest is 292 mm wide and 240 mm high; the image is wider than high.
SHOWN = 265.0

BAR = 14


def presets(settings: Settings) -> Iterator[Tile]:
    """Draw the chest with each preset of 3D Slicer, lit by a lamp on the camera."""
    volume = scan(settings.data / CT)
    camera = seen_from(volume, shown=SHOWN)
    mean_spacing = float(np.mean(volume.spacing))
    for entry in json.loads((settings.data / PRESETS).read_text(encoding="utf-8")):
        transfer, material = vr.load_preset(
            settings.data / PRESETS, entry["name"], mean_spacing=mean_spacing, units="HU"
        )
        lights = [] if material is None else [vr.Light.ambient(), vr.Light.headlight()]
        scene = vr.Scene(
            volume,
            transfer,
            camera,
            settings.pixels,
            settings.pixels * 4 // 5,
            lights=lights,
            material=material,
            background=BLACK,
        )
        yield tile_of(entry["name"], vr.render(scene, method="march", step=STEP))


def color_maps(settings: Settings) -> Iterator[Tile]:
    """Draw an axial slice of the head in each colour map of ParaView, with the map as a bar below it."""
    volume = scan(settings.data / HEAD)
    low, high = (float(volume.values.min()), float(volume.values.max()))
    point = middle(volume) + np.array([0, 0, 5])
    size = 1.02 * float(np.ptp(volume.corners[:, 1])) / settings.pixels
    for entry in json.loads((settings.data / MAPS).read_text(encoding="utf-8")):
        table = vr.load_transfer(settings.data / MAPS, key=entry["Name"], domain=(low, high))
        assert isinstance(table, vr.TransferFunction)
        opaque = vr.TransferFunction.from_opacity(table.values, table.colors, np.ones(len(table.values)))
        width = settings.pixels
        # Seen from the feet, as radiologists do: the patient's right is on the left of the image.
        scene = vr.oblique_slice(
            volume, opaque, point, (0, 0, -1), (0, 1, 0), width, settings.pixels, size, background=BLACK
        )
        drawn = tile_of(entry["Name"], vr.render(scene))
        picture = np.concatenate([drawn.picture, _bar(opaque, low, high, width)])
        yield Tile(drawn.label, picture, drawn.bound, drawn.kind)


def _bar(transfer: vr.TransferFunction, low: float, high: float, width: int) -> np.typing.NDArray[np.uint8]:
    """Return the colours of a table from `low` to `high` as a strip (BAR, width, 3)."""
    values = np.linspace(low, high, width)
    colors, _ = classify(lookup_table(transfer, (low, high)), values, Workspace())
    strip = np.concatenate([colors.T, np.ones((width, 1))], axis=1)
    return np.repeat(codes_of(strip[None]), BAR, axis=0)
