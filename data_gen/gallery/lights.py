"""Gradients, models of light, kinds of light."""

from collections.abc import Iterator

import volref as vr
from data_gen.gallery.scans import HEAD, scan, seen_from, towards
from data_gen.gallery.sheets import BLACK, Settings, Tile, tile_of

GRADIENTS = ("central", "sobel", "analytic")
MODELS = ("lambert", "phong", "blinn-phong")

# Grey matter begins at two fifths of the greatest value.
SKIN = 100.0


def lights(settings: Settings) -> Iterator[Tile]:
    """Draw a row for each gradient: folds of the brain by each model; then the brain in some light."""
    for gradient, (label, lamps) in zip(GRADIENTS, _kinds(), strict=True):
        for model in MODELS:
            material = vr.Material(
                model, ambient=0.15, diffuse=0.7, specular=0.5, shininess=20, two_sided=True
            )
            lamp = [vr.Light.ambient(), vr.Light.directional(-towards(110, 50))]
            yield _tile(settings, f"{gradient}, {model}", material, lamp, gradient, shown=50.0)
        material = vr.Material(
            "blinn-phong", ambient=0.2, diffuse=0.8, specular=0.3, shininess=30, two_sided=True
        )
        yield _tile(settings, label, material, lamps, "sobel", shown=190.0)


def _tile(
    settings: Settings, label: str, material: vr.Material, lamps: list[vr.Light], gradient: str, shown: float
) -> Tile:
    """Draw the surface of the brain seen from its front and right."""
    volume = scan(settings.data / HEAD)
    scene = vr.Scene(
        volume,
        vr.TransferFunction([SKIN], [(0.85, 0.72, 0.66)], opacity=[1.0]),
        seen_from(volume, 60, 15, shown),
        settings.pixels,
        settings.pixels,
        lights=lamps,
        material=material,
        background=BLACK,
        mode="isosurface",
        isovalue=SKIN,
        gradient=gradient,
    )
    return tile_of(label, vr.render(scene, tolerance=1 / 255))


def _kinds() -> Iterator[tuple[str, list[vr.Light]]]:
    ambient = vr.Light.ambient((0.6, 0.6, 0.7))
    yield "ambient and headlight", [ambient, vr.Light.headlight()]
    yield "directional", [ambient, vr.Light.directional(-towards(100, 45))]
    # 1 / (1 + (d / 60 mm)^2): half as bright at 60 mm.
    near = (1.0, 0.0, 1 / 3600)
    yield (
        "two points of light",
        [
            ambient,
            vr.Light.point(140 * towards(95, 20), (4.0, 1.6, 0.4), near),
            vr.Light.point(140 * towards(5, 20), (0.3, 1.2, 4.0), near),
        ],
    )
