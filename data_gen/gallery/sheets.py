"""Contact sheets: small pictures side by side, each with its name above it.

+---- 2 ----+--------------+
| CT-AAA    | CT-Bone      |   LABEL pixels high
| +-------+ | +----------+ |
| |picture| | |          | |
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from volref.arrays import Bytes, Floats
from volref.image import bytes_from_unit, encode_light, straight_from_premultiplied
from volref.io.atomic import atomic_path
from volref.truth.result import Render

LABEL, GAP, MARGIN = 15, 3, 3
PAPER, INK = (24, 25, 28), (236, 236, 236)

# Bounds below it are those of roundings, as of pixels that show no volume.
NOTHING = 1e-9

# What the scans are drawn on, in codes and in light.
BLACK = (0.0, 0.0, 0.0, 1.0)


@dataclass(frozen=True)
class Settings:
    """The folder with the data, and the side of a picture in pixels."""

    data: Path
    pixels: int = 160


@dataclass(frozen=True, eq=False)
class Tile:
    """A picture (H, W, 3) in bytes with its name, and the errors of its pixels (H, W) with their kind."""

    label: str
    picture: Bytes
    bound: Floats | None = None
    kind: str = "none"


@dataclass(frozen=True)
class Sheet:
    """One image of the gallery: `gallery-NAME.png`.

    files: what it is drawn from, names in the folder of data.  caption: what it shows.  tiles: draws one
    after the other, so that a few can be had without the others.  columns: pictures in a row.
    pixels: their side.  palette: whether the file keeps 256 colours only, which in pictures of few hues
    nobody sees.
    """

    name: str
    title: str
    files: tuple[str, ...]
    caption: str
    tiles: Callable[[Settings], Iterator[Tile]]
    columns: int
    pixels: int
    palette: bool = False

    @property
    def file(self) -> str:
        """The name of its image."""
        return f"gallery-{self.name}.png"


def tile_of(label: str, render: Render, encoding: str = "none") -> Tile:
    """Return the picture of a rendering over an opaque background.

    encoding: "none" where colours are those of other programs' tables, which are meant for screens as they
    are; "srgb" where they are light.
    """
    return Tile(label, codes_of(render.rgba, encoding), render.bound, render.bound_kind)


def codes_of(rgba: Floats, encoding: str = "none") -> Bytes:
    """Return bytes (H, W, 3) of an opaque image (H, W, 4).

    Examples
    --------
    >>> codes_of(np.array([[[0.5, 2.0, 0.0, 1.0]]])).tolist()
    [[[128, 255, 0]]]
    """
    return bytes_from_unit(encode_light(straight_from_premultiplied(rgba)[..., :3], encoding))


def contact_sheet(tiles: Sequence[Tile], columns: int) -> Bytes:
    """Return the tiles in rows (H, W, 3); columns and rows fit their largest.

    Examples
    --------
    >>> dot = Tile("dot", np.zeros((10, 20, 3), np.uint8))
    >>> contact_sheet([dot, dot, dot], columns=2).shape  # 2 x (15 + 10 + 3) + 3, 2 x (20 + 3) + 3
    (59, 49, 3)
    """
    from PIL import Image, ImageDraw, ImageFont

    rows = [tiles[i : i + columns] for i in range(0, len(tiles), columns)]
    widths = [max(tile.picture.shape[1] for tile in tiles[i::columns]) for i in range(len(rows[0]))]
    heights = [max(tile.picture.shape[0] for tile in row) + LABEL for row in rows]
    size = sum(widths) + GAP * len(widths) + MARGIN, sum(heights) + GAP * len(heights) + MARGIN
    sheet = Image.new("RGB", size, PAPER)
    draw, font = ImageDraw.Draw(sheet), ImageFont.load_default(11)
    for i, row in enumerate(rows):
        y = MARGIN + sum(heights[:i]) + GAP * i
        for k, tile in enumerate(row):
            x = MARGIN + sum(widths[:k]) + GAP * k
            draw.text((x + 1, y), _cut(tile.label, lambda s: draw.textlength(s, font), widths[k]), INK, font)
            sheet.paste(Image.fromarray(tile.picture), (x, y + LABEL))
    return np.asarray(sheet)


def _cut(words: str, length: Callable[[str], float], width: int) -> str:
    """Return as much of a label as is not wider than its picture."""
    while words and length(words) > width:
        words = words[:-1]
    return words


def write_sheet(path: Path, picture: Bytes, *, palette: bool = False) -> None:
    """Write a PNG, with 256 colours if `palette`, in place of one that is there."""
    from PIL import Image

    image = Image.fromarray(picture)
    if palette:
        # Mixed from its neighbours, a hue that is rare is not lost.
        few = image.quantize(256, Image.Quantize.MAXCOVERAGE)
        image = image.quantize(palette=few, dither=Image.Dither.FLOYDSTEINBERG)
    with atomic_path(path, overwrite=True) as temporary:
        image.save(temporary, format="PNG", optimize=True)


def error_of(tiles: Iterable[Tile]) -> str:
    """Return what is known of the errors of some pictures, in a sentence.

    Examples
    --------
    >>> flat = np.zeros((1, 1, 3), np.uint8)
    >>> error_of([Tile("a", flat, np.array([[0.25]]), "certified"), Tile("b", flat)])
    'Certified (1 picture): no channel off by more than 0.25.'
    """
    sentences = []
    known = [tile for tile in tiles if tile.bound is not None]
    for kind in ("certified", "estimate"):
        bounds = [tile.bound for tile in known if tile.bound is not None and tile.kind == kind]
        if not bounds:
            continue
        count = f"{len(bounds)} picture{'s' * (len(bounds) > 1)}"
        errors = np.concatenate([bound[bound > NOTHING] for bound in bounds])
        errors = errors if len(errors) else np.zeros(1)
        if kind == "certified":
            sentences.append(f"Certified ({count}): no channel off by more than {errors.max():.2g}.")
        else:
            half, most = np.quantile(errors, (0.5, 0.95))
            sentences.append(
                f"Estimated ({count}): half of the pixels that show anything off by less than {half:.2g}, "
                f"95 % by less than {most:.2g}."
            )
    return " ".join(sentences)
