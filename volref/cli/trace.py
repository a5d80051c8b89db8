"""`volref trace`: every number of one ray."""

import argparse

from volref.cli.options import add_json, add_scene, fraction, read_scene
from volref.cli.output import print_json
from volref.cli.verb import GOOD, Verb


def _arguments(parser: argparse.ArgumentParser) -> None:
    add_scene(parser)
    parser.add_argument("x", metavar="X", type=int, help="column of the pixel, from 0 at the left")
    parser.add_argument("y", metavar="Y", type=int, help="row of the pixel, from 0 at the top")
    parser.add_argument(
        "--step",
        type=fraction,
        metavar="L",
        help="length of a segment in world units; default half the least voxel spacing",
    )
    add_json(parser)


def _run(options: argparse.Namespace) -> int:
    from volref import trace

    found = trace(read_scene(options), (options.x, options.y), step=options.step)
    if options.json:
        print_json(found.as_dict())
    else:
        print(found)
    return GOOD


VERB = Verb(
    "trace",
    "every number of the ray through one pixel",
    (
        ("trace scene.json 120 80", "the ray through column 120, row 80, as a table"),
        ("trace scene.json 120 80 --json > ray.json", "with the cells, their corner samples and the weights"),
    ),
    _arguments,
    _run,
    notes="The JSON has columns that the table leaves out: cell, fraction, corners, position.",
)
