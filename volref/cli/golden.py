"""`volref golden`: images that a renderer is held to, made of recipes, checked, and made again."""

import argparse
from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from volref.cli.golden_judging import add_check, add_report, run_check, run_report
from volref.cli.machines import add_dask, executor_at
from volref.cli.options import add_force, add_json, add_scene, fraction, read_scene
from volref.cli.output import note, print_json, progress
from volref.cli.programs import add_program, read_jitter, read_program
from volref.cli.verb import DIFFERS, GOOD, Verb
from volref.errors import FormatError

if TYPE_CHECKING:
    from volref.golden.recipe import Recipe
    from volref.golden.verifying import Redrawn


def _arguments(parser: argparse.ArgumentParser) -> None:
    actions = parser.add_subparsers(title="what to do", metavar="WHAT", required=True)
    several = {
        "list": ("the goldens of a suite", _arguments_of_list, _list),
        "make": ("make golden bundles of a scene, a recipe or a suite", _arguments_of_make, _make),
        "check": ("hold images against bundles; exit status 1 if one fails", add_check, run_check),
        "report": ("the same as a page to open in a browser", add_report, run_report),
        "verify": (
            "draw a suite or bundles again, held to what they were; exit status 1 if one differs",
            _arguments_of_verify,
            _verify,
        ),
    }
    for name, (purpose, arguments, act) in several.items():
        made = actions.add_parser(name, help=purpose, description=purpose, allow_abbrev=False)
        arguments(made)
        add_json(made)
        made.set_defaults(act=act)


def _arguments_of_list(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "suite", nargs="?", metavar="SUITE", default="volref", help="a suite's .json; default volref's own"
    )


def _arguments_of_make(parser: argparse.ArgumentParser) -> None:
    add_scene(parser, "a scene, a recipe or a suite (.json), or 'volref', the suite that comes along")
    parser.add_argument("output", metavar="OUT", help="the bundle's folder; of a suite, the folder for all")
    add_program(parser, required=False)
    parser.add_argument("--name", metavar="NAME", help="of a scene: short name; default that of OUT")
    parser.add_argument("--title", metavar="TEXT", default="", help="of a scene: a line for people")
    parser.add_argument(
        "--truth", type=fraction, metavar="E", help="of a scene: the integral too, to this tolerance"
    )
    parser.add_argument(
        "--only", metavar="NAME", action="append", default=[], help="of a suite: this golden; may be repeated"
    )
    _add_work(parser)
    add_force(parser)


def _arguments_of_verify(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "places",
        nargs="+",
        metavar="SUITE|BUNDLE",
        help="'volref', a suite's .json with its digests, or folders of bundles",
    )
    _add_work(parser)


def _add_work(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("-j", "--jobs", type=int, metavar="N", default=1, help="processes; default 1")
    add_dask(parser)
    parser.add_argument("-q", "--quiet", action="store_true", help="no progress, no summary, errors only")


def _run(options: argparse.Namespace) -> int:
    status: int = options.act(options)
    return status


def _list(options: argparse.Namespace) -> int:
    from volref.golden.suite import load_suite

    recipes = load_suite(options.suite).recipes.values()
    if options.json:
        print_json({"recipes": [dict(recipe.document) for recipe in recipes]})
        return GOOD
    width = max(len(recipe.name) for recipe in recipes)
    for recipe in recipes:
        device = recipe.document.get("device", {})
        print(f"{recipe.name:<{width}}  {device.get('name', 'a file'):<11}  {recipe.title}")
    return GOOD


def _make(options: argparse.Namespace) -> int:
    recipes = _recipes(options)
    if recipes is None:
        folders = [(str(_make_one(options)), "made")]
    else:
        from volref.golden.making import make_goldens

        with _workers(options) as executor, progress("goldens", quiet=options.quiet) as show:
            made = make_goldens(
                recipes, options.output, executor=executor, overwrite=options.force, progress=show
            )
        folders = [(str(one.folder), one.state) for one in made]
    if options.json:
        print_json({"goldens": [{"folder": folder, "state": state} for folder, state in folders]})
    if not options.quiet:
        kept = sum(state == "kept" for _, state in folders)
        note(f"{len(folders) - kept} made, {kept} kept in {options.output}")
    return GOOD


def _recipes(options: argparse.Namespace) -> "list[Recipe] | None":
    """Return the recipes that the word names; None if it names a scene."""
    from volref.golden.recipe import FORMAT, load_recipe
    from volref.golden.suite import BUILT_IN, is_suite, load_suite
    from volref.io.guard import nearest, read_json

    word = options.scene
    if word != BUILT_IN and not is_suite(Path(word)):
        document: Any = read_json(Path(word))
        is_recipe = isinstance(document, dict) and document.get("format") == FORMAT
        if not is_recipe and options.pipeline is None:
            message = "--pipeline must be given for a scene, got none; name one that `volref pipelines` lists"
            raise FormatError(message)
        if not is_recipe:
            return None
        _refuse_program(options)
        return [load_recipe(word)]
    _refuse_program(options)
    recipes = load_suite(word).recipes
    for name in options.only:
        if name not in recipes:
            message = f"--only must name a golden of the suite, got {name!r}; {nearest(name, recipes)}"
            raise FormatError(message)
    return [recipes[name] for name in options.only or recipes]


def _refuse_program(options: argparse.Namespace) -> None:
    """Refuse options that a recipe has settled already."""
    for name in ("pipeline", "device", "jitter", "frames", "size", "truth", "name"):
        if getattr(options, name) is not None:
            message = f"--{name} must be given for a scene alone, got it for a recipe; write another recipe"
            raise FormatError(message)


def _make_one(options: argparse.Namespace) -> Path:
    from volref import write_bundle

    program, device = read_program(options)
    scene = read_scene(options)
    jitter, frames = read_jitter(options, scene, program)
    about = {"name": options.name, "title": options.title, "truth": options.truth}
    return write_bundle(
        options.output, scene, program, device, jitter, frames, overwrite=options.force, **about
    )


def _verify(options: argparse.Namespace) -> int:
    redrawn: list[Redrawn] = []
    with _workers(options) as executor, progress("goldens", quiet=options.quiet) as show:
        from volref.golden.verifying import verify_bundles, verify_suite

        for suite, folders in _parts(options.places):
            if suite is not None:
                redrawn += verify_suite(suite, executor=executor, progress=show)
            else:
                redrawn += verify_bundles(folders, executor=executor, progress=show)
    failed = [one for one in redrawn if not one.passed]
    if options.json:
        print_json({"goldens": [_document(one) for one in redrawn]})
    elif not options.quiet:
        for one in redrawn:
            print(one.message)
    if not options.quiet:
        within = sum(one.status == "within" for one in redrawn)
        equal = len(redrawn) - within - len(failed)
        note(f"{equal} the same to the bit, {within} within their intervals, {len(failed)} differ")
    return DIFFERS if failed else GOOD


def _parts(places: list[str]) -> "Iterator[tuple[Any, list[Path]]]":
    """Yield suites and folders of bundles, as the words name them."""
    from volref.golden.checking import bundles_in
    from volref.golden.suite import BUILT_IN, load_suite

    for place in places:
        if place == BUILT_IN or Path(place).suffix == ".json":
            yield load_suite(place), []
        elif found := bundles_in(Path(place)):
            yield None, found
        else:
            message = f"SUITE|BUNDLE must be 'volref', a .json or a folder of bundles, got {place!r}; "
            raise FormatError(message + "check the path")


@contextmanager
def _workers(options: argparse.Namespace) -> Iterator[Executor | None]:
    """Yield the executor that --jobs or --dask asks for; None for this process alone."""
    if options.dask is not None or options.jobs == 1:
        with executor_at(options.dask) as executor:
            yield executor
        return
    if not 1 <= options.jobs <= 1024:
        message = f"--jobs must be from 1 to 1024, got {options.jobs}; give a number of processes"
        raise FormatError(message)
    import multiprocessing
    from concurrent.futures import ProcessPoolExecutor

    # A fork of a process with threads, as NumPy's may be, can hang.
    with ProcessPoolExecutor(options.jobs, mp_context=multiprocessing.get_context("spawn")) as pool:
        yield pool


def _document(one: "Redrawn") -> dict[str, Any]:
    return {
        "name": one.name,
        "status": one.status,
        "changed": list(one.changed),
        "digests": dict(one.digests),
    }


VERB = Verb(
    "golden",
    "images that a renderer is held to: made of recipes, checked, made again",
    (
        ("golden list", "the suite that comes along"),
        (
            "golden make scene.json goldens/head --pipeline texture3d --device webgl-highp",
            "what any correct machine may draw of your scene, in files that a test reads",
        ),
        ("golden make volref goldens/ -j 4", "all of the suite, in four processes"),
        ("golden check goldens/head canvas.png", "is the image right?"),
        ("golden check goldens/ captures/ --junit result.xml", "every capture by the golden of its name"),
        ("golden report goldens/ captures/ -o page.html", "the same as a page"),
        ("golden verify volref", "is the suite still the same to the bit here?"),
    ),
    _arguments,
    _run,
)
