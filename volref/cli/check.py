"""`volref check`: whether an image lies inside the acceptance intervals of its scene."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from volref.cli.options import add_force, add_json, add_scene, read_limit, read_scene
from volref.cli.output import note, print_json
from volref.cli.programs import add_program, read_jitter, read_program
from volref.cli.shrinking import add_shrinking, check_shrinking, run_shrinking
from volref.cli.verb import DIFFERS, GOOD, Verb
from volref.errors import FormatError

if TYPE_CHECKING:
    from volref.oracle.acceptance import Acceptance
    from volref.oracle.faults.fault import Subject
    from volref.oracle.verdict import Verdict

# Those of volref.oracle.delivery and volref.image, which would be dear to import for a help text.
ALPHAS = ("premultiplied", "straight", "ignored")
ENCODINGS = ("none", "srgb", "gamma2.2")

PICTURES = ("candidate", "nominal", "difference", "overlay")

# What a file of intervals has settled already.
SETTLED = ("pipeline", "device", "jitter", "frames", "size", "shrink")


def _arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("candidate", metavar="CANDIDATE", help="the image: .png, .npy, .npz or .exr")
    add_scene(parser, "a scene file (.json), or intervals that `volref accept -o` wrote (.npz)")
    add_program(parser, required=False)
    parser.add_argument(
        "--alpha",
        choices=ALPHAS,
        help="how the image holds its colours; default as the canvas has them.  What a browser saves as PNG "
        "is straight; 'ignored': its alpha is not the canvas's",
    )
    parser.add_argument(
        "--encoding", choices=ENCODINGS, help="what its colours were encoded by after drawing; default none"
    )
    parser.add_argument("--mask", metavar="FILE", help="an image: pixels that are not black are left out")
    parser.add_argument("--images", metavar="DIR", help=f"folder for pictures: {', '.join(PICTURES)}")
    parser.add_argument("--page", metavar="OUT.html", help="a page with all of it, to open in a browser")
    add_shrinking(parser)
    add_force(parser)
    add_json(parser)


def _run(options: argparse.Namespace) -> int:
    from volref import check, load_acceptance

    _check_targets(options)
    subject = None
    if Path(options.scene).suffix.lower() == ".npz":
        _check_settled(options)
        acceptance = load_acceptance(options.scene, **read_limit(options))
    else:
        subject = _subject(options)
        acceptance = _accepted(subject)
    verdict = check(
        options.candidate,
        acceptance,
        alpha=options.alpha,
        encoding=options.encoding,
        mask=options.mask,
        **read_limit(options),
    )
    print_json(verdict.as_dict()) if options.json else print(verdict)
    _write_pictures(options, acceptance, verdict, subject)
    if options.shrink and subject is not None and verdict.outside.any() and not verdict.passed:
        run_shrinking(options, subject)
    return GOOD if verdict.passed else DIFFERS


def _check_targets(options: argparse.Namespace) -> None:
    """Refuse what could not be judged by or written, before the work rather than after it."""
    from volref.io.atomic import check_free

    suffix = Path(options.scene).suffix.lower()
    if suffix not in (".json", ".npz"):
        message = f"SCENE must be a scene (.json) or intervals (.npz), got {options.scene}; name one of these"
        raise FormatError(message)
    if options.images and Path(options.images).exists() and not Path(options.images).is_dir():
        message = f"{options.images} must be a folder, got a file; choose another name"
        raise FormatError(message)
    targets = [Path(options.images) / f"{name}.png" for name in PICTURES] if options.images else []
    for target in [*targets, *([Path(options.page)] if options.page else [])]:
        check_free(target, overwrite=options.force)
    check_shrinking(options)


def _check_settled(options: argparse.Namespace) -> None:
    for name in SETTLED:
        if getattr(options, name) is not None:
            message = f"--{name} must be left out for intervals from a file, which have it already, got "
            raise FormatError(message + f"{getattr(options, name)}; leave it out, or give the scene")


def _subject(options: argparse.Namespace) -> "Subject":
    from volref.oracle.faults.fault import Subject

    if options.pipeline is None:
        message = "--pipeline must be given with a scene, got none; name the program that draws it"
        raise FormatError(message)
    program, device = read_program(options)
    scene = read_scene(options)
    return Subject(scene, program, device, *read_jitter(options, scene, program))


def _accepted(subject: "Subject") -> "Acceptance":
    from volref import accept

    return accept(subject.scene, subject.pipeline, subject.device, subject.jitter, subject.frames)


def _write_pictures(
    options: argparse.Namespace, acceptance: "Acceptance", verdict: "Verdict", subject: "Subject | None"
) -> None:
    from volref.io import write_png

    if options.images:
        from volref.report.verdict_images import verdict_images

        folder = Path(options.images)
        folder.mkdir(parents=True, exist_ok=True)
        for name, picture in verdict_images(acceptance, verdict).items():
            write_png(folder / f"{name}.png", picture, overwrite=options.force)
        note(f"wrote {len(PICTURES)} pictures to {folder}")
    if options.page:
        from volref.report.judging import write_judging
        from volref.report.verdicts.making import case_of

        files = {"candidate": options.candidate, "scene": options.scene}
        case = case_of(Path(options.candidate).name, acceptance, verdict, subject=subject, files=files)
        write_judging(options.page, [case], overwrite=options.force)
        note(f"wrote {options.page}")


VERB = Verb(
    "check",
    "whether an image is one that a correct machine may draw",
    (
        ("check mine.png scene.json --pipeline texture3d --alpha straight", "an image that a browser saved"),
        ("check mine.png mine.npz --images why", "by intervals from a file; pictures of what is outside"),
        (
            'check mine.npy scene.json --pipeline mine.json --shrink small.json --command "node draw.js '
            '{scene} {out}"',
            "if it is outside: the smallest scene that your program still draws outside",
        ),
    ),
    _arguments,
    _run,
    notes="Exit status 0: inside; 1: outside, or the intervals are too wide to say so.",
)
