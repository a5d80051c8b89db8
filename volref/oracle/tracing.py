"""`trace`: every number of one ray, of the integral or of an emulated program."""

from collections.abc import Sequence

from numpy.typing import ArrayLike

from volref.emulation.device import Device
from volref.emulation.pipeline import Pipeline
from volref.emulation.tracing import trace_program
from volref.errors import SceneError
from volref.planning import Plan
from volref.scene.scene import Scene
from volref.traces import Trace
from volref.truth.tracing import trace as trace_march


def trace(
    scene: Scene,
    pixel: Sequence[int],
    pipeline: str | Pipeline | None = None,
    jitter: ArrayLike | None = None,
    frames: int = 1,
    *,
    device: str | Device | None = None,
    step: float | None = None,
    plan: Plan | None = None,
) -> Trace:
    """Return every number of the ray through `pixel` (x, y), row 0 at the top.

    Without a pipeline the ray is marched, `step` and `plan` as for `render`: a row is a segment; early
    termination and empty space play no part.  Where the look of the volume takes more than its value (lights,
    gradients, radars), the colour and the strength are those after all of it, and the columns of the
    interpolation are left out.

    With one, a row is an iteration of the program's loop: where it samples, which slices and texels it mixes,
    what the table gives, the opacity, what has been accumulated; `head["ended"]` says why it stopped.
    `jitter`, `frames` and `device` are as for `emulate`, and `head["rgba"]` is the pixel of its canvas.

    Raises
    ------
    SceneError
        If the pixel lies outside the image; without a pipeline, if an argument breaks a rule of
        `volref.plan`, or the scene has transparent meshes or another mode than "composite"; with one, if
        `emulate` refuses the scene or an argument.
    """
    if pipeline is None:
        _refuse("None without a pipeline", "pipeline", jitter=jitter, device=device)
        if frames != 1:
            message = f"frames must be 1 without a pipeline, got {frames!r}; pass a pipeline, or leave it out"
            raise SceneError(message)
        return trace_march(scene, pixel, step=step, plan=plan)
    _refuse("None with a pipeline, which has its own", "no pipeline", step=step, plan=plan)
    return trace_program(scene, pixel, pipeline, device, jitter, frames)


def _refuse(rule: str, cure: str, **given: object) -> None:
    for name, value in given.items():
        if value is not None:
            message = f"{name} must be {rule}, got one; pass {cure}, or leave it out"
            raise SceneError(message)
