"""Compute the faults' confusion on the charts: `python -m data_gen.faults`.

Writes docs/faults.json, docs/faults.md and docs/images/faults-confusion.png.  With --page only the page and
the picture are written anew, from the figures that are there.
Exit codes: 0 written, 2 refused, with one sentence on stderr.
"""

import argparse
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

from data_gen.faults.figures import figures, from_json, to_json
from data_gen.faults.page import page
from data_gen.faults.picture import heat_map
from data_gen.faults.reasons import REASONS
from data_gen.gallery.sheets import write_sheet
from volref.errors import FormatError
from volref.golden.charts import CHARTS
from volref.golden.confusion import Confusion, confusion
from volref.io.atomic import write_text
from volref.oracle.faults.table import FAULTS


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return its exit code."""
    options = _parser().parse_args(arguments)
    numbers = options.docs / "faults.json"
    try:
        (options.docs / "images").mkdir(parents=True, exist_ok=True)
        if not options.page:
            write_text(numbers, to_json(figures(_studies())), overwrite=True)
        found = from_json(numbers.read_text(encoding="utf-8"))
        write_text(options.docs / "faults.md", page(found, FAULTS, REASONS), overwrite=True)
        write_sheet(options.docs / "images" / "faults-confusion.png", heat_map(found))
    except (FormatError, OSError) as error:
        print(f"faults: {error}", file=sys.stderr)
        return 2
    return 0


def _studies() -> Iterator[Confusion]:
    for name, chart in CHARTS.items():
        started = time.perf_counter()
        yield confusion(chart, FAULTS)
        print(f"faults: {name}, {time.perf_counter() - started:.0f} s", file=sys.stderr)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m data_gen.faults", description=__doc__.partition("\n")[0])
    parser.add_argument("--docs", type=Path, default=Path("docs"), help="folder to write in (docs)")
    parser.add_argument("--page", action="store_true", help="the page alone, from figures that are there")
    return parser


if __name__ == "__main__":
    sys.exit(main())
