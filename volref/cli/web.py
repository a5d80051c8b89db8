"""`volref web`: the modules for browsers, as files."""

import argparse
from importlib import resources
from pathlib import Path

from volref.cli.options import add_force
from volref.cli.output import note
from volref.cli.verb import GOOD, Verb
from volref.errors import FormatError


def _arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("folder", metavar="DIR", help="folder for the modules; it is made if it is not there")
    add_force(parser)


def _run(options: argparse.Namespace) -> int:
    from volref.io.atomic import check_free, write_text

    folder = Path(options.folder)
    if folder.exists() and not folder.is_dir():
        message = f"{folder} must be a folder, got a file; choose another name"
        raise FormatError(message)
    entries = sorted(resources.files("volref").joinpath("web").iterdir(), key=lambda entry: entry.name)
    modules = [entry for entry in entries if entry.name.endswith(".js")]
    for module in modules:
        check_free(folder / module.name, overwrite=options.force)
    folder.mkdir(parents=True, exist_ok=True)
    for module in modules:
        write_text(folder / module.name, module.read_text(encoding="utf-8"), overwrite=options.force)
    note(f"wrote {len(modules)} modules to {folder}; import them from index.js")
    return GOOD


VERB = Verb(
    "web",
    "the JavaScript modules that capture a frame and judge it in a browser",
    (("web public/volref", "copy them to where your pages can import them"),),
    _arguments,
    _run,
)
