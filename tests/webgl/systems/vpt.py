"""VPT's emission-absorption renderer in real WebGL 2: frame, running mean and tone map, frame by frame."""

from collections.abc import Iterator

import numpy as np

from tests.webgl.engine import Engine, Job, Pass
from tests.webgl.systems.common import (
    IMAGE,
    System,
    drawn,
    float32,
    program,
    table_upload,
    target_of,
    volume_upload,
)
from volref import Scene
from volref.emulation.loop.opacity import factor_of
from volref.emulation.pipeline import Pipeline
from volref.emulation.rays.box import box_of
from volref.emulation.textures.uploads import uploads_of

ALPHA = {"one": "1.0", "accumulated": "sum.a"}


def draw(
    engine: Engine, scene: Scene, pipeline: Pipeline, *, jitter: np.ndarray | None = None, frames: int = 1
) -> dict[str, np.ndarray]:
    """Every target by name; jitter is (frames, H, W), and the same all over each frame."""
    uploads = uploads_of(scene, pipeline)
    output = pipeline.output
    targets = dict.fromkeys(("frame", IMAGE), target_of(output.format))
    targets |= dict.fromkeys(("running_mean", "other"), target_of(output.mean_format))
    textures = {
        "volume": volume_upload(uploads, pipeline, version=2),
        "colors": table_upload(uploads, pipeline, version=2),
    }
    passes = tuple(_passes(scene, pipeline, offsets_of(jitter, frames)))
    read = ("frame", "running_mean", IMAGE)
    return drawn(engine, Job(scene.width, scene.height, passes, textures, targets, read, version=2))


def offsets_of(jitter: np.ndarray | None, frames: int) -> list[float]:
    """Offset of each frame."""
    if jitter is None:
        return [0.0] * frames
    assert all(np.ptp(frame) == 0 for frame in jitter)
    return [float(frame[0, 0]) for frame in jitter]


def _passes(scene: Scene, pipeline: Pipeline, offsets: list[float]) -> Iterator[Pass]:
    screen, output = "vpt_screen.vertex", pipeline.output
    generate = program("unproject.vertex", "vpt.fragment", {"ALPHA": ALPHA[pipeline.accumulation.alpha]})
    generated = {
        "texture_from_clip": float32(np.linalg.inv(box_of(scene).clip_from_texture)),
        "volume": "volume",
        "colors": "colors",
        "step_size": 1 / pipeline.stepping.steps,
        "extinction": factor_of(scene, pipeline, box_of(scene)),
    }
    # Two targets take turns; the mean of all frames is to end up in the first.
    turns = ["running_mean", "other"] if len(offsets) % 2 == 0 else ["other", "running_mean"]
    yield Pass(program(screen, "vpt_reset.fragment"), target=turns[0])
    for number, offset in enumerate(offsets, start=1):
        before, after = turns[(number - 1) % 2], turns[number % 2]
        yield Pass(generate, uniforms={**generated, "offset": offset}, target="frame")
        mixed = {"mean": before, "frame": "frame", "share": 1 / number}
        yield Pass(program(screen, "vpt_integrate.fragment"), uniforms=mixed, target=after)
    names = ("low", "mid", "high", "saturation", "gamma")
    shaped = {"mean": "running_mean", **{name: getattr(output, name) for name in names}}
    yield Pass(program(screen, "vpt_artistic.fragment"), uniforms=shaped, target=IMAGE)


SYSTEM = System(draw, ("vpt-eam",), frozenset({"parallel"}), p99=1e-4, jitter=True, steady=True, frames=3)
