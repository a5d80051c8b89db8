"""When an interval is of no use, and what would make it so; and the same with coarser filters."""

import dataclasses
from collections.abc import Callable
from functools import partial

from numpy.typing import ArrayLike

from volref.emulation.device import Device
from volref.emulation.pipeline import Pipeline
from volref.errors import SceneError
from volref.oracle.acceptance import Acceptance
from volref.scene.scene import Scene

# Half a step of a filter with 4 fraction bits, which Khronos's tests let pass with a warning.
COARSE = 2.0**-5


# Intervals of half of the pixels that are wider than this, what half a voxel of shift moves the most, say
# little: a fault as large as that may lie inside.
WIDE = 23 / 255


def advice_for(pipeline: Pipeline, device: Device, typical: float) -> str:
    """Return why intervals are of no use, "" where they are; `typical` is their median width."""
    if device.snap_slack and pipeline.rays.kind == "coordinates" and pipeline.rays.format == "unorm8":
        return (
            "vertices are snapped to an unknown grid, and coordinates are stored in 8 bits: most rays may be "
            "another one; find the grid with: volref probe, and accept the device that it writes"
        )
    if device.freedom == "khronos" and typical > WIDE:
        return (
            f"half of the pixels may differ by {255 * typical:.0f}/255 or more between machines of "
            f"{device.name!r}; find out what this one does with: volref probe, and accept what it writes"
        )
    return ""


def check_bounded(scene: Scene, pipeline: Pipeline) -> None:
    """Refuse programs for whose images no interval is known.

    Raises
    ------
    SceneError
        With the switch.
    """
    accumulation, meshes = pipeline.accumulation, bool(scene.meshes)
    straight, lit = accumulation.color == "straight", pipeline.lighting.model != "none"
    own_alpha = accumulation.alpha != "accumulated"
    # An alpha of *over* is never above 1.
    divides = accumulation.normalize == "always" or (
        accumulation.normalize == "above-one" and accumulation.rule != "over"
    )
    reasons = {
        "table.filter": (pipeline.table.filter == "linear-mipmap", "a level that no specification bounds"),
        "lighting.normals": (lit and pipeline.lighting.normals == "unguarded", "0 / 0 without a gradient"),
        "accumulation.alpha": (own_alpha and meshes, "another alpha than that of what is before a mesh"),
        "accumulation.normalize": (divides and meshes, "colours divided by an alpha before a mesh is added"),
        "accumulation.rule": (
            accumulation.alpha == "weighted" and not accumulation.rule.startswith(("over", "add")),
            "samples without a weight, whose own alpha is to be weighted",
        ),
        "accumulation.color": (
            not straight and (divides or accumulation.alpha == "weighted"),
            "premultiplied colours, that are divided or weighted by an alpha",
        ),
        "output.blend": (pipeline.output.blend == "environment" and meshes, "an environment behind meshes"),
    }
    for name, (holds, why) in reasons.items():
        if holds:
            message = f"pipeline.{name} must be one whose image has bounds, got {why}; "
            raise SceneError(message + "change it, or emulate and compare")


def low_quality_of(
    accept: Callable[..., Acceptance],
    scene: Scene,
    pipeline: Pipeline,
    device: Device,
    jitter: ArrayLike | None,
    frames: int,
) -> Callable[[], Acceptance] | None:
    """Return what makes the intervals with filters of 4 bits; None where the device's filters are known."""
    if not device.weight_slack or device.weight_slack >= COARSE:
        return None
    coarse = dataclasses.replace(device, name=f"{device.name}, low quality", weight_slack=COARSE)
    return partial(accept, scene, pipeline, coarse, jitter, frames)
