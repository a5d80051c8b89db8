"""The figure: which criterion catches which fault, as a heat map that the colour-blind can read."""

import io
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from data_gen.why_intervals.records import Record
from data_gen.why_intervals.summary import COLUMNS, keys_of, shares, tally

if TYPE_CHECKING:
    from matplotlib.figure import Figure

INK, ABSENT = "#202124", "#FFFFFF"


def draw(records: Sequence[Record], path: Path) -> None:
    """Write the heat map: a row for each criterion, a column for each fault that shows."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    every = keys_of(records)
    shown = np.array([[np.nan if x is None else x for x in shares(one, records, every)] for one in COLUMNS])
    there = ~np.isnan(shown).all(axis=0)
    keys = [key for key, is_there in zip(every, there, strict=True) if is_there]
    figure = Figure(figsize=(13, 6.4), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    axes.set_facecolor(ABSENT)
    cells = axes.pcolormesh(shown[:, there], cmap="cividis", vmin=0, vmax=1, edgecolors=ABSENT, linewidth=0.8)
    axes.invert_yaxis()
    axes.set_xticks(np.arange(len(keys)) + 0.5, keys, rotation=90, fontsize=8, color=INK)
    axes.set_yticks(np.arange(len(COLUMNS)) + 0.5, [_label(one, records) for one in COLUMNS], fontsize=8.5)
    axes.tick_params(length=0)
    for side in axes.spines.values():
        side.set_visible(False)
    bar = figure.colorbar(cells, ax=axes, shrink=0.6, pad=0.01)
    bar.set_label("part of the scenes in which the fault is caught", fontsize=8.5)
    bar.outline.set_visible(False)
    _save(figure, path)


def _save(figure: "Figure", path: Path) -> None:
    """Write a figure as a PNG of few colours: a third of the bytes."""
    from PIL import Image

    picture = io.BytesIO()
    figure.savefig(picture, dpi=110)
    picture.seek(0)
    with Image.open(picture) as image:
        image.convert("RGB").quantize(128, dither=Image.Dither.NONE).save(path, optimize=True)


def _label(column: object, records: Sequence[Record]) -> str:
    """Return the name of a row with how much it catches and wrongly fails."""
    found = tally(column, records)
    caught, failed = found.caught / found.faulty, found.failed / found.correct
    return f"{column.name}   {caught:.0%} caught, {failed:.0%} wrongly failed"
