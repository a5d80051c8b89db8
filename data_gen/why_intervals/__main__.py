"""Redo the public experiment: `python -m data_gen.why_intervals [--webgl]`.

Writes docs/why-intervals.md, docs/images/why-intervals.png and tests/data/why_intervals.json; needs the extra
`experiment`, and node with `npm install --prefix data_gen/why_intervals` for the original of pixelmatch (its
port to Python counts otherwise).  Exit codes: 0 written, 2 refused, with one sentence on stderr.
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from data_gen.why_intervals.experiment import run
from data_gen.why_intervals.figure import draw
from data_gen.why_intervals.page import page
from data_gen.why_intervals.records import Findings, load, save
from data_gen.why_intervals.scenes import CASES, DATA
from volref.errors import FormatError
from volref.io.atomic import atomic_path, write_text

PAGE, FIGURE, FIGURES = "why-intervals.md", "why-intervals.png", "why_intervals.json"


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return its exit code."""
    options = _parser().parse_args(arguments)
    unknown = [name for name in options.scenes if name not in CASES]
    if unknown:
        print(f"why_intervals: SCENE must be one of {', '.join(CASES)}, got {unknown[0]!r}", file=sys.stderr)
        return 2
    file = options.data / FIGURES
    try:
        if not options.page_only:
            save(run(options.scenes or tuple(CASES), webgl=options.webgl), file)
        write(load(file), options.docs)
    except (FormatError, ImportError, OSError) as error:
        print(f"why_intervals: {error}", file=sys.stderr)
        return 2
    return 0


def write(findings: Findings, docs: Path) -> None:
    """Write the page and its figure."""
    (docs / "images").mkdir(parents=True, exist_ok=True)
    write_text(docs / PAGE, page(findings), overwrite=True)
    with atomic_path(docs / "images" / FIGURE, overwrite=True) as path:
        draw(findings.records, path)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m data_gen.why_intervals", description=__doc__.partition("\n")[0]
    )
    parser.add_argument("scenes", nargs="*", metavar="SCENE", help=f"of {', '.join(CASES)}; all if none")
    parser.add_argument("--webgl", action="store_true", help="draw correct images by real WebGL too")
    parser.add_argument(
        "--page-only", action="store_true", help="write page and figure from the figures kept"
    )
    parser.add_argument("--docs", type=Path, default=Path("docs"), help="folder of the page (docs)")
    parser.add_argument("--data", type=Path, default=DATA, help="folder of the figures (tests/data)")
    return parser


if __name__ == "__main__":
    sys.exit(main())
