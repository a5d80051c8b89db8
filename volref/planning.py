"""Every choice of a rendering resolved to numbers, and what the scene does not need.

A stage is left out where the scene alone proves that it cannot change the image, or, for early
termination, where its effect is below a bound that the result carries.
"""

import dataclasses
import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from volref.arrays import Booleans, Floats, number, one_of
from volref.errors import SceneError
from volref.scene.blocks import block_ranges
from volref.scene.scene import Scene
from volref.scene.transfer import TransferFunction
from volref.scene.volume import Volume

# Half a level of an 8-bit image: below it a difference cannot be seen after rounding.
HALF_LEVEL = 1 / 510

# A ray ends when less than this part of the light behind it would arrive.
TERMINATION = 1e-6

# Cells per side of a block of empty space.
BLOCK = 4

# Segments of a ray that are sampled together (a multiple of 3), and rays that are marched together.
# NumPy spends about 1 us on a call: 16384 x 6 samples make that small, and more no longer fit the cache.
SEGMENTS_PER_BLOCK = 6
RAYS_PER_CHUNK = 16384

# Above this many samples on one ray the default step is refused rather than left to run for hours.
MOST_DEFAULT_SEGMENTS = 1 << 20

# And above this many any step is: 2^31 samples take a minute and a half on one ray.
MOST_SEGMENTS = 1 << 31

# Skipping costs one look-up per block of segments; with fewer empty blocks than this it does not pay.
LEAST_EMPTY_PART = 0.05


@dataclass(frozen=True)
class Stage:
    """One stage of the renderer, in or out, and why."""

    name: str
    included: bool
    reason: str


@dataclass(frozen=True, eq=False)
class Occupancy:
    """Where something can be seen: blocks of `BLOCK`^3 cells (bz, by, bx), with layers of blocks around.

    A block counts as occupied if anything within `reach` world units of it is visible.  Index point p lies
    in block floor(p / BLOCK) + `layers` (x, y, z); the layers hold every point within `reach` of the volume.
    """

    blocks: Booleans
    layers: tuple[int, int, int]
    reach: float


@dataclass(frozen=True, eq=False)
class Plan:
    """What `render` will do for one scene.

    Parameters
    ----------
    scene
        The scene it was made for; it holds for other cameras, image sizes and backgrounds too.
    method
        "march": midpoint rule at a uniform step; "exact": pieces inside cells, with a proven bound; "auto":
        `render` measures which of the two is cheaper.
    step
        Length of a segment in world units; 0 without a volume, and where the method has none.
    tolerance
        The error per pixel that the result is compared with.
    termination
        A ray ends below this transmittance; 0: it never ends early.
    most_segments
        Segments on the longest possible ray.
    occupancy
        Where something can be seen, or None: everywhere.
    stages
        Each stage, in or out, and why.
    """

    scene: Scene = field(repr=False)
    method: str
    step: float
    tolerance: float
    termination: float
    most_segments: int
    occupancy: Occupancy | None = field(repr=False)
    stages: tuple[Stage, ...]

    def includes(self, name: str) -> bool:
        """Tell whether the stage `name` takes part."""
        return any(stage.name == name and stage.included for stage in self.stages)

    def everything(self) -> "Plan":
        """Return this plan with what was left out forced in, to prove that leaving it out changes nothing.

        Every part that the scene has takes part, and nothing is skipped or ended early.
        """
        stages = tuple(self._forced(stage) for stage in self.stages)
        return dataclasses.replace(self, termination=0.0, occupancy=None, stages=stages)

    def _forced(self, stage: Stage) -> Stage:
        if stage.name in SHORTCUTS:
            return Stage(stage.name, included=False, reason="forced off")
        if stage.name == "volume" and not stage.included and self.scene.volume is not None:
            return Stage(stage.name, included=True, reason="forced in")
        return stage

    def check(self, scene: Scene) -> None:
        """Refuse another scene than the one it was made for: what may be left out there is not known.

        Raises
        ------
        SceneError
            If volume, transfer function or the presence of meshes differ.
        """
        mine = self.scene
        same = mine.volume is scene.volume and mine.transfer is scene.transfer
        if not same or bool(mine.meshes) != bool(scene.meshes):
            message = "plan must be one for this scene, got the plan of another volume, transfer function or "
            raise SceneError(message + "meshes; make one with volref.plan(scene)")

    def as_dict(self) -> dict[str, Any]:
        """Return the plan as plain data for JSON."""
        return {
            "method": self.method,
            "step": self.step,
            "tolerance": self.tolerance,
            "termination": self.termination,
            "most_segments": self.most_segments,
            "stages": [dataclasses.asdict(stage) for stage in self.stages],
        }

    def __str__(self) -> str:
        """Return the plan as a table for people."""
        head = f"method {self.method}"
        if self.step:
            head += f", step {self.step:g} world units, at most {self.most_segments} segments per ray"
        width = max(len(stage.name) for stage in self.stages)
        lines = [
            f"  {'in ' if stage.included else 'out'}  {stage.name:<{width}}  {stage.reason}"
            for stage in self.stages
        ]
        return "\n".join([head, *lines])


# Stages that only save work: "forced in" means that they are switched off.
SHORTCUTS = ("empty space", "early termination")


METHODS = ("auto", "march", "exact")


def plan(
    scene: Scene,
    *,
    method: str = "auto",
    step: float | None = None,
    tolerance: float = HALF_LEVEL,
    certified: bool = True,
) -> Plan:
    """Decide what rendering `scene` takes, from the scene alone.

    Parameters
    ----------
    scene
        What to draw.
    method
        "march", "exact", or "auto": the cheapest whose proven bound meets the tolerance, which is "exact"; if
        an estimate may do (`certified=False`), `volref.render` measures which is cheaper.
    step
        Of "march", in world units; default half the least spacing of the volume.
    tolerance
        The error per pixel that is asked for.
    certified
        Whether the bound has to be proven.

    Raises
    ------
    SceneError
        If the method is unknown, the step is not positive, or it would take more than 2^31 samples on one
        ray (2^20 for the default step).
    """
    if not isinstance(scene, Scene):
        message = f"scene must be a volref.Scene, got {type(scene).__name__}; build or load one first"
        raise SceneError(message)
    one_of("method", method, METHODS)
    number("tolerance", tolerance, above=0)
    if method == "auto" and certified:
        method = "exact"
    if method != "march":
        if step is not None:
            message = f"step must be left out unless method is 'march', got {step!r}; pass method='march' too"
            raise SceneError(message)
        return _stepless(scene, method, tolerance)
    stages = [_meshes_stage(scene)]
    if scene.volume is None or scene.transfer is None:
        stages.append(Stage("volume", included=False, reason="the scene has none"))
        return Plan(scene, method, 0.0, tolerance, 0.0, 0, None, (*stages, _background_stage(scene)))
    length, most_segments = _step_length(scene.volume, step)
    seen = bool(may_be_seen(scene.transfer, *map(np.array, scene.volume.value_bounds)))
    stages.append(_volume_stage(scene.volume, seen=seen))
    if not seen:
        return Plan(scene, method, length, tolerance, 0.0, 0, None, (*stages, _background_stage(scene)))
    occupancy, stage = _empty_space(scene.volume, scene.transfer, length)
    stages.append(stage)
    termination, stage = _early_termination(scene.volume, scene.transfer)
    stages.extend([stage, _background_stage(scene)])
    return Plan(scene, method, length, tolerance, termination, most_segments, occupancy, tuple(stages))


def _stepless(scene: Scene, method: str, tolerance: float) -> Plan:
    """Return the plan of a method that chooses its own steps."""
    stages = [_meshes_stage(scene)]
    if scene.volume is None or scene.transfer is None:
        stages.append(Stage("volume", included=False, reason="the scene has none"))
    else:
        seen = bool(may_be_seen(scene.transfer, *map(np.array, scene.volume.value_bounds)))
        stages.append(_volume_stage(scene.volume, seen=seen))
        if seen:
            reason = "cells that are transparent are not integrated"
            stages.append(Stage("empty space", included=True, reason=reason))
    stages.append(_background_stage(scene))
    return Plan(scene, method, 0.0, tolerance, 0.0, 0, None, tuple(stages))


def _meshes_stage(scene: Scene) -> Stage:
    name = "meshes"
    if not scene.meshes:
        return Stage(
            name, included=False, reason="no mesh: no z-buffer, no cut of the rays, no surface colour"
        )
    triangles = sum(len(mesh.faces) for mesh in scene.meshes)
    count = len(scene.meshes)
    return Stage(name, included=True, reason=f"{count} mesh{'es' * (count > 1)}, {triangles} triangles")


def _background_stage(scene: Scene) -> Stage:
    if any(scene.background):
        return Stage("background", included=True, reason=f"premultiplied RGBA {scene.background}")
    return Stage("background", included=False, reason="clear: nothing to blend with")


def _volume_stage(volume: Volume, *, seen: bool) -> Stage:
    low, high = volume.value_bounds
    if not seen:
        reason = f"opacity 0 for every value from {low:g} to {high:g}"
        return Stage("volume", included=False, reason=reason)
    reason = f"{' x '.join(map(str, volume.size))} {volume.values.dtype}, values {low:g} to {high:g}"
    return Stage("volume", included=True, reason=reason)


def _step_length(volume: Volume, step: float | None) -> tuple[float, int]:
    diagonal = _diagonal(volume)
    length = min(volume.spacing) / 2 if step is None else number("step", step, above=0)
    if step is None and diagonal > length * MOST_DEFAULT_SEGMENTS:
        message = f"step must be stated for this volume, got the default {length:g}, half the least spacing, "
        message += (
            f"which takes {diagonal / length:.3g} samples on a ray of length {diagonal:.3g}; pass step="
        )
        raise SceneError(message)
    if diagonal > length * MOST_SEGMENTS:
        message = f"step must take at most {MOST_SEGMENTS} samples on a ray of length {diagonal:.3g}, got "
        raise SceneError(message + f"{length:g}; make it longer than {diagonal / MOST_SEGMENTS:.3g}")
    return length, math.ceil(diagonal / length)


def _diagonal(volume: Volume) -> float:
    offsets = volume.corners[:, None] - volume.corners[None]
    return float(np.linalg.norm(offsets, axis=-1).max())


def _empty_space(volume: Volume, transfer: TransferFunction, step: float) -> tuple[Occupancy | None, Stage]:
    """Mark the blocks that have something visible within half the length of a block of segments."""
    half = SEGMENTS_PER_BLOCK * step / 2
    # A unit step in the world moves at most this many indices along each axis.
    indices_per_length = np.linalg.norm(volume.index_from_world[:3, :3], axis=1)
    x, y, z = (math.ceil(half * count * (1 + 1e-12)) for count in indices_per_length)
    name = "empty space"
    if max(x, y, z) > max(volume.size):
        return None, Stage(name, included=False, reason="one block of segments is longer than the volume")
    low, high = block_ranges(volume, BLOCK, (x, y, z))
    occupied = may_be_seen(transfer, low, high)
    empty = 1 - float(occupied.mean())
    saved = f"{empty:.0%} of the {BLOCK}^3 blocks are transparent with their surroundings"
    if empty < LEAST_EMPTY_PART:
        return None, Stage(name, included=False, reason=f"{saved}: looking for them would cost more")
    # One index more than the reach: a "cell" volume begins half an index before its first block.
    layers = (1 + x // BLOCK, 1 + y // BLOCK, 1 + z // BLOCK)
    blocks = np.pad(occupied, [(layers[axis], layers[axis]) for axis in (2, 1, 0)], mode="edge")
    return Occupancy(blocks, layers, half), Stage(name, included=True, reason=f"{saved}: no samples there")


def may_be_seen(transfer: TransferFunction, low: Floats, high: Floats) -> Booleans:
    """Tell whether anything interpolated between samples from `low` to `high` can have an opacity above 0.

    Interpolation may leave the range of its corners by rounding, unless they are all one value.
    """
    slack = np.where(high > low, 8 * np.finfo(np.float64).eps * np.maximum(abs(low), abs(high)), 0.0)
    return transfer.is_visible(low - slack, high + slack)


def _early_termination(volume: Volume, transfer: TransferFunction) -> tuple[float, Stage]:
    name = "early termination"
    most = transfer.most_extinction(*volume.value_bounds) * _diagonal(volume)
    if most < -math.log(TERMINATION):
        reason = f"the optical depth of a ray cannot exceed {most:.3g}"
        return 0.0, Stage(name, included=False, reason=reason)
    reason = f"a ray ends below a transmittance of {TERMINATION:g}, and the bound counts what it left"
    return TERMINATION, Stage(name, included=True, reason=reason)
