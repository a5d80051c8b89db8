"""Seed 002 in WebGL 1: exits as floats, then the front faces and a loop; page and article by `#define`s."""

import numpy as np

from tests.webgl.engine import Engine, Job, Pass, Target, Texture
from tests.webgl.systems.common import (
    BLENDS,
    IMAGE,
    System,
    box_geometry,
    clip_from_texture,
    drawn,
    program,
    target_of,
)
from volref import Scene, Volume
from volref.emulation.loop.opacity import factor_of
from volref.emulation.pipeline import Pipeline
from volref.emulation.rays.box import box_of
from volref.emulation.textures.uploads import Uploads, uploads_of

EMPTY = (0.0, 0.0, 0.0, 0.0)


def draw(
    engine: Engine, scene: Scene, pipeline: Pipeline, *, jitter: None = None, frames: int = 1
) -> dict[str, np.ndarray]:
    """Coordinate targets and canvas; entries have no target of their own, they are the varying drawn."""
    assert jitter is None
    assert frames == 1
    uploads = uploads_of(scene, pipeline)
    box, matrix = box_geometry(scene), {"clip_from_texture": clip_from_texture(scene)}
    coordinates = program("coordinates.vertex", "coordinates.fragment")
    walk = program("barbagallo.vertex", "barbagallo.fragment", defines_of(pipeline, uploads))
    uniforms = {
        **matrix,
        "exits": "back_coordinates",
        "atlas": "atlas",
        "colors": "colors",
        "factor": factor_of(scene, pipeline, box_of(scene)),
    }
    blend = BLENDS[pipeline.output.blend]
    passes = (
        Pass(coordinates, box, matrix, "front_coordinates", EMPTY, cull="back"),
        Pass(coordinates, box, matrix, "back_coordinates", EMPTY, cull="front"),
        Pass(walk, box, uniforms, IMAGE, scene.background, cull="back", blend=blend),
    )
    targets = {
        "front_coordinates": Target("rgba32f"),
        "back_coordinates": target_of(pipeline.rays.format, filtering=pipeline.rays.filter),
        IMAGE: target_of(pipeline.output.format),
    }
    textures = {"atlas": atlas_of(scene, uploads, pipeline), "colors": canvas_of(uploads, pipeline)}
    return drawn(engine, Job(scene.width, scene.height, passes, textures, targets))


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


def atlas_of(scene: Scene, uploads: Uploads, pipeline: Pipeline) -> Texture:
    """PNG of the slices, row 0 its top, with the values in alpha; uploaded upside down, as three.js does.

    Slices are put into it here, from the first tile in the upper left corner on, y upwards.
    """
    assert isinstance(scene.volume, Volume)
    low, high = uploads.domain
    slices = np.rint(255 * np.clip((scene.volume.values.astype(float) - low) / (high - low), 0, 1))
    count, height, width = slices.shape
    across = int(np.ceil(np.sqrt(count)))
    png = np.zeros((-(-count // across) * height, across * width, 4), np.uint8)
    for number, values in enumerate(slices):
        top, left = number // across * height, number % across * width
        png[top : top + height, left : left + width, 3] = values[::-1]
    return Texture(png, "rgba8", pipeline.volume.filter, flip_y=True)


def canvas_of(uploads: Uploads, pipeline: Pipeline) -> Texture:
    """Canvas of 20 equal rows, the last of them empty: `fillRect` ends one short of both sides.

    WebGL 1 has mip levels for powers of two only: three.js then makes 16 rows of the 20, here all filled.
    """
    if pipeline.table.filter == "linear-mipmap":
        return Texture(np.repeat(uploads.table, 16, axis=0), "rgba8", "linear-mipmap-linear")
    canvas = np.repeat(uploads.table, 20, axis=0)
    canvas[-1] = 0
    return Texture(canvas, "rgba8", pipeline.table.filter, flip_y=True)


SYSTEM = System(draw, ("barbagallo", "barbagallo-article"), frozenset({"parallel"}), p99=1e-3)
