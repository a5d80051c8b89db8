"""x3dom's VolumeData in real WebGL 1: one pass over the faces of the box."""

import numpy as np

from tests.webgl.engine import Engine, Job, Pass
from tests.webgl.systems.common import (
    BLENDS,
    IMAGE,
    System,
    box_geometry,
    clip_from_texture,
    drawn,
    eye_in_texture,
    program,
    table_upload,
    target_of,
    volume_upload,
)
from volref import Scene
from volref.emulation.loop.opacity import factor_of
from volref.emulation.pipeline import Pipeline
from volref.emulation.rays.box import box_of
from volref.emulation.textures.uploads import Uploads, uploads_of


def draw(
    engine: Engine, scene: Scene, pipeline: Pipeline, *, jitter: np.ndarray | None = None, frames: int = 1
) -> dict[str, np.ndarray]:
    """Draw the canvas, the only target; with the eye in the box the back faces are drawn."""
    assert jitter is None
    assert frames == 1
    uploads = uploads_of(scene, pipeline)
    eye = eye_in_texture(scene)
    uniforms = {
        "clip_from_texture": clip_from_texture(scene),
        "atlas": "atlas",
        "colors": "colors",
        "eye": eye,
        "opacity_factor": factor_of(scene, pipeline, box_of(scene)),
        "light_factor": pipeline.lighting.factor,
        "step_length": pipeline.stepping.length,
    }
    drawing = Pass(
        program("x3dom.vertex", "x3dom.fragment", defines_of(pipeline, uploads)),
        box_geometry(scene),
        uniforms,
        IMAGE,
        scene.background,
        cull="front" if np.all((eye > 0) & (eye < 1)) else "back",
        blend=BLENDS[pipeline.output.blend],
    )
    targets = {IMAGE: target_of(pipeline.output.format)}
    textures = {"atlas": volume_upload(uploads, pipeline), "colors": table_upload(uploads, pipeline)}
    return drawn(engine, Job(scene.width, scene.height, (drawing,), textures, targets))


def defines_of(pipeline: Pipeline, uploads: Uploads) -> dict[str, object]:
    """What the shader is told before it is compiled."""
    numbers = {
        "STEPS": float(pipeline.stepping.steps),
        "ACROSS": float(uploads.tiles[0]),
        "DOWN": float(uploads.tiles[1]),
        "SLICES": float(uploads.size[2]),
    }
    return {**numbers, "ROW_DIVISOR": "DOWN" if pipeline.volume.tile_row == "rows" else "ACROSS"}


SYSTEM = System(draw, ("x3dom",), p99=1e-3)
