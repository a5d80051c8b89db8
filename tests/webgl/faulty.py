"""Programs with a fault: the systems' own GLSL with a macro, or a page that uploads or blends wrongly.

A second implementation: nothing here knows more of `volref.oracle.faults` than the names.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from tests.webgl.engine import CANVAS, Engine, Job, Pass, Program
from tests.webgl.faulty_pages import PAGE, with_passes
from tests.webgl.systems import SYSTEMS
from tests.webgl.systems.common import System
from volref import Scene
from volref.emulation.pipeline import Pipeline
from volref.golden.charts import Chart

# What the papers' own misprints are called in the shaders.
OWN = {
    "O2-add-alpha": "ADDED_ALPHA",
    "D1-window-over-w": "WINDOW_OVER_W",
    "D1-packing": "PACKING_PRINTED",
    "D2-squared-alpha": "OBJECT_PRINTED",
    "D2-one-step-early": "ONE_STEP_EARLY",
    "N1-kernel": "MISPRINT",
    "N1-zero": "ZERO_HALF",
    "N1-flat-skipped": "SKIP_FLAT",
}


@dataclass(frozen=True)
class FaultyEngine(Engine):
    """An engine whose page changes every job before it runs it."""

    change: Callable[[Job], Job]

    def run(self, job: Job) -> dict[str, np.ndarray]:
        """Run the job as changed."""
        return super().run(self.change(job))


def draw_chart(engine: Engine, chart: Chart, key: str = "", strength: float = 1.0) -> np.ndarray:
    """Canvas (H, W, 4) of a chart, with the fault of that name if there is one."""
    subject = chart.subject()
    jitter = None if subject.jitter is None else subject.jitter.astype(np.float32)
    more = {"jitter": jitter, "frames": subject.frames}
    if key:
        return draw_faulty(engine, subject.scene, subject.pipeline, key, strength, **more)
    return system_of(subject.pipeline).draw(engine, subject.scene, subject.pipeline, **more)[CANVAS]


def draw_faulty(
    engine: Engine,
    scene: Scene,
    pipeline: Pipeline,
    key: str,
    strength: float = 1.0,
    *,
    jitter: np.ndarray | None = None,
    frames: int = 1,
) -> np.ndarray:
    """Canvas (H, W, 4) that the pipeline's system draws with the fault of that name.

    Raises
    ------
    ValueError
        If the system's program has no such fault.
    """
    touched = []

    def change(job: Job) -> Job:
        changed = with_fault(job, scene, key, strength)
        touched.append(changed is not job)
        return changed

    faulty = FaultyEngine(engine.name, engine.call, change)
    canvas = system_of(pipeline).draw(faulty, scene, pipeline, jitter=jitter, frames=frames)[CANVAS]
    if not any(touched):
        raise ValueError(f"{pipeline.name} has no fault {key}")
    return canvas


def system_of(pipeline: Pipeline) -> System:
    """System that draws a pipeline or a variant of it: "texture3d-floats" as "texture3d"."""
    names = {name: system for system in SYSTEMS for name in system.pipelines}
    return names[max((name for name in names if pipeline.name.startswith(name)), key=len)]


def with_fault(job: Job, scene: Scene, key: str, strength: float) -> Job:
    """Return the job of a page with the fault; the job itself if nothing in it can have the fault."""
    changed = PAGE[key](job, scene, strength) if key in PAGE else job
    own = with_macro(changed, OWN[key], strength) if key in OWN else changed
    return with_macro(own, "FAULT_" + key.upper().replace("-", "_"), strength)


def with_macro(job: Job, macro: str, strength: float) -> Job:
    """Define a macro in all shaders that ask for it."""
    asked = re.compile(rf"^#.*\b{macro}\b", re.MULTILINE)

    def change(one: Pass) -> Pass:
        program = one.program
        if not asked.search(program.vertex + program.fragment):
            return one
        defines = {**program.defines, macro: float(strength)}
        return replace(one, program=Program(program.vertex, program.fragment, defines))

    return with_passes(job, change)
