"""Where in its first step each ray takes its first sample."""

import numpy as np
from numpy.typing import ArrayLike

from volref.arrays import Floats, float_array
from volref.emulation.pipeline import Pipeline
from volref.errors import SceneError
from volref.scene.scene import Scene


def start_offsets(scene: Scene, pipeline: Pipeline, jitter: ArrayLike | None, frames: int) -> Floats:
    """Return where in its first step each ray takes its first sample (frames, H * W)."""
    size = frames, scene.height, scene.width
    offsets = np.full(size, pipeline.stepping.offset)
    if frames > 1 and pipeline.output.mean_format is None:
        message = f"frames must be 1 for a pipeline that keeps no mean of frames, got {frames}; "
        raise SceneError(message + "set pipeline.output.mean_format, or draw one frame")
    if jitter is not None:
        if not pipeline.stepping.jitter:
            message = "jitter must be None for a pipeline that has none, got numbers; "
            raise SceneError(message + "set pipeline.stepping.jitter, or leave it out")
        offsets = offsets + checked_jitter(jitter, size)
    return offsets.reshape(frames, -1)


def checked_jitter(jitter: ArrayLike, size: tuple[int, int, int]) -> Floats:
    """Return start offsets of this size, all of 0..1."""
    offsets = float_array("jitter", jitter, size)
    for worst in (offsets.min(), offsets.max()):
        if not 0 <= worst <= 1:
            message = f"jitter must lie in 0..1, got {worst:g}; give shares of a step"
            raise SceneError(message)
    return offsets
