"""Options of what a pixel is the mean of: several rays, or frames with start offsets."""

import argparse
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

from volref.cli.options import accuracy
from volref.errors import FormatError

if TYPE_CHECKING:
    from volref.truth.result import Render

Draw = Callable[..., "Render"]


def add_rays(parser: argparse.ArgumentParser) -> None:
    """Add --supersample, --frames, --seed and --jitter."""
    parser.add_argument(
        "--supersample",
        type=int,
        metavar="N",
        help="make each pixel the mean of N x N rays; the error is that of their mean",
    )
    parser.add_argument(
        "--frames",
        type=int,
        metavar="N",
        help="march N times with a random start offset for each ray, and take the mean",
    )
    parser.add_argument(
        "--jitter",
        metavar="FILE",
        help="take the start offsets from a grey PNG or an .npy, repeated over the image, not from --seed",
    )
    parser.add_argument("--seed", type=int, metavar="S", help="seed of the start offsets; default 0")


def draw_with(options: argparse.Namespace) -> Draw:
    """Return what renders a scene as the options have it: it takes the scene, and how to work.

    Raises
    ------
    FormatError
        If options are given that do not go together.
    """
    from volref import load_jitter, render, render_jittered, supersample

    how = accuracy(options)
    if options.supersample is not None and options.verify is not None:
        message = "--verify must be given without --supersample, whose pixels are no single rays, got both; "
        raise FormatError(message + "leave one out")
    if options.frames is None and options.jitter is None:
        if options.seed is not None:
            message = f"--seed must be given with --frames, got {options.seed} alone; leave it out"
            raise FormatError(message)
        return (
            partial(render, **how)
            if options.supersample is None
            else partial(supersample, factor=options.supersample, **how)
        )
    _refuse_with_frames(options)
    if options.jitter is not None:
        start: dict[str, Any] = {"jitter": load_jitter(options.jitter)}
    else:
        start = {"seed": 0 if options.seed is None else options.seed}
    kept = {name: how[name] for name in ("step", "tolerance") if name in how}
    return partial(render_jittered, frames=options.frames, **start, **kept)


def _refuse_with_frames(options: argparse.Namespace) -> None:
    """Refuse what a mean of marches cannot do."""
    others = ("supersample", "verify", "max_seconds", "series")
    found = [f"--{name.replace('_', '-')}" for name in others if getattr(options, name) is not None]
    found += ["--method exact"] if options.method == "exact" else []
    if options.seed is not None and options.jitter is not None:
        found.append("--seed beside --jitter")
    if found:
        message = f"--frames and --jitter must be given without {found[0]}, got both; leave one out"
        raise FormatError(message)
