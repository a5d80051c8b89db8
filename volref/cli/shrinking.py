"""`volref check --shrink`: the smallest scene that a program still draws wrong."""

import argparse
import shlex
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from volref.cli.output import note, progress
from volref.errors import FormatError

if TYPE_CHECKING:
    from volref.oracle.faults.fault import Subject

PLACES = ("{scene}", "{out}")


def add_shrinking(parser: argparse.ArgumentParser) -> None:
    """Add --shrink, --command and --trials."""
    parser.add_argument(
        "--shrink",
        metavar="OUT.json",
        help="if the image is outside: file for the smallest scene that still is",
    )
    parser.add_argument(
        "--command",
        metavar="WORDS",
        help="how to draw a scene for --shrink: your program, with {scene} for its file and {out} for the "
        "image, of the same kind as CANDIDATE",
    )
    parser.add_argument(
        "--trials",
        type=int,
        default=300,
        metavar="N",
        help="scenes to draw for --shrink at most; default 300",
    )


def check_shrinking(options: argparse.Namespace) -> None:
    """Refuse half of what --shrink needs, before the work rather than after it.

    Raises
    ------
    FormatError
        If that is what there is.
    """
    from volref.io.atomic import check_free

    if (options.shrink is None) != (options.command is None):
        message = (
            f"--{'command' if options.shrink else 'shrink'} must be given with the other one, got none; "
        )
        raise FormatError(message + "give both")
    if options.shrink is None:
        return
    if Path(options.shrink).suffix.lower() != ".json":
        message = f"{options.shrink} must end in .json, got {Path(options.shrink).suffix!r}; rename it"
        raise FormatError(message)
    for name, why in (("mask", "images are smaller"), ("jitter", "scenes do not hold it")):
        if getattr(options, name) is not None:
            message = f"--{name} must be left out with --shrink, whose {why}, got {getattr(options, name)}; "
            raise FormatError(message + "leave it out, or shrink in Python with volref.shrink")
    if not all(place in options.command for place in PLACES):
        message = f"--command must hold {{scene}} and {{out}}, got {options.command!r}; say where they belong"
        raise FormatError(message)
    check_free(Path(options.shrink), overwrite=options.force)


def run_shrinking(options: argparse.Namespace, subject: "Subject") -> None:
    """Write the smallest scene that the command still draws outside.

    Raises
    ------
    FormatError
        If the command does not draw the scene as it is.
    """
    from volref import save_scene
    from volref.oracle.shrinking import shrink

    with tempfile.TemporaryDirectory() as folder, progress("shrinking") as show:
        judge = _Judge(options, Path(folder))
        found = shrink(subject, judge, trials=options.trials, progress=show)
    save_scene(found.scene, options.shrink, overwrite=options.force)
    note(f"wrote {options.shrink}: {_words(found)}")


@dataclass
class _Judge:
    """Whether a subject fails: its scene is written, drawn by the command, and judged."""

    options: argparse.Namespace
    folder: Path
    asked: int = 0

    def __call__(self, subject: "Subject") -> bool:
        from volref import accept, check, save_scene
        from volref.oracle.verdict import OUTSIDE

        self.asked += 1
        place = self.folder / str(self.asked)
        place.mkdir()
        scene, image = place / "scene.json", place / f"image{Path(self.options.candidate).suffix}"
        save_scene(subject.scene, scene)
        acceptance = accept(subject.scene, subject.pipeline, subject.device, subject.jitter, subject.frames)
        try:
            self._draw(scene, image)
            found = check(image, acceptance, alpha=self.options.alpha, encoding=self.options.encoding)
        except FormatError:
            # A scene that the program cannot draw is another failure, unless it is the one to shrink.
            if self.asked == 1:
                raise
            return False
        return found.status == OUTSIDE

    def _draw(self, scene: Path, image: Path) -> None:
        places = {"{scene}": str(scene), "{out}": str(image)}
        words = shlex.split(self.options.command)
        for place, path in places.items():
            words = [word.replace(place, path) for word in words]
        try:
            done = subprocess.run(words, capture_output=True, check=False)
        except OSError as error:
            message = f"--command must be a program that can be run, got {error.strerror} for {words[0]!r}; "
            raise FormatError(message + "check its name") from error
        if done.returncode or not image.exists():
            last = done.stderr.decode(errors="replace").strip().splitlines()[-1:]
            message = f"--command must draw the scene, got exit status {done.returncode} and "
            message += f"{'an' if image.exists() else 'no'} image ({last[0] if last else 'no message'}); "
            raise FormatError(message + "try it by hand")


def _words(subject: "Subject") -> str:
    from volref.scene.transfer import TransferFunction
    from volref.scene.volume import Volume

    scene = subject.scene
    parts = [f"{scene.width} x {scene.height} pixels"]
    if isinstance(scene.volume, Volume):
        parts.append(f"{' x '.join(map(str, scene.volume.size))} voxels")
    if isinstance(scene.transfer, TransferFunction):
        parts.append(f"{len(scene.transfer.values)} knots")
    for name, items in (("mesh", scene.meshes), ("light", scene.lights)):
        if items:
            parts.append(f"{len(items)} {name}{'es' if name == 'mesh' else 's'}")
    if subject.frames > 1:
        parts.append(f"{subject.frames} frames")
    return ", ".join(parts)
