"""`volref compare`: how far apart two images are."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from volref.cli.options import add_force, add_json, add_limit, fraction, read_limit
from volref.cli.output import note, print_json
from volref.cli.verb import DIFFERS, GOOD, Verb

if TYPE_CHECKING:
    from volref.arrays import Floats


def _arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("a", metavar="A", help="an image: .png, .npy or .npz")
    parser.add_argument("b", metavar="B", help="another of the same size")
    parser.add_argument(
        "--max",
        type=fraction,
        metavar="T",
        help="call them the same up to a difference of T, e.g. 1/255: an unjustified tolerance, as "
        "nothing in the scene derives it",
    )
    parser.add_argument(
        "--codes",
        action="store_true",
        help="take the numbers as sRGB code values; by default PNG is decoded to linear light",
    )
    parser.add_argument("--diff", metavar="OUT.png", help="write the difference as grey, the largest white")
    add_limit(parser)
    add_force(parser)
    add_json(parser)


def _run(options: argparse.Namespace) -> int:
    from volref.arrays import number
    from volref.io import read_image
    from volref.io.atomic import check_free
    from volref.oracle import metrics

    if options.diff:
        check_free(Path(options.diff), overwrite=options.force)  # before the work, and before any output
    encoding = "none" if options.codes else None
    a, b = (read_image(path, encoding=encoding, **read_limit(options)) for path in (options.a, options.b))
    found = metrics.compare(a, b, encoding="srgb" if options.codes else "linear")
    limit = 0.0 if options.max is None else number("--max", options.max, low=0)
    # Codes k/255 are rounded, so that neighbouring levels may be a little more than 1/255 apart.
    same = found.max <= (limit + metrics.LEVEL_ROUNDING if limit else 0.0)
    if options.json:
        tolerance = None if options.max is None else {"max": limit, "justified": False}
        print_json({"same": same, "tolerance": tolerance, **found.as_dict()})
    else:
        print(found)
        print(_verdict(options, same=same))
    if options.diff:
        _write_difference(options, metrics.difference_image(a, b), found.max)
    return GOOD if same else DIFFERS


def _verdict(options: argparse.Namespace, *, same: bool) -> str:
    word = "same" if same else "differs"
    if options.max is None:
        return f"{word} (no tolerance: any difference counts)"
    return f"{word} (up to {options.max:.6g}, an unjustified tolerance)"


def _write_difference(options: argparse.Namespace, difference: "Floats", largest: float) -> None:
    from volref.image import bytes_from_unit
    from volref.io import write_png

    scale = 1 / largest if largest else 0.0
    write_png(options.diff, bytes_from_unit(difference * scale), overwrite=options.force)
    note(f"wrote {options.diff}, where white is a difference of {largest:.6g}")


VERB = Verb(
    "compare",
    "how far apart two images are, in numbers",
    (
        ("compare reference.png mine.png", "a table of measures"),
        ("compare reference.npy mine.npy --diff difference.png", "and a picture of where they differ"),
        ("compare a.png b.png --codes --max 2/255 --json", "for a script: at most two 8-bit levels apart"),
    ),
    _arguments,
    _run,
    notes="Exit status 0: the same; 1: they differ.  Numbers are premultiplied and linear unless --codes.",
)
