"""Draw the systems: `python -m data_gen.systems [PAGE ...]`, the head of the demo by each GPU program.

Writes docs/images/system-PAGE.png, and, without names, docs/systems/against_truth.md.
Exit codes: 0 written, 2 refused, with one sentence on stderr.
"""

import argparse
import sys
import time
from collections.abc import Sequence
from importlib import resources
from pathlib import Path

import volref as vr
from data_gen.gallery.sheets import contact_sheet, write_sheet
from data_gen.systems.figures import Case, Distance, case_of, demo_scene, distances
from data_gen.systems.page import page
from data_gen.systems.sheets import PAGES, tiles_of
from volref.arrays import Floats
from volref.errors import FormatError
from volref.io.atomic import write_text

COLUMNS = 4


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return its exit code."""
    options = _parser().parse_args(arguments)
    unknown = [name for name in options.names if name not in PAGES]
    if unknown:
        print(f"systems: PAGE must be one of {', '.join(PAGES)}, got {unknown[0]!r}", file=sys.stderr)
        return 2
    try:
        rows = draw(options.names or list(PAGES), options.docs, options.pixels)
        if not options.names:
            write_text(options.docs / "systems" / "against_truth.md", page(rows), overwrite=True)
    except (FormatError, OSError) as error:
        print(f"systems: {error}", file=sys.stderr)
        return 2
    return 0


def draw(names: Sequence[str], docs: Path, pixels: int) -> dict[str, dict[str, Distance]]:
    """Write the sheets of pages; return how far each of their programs is from the truth."""
    demo = Path(str(resources.files("volref").joinpath("demo_data", "scene.json")))
    scene, mesh = demo_scene(demo, pixels), vr.load_scene(demo).meshes[0]
    (docs / "images").mkdir(parents=True, exist_ok=True)
    known: dict[bool, Floats] = {}
    rows: dict[str, dict[str, Distance]] = {}
    for name in names:
        started = time.perf_counter()
        cases = [case_of(pipeline, scene, mesh) for pipeline in PAGES[name]]
        truths = [_truth(case, known) for case in cases]
        tiles = list(tiles_of(cases, truths))
        write_sheet(docs / "images" / f"system-{name}.png", contact_sheet(tiles, COLUMNS))
        rows |= {
            case.pipeline.name: distances(case, truth) for case, truth in zip(cases, truths, strict=True)
        }
        print(f"systems: {name}, {time.perf_counter() - started:.0f} s", file=sys.stderr)
    return rows


def _truth(case: Case, known: dict[bool, Floats]) -> Floats:
    """Return the certified image of a case, 1/2550 at most off, drawn once with meshes and once without."""
    with_meshes = bool(case.scene.meshes)
    if with_meshes not in known:
        known[with_meshes] = vr.render(case.scene, tolerance=1 / 2550).rgba
    return known[with_meshes]


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m data_gen.systems", description=__doc__.partition("\n")[0]
    )
    parser.add_argument("names", nargs="*", metavar="PAGE", help=f"of {', '.join(PAGES)}; all if none")
    parser.add_argument("--docs", type=Path, default=Path("docs"), help="folder to write in (docs)")
    parser.add_argument("--pixels", type=int, default=150, help="side of a picture (150)")
    return parser


if __name__ == "__main__":
    sys.exit(main())
