"""Seed 001 in WebGL 1: front and back coordinates in bytes, then a loop between the two."""

import numpy as np

from tests.webgl.engine import Engine, Job, Pass
from tests.webgl.systems.common import (
    BLENDS,
    IMAGE,
    System,
    box_geometry,
    clip_from_texture,
    coordinate_passes,
    drawn,
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


def draw(
    engine: Engine, scene: Scene, pipeline: Pipeline, *, jitter: None = None, frames: int = 1
) -> dict[str, np.ndarray]:
    """Coordinate targets and canvas."""
    assert jitter is None
    assert frames == 1
    uploads = uploads_of(scene, pipeline)
    targets, passes = coordinate_passes(scene, pipeline)
    defines: dict[str, object] = {"STEPS": pipeline.stepping.steps, "OPAQUE_AT": pipeline.stepping.opaque_at}
    flags = {
        "PRINTED": pipeline.name.endswith("-printed"),
        "CLAMPED": pipeline.volume.in_tile == "clamped",
        "CENTERS": pipeline.volume.slices == "centers",
        "LAST_AGAIN": pipeline.volume.second_slice == "clamped",
    }
    defines |= {name: 1 for name, on in flags.items() if on}
    uniforms = {
        "clip_from_texture": clip_from_texture(scene),
        "front_coordinates": "front_coordinates",
        "back_coordinates": "back_coordinates",
        "atlas": "atlas",
        "table": "table",
        "tiles": (*uploads.tiles, uploads.size[2]),
        "tile_size": uploads.size[:2],
        "opacity_factor": factor_of(scene, pipeline, box_of(scene)),
        "light_factor": pipeline.lighting.factor,
    }
    walk = Pass(
        program("congote.vertex", "congote.fragment", defines),
        box_geometry(scene),
        uniforms,
        IMAGE,
        scene.background,
        cull="back",
        blend=BLENDS[pipeline.output.blend],
    )
    job = Job(
        scene.width,
        scene.height,
        (*passes, walk),
        {"atlas": volume_upload(uploads, pipeline), "table": table_upload(uploads, pipeline)},
        targets | {IMAGE: target_of(pipeline.output.format)},
    )
    return drawn(engine, job)


SYSTEM = System(draw, ("congote2012", "congote2012-printed"), frozenset({"parallel"}))
