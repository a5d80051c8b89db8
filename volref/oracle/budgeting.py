"""`budget`: where a program's distance from the truth comes from, and what to change first.

The distance is that of its image from the certified truth of the scene.  A program with every source ideal
(a step an eighth as long, floats everywhere, exact arithmetic, no early end) has a distance of its own: its
formulas, and where it puts voxels and entries of tables.  Every source is measured in two ways:

    gain    what the image changes by when this source alone is ideal
    floor   what it leaves when all others are: with it you cannot do better
"""

import dataclasses
import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from volref.arrays import Floats
from volref.emulation.catalogue import named
from volref.emulation.device import Device
from volref.emulation.passes import emulate
from volref.emulation.pipeline import Pipeline
from volref.emulation.targets.canvas import tone_mapped
from volref.errors import SceneError
from volref.oracle.ideals import CAUSES, Drawn, machine_of, without
from volref.scene.scene import Scene
from volref.truth.rendering import render

# How exact the truth is, in parts of 1: a tenth of a byte.
TRUTH = 0.1 / 255

# Less than this, in 1/255, is no matter of anyone's: half a byte.
NO_MATTER = 0.5


@dataclass(frozen=True)
class Spread:
    """How far images are apart over the drawn pixels, the largest channel's, in 1/255."""

    p50: float
    p99: float
    largest: float


@dataclass(frozen=True)
class Source:
    """A source of differences: its name, what it is now, its gain and its floor."""

    name: str
    now: str
    gain: Spread
    floor: Spread


@dataclass(frozen=True)
class Budget:
    """Where a program's distance from the truth comes from.

    Parameters
    ----------
    distance
        From the certified truth of the scene, tone-mapped as the program does.
    itself
        The same with every source ideal: what the program's own formulas make of the scene.
    sources
        The sources, the one with the highest floor first.
    left_out
        Sources that cannot be ideal in this program, and why.
    message
        What to change first, in a sentence or two.
    pipeline, device
        What was drawn; of a set of machines, the one with the coarsest filter and grid.
    seconds
        Wall time.
    """

    distance: Spread
    itself: Spread
    sources: tuple[Source, ...]
    left_out: Mapping[str, str]
    message: str
    pipeline: Pipeline
    device: Device
    seconds: float

    def as_dict(self) -> dict[str, Any]:
        """Return the figures as plain data."""
        return {
            "pipeline": self.pipeline.name,
            "device": self.device.name,
            "distance": dataclasses.asdict(self.distance),
            "itself": dataclasses.asdict(self.itself),
            "sources": [dataclasses.asdict(source) for source in self.sources],
            "left_out": dict(self.left_out),
            "message": self.message,
            "seconds": self.seconds,
        }


def budget(
    scene: Scene,
    pipeline: str | Pipeline,
    device: str | Device | None = None,
    jitter: ArrayLike | None = None,
    frames: int = 1,
) -> Budget:
    """Return where a program's distance from the truth comes from, source by source.

    It takes some twenty emulations, half of them with a step an eighth as long, and one image of the truth.

    Parameters
    ----------
    pipeline
        The name of a system in the catalogue, or a `Pipeline`.
    device
        The machine, or a set of machines; see `Device`.
    jitter, frames
        As for `emulate`.

    Raises
    ------
    SceneError
        If `emulate` or `render` refuses the scene or an argument.

    Examples
    --------
    >>> import volref as vr
    >>> volume = vr.Volume(np.tile(np.arange(0, 256, 16.0), (4, 4, 1)))
    >>> transfer = vr.TransferFunction.from_opacity([0, 90, 100, 110, 255], [(1, 1, 1)] * 5, [0, 0, 1, 0, 0])
    >>> camera = vr.Camera.orthographic((7.5, 1.5, 9), (7.5, 1.5, 1.5), (0, 1, 0), 4, 1, 20)
    >>> program = vr.pipelines()["texture3d"].with_switches(table={"size": 16})
    >>> found = budget(vr.Scene(volume, transfer, camera, 32, 4), program)
    >>> found.sources[0].name, found.sources[0].now
    ('table size', '16 entries')
    """
    began = time.perf_counter()
    program = named(pipeline) if isinstance(pipeline, str) else pipeline
    machine = Device.named(device) if isinstance(device, str) else Device() if device is None else device
    drawn = Drawn(scene, program, machine_of(machine))

    def image(one: Drawn) -> Floats:
        return _held(emulate(one.scene, one.pipeline, one.device, jitter, frames).rgba, program)

    seen = image(drawn)
    there = [cause for cause in CAUSES if cause.now(drawn)]
    alone, left_out = {}, {}
    for cause in there:
        try:
            alone[cause.name] = image(without(drawn, (cause,)))
        except SceneError as error:
            left_out[cause.name] = str(error)
    causes = tuple(cause for cause in there if cause.name in alone)

    def ideal_but(kept: set[str]) -> Floats:
        return image(without(drawn, tuple(cause for cause in causes if cause.name not in kept)))

    ideal = ideal_but(set())
    truth = _held(_as_shown(render(scene, tolerance=TRUTH).rgba, program, scene), program)
    mask = np.any(np.abs(np.stack([seen, truth]) - scene.background).max(axis=-1) > 0, axis=0)
    sources = [
        Source(
            cause.name,
            cause.now(drawn),
            _spread(alone[cause.name] - seen, mask),
            _spread(
                ideal_but({cause.name, *cause.needs})
                - (ideal_but(set(cause.needs)) if cause.needs else ideal),
                mask,
            ),
        )
        for cause in causes
    ]
    sources.sort(key=lambda source: (source.floor.p99, source.floor.largest), reverse=True)
    distance, itself = _spread(seen - truth, mask), _spread(ideal - truth, mask)
    return Budget(
        distance,
        itself,
        tuple(sources),
        left_out,
        message_of(distance, itself, tuple(sources)),
        program,
        drawn.device,
        time.perf_counter() - began,
    )


def _held(image: Floats, pipeline: Pipeline) -> Floats:
    """Return an image as a canvas holds it: bytes cut it off at 0 and 1, however many there are."""
    return np.clip(image, 0.0, 1.0) if pipeline.output.format.startswith("unorm") else image


def _as_shown(truth: Floats, pipeline: Pipeline, scene: Scene) -> Floats:
    """Return the truth as the program's tone map and gamma show it; what is behind is in it already."""
    output = dataclasses.replace(pipeline.output, blend="none")
    shown = tone_mapped(truth, output, scene.background)
    if pipeline.accumulation.alpha == "one" or pipeline.output.blend.startswith("shader"):
        shown[..., 3] = 1.0
    return shown


def _spread(difference: Floats, mask: Floats) -> Spread:
    """Return how far images are apart where something is drawn."""
    apart = 255 * np.abs(np.nan_to_num(difference)).max(axis=-1)[mask]
    if not apart.size:
        return Spread(0.0, 0.0, 0.0)
    p50, p99 = np.percentile(apart, [50, 99])
    return Spread(float(p50), float(p99), float(apart.max()))


def message_of(distance: Spread, itself: Spread, sources: tuple[Source, ...]) -> str:
    """Return what to change first.

    Examples
    --------
    >>> little, much = Spread(0.1, 0.2, 0.3), Spread(1.0, 3.1, 4.0)
    >>> table = Source("table size", "32 entries", much, much)
    >>> message_of(much, little, (table,))
    'The image is 3.1/255 from the truth on 99 % of its pixels. With this table size (32 entries) you cannot
    do better than 3.1/255, whatever else you change: change the table size first.'
    """
    said = f"The image is {distance.p99:.1f}/255 from the truth on 99 % of its pixels."
    floor = sources[0].floor.p99 if sources else 0.0
    if max(itself.p99, floor) < NO_MATTER:
        return f"{said} No source makes more than half a byte: there is nothing to change."
    if itself.p99 >= floor:
        said += (
            f" With every source ideal it is {itself.p99:.1f}/255: that is the program's own, its formulas "
        )
        said += "and where it puts voxels and entries, and no bits or steps will help."
        if floor < NO_MATTER:
            return said
        return f"{said} Of the rest the {sources[0].name} ({sources[0].now}) makes most, {floor:.1f}/255."
    said += f" With this {sources[0].name} ({sources[0].now}) you cannot do better than {floor:.1f}/255, "
    return said + f"whatever else you change: change the {sources[0].name} first."
