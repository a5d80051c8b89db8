"""Drawing a subject at some pixels only: a search for faults draws it a hundred times."""

import numpy as np

from volref.arrays import Booleans, Floats
from volref.emulation.drawing import prepare
from volref.emulation.frames import last_targets, march_frame
from volref.emulation.loop.offsets import start_offsets
from volref.emulation.targets.canvas import cleared
from volref.oracle.delivery import canvas_levels
from volref.oracle.faults.fault import Subject


def canvas_at(subject: Subject, chosen: Booleans, *, rounds: bool = False) -> Floats:
    """Return what `emulate` draws at the pixels `chosen` (H, W) before the canvas rounds it (H, W, 4).

    Other pixels hold anything.  A canvas of bytes holds nothing below 0 or above 1, and no NaN.

    Raises
    ------
    SceneError
        If the scene holds what the program cannot draw.
    """
    scene, pipeline, device = subject.scene, subject.pipeline, subject.device
    offsets = start_offsets(scene, pipeline, subject.jitter, subject.frames)
    drawing = prepare(scene, pipeline, device)
    rays = np.flatnonzero(chosen.reshape(-1)[drawing.ends.pixel])
    mean = cleared(scene, pipeline.output, device)
    for number, offset in enumerate(offsets, start=1):
        marched = march_frame(drawing, offset, rays=rays)
        last, mean = last_targets(drawing, marched, number, mean, rounds=rounds)
    canvas = last["canvas"].reshape(scene.height, scene.width, 4).astype(np.float64)
    if canvas_levels(pipeline) is None:
        return canvas
    return np.clip(np.nan_to_num(canvas, nan=1.0 if device.nan_stored == "one" else 0.0), 0.0, 1.0)
