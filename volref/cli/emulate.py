"""`volref emulate`: what a GPU program draws of a scene, with every target on the way."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from volref.cli.options import add_force, add_json, add_scene, read_scene
from volref.cli.output import check_targets, note, print_json
from volref.cli.programs import add_program, read_jitter, read_program
from volref.cli.verb import GOOD, Verb
from volref.errors import FormatError

if TYPE_CHECKING:
    from volref.emulation.result import Emulation


def _arguments(parser: argparse.ArgumentParser) -> None:
    add_scene(parser)
    add_program(parser, required=True)
    parser.add_argument(
        "-o",
        "--output",
        metavar="OUT",
        action="append",
        default=[],
        help="file to write: .png the bytes of the canvas, as a frame capture has them; .npy the same as "
        "numbers; .npz with every target; .exr float32; may be given several times",
    )
    parser.add_argument(
        "--passes",
        metavar="DIR",
        help="folder for every target in the order of drawing, twice: .npy exact, .png for people",
    )
    add_force(parser)
    add_json(parser)
    parser.add_argument("-q", "--quiet", action="store_true", help="no summary, errors only")


def _run(options: argparse.Namespace) -> int:
    from volref import emulate

    targets = [Path(name) for name in options.output]
    _check_targets(targets, options.passes, force=options.force, json=options.json)
    program, device = read_program(options)
    scene = read_scene(options)
    jitter, frames = read_jitter(options, scene, program)
    out = emulate(scene, program, device, jitter, frames)
    files = [] if options.passes is None else _pass_files(out, Path(options.passes))
    for target in targets:
        _save(out, target, force=options.force)
    for path, name in files:
        _save_pass(out, path, name, force=options.force)
    if options.json:
        print_json(_figures(out, frames, options.output, [str(path) for path, _ in files]))
    if not options.quiet:
        note(_summary(out, options.output, options.passes))
    return GOOD


def _check_targets(targets: list[Path], passes: str | None, *, force: bool, json: bool) -> None:
    """Refuse what could not be written, before the work rather than after it."""
    from volref.io.atomic import check_free

    if not (targets or passes or json):
        message = "-o must be given, or --passes or --json, got none; name a file such as -o canvas.png"
        raise FormatError(message)
    check_targets(targets, force=force)
    if passes is None:
        return
    if Path(passes).exists() and not Path(passes).is_dir():
        message = f"{passes} must be a folder, got a file; choose another name"
        raise FormatError(message)
    # Targets of another run beside these would be taken for these.
    for path in sorted(Path(passes).glob("[0-9][0-9]_*.*")):
        check_free(path, overwrite=force)


def _save(out: "Emulation", target: Path, *, force: bool) -> None:
    from volref.io.images import write_image
    from volref.io.png import write_png

    suffix = target.suffix.lower()
    if suffix == ".png":
        write_png(target, out.rgba8, overwrite=force)
    elif suffix == ".npz":
        out.save(target, overwrite=force)
    else:
        write_image(target, out.rgba, overwrite=force)


def _pass_files(out: "Emulation", folder: Path) -> list[tuple[Path, str]]:
    """Return files and names of all targets, numbered as they are drawn."""
    return [
        (folder / f"{number:02d}_{name}{suffix}", name)
        for number, name in enumerate(out.passes, start=1)
        for suffix in (".npy", ".png")
    ]


def _save_pass(out: "Emulation", path: Path, name: str, *, force: bool) -> None:
    from volref.io.npy import write_npy
    from volref.io.png import write_png
    from volref.report.targets import target_picture

    path.parent.mkdir(parents=True, exist_ok=True)
    if path.suffix == ".npy":
        write_npy(path, out.passes[name], overwrite=force)
    else:
        write_png(path, out.rgba8 if name == "canvas" else target_picture(out.passes[name]), overwrite=force)


def _figures(out: "Emulation", frames: int, outputs: list[str], passes: list[str]) -> dict[str, Any]:
    return {
        "outputs": outputs,
        "passes": passes,
        "pipeline": out.pipeline.name,
        "device": out.device.name,
        "width": out.rgba.shape[1],
        "height": out.rgba.shape[0],
        "frames": frames,
        "targets": {name: list(target.shape) for name, target in out.passes.items()},
        "samples": {"total": int(out.samples.sum()), "max": int(out.samples.max())},
        "seconds": out.seconds,
    }


def _summary(out: "Emulation", outputs: list[str], passes: str | None) -> str:
    written = [*outputs, *([] if passes is None else [f"{len(out.passes)} targets to {passes}"])]
    line = f"{out.pipeline.name} on {out.device.name}: at most {int(out.samples.max())} samples on a ray, "
    return line + f"{out.seconds:.2f} s" + (f"; wrote {', '.join(written)}" if written else "")


VERB = Verb(
    "emulate",
    "what a GPU program draws of a scene, pass by pass",
    (
        ("emulate scene.json --pipeline congote2012 -o canvas.png", "the bytes that a frame capture shows"),
        (
            "emulate scene.json --pipeline arbelaz2016 --passes targets/",
            "every target, as numbers and pictures",
        ),
        ("emulate scene.json --pipeline mine.json --device llvmpipe -o canvas.npz", "your own, on Mesa"),
        (
            "emulate scene.json --pipeline cej2020 --jitter noise.npy --frames 16 -o mean.png",
            "the running mean of 16 frames",
        ),
    ),
    _arguments,
    _run,
    notes="`volref pipelines` lists the names, `volref pipelines new` writes a file for your own renderer.",
)
