"""Write made-up data: `python -m data_gen OUT [NAME ...]`.

Exit codes: 0 written, 2 refused, with one sentence on stderr.
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn

from data_gen.catalogue import CATALOGUE
from data_gen.files import write_items
from volref.errors import FormatError


class _Parser(argparse.ArgumentParser):
    """A parser whose complaint is one sentence, without the usage before it."""

    def error(self, message: str) -> NoReturn:
        self.exit(2, f"{self.prog}: {message}; see --help\n")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return its exit code."""
    options = _parser().parse_args(arguments)
    if options.list:
        for name, entry in CATALOGUE.items():
            print(f"{name:20s} {entry.about}{' (seeded)' if entry.seeded else ''}")
        return 0
    problem = _problem(options)
    if problem:
        return _refuse(problem)
    items = {
        stem: (CATALOGUE[name], item)
        for name in options.names or CATALOGUE
        for stem, item in CATALOGUE[name].make(options.seed).items()
    }
    try:
        for path in write_items(options.out, items, options.seed, force=options.force):
            print(path)
    except FormatError as error:
        return _refuse(str(error))
    except OSError as error:
        return _refuse(
            f"OUT must be a folder to write in, got {options.out} ({error.strerror}); choose another"
        )
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(prog="data_gen", description="Write made-up volumes, meshes, storms and tables.")
    parser.add_argument("out", nargs="?", type=Path, metavar="OUT", help="folder, made if missing")
    parser.add_argument("names", nargs="*", metavar="NAME", help="what to write; everything if none")
    parser.add_argument("--list", action="store_true", help="list the names and stop")
    parser.add_argument("--seed", type=int, default=1, help="seed of what is random (default 1)")
    parser.add_argument("--force", action="store_true", help="replace files that exist")
    return parser


def _problem(options: argparse.Namespace) -> str | None:
    """Return what is wrong with the options in one sentence, or None."""
    if options.out is None:
        return "OUT must be a folder, got none; name one, or pass --list"
    if options.out.exists() and not options.out.is_dir():
        return f"OUT must be a folder, got the file {options.out}; name another"
    unknown = [name for name in options.names if name not in CATALOGUE]
    if unknown:
        return f"NAME must be in the list, got {unknown[0]!r}; pass --list to see it"
    if options.seed < 0:
        return f"--seed must be at least 0, got {options.seed}; give another"
    return None


def _refuse(sentence: str) -> int:
    print(f"data_gen: {sentence}", file=sys.stderr)
    return 2


if __name__ == "__main__":
    sys.exit(main())
