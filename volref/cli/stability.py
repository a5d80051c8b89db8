"""`volref stability`: stiff and extreme cases, with their true values."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from volref.cli.options import add_force, add_json
from volref.cli.output import note, print_json, progress
from volref.cli.verb import DIFFERS, GOOD, Verb

if TYPE_CHECKING:
    from collections.abc import Sequence

    from volref.studies.stability import Case


def _arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--only",
        metavar="NAME",
        nargs="+",
        help="run only these: names of cases, or of families in quotes; see --list",
    )
    parser.add_argument("--list", action="store_true", help="name the cases and what they ask; run nothing")
    parser.add_argument(
        "--markdown", metavar="OUT.md", help="write a page with the truth, the formulas and the reasons"
    )
    parser.add_argument("-q", "--quiet", action="store_true", help="no progress and no table, errors only")
    add_force(parser)
    add_json(parser)


def _run(options: argparse.Namespace) -> int:
    from volref.io.atomic import check_free, write_text
    from volref.studies.stability import run_stability
    from volref.studies.stability.catalogue import chosen_cases

    if options.list:
        _print_list(chosen_cases(options.only), json=options.json)
        return GOOD
    if options.markdown:
        check_free(Path(options.markdown), overwrite=options.force)  # before the work
    with progress("stability", quiet=options.quiet) as show:
        report = run_stability(show, only=options.only)
    if options.markdown:
        write_text(options.markdown, report.markdown(), overwrite=options.force)
    if options.json:
        print_json(report.as_dict())
    elif not options.quiet:
        print(report)
    if options.markdown and not options.quiet:
        note(f"wrote {options.markdown}")
    return GOOD if report.passed else DIFFERS


def _print_list(cases: "Sequence[Case]", *, json: bool) -> None:
    if json:
        print_json([{"name": c.name, "family": c.family, "question": c.question} for c in cases])
        return
    family = None
    for case in cases:
        if case.family != family:
            family = case.family
            print(family)
        print(f"  {case.name}: {case.question}")


VERB = Verb(
    "stability",
    "stiff and extreme cases: their true values, the textbook formula's, and volref's",
    (
        ("stability", "all cases: the error of the textbook formula, volref's, and its limit"),
        ("stability --list", "what is asked, without running it"),
        ("stability --only camera-inside 'Ray and box'", "one case, and a family"),
        ("stability --markdown stability.md", "a page with every formula and the reason of every limit"),
        ("stability --json > stability.json", "for a script"),
    ),
    _arguments,
    _run,
    notes="Exit status 1: a case fails.  Errors are the largest of a case, absolute or relative as the page\n"
    "says; inf stands for NaN too.",
)
