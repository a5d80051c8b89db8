"""Make the golden suite: `python -m data_gen.goldens OUT` writes the bundles of its recipes.

    python -m data_gen.goldens OUT [NAME ...]       bundles, those that are there already are kept
    python -m data_gen.goldens --rehash             digests and pictures of the suite, in their place
    python -m data_gen.goldens --rehash --intervals     with digests of the acceptance intervals, minutes
    python -m data_gen.goldens --scans              the small real scans, from tests/data

After --rehash has changed an image, docs/changelog.md has to say so under "Images changed": a test reads it.
Exit codes: 0 written, 2 refused, with one sentence on stderr.
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from data_gen.goldens.scans import write_scans
from volref.emulation.passes import emulate
from volref.errors import FormatError
from volref.golden.making import make_goldens
from volref.golden.recipe import subject_of
from volref.golden.suite import BUILT_IN, Suite, load_suite, save_hashes
from volref.golden.verifying import draw_again
from volref.io.png import write_png


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return its exit code."""
    options = _parser().parse_args(arguments)
    try:
        suite = load_suite(BUILT_IN)
        if options.scans:
            print(*write_scans(suite.file.parent / "scans"), sep="\n")
        elif options.rehash:
            rehash(suite, intervals=options.intervals)
        else:
            _make(suite, options)
    except FormatError as error:
        print(f"data_gen: {error}", file=sys.stderr)
        return 2
    return 0


def rehash(suite: Suite, *, intervals: bool) -> None:
    """Write digests and pictures of a suite beside it, and say what the changelog has to name."""
    goldens = {}
    suite.preview("").parent.mkdir(exist_ok=True)
    for name, recipe in suite.recipes.items():
        subject = subject_of(recipe)
        goldens[name] = draw_again(subject, interval=intervals)
        drawn = emulate(subject.scene, subject.pipeline, subject.device, subject.jitter, subject.frames)
        write_png(suite.preview(name), drawn.rgba8, overwrite=True)
        print(name)
    for picture in suite.preview("").parent.glob("*.png"):
        if picture.stem not in goldens:
            picture.unlink()
    digest = save_hashes(suite, goldens).digest
    print(f'\nunless it is there, write under "Images changed": suite `{digest[:12]}`')


def _make(suite: Suite, options: argparse.Namespace) -> None:
    if options.out is None:
        message = "OUT must be a folder, got none; name one, or pass --rehash"
        raise FormatError(message)
    for name in options.names:
        if name not in suite.recipes:
            message = f"NAME must be a golden of the suite, got {name!r}; see: volref golden list"
            raise FormatError(message)
    chosen = [suite.recipes[name] for name in options.names or suite.recipes]
    for made in make_goldens(chosen, options.out, overwrite=options.force):
        print(f"{made.folder}  {made.state}")


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="data_gen.goldens", description="Make the golden suite.")
    parser.add_argument("out", nargs="?", type=Path, metavar="OUT", help="folder for the bundles")
    parser.add_argument("names", nargs="*", metavar="NAME", help="which goldens; all if none")
    parser.add_argument("--force", action="store_true", help="make those that are there anew")
    parser.add_argument("--rehash", action="store_true", help="write the digests and pictures of the suite")
    parser.add_argument("--intervals", action="store_true", help="with --rehash: of the intervals too")
    parser.add_argument("--scans", action="store_true", help="write the small real scans from tests/data")
    return parser


if __name__ == "__main__":
    sys.exit(main())
