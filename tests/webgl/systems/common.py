"""What the programs of all systems share: uploads, matrices, geometry, targets, a job's way there and back.

Arithmetic of the systems is in their GLSL; here is only what a page's JavaScript would do before it draws.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tests.webgl.engine import CANVAS, Engine, Geometry, Job, Pass, Program, Target, Texture
from volref import Mesh, Scene
from volref.emulation.pipeline import Pipeline
from volref.emulation.rays.box import CORNERS, box_of
from volref.emulation.textures.uploads import Uploads

# The last target, in bytes or floats; the real canvas has bytes only.
IMAGE = "image"

SHADERS = Path(__file__).parents[1] / "shaders"

# Formats of uploads by number of channels; those of one row by the version of WebGL.
BYTES = {1: {1: "luminance8", 2: "r8"}, 2: {1: "luminance_alpha8", 2: "rg8"}, 4: {1: "rgba8", 2: "rgba8"}}
FLOATS = {1: "r32f", 4: "rgba32f"}

# What a render target of a number format is.
TARGETS = {"unorm8": "rgba8", "half": "rgba16f", "float": "rgba32f"}

BLENDS = {
    "none": None,
    "shader": None,
    "premultiplied": ("one", "one_minus_src_alpha", "one", "one_minus_src_alpha"),
    "straight": ("src_alpha", "one_minus_src_alpha", "src_alpha", "one_minus_src_alpha"),
    "additive-alpha": ("src_alpha", "one_minus_src_alpha", "one", "one"),
}


@dataclass(frozen=True)
class System:
    """A system that real WebGL draws.

    draw: (engine, scene, pipeline, *, jitter=None, frames=1) -> every target by the emulation's own names,
    (H, W, channels), row 0 at the top, uint8 or float32.  pipelines: names in the catalogue.  suits: kinds
    of scenes (see `scenes.py`) that it draws beside plain ones; only: kinds that a scene must be of.  p99:
    what 99 of 100 pixels of a float image are within.  jitter: whether it is given start offsets; steady: the
    same all over a frame.  frames: how many it averages in the tests.
    """

    draw: Callable[..., dict[str, np.ndarray]]
    pipelines: tuple[str, ...]
    suits: frozenset[str] = frozenset()
    p99: float = 1e-5
    jitter: bool = False
    steady: bool = False
    frames: int = 1
    only: frozenset[str] = frozenset()


def shader(name: str) -> str:
    """GLSL by the name of its file."""
    return (SHADERS / f"{name}.glsl").read_text(encoding="utf-8")


def program(vertex: str, fragment: str, defines: Mapping[str, object] | None = None) -> Program:
    """Vertex and fragment shader by the names of their files."""
    return Program(shader(vertex), shader(fragment), defines or {})


def volume_upload(uploads: Uploads, pipeline: Pipeline, *, version: int = 1) -> Texture:
    """Volume or atlas as it is uploaded; row 0 of the array lies at v = 0."""
    return texture(uploads.volume, pipeline.volume.filter, version=version)


def table_upload(uploads: Uploads, pipeline: Pipeline, *, version: int = 1) -> Texture:
    """Transfer function as it is uploaded."""
    kind = pipeline.table.filter.replace("linear-mipmap", "linear-mipmap-linear")
    if pipeline.table.srgb:
        return Texture(uploads.table, "srgb8_alpha8", kind)
    return texture(uploads.table, kind, version=version)


def texture(texels: np.ndarray, filtering: str, *, version: int = 1) -> Texture:
    """Texels (..., channels), codes or floats, as a texture."""
    channels = texels.shape[-1]
    values = texels[..., 0] if channels == 1 else texels
    if texels.dtype == np.uint8:
        return Texture(values, BYTES[channels][version], filtering)
    return Texture(values.astype(np.float32), FLOATS[channels], filtering)


def image_texture(values: np.ndarray) -> Texture:
    """One number per pixel, (H, W) with row 0 at the top, such as jitter: read at the pixel's own place."""
    return Texture(np.ascontiguousarray(values[::-1], dtype=np.float32), "r32f")


def box_geometry(scene: Scene) -> Geometry:
    """Unit cube of texture space, counter-clockwise from outside: attribute vec3 corner."""
    return Geometry({"corner": CORNERS}, box_of(scene).triangles)


def mesh_geometry(mesh: Mesh) -> Geometry:
    """Mesh in the world, with the colours of its vertices or its one colour: vec3 position, vec3 color."""
    colors = np.broadcast_to(mesh.colors, (len(mesh.vertices), np.shape(mesh.colors)[-1]))[:, :3]
    return Geometry({"position": mesh.vertices, "color": colors}, mesh.faces)


def float32(matrix: np.ndarray) -> np.ndarray:
    """Matrix as a uniform holds it."""
    return np.asarray(matrix, np.float32)


def clip_from_world(scene: Scene) -> np.ndarray:
    """Projection times view, multiplied in float64 before the upload."""
    camera = scene.camera
    return float32(camera.clip_from_view(scene.width, scene.height) @ camera.view_from_world)


def clip_from_texture(scene: Scene) -> np.ndarray:
    """From the unit cube to clip space."""
    return float32(box_of(scene).clip_from_texture)


def eye_in_texture(scene: Scene) -> np.ndarray:
    """Eye (3,) in texture space."""
    eye = np.append(scene.camera.world_from_view[:3, 3], 1.0)
    return float32((box_of(scene).texture_from_world @ eye)[:3])


def target_of(kind: str, *, depth: bool = False, filtering: str = "nearest") -> Target:
    """Render target for a number format of a pipeline."""
    return Target(TARGETS[kind], depth, filtering)


def coordinate_passes(scene: Scene, pipeline: Pipeline) -> tuple[dict[str, Target], tuple[Pass, ...]]:
    """Two passes that draw the box's faces with texture coordinates as colours: nearest and furthest."""
    drawing = program("coordinates.vertex", "coordinates.fragment")
    geometry, matrix = box_geometry(scene), clip_from_texture(scene)
    culled = {"back_coordinates": "front"}
    if pipeline.rays.front == "target":
        culled = {"front_coordinates": "back"} | culled
    passes = tuple(
        Pass(drawing, geometry, {"clip_from_texture": matrix}, name, (0.0, 0.0, 0.0, 0.0), cull=cull)
        for name, cull in culled.items()
    )
    target = target_of(pipeline.rays.format, filtering=pipeline.rays.filter)
    return dict.fromkeys(culled, target), passes


def drawn(engine: Engine, job: Job) -> dict[str, np.ndarray]:
    """Targets of a job, `IMAGE` under the name of the canvas; coordinate targets have three channels."""
    images = engine.run(job)
    three = {
        name: image[..., :3] if name.endswith("_coordinates") else image for name, image in images.items()
    }
    return {CANVAS if name == IMAGE else name: image for name, image in three.items()}
