"""`volref explain`: which fault of a renderer makes an image as it is."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from volref.cli.options import add_force, add_json, add_scene, read_scene
from volref.cli.output import check_targets, note, print_json, progress, table
from volref.cli.programs import add_program, is_file, pipeline_at, read_device, read_jitter
from volref.cli.verb import DIFFERS, GOOD, Verb

if TYPE_CHECKING:
    from volref.emulation.files.candidates import Candidates
    from volref.emulation.pipeline import Pipeline
    from volref.oracle.explanation import Explanation, Ranked

# Those of volref.oracle.delivery and volref.image, which would be dear to import for a help text.
ALPHAS = ("premultiplied", "straight", "ignored")
ENCODINGS = ("none", "srgb", "gamma2.2")

# How many faults are listed.
LISTED = 5


def _arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("candidate", metavar="CANDIDATE", help="the image: .png, .npy, .npz or .exr")
    add_scene(parser)
    add_program(parser, required=True)
    parser.add_argument(
        "--alpha", choices=ALPHAS, help="how the image holds its colours; default as the canvas has them"
    )
    parser.add_argument(
        "--encoding", choices=ENCODINGS, help="what its colours were encoded by after drawing; default none"
    )
    parser.add_argument("--mask", metavar="FILE", help="an image: pixels that are not black are left out")
    parser.add_argument(
        "--top", type=int, metavar="N", default=LISTED, help=f"how many faults to list; default {LISTED}"
    )
    parser.add_argument("--singles", action="store_true", help="do not try two faults together")
    parser.add_argument(
        "--counterfactual", metavar="OUT", help="file for what the program with the best fault draws"
    )
    add_force(parser)
    add_json(parser)
    parser.add_argument("-q", "--quiet", action="store_true", help="no progress")


def _run(options: argparse.Namespace) -> int:
    from volref import Candidates, explain

    if options.counterfactual:
        check_targets([Path(options.counterfactual)], force=options.force)
    scene, program = read_scene(options), _program(options)
    drawn = program.pipeline if isinstance(program, Candidates) else program
    jitter, frames = read_jitter(options, scene, drawn)
    mask = None if options.mask is None else Path(options.mask)
    with progress("explain", quiet=options.quiet) as show:
        why = explain(
            Path(options.candidate),
            scene,
            program,
            read_device(options),
            jitter,
            frames,
            pairs=not options.singles,
            alpha=options.alpha,
            encoding=options.encoding,
            mask=mask,
            progress=show,
        )
    if options.json:
        print_json(why.as_dict(options.top))
    else:
        print(why)
        print(_listed(why, options.top), end="")
    _write_picture(options, why)
    return GOOD if why.status == "none" else DIFFERS


def _program(options: argparse.Namespace) -> "Pipeline | Candidates":
    """Return the program, or the set of programs of a file that leaves switches open."""
    if not is_file(options.pipeline):
        return pipeline_at(options.pipeline)
    from volref import load_candidates

    found = load_candidates(options.pipeline)
    return found if found.unknown else found.pipeline


def _listed(why: "Explanation", most: int) -> str:
    """Return the best faults, one in a line."""
    shown = [one for one in why.ranking[:most] if one.explained > 0]
    return table({one.fault: _figures(one) for one in shown}) + "\n" if shown else ""


def _figures(one: "Ranked") -> str:
    strengths = one.strength if isinstance(one.strength, tuple) else (one.strength,)
    return f"strength {' and '.join(f'{number:.3g}' for number in strengths)}, {one.explained:.1%}"


def _write_picture(options: argparse.Namespace, why: "Explanation") -> None:
    if not options.counterfactual:
        return
    if why.counterfactual is None:
        note(f"did not write {options.counterfactual}: there is no fault to draw")
        return
    from volref.io import write_image

    write_image(options.counterfactual, why.counterfactual, encoding="none", overwrite=options.force)
    note(f"wrote {options.counterfactual}")


VERB = Verb(
    "explain",
    "which fault of a renderer makes an image as it is",
    (
        (
            "explain mine.png scene.json --pipeline texture3d --alpha straight",
            "an image that a browser saved",
        ),
        (
            "explain mine.npy scene.json --pipeline congote2012 --device llvmpipe --counterfactual fault.png",
            "and what the program would draw with that fault",
        ),
        (
            "explain mine.png scene.json --pipeline open.json",
            "which values of open switches it was drawn with",
        ),
    ),
    _arguments,
    _run,
    notes="Exit status 0: the image lies inside its intervals; 1: it does not.",
)
