"""The heat map of docs/faults.md: a row for each fault, a column for each chart.

green   caught, and named alone        yellow  caught, and named with others that look the same
orange  caught, and another is named   grey    not caught             dark  the program cannot have it
"""

import numpy as np

from data_gen.faults.figures import Figures
from data_gen.gallery.sheets import INK, PAPER
from volref.arrays import Bytes
from volref.golden.confusion import Told

CELL, GAP, MARGIN, LEFT, TOP = 13, 1, 4, 178, 118

GREEN, YELLOW, ORANGE, GREY, DARK = (
    (64, 160, 96),
    (222, 196, 72),
    (214, 112, 56),
    (120, 124, 132),
    (38, 40, 45),
)


def color_of(key: str, told: Told | None) -> tuple[int, int, int]:
    """Return the colour of a cell.

    Examples
    --------
    >>> color_of("A1-x", Told(9.0, 0.5, 0.5, 1.0, ("A1-x",), 1)) == GREEN, color_of("A1-x", None) == DARK
    (True, True)
    """
    if told is None:
        return DARK
    if not told.caught:
        return GREY
    if told.named == (key,):
        return GREEN
    return YELLOW if key in told.named else ORANGE


def heat_map(found: Figures) -> Bytes:
    """Return the picture (H, W, 3)."""
    from PIL import Image, ImageDraw, ImageFont

    keys, charts, pitch = found.keys, list(found.told), CELL + GAP
    size = LEFT + pitch * len(charts) + MARGIN, TOP + pitch * len(keys) + MARGIN
    sheet = Image.new("RGB", size, PAPER)
    draw, font = ImageDraw.Draw(sheet), ImageFont.load_default(11)
    for column, chart in enumerate(charts):
        label = Image.new("RGB", (TOP - 4, CELL + 1), PAPER)
        ImageDraw.Draw(label).text((0, 0), chart, INK, font)
        sheet.paste(label.rotate(90, expand=True), (LEFT + pitch * column, 2))
    for row, key in enumerate(keys):
        y = TOP + pitch * row
        draw.text((MARGIN, y), key, INK, font)
        for column, chart in enumerate(charts):
            x = LEFT + pitch * column
            draw.rectangle((x, y, x + CELL - 1, y + CELL - 1), color_of(key, found.told[chart].get(key)))
    return np.asarray(sheet)
