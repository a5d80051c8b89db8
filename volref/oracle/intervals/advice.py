"""When an interval is of no use, and what would make it so; and the same with coarser filters."""

import dataclasses
from collections.abc import Callable
from functools import partial

from numpy.typing import ArrayLike

from volref.emulation.device import Device
from volref.emulation.pipeline import Pipeline
from volref.oracle.acceptance import Acceptance
from volref.scene.scene import Scene

# Half a step of a filter with 4 fraction bits, which Khronos's tests let pass with a warning.
COARSE = 2.0**-5


def advice_for(pipeline: Pipeline, device: Device) -> str:
    """Return why intervals are of no use, "" where they are."""
    if device.snap_slack and pipeline.rays.kind == "coordinates" and pipeline.rays.format == "unorm8":
        return (
            "vertices are snapped to an unknown grid, and coordinates are stored in 8 bits: most rays may be "
            "another one; find the grid with: volref probe, and accept the device that it writes"
        )
    return ""


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
