"""Thunderstorms over Den Helder: maps as meteorologists draw them, and the storms in space."""

from collections.abc import Iterator, Sequence

import numpy as np

import volref as vr
from data_gen.gallery.sheets import Settings, Tile, codes_of
from volref.arrays import Bytes
from volref.phantoms.meshes import plane_mesh

RADAR = "radar_knmi_denhelder_20110610.npz"

# Metres.  The lowest sweep ends at 320 km; the storms lie within 200.
REACH, RINGS, LEVEL = 200e3, 50e3, 2000.0
GROUND_REACH = 260e3

# Heights are stretched: a storm is 10 km high and the map is 400 km wide.
STRETCH, STEP = 5.0, 500.0

# Per metre, at 75 dBZ: 1 km of 35 dBZ lets through half of the light.
EXTINCTION = 4e-3

# Codes, as the National Weather Service's colours are: nothing is decoded, nothing encoded.
GROUND, SKY = (0.84, 0.85, 0.83), (0.95, 0.97, 1.0, 1.0)
BANDS = tuple(range(5, 80, 5))


def maps(settings: Settings) -> Iterator[Tile]:
    """Draw the lowest sweep gate by gate and the map at a height, north up, with the bar of their colours."""
    radar, width = _radar(settings), 2 * settings.pixels
    for made in (
        vr.ppi(radar, 0, width, reach=REACH, gates="nearest"),
        vr.cappi(radar, LEVEL, width, reach=REACH),
    ):
        picture = codes_of(made.colored(vr.dbz_transfer(), rings=RINGS, unseen=(0.75, 0.75, 0.75)))
        yield Tile(made.title, _with_words(picture, _rings(width), ink=(60, 60, 60)))
    yield Tile("dBZ", _bar(width))


def storms(settings: Settings) -> Iterator[Tile]:
    """Draw the storms in space from the south-east, over a map with rings and the four directions."""
    radar, width = _radar(settings), 4 * settings.pixels
    scene = vr.Scene(
        radar,
        vr.dbz_transfer(EXTINCTION),
        _south_east(),
        width,
        width // 2,
        meshes=[_ground(settings.pixels * 6)],
        background=SKY,
    )
    out = vr.render(scene, method="march", step=STEP)
    label = f"seen from the south-east, heights x {STRETCH:g}"
    yield Tile(label, codes_of(out.rgba), out.bound, out.bound_kind)
    yield Tile("dBZ", _bar(width // 2))


def _radar(settings: Settings) -> vr.RadarVolume:
    return vr.load_radar(settings.data / RADAR)


def _south_east() -> vr.Camera:
    """Return a camera over a world whose heights are stretched: they are before it is looked at."""
    eye, target = (300e3, -470e3, 350e3), (-15e3, -55e3, 0)
    view = vr.Camera.look_at(eye, target, (0, 0, 1), 30.0, 1e3, 2e6).view_from_world
    return vr.Camera(view @ np.diag([1, 1, STRETCH, 1]), "perspective", fov_y=30.0, near=1e3, far=2e6)


def _ground(width: int) -> vr.Mesh:
    """Return the ground below the storms, with rings and letters."""
    from PIL import Image, ImageDraw, ImageFont

    image = Image.fromarray(np.full((width, width, 3), np.round(255 * np.array(GROUND)), np.uint8))
    draw, font = ImageDraw.Draw(image), ImageFont.load_default(width // 20)
    middle = width / 2
    for radius in np.arange(RINGS, GROUND_REACH + 1, RINGS):
        r = radius / GROUND_REACH * middle
        draw.ellipse((middle - r, middle - r, middle + r, middle + r), outline=(110, 112, 110), width=2)
    draw.ellipse((middle - 4, middle - 4, middle + 4, middle + 4), fill=(40, 40, 40))
    for letter, x, y in (("N", 0, -1), ("E", 1, 0), ("S", 0, 1), ("W", -1, 0)):
        place = middle + 0.93 * middle * np.array([x, y])
        draw.text(tuple(place), letter, (90, 90, 90), font, anchor="mm")
    # The lowest beam is above it everywhere.
    return plane_mesh(2 * GROUND_REACH, 2 * GROUND_REACH, (0, 0, -50.0), texture=np.asarray(image) / 255)


def _rings(width: int) -> list[tuple[str, float, float]]:
    """Return what is written on a map, with its pixel: north, and the distances of the rings, in km."""
    pixel = 2 * REACH / width
    words = [("N", width / 2, 8.0)]
    for k in range(1, int(REACH / RINGS)):
        off = k * RINGS / pixel * np.sqrt(0.5)
        words.append((f"{k * RINGS / 1000:g} km", width / 2 + off, width / 2 - off))
    return words


def _with_words(
    picture: Bytes, words: Sequence[tuple[str, float, float]], ink: tuple[int, int, int]
) -> Bytes:
    from PIL import Image, ImageDraw, ImageFont

    image = Image.fromarray(picture)
    draw, font = ImageDraw.Draw(image), ImageFont.load_default(11)
    for word, x, y in words:
        draw.text((x, y), word, ink, font, anchor="mm", stroke_width=2, stroke_fill=(255, 255, 255))
    return np.asarray(image)


def _bar(height: int) -> Bytes:
    """Return the bands of reflectivity from below up, with the dBZ at which each begins (height, 48, 3)."""
    from PIL import Image, ImageDraw, ImageFont

    image = Image.new("RGB", (48, height), (24, 25, 28))
    draw, font = ImageDraw.Draw(image), ImageFont.load_default(11)
    edges = np.linspace(height - 10, 10, len(BANDS) + 1)
    for dbz, low, high, color in zip(BANDS, edges[:-1], edges[1:], _band_colors(), strict=True):
        draw.rectangle((2, high, 20, low), fill=tuple(color))
        draw.text((24, low), f"{dbz}", (236, 236, 236), font, anchor="lm")
    return np.asarray(image)


def _band_colors() -> list[list[int]]:
    """Return the colours of the middles of the bands."""
    table = vr.dbz_transfer()
    rows = [int(np.searchsorted(table.values, dbz + 2.5)) - 1 for dbz in BANDS]
    return [[round(255 * float(channel)) for channel in table.colors[row]] for row in rows]
