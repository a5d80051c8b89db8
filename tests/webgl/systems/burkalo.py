"""Seed 003 in WebGL 2, as it works and as it is printed, and its base: one pass over the whole target."""

import numpy as np

from tests.webgl.engine import Engine, Job, Pass
from tests.webgl.systems.common import (
    IMAGE,
    System,
    drawn,
    eye_in_texture,
    float32,
    image_texture,
    program,
    table_upload,
    target_of,
    volume_upload,
)
from volref import Scene
from volref.emulation.pipeline import Pipeline
from volref.emulation.rays.box import box_of
from volref.emulation.textures.uploads import uploads_of

DEFINES = {
    "burkalo2022": (),
    "burkalo2022-printed": ("NO_ASPECT", "NO_BACKGROUND"),
    "mpilia2018": ("DEEPEST_IN_FRONT",),
}


def draw(
    engine: Engine, scene: Scene, pipeline: Pipeline, *, jitter: np.ndarray | None = None, frames: int = 1
) -> dict[str, np.ndarray]:
    """Canvas, the one target there is; jitter (1, H, W) for the base."""
    assert frames == 1
    uploads = uploads_of(scene, pipeline)
    textures = {
        "volume": volume_upload(uploads, pipeline, version=2),
        "table": table_upload(uploads, pipeline, version=2),
    }
    if pipeline.stepping.jitter:
        offsets = np.zeros((1, scene.height, scene.width)) if jitter is None else jitter
        textures["jitter"] = image_texture(offsets[0])
    defines = {"TABLE_SIZE": pipeline.table.size} | dict.fromkeys(DEFINES[pipeline.name], 1)
    walk = Pass(
        program("burkalo.vertex", "burkalo.fragment", defines),
        uniforms=uniforms_of(scene, pipeline) | {name: name for name in textures},
        target=IMAGE,
        clear=scene.background,
    )
    targets = {IMAGE: target_of(pipeline.output.format)}
    return drawn(engine, Job(scene.width, scene.height, (walk,), textures, targets, version=2))


def uniforms_of(scene: Scene, pipeline: Pipeline) -> dict[str, object]:
    """What the page's JavaScript would set; some of it no variant but one reads."""
    camera, stepping, printed = scene.camera, pipeline.stepping, pipeline.name.endswith("-printed")
    turn = box_of(scene).texture_from_world @ camera.world_from_view
    uniforms = {
        "viewport": (scene.width, scene.height),
        "focal_length": camera.clip_from_view(scene.width, scene.height)[1, 1],
        "texture_from_view": float32(turn[:3, :3]),
        "eye": eye_in_texture(scene),
        "step_length": stepping.length or 1.0 / stepping.steps,
        "opaque_at": stepping.opaque_at,
        "gamma": pipeline.output.gamma,
    }
    if not printed:
        uniforms |= {"aspect": scene.width / scene.height, "background": scene.background[:3]}
    return uniforms


SYSTEM = System(draw, ("burkalo2022", "burkalo2022-printed"))
BASE = System(draw, ("mpilia2018",), jitter=True)
