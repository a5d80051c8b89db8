"""`volref precision`: the error of every method against its run time."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from volref.cli.options import add_force, add_json, add_limit, image_size, read_limit
from volref.cli.output import note, print_json, progress
from volref.cli.verb import DIFFERS, GOOD, Verb
from volref.errors import FormatError, SceneError

if TYPE_CHECKING:
    from volref.studies.precision import PrecisionReport, Subject


def _arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("scenes", metavar="SCENE", nargs="*", help="scene files (.json) to measure on")
    parser.add_argument("--suite", metavar="NAME", nargs="+", help="scenes of volref's own; see --list")
    parser.add_argument("--all", action="store_true", help="every suite")
    parser.add_argument("--list", action="store_true", help="name the suites and methods; run nothing")
    parser.add_argument(
        "--orders", action="store_true", help="the order of every rival, expected and observed"
    )
    parser.add_argument(
        "--size",
        type=image_size,
        metavar="WxH",
        help="image size; default a scene's own, scaled down to 6912 pixels (96x72)",
    )
    parser.add_argument(
        "--budget",
        type=float,
        metavar="S",
        help="seconds for each scene: every setting runs once, then again while they last; default 240",
    )
    parser.add_argument("--methods", metavar="NAME", nargs="+", help="measure only these; see --list")
    parser.add_argument("--csv", metavar="OUT.csv", help="write a row per method and setting")
    parser.add_argument("--markdown", metavar="OUT.md", help="write a page that says what to use")
    parser.add_argument(
        "--plot",
        metavar="OUT.svg",
        help="write error against seconds, .svg or .png (extra 'plot'); with several scenes each gets a "
        "file, as OUT-smooth.svg",
    )
    parser.add_argument(
        "--allow-outside",
        action="store_true",
        help="let scenes name files outside their own folder; only for scenes that you trust",
    )
    add_limit(parser)
    parser.add_argument("-q", "--quiet", action="store_true", help="no progress and no table, errors only")
    add_force(parser)
    add_json(parser)


def _run(options: argparse.Namespace) -> int:
    if options.list:
        return _print_list(json=options.json)
    if options.orders:
        return _print_orders(json=options.json)
    from volref.studies.precision import run_precision
    from volref.studies.precision.run import BUDGET

    subjects = _subjects(options)
    plots = _targets(options, [subject.name for subject in subjects])
    budget = BUDGET if options.budget is None else options.budget
    with progress("precision", quiet=options.quiet) as show:
        report = run_precision(subjects, methods=options.methods, budget=budget, progress=show)
    _write(report, options, plots)
    if options.json:
        print_json(report.as_dict())
    elif not options.quiet:
        print(report)
    return GOOD if report.passed else DIFFERS


def _subjects(options: argparse.Namespace) -> list["Subject"]:
    """Return what to measure on: the suites, then the scene files under the names of their files."""
    from volref.io import load_scene
    from volref.studies.precision import Subject, resized, subject_of
    from volref.studies.precision.suites import chosen_suites

    suites = chosen_suites(None if options.all else options.suite or [])
    subjects = [subject_of(suite, options.size) for suite in suites]
    for name in options.scenes:
        scene = load_scene(name, allow_outside=options.allow_outside, **read_limit(options))
        subjects.append(
            Subject(Path(name).stem, f"the scene {Path(name).name}", resized(scene, options.size))
        )
    if not subjects:
        message = (
            "precision must be told what to measure on, got no scene; name a SCENE, --suite NAME or --all"
        )
        raise SceneError(message)
    names = [subject.name for subject in subjects]
    for name in names:
        if names.count(name) > 1:
            message = f"scenes must have different names, got {name!r} twice; rename a file"
            raise SceneError(message)
    return subjects


def _targets(options: argparse.Namespace, names: list[str]) -> dict[str, Path]:
    """Refuse what could not be written, before the work; return where each scene's plot goes."""
    from volref.io.atomic import check_free

    plots = {}
    if options.plot:
        from volref.report.plots import check_matplotlib, plot_paths

        check_matplotlib()
        plots = plot_paths(options.plot, names)
    for target in (options.csv, options.markdown, *plots.values()):
        if target is None:
            continue
        file = Path(target)
        if not file.parent.is_dir():
            message = f"{file} must lie in a folder that exists, got {file.parent}; create it first"
            raise FormatError(message)
        check_free(file, overwrite=options.force)
    return plots


def _write(report: "PrecisionReport", options: argparse.Namespace, plots: dict[str, Path]) -> None:
    from volref.io.atomic import write_text

    written = []
    for study in report.scenes:
        if study.name in plots:
            from volref.report.plots import save_precision_plot

            save_precision_plot(study, plots[study.name], overwrite=options.force)
            written.append(str(plots[study.name]))
    if options.csv:
        write_text(options.csv, report.csv(), overwrite=options.force)
        written.append(options.csv)
    if options.markdown:
        images = {name: _seen_from(Path(options.markdown).parent, path) for name, path in plots.items()}
        write_text(options.markdown, report.markdown(images), overwrite=options.force)
        written.append(options.markdown)
    if written and not options.quiet:
        note(f"wrote {', '.join(written)}")


def _seen_from(folder: Path, path: Path) -> str:
    """Return a path as a page in `folder` names it."""
    import os

    return Path(os.path.relpath(path, folder)).as_posix()


def _print_list(*, json: bool) -> int:
    from volref.studies.precision import METHODS, SUITES

    if json:
        print_json(
            {
                "suites": [{"name": suite.name, "meaning": suite.meaning} for suite in SUITES],
                "methods": [{"name": m.name, "title": m.title, "knob": m.knob} for m in METHODS],
            }
        )
        return GOOD
    width = max(len(name) for name in (*(s.name for s in SUITES), *(m.name for m in METHODS)))
    print("suites")
    for suite in SUITES:
        print(f"  {suite.name:<{width}}  {suite.meaning}")
    print("methods")
    for method in METHODS:
        print(f"  {method.name:<{width}}  {method.title}, by {method.knob}")
    return GOOD


def _print_orders(*, json: bool) -> int:
    from dataclasses import asdict

    from volref.studies.orders import observe_orders, orders_markdown

    observations = observe_orders()
    if json:
        print_json([asdict(observation) for observation in observations])
    else:
        print("expected: observed power with which the error falls")
        print(orders_markdown(observations))
    return GOOD


VERB = Verb(
    "precision",
    "the error of every method against its run time: which to use for which error",
    (
        ("precision --suite few-kinks", "what no other method beats, on a scene of volref's own (4 minutes)"),
        ("precision scene.json --plot scene.svg --csv scene.csv", "on a scene of yours, with every number"),
        ("precision scene.json --methods auto march --size 64x48", "a quick look at volref's own"),
        ("precision --all --markdown precision.md --plot precision.svg", "a page with a plot for each suite"),
        ("precision --list", "suites and methods"),
        ("precision --orders", "with which power of the step each rival's error falls"),
    ),
    _arguments,
    _run,
    notes="The truth is the certified integral at 1e-12.  Times are CPU seconds on one thread, the least of\n"
    "up to 5 runs.  Exit status 1: a certificate does not hold, or a certified method misses a tolerance.",
)
