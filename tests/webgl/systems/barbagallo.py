"""Seed 002 in real WebGL 1: the page of today and the article, told apart by `#define`s."""

import numpy as np

from tests.webgl.engine import Engine, Job, Pass, Target, Texture
from tests.webgl.systems.common import (
    TARGETS,
    box_geometry,
    clip_from_texture,
    drawn,
    program,
)
from volref import Scene
from volref.emulation.box import box_of
from volref.emulation.opacity import factor_of
from volref.emulation.pipeline import Pipeline
from volref.emulation.uploads import Uploads, uploads_of

EMPTY = (0.0, 0.0, 0.0, 0.0)


def draw(
    browser: Engine, scene: Scene, pipeline: Pipeline, *, jitter: np.ndarray | None = None, frames: int = 1
) -> dict[str, np.ndarray]:
    """Every target by name; the entries, which have no target of their own, as a picture of the varying."""
    assert jitter is None
    assert frames == 1
    uploads = uploads_of(scene, pipeline)
    box, matrix = box_geometry(scene), {"clip_from_texture": clip_from_texture(scene)}
    first = program("barbagallo.vertex", "barbagallo_first.fragment")
    second = program("barbagallo.vertex", "barbagallo.fragment", defines_of(pipeline, uploads))
    reads = {"exits": "back_coordinates", "atlas": "atlas", "colors": "colors"}
    factor = {"factor": factor_of(scene, pipeline, box_of(scene))}
    passes = (
        Pass(first, box, matrix, "front_coordinates", EMPTY, depth_test="lequal", cull="back"),
        Pass(first, box, matrix, "back_coordinates", EMPTY, depth_test="lequal", cull="front"),
        Pass(
            second,
            box,
            {**matrix, **reads, **factor},
            "final",
            scene.background,
            depth_test="lequal",
            cull="back",
        ),
    )
    targets = {
        "front_coordinates": Target("rgba32f", depth=True),
        "back_coordinates": Target("rgba32f", depth=True, filter=pipeline.rays.filter),
        "final": Target(TARGETS[pipeline.output.format], depth=True),
    }
    textures = {"atlas": atlas_of(uploads, pipeline), "colors": canvas_of(uploads, pipeline)}
    images = drawn(browser, scene, Job(scene.width, scene.height, passes, textures, targets))
    images["canvas"] = images.pop("final")
    return images


def defines_of(pipeline: Pipeline, uploads: Uploads) -> dict[str, object]:
    """What the shader is told before it is compiled."""
    numbers = {
        "MAX_STEPS": pipeline.stepping.cap,
        "STEPS": pipeline.stepping.steps,
        "ACROSS": uploads.tiles[0],
        "DOWN": uploads.tiles[1],
        "SLICES": uploads.size[2],
    }
    flags = {
        "LEFT_WITHOUT_EXIT": pipeline.rays.no_exit == "left",
        "ADDED_ALPHA": pipeline.accumulation.rule == "add-alpha",
        "PER_STEP": pipeline.opacity.rule == "per-step",
    }
    return {**numbers, **{name: 1 for name, on in flags.items() if on}}


def atlas_of(uploads: Uploads, pipeline: Pipeline) -> Texture:
    """PNG of the slices, row 0 its top, with the values in alpha; uploaded upside down, as three.js does."""
    png = np.zeros((*uploads.volume.shape[:2], 4), np.uint8)
    png[..., 3] = uploads.volume[::-1, :, 0]
    return Texture(png, "rgba8", pipeline.volume.filter, flip_y=True)


def canvas_of(uploads: Uploads, pipeline: Pipeline) -> Texture:
    """Canvas of 20 equal rows, the last of them empty: `fillRect` ends one short of both sides."""
    canvas = np.repeat(uploads.table[:1], 20, axis=0)
    canvas[-1] = 0
    kind = pipeline.table.filter.replace("linear-mipmap", "linear-mipmap-linear")
    return Texture(canvas, "rgba8", kind, flip_y=True)
