"""`volref render`: the image of a scene, and how far from the truth it may be."""

import argparse
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from volref.cli.display import add_display, check_display, save
from volref.cli.machines import add_dask, executor_at
from volref.cli.options import (
    add_accuracy,
    add_force,
    add_json,
    add_scene,
    add_work,
    fraction,
    read_scene,
)
from volref.cli.output import check_targets, note, print_json, progress
from volref.cli.rays import add_rays, draw_with
from volref.cli.series import add_series, check_no_series, run_series
from volref.cli.verb import DIFFERS, GOOD, Verb

if TYPE_CHECKING:
    from volref.scene.scene import Scene
    from volref.truth.result import Render
    from volref.truth.verification import Verification


def _arguments(parser: argparse.ArgumentParser) -> None:
    add_scene(parser)
    parser.add_argument(
        "-o",
        "--output",
        metavar="OUT",
        action="append",
        required=True,
        help="file to write: .png for people (8-bit sRGB), .exr (float32, premultiplied), .npy and .npz "
        "exact (float64, premultiplied, linear); may be given several times",
    )
    add_accuracy(parser)
    parser.add_argument(
        "--max-seconds",
        type=fraction,
        metavar="S",
        help="begin nothing more after S seconds; what is not finished then has a larger error, and says so",
    )
    parser.add_argument(
        "--verify",
        type=int,
        metavar="N",
        help="integrate N random rays again at 30 digits, by another path, and compare (extra 'verify')",
    )
    add_rays(parser)
    add_display(parser)
    add_series(parser)
    add_work(parser)
    add_dask(parser)
    add_force(parser)
    add_json(parser)


def _run(options: argparse.Namespace) -> int:
    draw = draw_with(options)
    if options.series is not None:
        return run_series(options)
    check_no_series(options)
    targets = [Path(name) for name in options.output]
    check_targets(targets, force=options.force)
    check_display(options)
    scene = read_scene(options)
    if options.verify is not None:
        from volref.truth.verification import check_verifiable

        check_verifiable(scene)
    with executor_at(options.dask) as executor, progress("render", quiet=options.quiet) as show:
        out = draw(
            scene,
            threads=options.threads,
            executor=executor,
            progress=show,
            **({} if options.max_seconds is None else {"max_seconds": options.max_seconds}),
        )
    for target in targets:
        save(out, target, options)
    checked = None if options.verify is None else _verified(scene, out, options)
    if options.json:
        print_json(_figures(out, options.output) | ({"verification": checked.as_dict()} if checked else {}))
    if not options.quiet:
        note(_summary(out, options.output))
    if checked is not None and not (options.quiet and checked.ok):
        note(str(checked))
    if not out.met_tolerance:
        note(_shortfall(out, options.max_seconds))
    return GOOD if out.met_tolerance and (checked is None or checked.ok) else DIFFERS


def _verified(scene: "Scene", out: "Render", options: argparse.Namespace) -> "Verification":
    from volref import verify

    with progress("verify", quiet=options.quiet) as show:
        return verify(scene, out, options.verify, progress=show)


def _figures(out: "Render", outputs: list[str]) -> dict[str, Any]:
    import numpy as np

    return {
        "outputs": outputs,
        "width": out.rgba.shape[1],
        "height": out.rgba.shape[0],
        "seconds": out.seconds,
        "method": out.plan.method,
        "samples": out.samples,
        "threads": out.threads,
        "bound": {
            "kind": out.bound_kind,
            "max": float(out.bound.max()),
            "p99": float(np.percentile(out.bound, 99)),
        },
        "tolerance": out.plan.tolerance,
        "met_tolerance": out.met_tolerance,
        "plan": out.plan.as_dict(),
    }


def _summary(out: "Render", outputs: list[str]) -> str:
    from volref.report.figures import error_and_time

    return f"{error_and_time(out)}, method {out.plan.method}; wrote {', '.join(outputs)}"


def _shortfall(out: "Render", max_seconds: float | None) -> str:
    """Say by how much the tolerance is missed, and what should meet it."""
    from volref.planning import sampled_because

    largest, tolerance = float(out.bound.max()), out.plan.tolerance
    missed = int((out.bound > tolerance).sum())
    message = f"tolerance not met: error {largest:.3g} ({out.bound_kind}) above {tolerance:.3g} in {missed} "
    message += f"pixel{'s' * (missed > 1)}"
    if max_seconds is not None and out.seconds >= max_seconds:
        return f"{message}; the time was up: raise --max-seconds or --tolerance"
    if not out.plan.step:
        why = "float64 cannot tell more" if out.bound_kind == "certified" else "nothing can be refined"
        return f"{message}; {why}: raise --tolerance"
    if out.plan.termination >= tolerance:
        return f"{message}; rays end at a transmittance of {out.plan.termination:g}: raise --tolerance"
    # The error falls with the square of the step.
    halvings = max(1, math.ceil(math.log(largest / tolerance, 4)))
    step = f"{out.plan.step / 2**halvings:.6g}"
    exact = "" if sampled_because(out.plan.scene) else " or --method exact,"
    return f"{message}; try --step {step},{exact} or raise --tolerance"


VERB = Verb(
    "render",
    "the image of a scene, and how far from the truth it may be",
    (
        ("render scene.json -o image.png", "an image for people, its error certified below half a level"),
        ("render scene.json -o image.png -o image.npz --json", "also all digits, and the figures as JSON"),
        ("render scene.json -o fine.npy --tolerance 1e-9", "a stricter tolerance"),
        ("render scene.json -o quick.png --max-seconds 5", "what can be certified in five seconds"),
        ("render scene.json -o look.png --step 1 --tolerance 1", "a quick march, its error estimated"),
        ("render scene.json -o smooth.png --supersample 4", "each pixel the mean of 4 x 4 rays"),
        ("render scene.json -o even.png --step 2 --frames 64", "the mean of 64 marches with random starts"),
        ("render scene.json -o bright.png --tone-map hable --exposure 4", "strong light, filmed"),
        (
            "render scene.json --series scans/ --times 0:600 --interpolate 10 -o film.png",
            "a film of the volumes in a folder, ten minutes apart, ten frames from each to the next",
        ),
        ("render scene.json -o image.npy --dask local:4", "with four processes of this machine"),
        ("render scene.json -o image.npy --verify 64", "with 64 of its rays checked at 30 digits"),
    ),
    _arguments,
    _run,
    notes="Exit status 1: the tolerance is not met, or a verified ray is outside its bound.  The image is "
    "written all the same.",
)
