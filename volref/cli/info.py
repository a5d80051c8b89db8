"""`volref info`: what files hold."""

import argparse

from volref.cli.options import add_json, add_limit, add_statements, read_limit, read_statements
from volref.cli.output import print_json, refuse, table
from volref.cli.verb import BAD_USE, GOOD, Verb
from volref.errors import FormatError, SceneError


def _arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "files", metavar="FILE", nargs="+", help="a scene, volume, radar, mesh, transfer function or image"
    )
    add_statements(parser, "a volume file")
    add_limit(parser)
    add_json(parser)


def _run(options: argparse.Namespace) -> int:
    from volref.io import describe_file

    told = read_statements(options)
    found, refused = [], False
    for path in options.files:
        try:
            found.append(describe_file(path, **read_limit(options), **told))
        except (SceneError, FormatError) as error:  # the other files are still worth their lines
            refuse(str(error))
            refused = True
    if options.json:
        print_json(found)
    elif found:
        print("\n\n".join(table(about) for about in found))
    return BAD_USE if refused else GOOD


VERB = Verb(
    "info",
    "what a file holds: size, type, spacing, range of values",
    (
        ("info head.nrrd skin.ply scene.json", "several files at once"),
        ("info head.nii.gz --json", "one as JSON (a list with one entry per file)"),
        (
            "info ct.raw -D size=256,256,128 -D dtype=uint8 -D byte_order=little -D skip=0 -D spacing=1,1,2",
            "a file without a header",
        ),
    ),
    _arguments,
    _run,
)
