"""`volref budget`: where a program's distance from the truth comes from, and what to change first."""

import argparse
from typing import TYPE_CHECKING

from volref.cli.options import add_json, add_scene, read_scene
from volref.cli.output import note, print_json, table
from volref.cli.programs import add_program, read_jitter, read_program
from volref.cli.verb import GOOD, Verb

if TYPE_CHECKING:
    from volref.oracle.budgeting import Budget, Spread


def _arguments(parser: argparse.ArgumentParser) -> None:
    add_scene(parser)
    add_program(parser, required=True)
    add_json(parser)


def _run(options: argparse.Namespace) -> int:
    from volref import budget

    program, device = read_program(options)
    scene = read_scene(options)
    jitter, frames = read_jitter(options, scene, program)
    found = budget(scene, program, device, jitter, frames)
    if options.json:
        print_json(found.as_dict())
        return GOOD
    print(table(_rows(found)))
    note(found.message)
    for name, why in found.left_out.items():
        note(f"the {name} was left out: {why}")
    return GOOD


def _rows(found: "Budget") -> dict[str, object]:
    sources = {
        f"{source.name} ({source.now})": f"floor {_levels(source.floor)}; gain {_levels(source.gain)}"
        for source in found.sources
    }
    return {
        "program": f"{found.pipeline.name} on {found.device.name}",
        "distance": _levels(found.distance),
        "itself": _levels(found.itself),
        "sources": sources,
        "seconds": round(found.seconds, 2),
    }


def _levels(spread: "Spread") -> str:
    return f"p50 {spread.p50:.3g}/255, p99 {spread.p99:.3g}/255, at most {spread.largest:.3g}/255"


VERB = Verb(
    "budget",
    "where a program's distance from the truth comes from, and what to change first",
    (
        ("budget scene.json --pipeline texture3d --device llvmpipe", "each source of error, the worst first"),
        ("budget scene.json --pipeline mine.json --json", "the same for a program"),
    ),
    _arguments,
    _run,
    notes="Each source is made ideal: a step an eighth as long, a table of 4096 entries, floats for bytes,\n"
    "exact arithmetic, no early end.  gain: what the image changes by when this source alone is ideal.\n"
    "floor: what it leaves when all others are.  itself: the distance with every source ideal.",
)
