"""`volref plan`: what rendering a scene takes, without rendering it."""

import argparse

from volref.cli.options import accuracy, add_accuracy, add_json, add_scene, read_scene
from volref.cli.output import print_json
from volref.cli.verb import GOOD, Verb


def _arguments(parser: argparse.ArgumentParser) -> None:
    add_scene(parser)
    add_accuracy(parser)
    add_json(parser)


def _run(options: argparse.Namespace) -> int:
    from volref import plan

    found = plan(read_scene(options), **accuracy(options))
    if options.json:
        print_json(found.as_dict())
    else:
        print(found)
    return GOOD


VERB = Verb(
    "plan",
    "each stage of rendering a scene, in or out, and why",
    (
        ("plan scene.json", "which method and stages this scene takes"),
        ("plan scene.json --step 0.25 --json", "those of a march at this step, for a program"),
    ),
    _arguments,
    _run,
)
