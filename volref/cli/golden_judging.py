"""`volref golden check` and `volref golden report`: images held against golden bundles."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from volref.cli.options import add_force
from volref.cli.output import note, print_json
from volref.cli.verb import DIFFERS, GOOD

if TYPE_CHECKING:
    from volref.golden.bundle import Bundle
    from volref.golden.checking import Pair
    from volref.oracle.verdict import Verdict


def add_check(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `golden check`."""
    _add_places(parser)
    parser.add_argument("--junit", metavar="FILE", help="the verdicts as JUnit XML")
    add_force(parser)


def add_report(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `golden report`."""
    _add_places(parser)
    parser.add_argument("-o", "--output", metavar="OUT.html", required=True, help="the page to write")
    parser.add_argument("--title", metavar="TEXT", default="Goldens", help="of the page")
    add_force(parser)


def run_check(options: argparse.Namespace) -> int:
    """Judge every image; print the verdicts."""
    from volref.golden.junit import Outcome, write_junit
    from volref.io.atomic import check_free

    if options.junit is not None:
        check_free(Path(options.junit), overwrite=options.force)
    judged = _judged(options)
    if options.json:
        print_json({"verdicts": [_document(*one) for one in judged]})
    else:
        for _, bundle, verdict in judged:
            print(f"{bundle.name}: {verdict}")
    if options.junit is not None:
        outcomes = [Outcome(b.name, b.pipeline.name, v.passed, v.message) for _, b, v in judged]
        write_junit(options.junit, outcomes, overwrite=options.force)
    return _status(judged)


def run_report(options: argparse.Namespace) -> int:
    """Judge every image; write the page of verdicts."""
    from volref.report.judging import write_judging
    from volref.report.verdicts.cases import Case

    judged = _judged(options)
    cases = [Case(b.name, b.acceptance, v, passes=b.passes, provenance=_provenance(b)) for _, b, v in judged]
    write_judging(options.output, cases, title=options.title, overwrite=options.force)
    if options.json:
        print_json({"output": options.output, "verdicts": [_document(*one) for one in judged]})
    failed = sum(not verdict.passed for _, _, verdict in judged)
    note(f"{len(judged) - failed} passed, {failed} failed; wrote {options.output}")
    return _status(judged)


def _add_places(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "places",
        nargs="+",
        metavar="BUNDLE... CANDIDATE",
        help="bundles (or a folder of them), then as many images in the same order, or a folder of images "
        "that bear the bundles' names",
    )
    parser.add_argument(
        "--alpha", choices=("premultiplied", "straight", "ignored"), help="as in volref check"
    )
    parser.add_argument("--encoding", choices=("none", "srgb", "gamma2.2"), help="as in volref check")
    parser.add_argument("--mask", metavar="FILE", help="an image: pixels that are not black are left out")


def _judged(options: argparse.Namespace) -> "list[tuple[Pair, Bundle, Verdict]]":
    from volref import load_bundle
    from volref.golden.checking import check_bundle, pairs_of

    said = {"alpha": options.alpha, "encoding": options.encoding, "mask": options.mask}
    judged = []
    for pair in pairs_of(options.places):
        bundle = load_bundle(pair.bundle)
        judged.append((pair, bundle, check_bundle(bundle, pair.candidate, **said)))
    return judged


def _status(judged: "list[tuple[Pair, Bundle, Verdict]]") -> int:
    return GOOD if all(verdict.passed for _, _, verdict in judged) else DIFFERS


def _document(pair: "Pair", bundle: "Bundle", verdict: "Verdict") -> dict[str, Any]:
    head = {"name": bundle.name, "bundle": str(pair.bundle), "candidate": str(pair.candidate)}
    return head | verdict.as_dict()


def _provenance(bundle: "Bundle") -> dict[str, str]:
    said = {
        "Golden": str(bundle.folder),
        "Recipe": str(bundle.manifest["recipe_sha256"]),
        "Made by": f"volref {bundle.manifest['volref']}, NumPy {bundle.manifest['environment'].get('numpy')}",
    }
    if bundle.bound is not None:
        said["Error of the truth"] = f"{float(bundle.bound.max()):.2g}"
    return said
