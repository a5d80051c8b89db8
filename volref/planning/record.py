"""What a rendering will do: the plan, its stages, and where something can be seen."""

import dataclasses
from dataclasses import dataclass, field
from typing import Any

from volref.arrays import Booleans, Floats, Vector
from volref.errors import SceneError
from volref.scene.palette import FULL_PALETTE, Palette
from volref.scene.scene import Scene

# Segments of a ray that are sampled together, unless that takes them too far: then 3.
SEGMENTS_PER_BLOCK = 6

# What a plan is made for, beside volume, transfer function and meshes.
LOOK = ("lights", "material", "mode", "isovalue", "slice_plane", "clip", "gradient", "classification")

# Stages that only save work: "forced in" means that they are switched off.
SHORTCUTS = ("empty space", "early termination")


@dataclass(frozen=True)
class Stage:
    """One stage of the renderer, in or out, why, and what leaving it out saves, or taking it in costs."""

    name: str
    included: bool
    reason: str
    saves: str = ""


@dataclass(frozen=True, eq=False)
class Occupancy:
    """Where something can be seen: blocks (bz, by, bx) of the space of the field, with layers around it.

    A block counts as occupied if anything within `reach` world units of it is visible.  Point p lies in
    block floor((p - low) / size), `low` and `size` being x, y, z; the blocks hold every point within `reach`
    of a volume on a grid, and every point of a radar's box.
    """

    blocks: Booleans
    low: Vector
    size: Vector
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
    offsets
        Where in its segments a march takes the samples of each pixel (height width,), from 0 to 1 from front
        to back; None: in the middle, 1/2.
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
    offsets: Floats | None = field(default=None, repr=False)

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
            If anything but the camera, the size, the background and which meshes there are differs.
        """
        mine = self.scene
        same = mine.volume is scene.volume and mine.transfer is scene.transfer
        same &= bool(mine.meshes) == bool(scene.meshes)
        if not same or any(getattr(mine, name) != getattr(scene, name) for name in LOOK):
            message = "plan must be one for this scene, got the plan of another volume, transfer function, "
            raise SceneError(message + "look or of other meshes; make one with volref.plan(scene)")
        if self.offsets is not None and self.offsets.shape != (scene.width * scene.height,):
            message = f"plan.offsets must be one per pixel of {scene.width} x {scene.height}, got shape "
            raise SceneError(message + f"{self.offsets.shape}; make an image of the scene's size")

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
