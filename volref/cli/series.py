"""`volref render --series`: the same view of one volume after another, as files or as an animated PNG."""

import argparse
import re
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

from volref.cli.display import check_display, save, shown
from volref.cli.machines import executor_at
from volref.cli.options import accuracy, fraction, read_scene
from volref.cli.output import note, print_json, progress
from volref.cli.verb import DIFFERS, GOOD
from volref.errors import FormatError

if TYPE_CHECKING:
    from volref.arrays import Floats
    from volref.scene.scene import Scene
    from volref.scene.series import Series
    from volref.truth.result import Render

# A name with one place for the number of a frame, such as frame_%03d.png.
PATTERN = re.compile(r"[^%]*%0?\d?d[^%]*")
EACH = (".png", ".exr", ".npy", ".npz")
ANIMATED = (".png", ".apng")


@dataclass(frozen=True)
class Targets:
    """Where frames go: patterns of one file for each, and at most one animated PNG of all."""

    patterns: tuple[str, ...]
    animation: Path | None

    def files(self, number: int) -> list[Path]:
        """Return the files of one frame."""
        return [Path(pattern % number) for pattern in self.patterns]


def add_series(parser: argparse.ArgumentParser) -> None:
    """Add --series, --times, --interpolate and --fps."""
    group = parser.add_argument_group("a series in time")
    group.add_argument(
        "--series",
        metavar="PATH",
        nargs="+",
        help="put these volumes in place of the scene's, one after the other: a folder (by name) or files; "
        "-o frame_%%03d.png writes one file for each, -o film.png (or .apng) an animated PNG; --max-seconds "
        "is for each frame",
    )
    group.add_argument(
        "--times",
        type=_times,
        metavar="T,T,...",
        help="when each volume holds, in seconds: as many as volumes, or START:STEP; default 0:1",
    )
    group.add_argument(
        "--interpolate",
        type=int,
        metavar="N",
        help="N frames from each volume to the next, its voxels mixed linearly; default the volumes alone",
    )
    group.add_argument(
        "--fps", type=fraction, metavar="F", help="frames per second of an animated PNG; default 10"
    )


def check_no_series(options: argparse.Namespace) -> None:
    """Refuse what has a meaning only beside --series.

    Raises
    ------
    FormatError
        If it is given.
    """
    for name in ("times", "interpolate", "fps"):
        if getattr(options, name) is not None:
            message = f"--{name} must be given with --series, got it alone; name the volumes, or leave it out"
            raise FormatError(message)


def run_series(options: argparse.Namespace) -> int:
    """Render the scene for each volume; return the exit status."""
    if options.verify is not None:
        message = "--verify must be given without --series, got both; verify one frame at a time"
        raise FormatError(message)
    targets = _targets(options.output)
    check_display(options)
    scene = read_scene(options)
    series = _series(scene, options)
    moments = frame_times(series.times.tolist(), options.interpolate)
    _check_free(targets, len(moments), force=options.force)
    done: list[dict[str, Any]] = []
    frames = _frames(scene, series, moments, targets, options, done)
    if targets.animation is None:
        for _ in frames:
            pass
    else:
        _animate(targets.animation, frames, options)
    _report(done, options)
    return GOOD if all(frame["met_tolerance"] for frame in done) else DIFFERS


def frame_times(times: list[float], per_interval: int | None) -> list[float]:
    """Return when frames are taken: at the times themselves, or N in each interval and the last.

    Raises
    ------
    FormatError
        If N is not at least 1.

    Examples
    --------
    >>> frame_times([0.0, 60.0, 90.0], None), frame_times([0.0, 60.0, 90.0], 2)
    ([0.0, 60.0, 90.0], [0.0, 30.0, 60.0, 75.0, 90.0])
    """
    if per_interval is None:
        return times
    if per_interval < 1:
        message = f"--interpolate must be at least 1, got {per_interval}; give the frames of one interval"
        raise FormatError(message)
    return [
        start + (end - start) * (k / per_interval)
        for start, end in pairwise(times)
        for k in range(per_interval)
    ] + times[-1:]


def _frames(
    scene: "Scene",
    series: "Series",
    moments: list[float],
    targets: Targets,
    options: argparse.Namespace,
    done: list[dict[str, Any]],
) -> Iterator["Floats"]:
    """Render, write the files of each frame and note it in `done`; yield what a PNG shows of it."""
    from volref.truth.series import render_series

    interpolation = "nearest" if options.interpolate is None else "linear"
    with executor_at(options.dask) as executor, progress("frames", quiet=options.quiet) as show:
        rendered = render_series(
            scene,
            series,
            moments,
            interpolation=interpolation,
            factor=1 if options.supersample is None else options.supersample,
            threads=options.threads,
            executor=executor,
            max_seconds=options.max_seconds,
            **accuracy(options),
        )
        for number, (moment, out) in enumerate(rendered):
            files = targets.files(number)
            for file in files:
                save(out, file, options)
            done.append(_figures(moment, out, files))
            if show is not None:
                show(number + 1, len(moments))
            yield shown(out.rgba, options)[0]


def _animate(target: Path, frames: Iterator["Floats"], options: argparse.Namespace) -> None:
    from volref.io.animation import write_animation

    fps = 10.0 if options.fps is None else options.fps
    if not 1 / 65 <= fps <= 1000:
        message = f"--fps must be from 1/65 to 1000, got {fps:g}; give the frames of one second"
        raise FormatError(message)
    encoding = "srgb" if options.gamma is None else "none"
    write_animation(target, frames, seconds=1 / fps, encoding=encoding, overwrite=options.force)


def _series(scene: "Scene", options: argparse.Namespace) -> "Series":
    from volref.io.series import load_series
    from volref.scene.radar import RadarVolume

    if scene.volume is None:
        message = "--series must be given with a scene that has a volume, got meshes only; add one, and its "
        raise FormatError(message + "transfer function")
    kind = "radar" if isinstance(scene.volume, RadarVolume) else "volume"
    limit = {} if options.max_bytes is None else {"max_bytes": options.max_bytes}
    paths = options.series[0] if len(options.series) == 1 else options.series
    series = load_series(paths, kind=kind, **limit)
    if options.times is None:
        return series
    count = len(series.volumes)
    times = options.times
    if isinstance(times, tuple):
        times = [times[0] + i * times[1] for i in range(count)]
    return type(series)(series.volumes, times)


def _targets(names: list[str]) -> Targets:
    """Return where frames go.

    Raises
    ------
    FormatError
        If a name is neither a pattern nor that of an animated PNG, or there are two of those.
    """
    for name in names:
        numbered = PATTERN.fullmatch(name) is not None
        known = EACH if numbered else ANIMATED
        if Path(name).suffix.lower() not in known or ("%" in name and not numbered):
            message = (
                "-o must be a name such as frame_%03d.png, or an animated .png or .apng, with --series, got "
            )
            raise FormatError(message + f"{name!r}; rename it")
        if not Path(name).parent.is_dir():
            message = f"{name} must lie in a folder that exists, got {Path(name).parent}; create it first"
            raise FormatError(message)
    animations = [Path(name) for name in names if "%" not in name]
    if len(animations) > 1 or len(set(names)) < len(names):
        message = f"-o must name one animated PNG and each pattern once, got {', '.join(names)}; drop one"
        raise FormatError(message)
    return Targets(tuple(name for name in names if "%" in name), animations[0] if animations else None)


def _check_free(targets: Targets, frames: int, *, force: bool) -> None:
    """Refuse what could not be written, before the work rather than after it."""
    from volref.io.atomic import check_free

    names = [file for number in range(frames) for file in targets.files(number)]
    for file in [*names, *([targets.animation] if targets.animation else [])]:
        check_free(file, overwrite=force)


def _times(text: str) -> list[float] | tuple[float, float]:
    """Return the times of a text T,T,... or (start, step) of START:STEP.

    Examples
    --------
    >>> _times("0,60,150"), _times("600:120")
    ([0.0, 60.0, 150.0], (600.0, 120.0))
    """
    start, colon, step = text.partition(":")
    if colon:
        return fraction(start), fraction(step)
    return [fraction(part) for part in text.split(",")]


def _figures(moment: float, out: "Render", files: list[Path]) -> dict[str, Any]:
    return {
        "time": moment,
        "outputs": [str(file) for file in files],
        "seconds": out.seconds,
        "method": out.plan.method,
        "bound": {"kind": out.bound_kind, "max": float(out.bound.max())},
        "met_tolerance": out.met_tolerance,
    }


def _report(done: list[dict[str, Any]], options: argparse.Namespace) -> None:
    if options.json:
        print_json({"outputs": options.output, "frames": done})
    missed = [frame for frame in done if not frame["met_tolerance"]]
    if missed:
        worst = max(frame["bound"]["max"] for frame in missed)
        which = f"{len(missed)} of {len(done)} frames"
        note(f"tolerance not met in {which}: error up to {worst:.3g}; raise --tolerance or leave out --step")
    if not options.quiet:
        from volref.report.figures import levels

        worst = max(frame["bound"]["max"] for frame in done)
        proven = all(frame["bound"]["kind"] == "certified" for frame in done)
        error = f"error <= {levels(worst)}/255 ({'certified' if proven else 'estimated'})"
        seconds = sum(frame["seconds"] for frame in done)
        note(f"{len(done)} frames, {error}, {seconds:.1f} s; wrote {', '.join(options.output)}")
