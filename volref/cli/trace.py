"""`volref trace`: every number of one ray."""

import argparse
from typing import TYPE_CHECKING

from volref.cli.options import add_json, add_scene, fraction, read_scene
from volref.cli.output import print_json
from volref.cli.programs import add_program, read_jitter, read_program
from volref.cli.verb import GOOD, Verb
from volref.errors import FormatError

if TYPE_CHECKING:
    from volref.traces import Trace


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
    add_program(parser, required=False)
    add_json(parser)


def _run(options: argparse.Namespace) -> int:
    found = _traced(options)
    if options.json:
        print_json(found.as_dict())
    else:
        print(found)
    return GOOD


def _traced(options: argparse.Namespace) -> "Trace":
    from volref import trace

    pixel = options.x, options.y
    if options.pipeline is None:
        for name in ("device", "jitter", "frames"):
            if getattr(options, name) is not None:
                message = f"--{name} must be given with --pipeline, got it alone; name a pipeline"
                raise FormatError(message)
        return trace(read_scene(options), pixel, step=options.step)
    if options.step is not None:
        message = "--step must be given without --pipeline, which has its own, got both; leave one out"
        raise FormatError(message)
    program, device = read_program(options)
    scene = read_scene(options)
    jitter, frames = read_jitter(options, scene, program)
    return trace(scene, pixel, program, jitter, frames, device=device)


VERB = Verb(
    "trace",
    "every number of the ray through one pixel",
    (
        ("trace scene.json 120 80", "the ray through column 120, row 80, as a table"),
        ("trace scene.json 120 80 --json > ray.json", "with the cells, their corner samples and the weights"),
        (
            "trace scene.json 120 80 --pipeline congote2012",
            "every iteration of a GPU program's loop, and why it ended",
        ),
    ),
    _arguments,
    _run,
    notes="The JSON has columns that the table leaves out: cell, fraction, corners, position; of a program "
    "the texels of each fetch and their weights.",
)
