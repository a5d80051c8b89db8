"""Drawing a subject at some pixels only: a search for faults draws it a hundred times."""

import numpy as np

from volref.arrays import Booleans, Floats
from volref.emulation.drawing import prepare
from volref.emulation.frames import last_targets, march_frame
from volref.emulation.loop.offsets import start_offsets
from volref.emulation.targets.canvas import cleared
from volref.oracle.faults.fault import Subject


def canvas_at(subject: Subject, chosen: Booleans) -> Floats:
    """Return the canvas (H, W, 4) that `emulate` returns at the pixels `chosen` (H, W), anything elsewhere.

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
        last, mean = last_targets(drawing, marched, number, mean)
    return last["canvas"].reshape(scene.height, scene.width, 4).astype(np.float64)
