"""`volref demo`: a scene to start with, rendered and explained."""

import argparse

from volref.cli.options import add_force, add_json, add_work, image_size
from volref.cli.output import print_json, progress
from volref.cli.verb import GOOD, Verb


def _arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "-o", "--output", metavar="DIR", default="volref-demo", help="folder to write to; default volref-demo"
    )
    parser.add_argument("--size", type=image_size, metavar="WxH", help="image size; default 512x512")
    add_work(parser)
    add_force(parser)
    add_json(parser)


def _run(options: argparse.Namespace) -> int:
    from volref.report.demo import run_demo

    size = {} if options.size is None else dict(zip(("width", "height"), options.size, strict=True))
    with progress("demo", quiet=options.quiet) as show:
        found = run_demo(
            options.output, **size, threads=options.threads, progress=show, overwrite=options.force
        )
    if options.json:
        print_json(found)
    elif not options.quiet:
        print(found["message"])
        print(f"wrote {', '.join(found['files'])}")
        print(f"open {found['page']} in a browser")
        print(f"the scene, to try the other verbs on: {found['scene']}")
    return GOOD


VERB = Verb(
    "demo",
    "start here: a head MRI with its white matter, its error and its time, on one page",
    (
        ("demo", "write volref-demo/ and say what is in it"),
        ("demo -o small-demo --size 320x240", "elsewhere and smaller"),
    ),
    _arguments,
    _run,
)
