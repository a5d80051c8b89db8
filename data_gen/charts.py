"""Draw the test charts: `python -m data_gen.charts`, each by its own program, on one sheet.

Writes docs/images/charts.png.  Exit codes: 0 written, 2 refused, with one sentence on stderr.
"""

import argparse
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

from data_gen.gallery.sheets import Tile, contact_sheet, write_sheet
from volref.arrays import Bytes, Floats
from volref.emulation.passes import emulate
from volref.errors import FormatError
from volref.golden.charts import CHARTS, Chart
from volref.image import bytes_from_unit

COLUMNS = 6

# A pixel of a chart is so many pixels of the sheet wide and high.
LARGER = 3


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return its exit code."""
    options = _parser().parse_args(arguments)
    try:
        (options.docs / "images").mkdir(parents=True, exist_ok=True)
        write_sheet(options.docs / "images" / "charts.png", contact_sheet(list(tiles()), COLUMNS))
    except (FormatError, OSError) as error:
        print(f"charts: {error}", file=sys.stderr)
        return 2
    return 0


def tiles() -> Iterator[Tile]:
    """Yield a picture of every chart."""
    for chart in CHARTS.values():
        yield Tile(chart.name, picture(canvas(chart)))


def canvas(chart: Chart) -> Floats:
    """Return what the chart's program draws (H, W, 4) on an ideal machine."""
    drawn = chart.subject()
    return emulate(drawn.scene, drawn.pipeline, drawn.device, drawn.jitter, drawn.frames).rgba


def picture(image: Floats) -> Bytes:
    """Return the colours of a canvas (H, W, 4), enlarged.

    Examples
    --------
    >>> import numpy as np
    >>> picture(np.full((2, 1, 4), 0.2))[:, :, 0].tolist() == [[51] * 3] * 6
    True
    """
    return bytes_from_unit(image[..., :3]).repeat(LARGER, axis=0).repeat(LARGER, axis=1)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m data_gen.charts", description=__doc__.partition("\n")[0])
    parser.add_argument("--docs", type=Path, default=Path("docs"), help="folder to write in (docs)")
    return parser


if __name__ == "__main__":
    sys.exit(main())
