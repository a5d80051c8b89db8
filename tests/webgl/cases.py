"""What is compared: the systems' pipelines with a canvas of bytes and with one of floats, on their scenes."""

from dataclasses import dataclass

import numpy as np

from tests.webgl.engine import Engine
from tests.webgl.figures import Figures, figures
from tests.webgl.scenes import EXAMPLES
from tests.webgl.systems import SYSTEMS
from tests.webgl.systems.common import System
from volref import Scene
from volref.emulation.ambiguity import ambiguous
from volref.emulation.catalogue import named
from volref.emulation.device import Device
from volref.emulation.passes import emulate
from volref.emulation.pipeline import Pipeline
from volref.emulation.surfaces.meshes import NOWHERE
from volref.emulation.surfaces.packing import unpacked


@dataclass(frozen=True)
class Case:
    """A pipeline of a system on a scene, with a canvas (and a mean of frames) in "unorm8" or "float"."""

    system: System
    pipeline: str
    format: str
    scene: str

    def __str__(self) -> str:
        return f"{self.pipeline}, {self.format}, {self.scene}"

    def described(self) -> Pipeline:
        """The pipeline with its last targets in this format."""
        pipeline = named(self.pipeline)
        changes = {"format": self.format}
        if pipeline.output.mean_format is not None:
            changes["mean_format"] = self.format
        return pipeline.with_switches(output=changes)


def suits(system: System, scene: str) -> bool:
    return system.only <= EXAMPLES[scene].needs <= system.suits


def cases() -> list[Case]:
    """All there are."""
    return [
        Case(system, pipeline, kind, scene)
        for system in SYSTEMS
        for pipeline in system.pipelines
        for kind in ("unorm8", "float")
        for scene in EXAMPLES
        if suits(system, scene)
    ]


def jitter_of(system: System, scene: Scene) -> np.ndarray | None:
    """Start offsets (frames, H, W) as a texture of floats holds them."""
    if not system.jitter:
        return None
    size = system.frames, scene.height, scene.width
    drawn = (system.frames, 1, 1) if system.steady else size
    return np.broadcast_to(np.random.default_rng(5).random(drawn, np.float32), size)


def compared(engine: Engine, case: Case) -> dict[str, Figures]:
    """Figures of every target."""
    scene, pipeline, device = EXAMPLES[case.scene].make(), case.described(), Device.named(engine.name)
    jitter, frames = jitter_of(case.system, scene), case.system.frames
    emulated = emulate(scene, pipeline, device, jitter, frames)
    ours = dict(emulated.passes)
    # A program that draws every pixel has black ones, equal without merit, where rays miss the box.
    met = None if pipeline.output.missed == "clear" else emulated.samples > 0
    theirs = case.system.draw(engine, scene, pipeline, jitter=jitter, frames=frames)
    assert set(theirs) == set(ours), f"emulated {sorted(ours)}, drawn {sorted(theirs)}"

    def predicted() -> np.ndarray:
        return ambiguous(scene, pipeline, device, jitter, frames)

    cleared = dict.fromkeys(("canvas", "frame", "running_mean"), scene.background)
    cleared["mesh_distance"] = (NOWHERE,)
    nothing = (0.0,)
    for images in (ours, theirs):
        images |= {name: as_numbers(images[name], pipeline) for name in ours if name.endswith("_depth")}
    return {
        name: figures(ours[name], theirs[name], predicted, cleared.get(name, nothing), met) for name in ours
    }


def as_numbers(target: np.ndarray, pipeline: Pipeline) -> np.ndarray:
    """Depths (H, W, 1) that a target holds: of their last digits no two roundings agree."""
    floats = target * np.float32(1 / 255) if target.dtype == np.uint8 else target.astype(np.float32)
    height, width, channels = floats.shape
    return unpacked(floats.reshape(-1, channels), pipeline.meshes.packing).reshape(height, width, 1)
