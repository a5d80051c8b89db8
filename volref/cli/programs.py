"""Arguments that name a GPU program, its device and its start offsets."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from volref.errors import FormatError

if TYPE_CHECKING:
    from volref.arrays import Floats
    from volref.emulation.device import Device
    from volref.emulation.pipeline import Pipeline
    from volref.scene import Scene


def add_program(parser: argparse.ArgumentParser, *, required: bool) -> None:
    """Add --pipeline, --device, --jitter and --frames."""
    parser.add_argument(
        "--pipeline",
        metavar="NAME|FILE",
        required=required,
        help="the program: a name that `volref pipelines` lists, or a .json",
    )
    parser.add_argument(
        "--device",
        metavar="NAME|FILE",
        help="the machine: ideal (default), exact, swiftshader, llvmpipe, lavapipe, mediump, or a .json",
    )
    parser.add_argument(
        "--jitter",
        metavar="FILE",
        help="start offsets of a program that has them: a grey PNG or an .npy, repeated over the image",
    )
    parser.add_argument(
        "--frames",
        type=int,
        metavar="N",
        help="frames of which the program shows the mean; default as many as --jitter holds, or 1",
    )


def pipeline_at(text: str) -> "Pipeline":
    """Return the pipeline of a name of the catalogue, or in a file."""
    from volref import load_pipeline
    from volref.emulation.catalogue import named

    return load_pipeline(text) if is_file(text) else named(text)


def is_file(text: str) -> bool:
    """Tell whether a text names a file rather than something volref knows by name."""
    return Path(text).suffix != "" or len(Path(text).parts) > 1


def read_program(options: argparse.Namespace) -> tuple["Pipeline", "Device"]:
    """Return the program and the device that the options name."""
    return pipeline_at(options.pipeline), read_device(options)


def read_device(options: argparse.Namespace) -> "Device":
    """Return the device that the options name, the ideal one if they name none."""
    from volref import Device, load_device

    if options.device is None:
        return Device()
    return load_device(options.device) if is_file(options.device) else Device.named(options.device)


def read_jitter(
    options: argparse.Namespace, scene: "Scene", program: "Pipeline"
) -> tuple["Floats | None", int]:
    """Return the start offsets (frames, H, W) that the options name, and how many frames to draw.

    Raises
    ------
    FormatError
        If the file has fewer frames than are asked for.
    """
    if options.jitter is None:
        return None, 1 if options.frames is None else options.frames
    import numpy as np

    from volref import load_jitter
    from volref.stages.jitter import repeated

    offsets = load_jitter(options.jitter)
    usual = 1 if program.output.mean_format is None else len(offsets)
    frames = usual if options.frames is None else options.frames
    if not 1 <= frames <= len(offsets):
        message = f"--frames must be from 1 to {len(offsets)}, which {options.jitter} has, got {frames}; "
        raise FormatError(message + "ask for fewer, or give more offsets")
    return np.stack([repeated(one, scene.width, scene.height) for one in offsets[:frames]]), frames
