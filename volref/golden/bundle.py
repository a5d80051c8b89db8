"""What a golden bundle holds, read and checked."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from volref.arrays import Floats
from volref.emulation.device import Device
from volref.emulation.pipeline import Pipeline
from volref.oracle.acceptance import Acceptance
from volref.oracle.faults.fault import Subject
from volref.scene.scene import Scene


@dataclass(frozen=True, eq=False)
class Bundle:
    """A golden bundle: what is drawn, and what a correct machine may make of it.

    Parameters
    ----------
    folder
        Where it lies.
    manifest
        What its manifest.json says, brought up to this version of the format.
    subject
        Scene, pipeline, device, start offsets and frames.
    acceptance
        The interval of every pixel; its `seconds` are 0, for it was read.
    passes
        Every target by name, in the order of drawing.
    distance
        World distance (H, W) to the opaque surface shown, +inf elsewhere; None without meshes.
    truth, bound
        The integral (H, W, 4) and its error at most (H, W), where they came along.
    """

    folder: Path
    manifest: Mapping[str, Any]
    subject: Subject
    acceptance: Acceptance
    passes: Mapping[str, Floats]
    distance: Floats | None = None
    truth: Floats | None = None
    bound: Floats | None = None

    @property
    def name(self) -> str:
        """Short name."""
        return str(self.manifest["name"])

    @property
    def title(self) -> str:
        """What it shows, in a line."""
        return str(self.manifest["title"])

    @property
    def scene(self) -> Scene:
        """What is drawn."""
        return self.subject.scene

    @property
    def pipeline(self) -> Pipeline:
        """The program that draws it."""
        return self.subject.pipeline

    @property
    def device(self) -> Device:
        """The machine that runs the program."""
        return self.subject.device
