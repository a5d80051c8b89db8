"""Every choice of a rendering resolved to numbers, and what the scene does not need.

A stage is left out where the scene alone proves that it cannot change the image, or, for early
termination, where its effect is below a bound that the result carries.
"""

import dataclasses
import math
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from volref.arrays import Booleans, Floats, number, one_of
from volref.errors import SceneError
from volref.scene.blocks import flag_blocks
from volref.scene.footprint import footprint
from volref.scene.palette import FULL_PALETTE, Palette, palette_of
from volref.scene.rounding import float32_error
from volref.scene.scene import Scene
from volref.scene.transfer import TransferFunction
from volref.scene.volume import Volume

# Half a level of an 8-bit image: below it a difference cannot be seen after rounding.
HALF_LEVEL = 1 / 510

# A ray ends when less than this part of the light behind it would arrive.
TERMINATION = 1e-6

# Cells per side of a block of empty space.
BLOCK = 4

# Segments of a ray that are sampled together, unless that takes them further than some voxels, then 3; and
# rays that are marched together.
SEGMENTS_PER_BLOCK, LONGEST_BLOCK = 6, 4.0
RAYS_PER_CHUNK = 16384

# The part of the tolerance that float32 may take.
FLOAT32_SHARE = 1 / 8

# Above this many samples on one ray the default step is refused rather than left to run for hours.
MOST_DEFAULT_SEGMENTS = 1 << 20

# And above this many any step is: 2^31 samples take a minute and a half on one ray.
MOST_SEGMENTS = 1 << 31

# Segments may be longer than the step by this part of it, and a sample's index be off by this in float32.
REACH_MARGIN, ROUNDED_INDEX = 1e-12, 1e-3

# Skipping costs one look-up per block of segments; with fewer empty blocks than this it does not pay.
LEAST_EMPTY_PART = 0.05


@dataclass(frozen=True)
class Stage:
    """One stage of the renderer, in or out, why, and what leaving it out saves, or taking it in costs."""

    name: str
    included: bool
    reason: str
    saves: str = ""


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
    palette
        The colour channels that are looked up and composited.
    precision
        "float32" or "float64": in what a march computes.
    rounding
        What the precision may change beside the roundings of compositing, in units of the brightest colour.
    block
        Segments of a ray that are sampled together, or left out together: 3 or 6.
    """

    scene: Scene = field(repr=False)
    method: str
    step: float
    tolerance: float
    termination: float
    most_segments: int
    occupancy: Occupancy | None = field(repr=False)
    stages: tuple[Stage, ...]
    palette: Palette = FULL_PALETTE
    precision: str = "float64"
    rounding: float = 0.0
    block: int = SEGMENTS_PER_BLOCK

    def includes(self, name: str) -> bool:
        """Tell whether the stage `name` takes part."""
        return any(stage.name == name and stage.included for stage in self.stages)

    def everything(self) -> "Plan":
        """Return this plan with what was left out forced in, to prove that leaving it out changes nothing.

        Every part that the scene has takes part, and nothing is skipped or ended early.
        """
        return dataclasses.replace(
            self,
            termination=0.0,
            occupancy=None,
            stages=tuple(self._forced(stage) for stage in self.stages),
            palette=FULL_PALETTE,
            precision="float64",
            rounding=0.0,
        )

    def _forced(self, stage: Stage) -> Stage:
        if stage.name in SHORTCUTS:
            return Stage(stage.name, included=False, reason="forced off")
        scene = self.scene
        needs = dict.fromkeys(("volume", "rays that miss", "colour", "float64"), scene.volume)
        if needs.get(stage.name) is not None and not stage.included:
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
            "precision": self.precision,
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
            + (f"; saves {stage.saves}" if stage.saves else "")
            for stage in self.stages
        ]
        return "\n".join([head, *lines])


HALF_TIME = "about half the time"

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
    precision: str | None = None,
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
    precision
        Of "march": "float64" or "float32"; default float32 where it provably cannot cost more than an eighth
        of the tolerance, which halves the time.

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
    indices = float(np.linalg.norm(scene.volume.index_from_world[:3, :3], axis=1).max())
    block = SEGMENTS_PER_BLOCK if SEGMENTS_PER_BLOCK * length * indices <= LONGEST_BLOCK else 3
    missing, occupancy = _missing(scene), None
    empty = Stage("empty space", included=False, reason="nothing of the volume is on the screen")
    if footprint(scene).pixels:
        occupancy, empty = _empty_space(scene.volume, scene.transfer, length * block)
    termination, ending = _early_termination(scene.volume, scene.transfer)
    palette, colour = _colour(scene.transfer)
    furthest = block * length * indices
    error = float32_error(scene.volume, scene.transfer, _diagonal(scene.volume), furthest)
    kind, rounding, float64 = _precision(scene.transfer, error, most_segments, tolerance, precision)
    stages.extend([missing, empty, ending, colour, float64])
    stages.extend([*_never_needed(), _background_stage(scene)])
    return Plan(
        scene,
        method,
        length,
        tolerance,
        termination,
        most_segments,
        occupancy,
        tuple(stages),
        palette,
        kind,
        rounding,
        block,
    )


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
            stages.append(_missing(scene))
            stages.append(
                Stage("empty space", included=True, reason=reason, saves="their crossings and cubics")
            )
            stages.extend(_never_needed())
    stages.append(_background_stage(scene))
    return Plan(scene, method, 0.0, tolerance, 0.0, 0, None, tuple(stages))


def _missing(scene: Scene) -> Stage:
    """Cast no rays outside the rectangle that the volume's box covers on the screen."""
    outside = 1 - footprint(scene).pixels / (scene.width * scene.height)
    reason = f"{outside:.0%} of the pixels lie beside the box of the volume on the screen"
    return Stage("rays that miss", included=False, reason=reason, saves="their rays")


def _never_needed() -> list[Stage]:
    """Return what no scene of today needs, and why."""
    return [
        Stage(
            "gradients", included=False, reason="no light, and the transfer function is of the value alone"
        ),
        Stage("lighting", included=False, reason="no light: colours are emitted as they are"),
        Stage("jitter", included=False, reason="rays begin where they meet the volume"),
        Stage("tone mapping", included=False, reason="the image stays in the working space"),
    ]


def _colour(transfer: TransferFunction) -> tuple[Palette, Stage]:
    """Look up each colour channel only once, and none that is constant where anything is seen."""
    palette, name = palette_of(transfer), "colour"
    left_out = 3 - len(palette.looked_up)
    saves = f"{left_out} of 4 channels of look-up and compositing"
    if left_out == 0:
        return palette, Stage(name, included=True, reason="red, green and blue differ")
    if left_out < 3:
        grey = palette.source == (0, 0, 0)
        reason = "grey: one channel" if grey else f"{len(palette.looked_up)} channels that differ and vary"
        return palette, Stage(name, included=True, reason=reason, saves=saves)
    words = ", ".join(f"{value:g}" for value in palette.constant)
    reason = f"({words}) wherever anything is seen: it follows from the opacity"
    return palette, Stage(name, included=False, reason=reason, saves=saves)


def _precision(
    transfer: TransferFunction, rounding: float, most_segments: int, tolerance: float, precision: str | None
) -> tuple[str, float, Stage]:
    """Choose float32 where what it can change is a small part of the tolerance."""
    name = "float64"
    if precision is not None:
        one_of("precision", precision, ("float64", "float32"))
    if precision == "float64":
        return "float64", 0.0, Stage(name, included=True, reason="asked for")
    brightest = max(float(transfer.colors.max()), 1.0)
    most = (rounding + most_segments * float(np.finfo(np.float32).eps)) * brightest
    words = (
        f"float32 may change a pixel by {most:.1e}" if math.isfinite(most) else "float32 has no bound here"
    )
    if precision == "float32":
        return "float32", rounding, Stage(name, included=False, reason=f"asked for; {words}", saves=HALF_TIME)
    if most > tolerance * FLOAT32_SHARE:
        return "float64", 0.0, Stage(name, included=True, reason=words)
    reason = f"{words} at most, of a tolerance of {tolerance:.1e}"
    return "float32", rounding, Stage(name, included=False, reason=reason, saves=HALF_TIME)


def _meshes_stage(scene: Scene) -> Stage:
    name = "meshes"
    if not scene.meshes:
        saves = "the z-buffer, the cut of the rays and the colour of the surface"
        return Stage(name, included=False, reason="no mesh", saves=saves)
    triangles = sum(len(mesh.faces) for mesh in scene.meshes)
    count = len(scene.meshes)
    return Stage(name, included=True, reason=f"{count} mesh{'es' * (count > 1)}, {triangles:,} triangles")


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


def _empty_space(volume: Volume, transfer: TransferFunction, block: float) -> tuple[Occupancy | None, Stage]:
    """Mark the cells that have something visible within half the length of a block of segments, `block`."""
    half = block / 2 * (1 + REACH_MARGIN)
    # A unit step in the world moves at most this many indices along each axis.
    indices_per_length = np.linalg.norm(volume.index_from_world[:3, :3], axis=1)
    x, y, z = (math.ceil(half * count + ROUNDED_INDEX) for count in indices_per_length)
    name = "empty space"
    if max(x, y, z) > max(volume.size):
        return None, Stage(name, included=False, reason="one block of segments is longer than the volume")
    occupied = flag_blocks(volume, BLOCK, (x, y, z), partial(may_be_seen, transfer))
    empty = 1 - float(occupied.mean())
    reason = f"{empty:.0%} of the {BLOCK}^3 blocks are transparent with their surroundings"
    if empty < LEAST_EMPTY_PART:
        return None, Stage(name, included=False, reason=f"{reason}: looking for them would cost more")
    # One index more than the reach: a "cell" volume begins half an index before its first block.
    layers = (1 + x // BLOCK, 1 + y // BLOCK, 1 + z // BLOCK)
    blocks = np.pad(occupied, [(layers[axis], layers[axis]) for axis in (2, 1, 0)], mode="edge")
    return Occupancy(blocks, layers, half), Stage(
        name, included=True, reason=reason, saves="the samples there"
    )


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
    return TERMINATION, Stage(name, included=True, reason=reason, saves="the samples behind it")
