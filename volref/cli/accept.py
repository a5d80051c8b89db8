"""`volref accept`: what any correct machine may draw of a scene with a program."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from volref.cli.options import add_force, add_json, add_scene, read_scene
from volref.cli.output import note, print_json, table
from volref.cli.programs import add_program, read_jitter, read_program
from volref.cli.verb import DIFFERS, GOOD, Verb
from volref.errors import FormatError

if TYPE_CHECKING:
    from volref.arrays import Floats
    from volref.oracle.acceptance import Acceptance

PERCENTS = (50, 99)


def _arguments(parser: argparse.ArgumentParser) -> None:
    add_scene(parser)
    add_program(parser, required=True)
    parser.add_argument(
        "-o", "--output", metavar="OUT.npz", help="file for the intervals, for `volref check` without SCENE"
    )
    add_force(parser)
    add_json(parser)


def _run(options: argparse.Namespace) -> int:
    from volref import accept, save_acceptance

    if options.output:
        _check_output(Path(options.output), force=options.force)
    program, device = read_program(options)
    scene = read_scene(options)
    jitter, frames = read_jitter(options, scene, program)
    acceptance = accept(scene, program, device, jitter, frames)
    if options.output:
        save_acceptance(acceptance, options.output, overwrite=options.force)
    if options.json:
        print_json({"output": options.output, **figures(acceptance)})
    else:
        print(table(_rows(acceptance)))
    if options.output:
        note(f"wrote {options.output}")
    if acceptance.advice:
        note(acceptance.advice)
    return DIFFERS if acceptance.advice else GOOD


def _check_output(target: Path, *, force: bool) -> None:
    """Refuse what could not be written, before the work rather than after it."""
    from volref.io.atomic import check_free

    if target.suffix.lower() != ".npz":
        message = f"{target} must end in .npz, got {target.suffix!r}; rename it"
        raise FormatError(message)
    check_free(target, overwrite=force)


def figures(acceptance: "Acceptance") -> dict[str, Any]:
    """Return how tight intervals are, as plain data; widths are in parts of 1."""
    import numpy as np

    height, width = acceptance.drawn.shape
    drawn = acceptance.drawn
    return {
        "pipeline": acceptance.pipeline.name,
        "device": acceptance.device.name,
        "frames": acceptance.frames,
        "width": width,
        "height": height,
        "drawn": int(np.count_nonzero(drawn)),
        "share_ambiguous": acceptance.share_ambiguous,
        "widths": {f"p{percent}": acceptance.percentile(percent) / 255 for percent in PERCENTS},
        "causes": {
            name: {f"p{percent}": _percentile(widths[drawn], percent) for percent in PERCENTS}
            for name, widths in acceptance.causes.items()
        },
        "advice": acceptance.advice,
        "seconds": acceptance.seconds,
    }


def _percentile(widths: "Floats", percent: int) -> float:
    import numpy as np

    return float(np.percentile(widths, percent)) if widths.size else 0.0


def _rows(acceptance: "Acceptance") -> dict[str, Any]:
    """Return the figures for people, the widest cause first."""
    found = figures(acceptance)
    causes = sorted(found["causes"].items(), key=lambda item: -item[1]["p99"])
    return {
        "program": f"{found['pipeline']} on {found['device']}, {_count(found['frames'], 'frame')}",
        "image": f"{found['width']} x {found['height']}, {_count(found['drawn'], 'pixel')} drawn",
        "width": _levels(found["widths"]),
        "ambiguous": f"{found['share_ambiguous']:.2%} of what is drawn",
        **({"causes": {name: _levels(widths) for name, widths in causes}} if causes else {}),
        "seconds": round(found["seconds"], 2),
    }


def _levels(widths: dict[str, float]) -> str:
    return ", ".join(f"{name} {255 * width:.3g}/255" for name, width in widths.items())


def _count(number: int, word: str) -> str:
    return f"{number} {word}{'s' * (number != 1)}"


VERB = Verb(
    "accept",
    "what any correct machine may draw of a scene with a program",
    (
        (
            "accept scene.json --pipeline congote2012 --device llvmpipe",
            "how tight the intervals are, and why",
        ),
        ("accept scene.json --pipeline mine.json -o mine.npz", "keep them for `volref check`"),
    ),
    _arguments,
    _run,
    notes="Widths are those before the canvas rounds, the widest channel's, over the drawn pixels.\n"
    "Exit status 1: the intervals are of no use; what would settle it is said.",
)
