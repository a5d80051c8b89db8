"""Correct images by real WebGL: the programs of tests/webgl in headless Chromium."""

from collections.abc import Iterator
from contextlib import ExitStack

import numpy as np

from data_gen.why_intervals.drawing import Drawn
from data_gen.why_intervals.experiment import Drawer
from data_gen.why_intervals.scenes import Case
from tests.webgl.engine import engine
from tests.webgl.systems import SYSTEMS
from volref.emulation.device import Device


def drawer(closing: ExitStack, name: str) -> Drawer:
    """Return what draws cases on an implementation of WebGL, until `closing` ends."""
    opened = closing.enter_context(engine(name))

    def draw(case: Case) -> Iterator[Drawn]:
        subject = case.subject(Device.named(name))
        for system in SYSTEMS:
            if case.pipeline.name in system.pipelines:
                targets = system.draw(
                    opened, subject.scene, subject.pipeline, jitter=subject.jitter, frames=subject.frames
                )
                canvas = targets["canvas"].astype(np.float64) / 255
                yield Drawn("correct", f"WebGL on {name}", 1.0, canvas, subject)

    return draw
