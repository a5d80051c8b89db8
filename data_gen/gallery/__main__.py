"""Draw the gallery: `python -m data_gen.gallery [NAME ...]`, from tests/data into docs/.

Without names it draws every sheet and writes the page; with names only those images, and leaves the page.
Exit codes: 0 written, 2 refused, with one sentence on stderr.
"""

import argparse
import sys
import time
from collections.abc import Sequence
from itertools import islice
from pathlib import Path

from data_gen.gallery.catalogue import SHEETS
from data_gen.gallery.page import page
from data_gen.gallery.sheets import Settings, Sheet, contact_sheet, error_of, write_sheet
from volref.errors import FormatError
from volref.io.atomic import write_text


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return its exit code."""
    options = _parser().parse_args(arguments)
    names = [sheet.name for sheet in SHEETS]
    unknown = [name for name in options.names if name not in names]
    if unknown:
        print(f"gallery: NAME must be one of {', '.join(names)}, got {unknown[0]!r}", file=sys.stderr)
        return 2
    chosen = [sheet for sheet in SHEETS if not options.names or sheet.name in options.names]
    images: Path = options.docs / "images"
    try:
        images.mkdir(parents=True, exist_ok=True)
        errors = {
            sheet.name: draw(sheet, options.data, images, options.scale, options.first) for sheet in chosen
        }
        if not options.names:
            write_text(options.docs / "gallery.md", page(SHEETS, errors), overwrite=True)
    except (FormatError, OSError) as error:
        print(f"gallery: {error}", file=sys.stderr)
        return 2
    return 0


def draw(sheet: Sheet, data: Path, images: Path, scale: float = 1.0, first: int | None = None) -> str:
    """Write the image of a sheet, or of its first pictures; return what is known of its errors."""
    tiles, started = [], time.perf_counter()
    settings = Settings(data, max(1, round(scale * sheet.pixels)))
    for tile in islice(sheet.tiles(settings), first):
        tiles.append(tile)
        print(f"{sheet.name}: {tile.label}, {time.perf_counter() - started:.0f} s", file=sys.stderr)
    write_sheet(images / sheet.file, contact_sheet(tiles, sheet.columns), palette=sheet.palette)
    return error_of(tiles)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m data_gen.gallery", description=__doc__.partition("\n")[0]
    )
    names = ", ".join(sheet.name for sheet in SHEETS)
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"which sheets: {names}; all if none")
    parser.add_argument(
        "--data", type=Path, default=Path("tests/data"), help="folder of the files (tests/data)"
    )
    parser.add_argument("--docs", type=Path, default=Path("docs"), help="folder to write in (docs)")
    parser.add_argument("--scale", type=float, default=1.0, help="size of the pictures (1)")
    parser.add_argument("--first", type=int, metavar="N", help="draw only the first N pictures of each sheet")
    return parser


if __name__ == "__main__":
    sys.exit(main())
