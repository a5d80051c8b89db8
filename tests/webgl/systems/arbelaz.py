"""Seed 000 in WebGL 1: five passes, depth in bytes; meshes and volume meet in the last one."""

import numpy as np

from tests.webgl.engine import Engine, Geometry, Job, Pass, Program, Target
from tests.webgl.systems.common import (
    BLENDS,
    IMAGE,
    System,
    box_geometry,
    clip_from_texture,
    clip_from_world,
    drawn,
    float32,
    program,
    shader,
    table_upload,
    target_of,
    volume_upload,
)
from volref import Mesh, Scene
from volref.emulation.loop.opacity import factor_of
from volref.emulation.pipeline import Pipeline
from volref.emulation.rays.box import CORNERS, box_of
from volref.emulation.textures.uploads import uploads_of

EMPTY = (0.0, 0.0, 0.0, 0.0)

# A mesh shows these of its sides: what is culled for that.
CULLED = {"both": "none", "front": "back", "back": "front"}


def draw(
    engine: Engine, scene: Scene, pipeline: Pipeline, *, jitter: None = None, frames: int = 1
) -> dict[str, np.ndarray]:
    """Depth and colour of the meshes, depth and coordinates of the back, coordinates of the front, canvas."""
    assert jitter is None
    assert frames == 1
    uploads = uploads_of(scene, pipeline)
    depth = "rgba32f" if pipeline.meshes.packing == "exact" else "rgba8"
    targets = {
        "mesh_depth": Target(depth, depth=True),
        "mesh_color": target_of(pipeline.meshes.format, depth=True),
        "back_depth": Target(depth),
        "back_coordinates": target_of(pipeline.rays.format),
        "front_coordinates": Target("rgba32f"),
        IMAGE: target_of(pipeline.output.format, depth=True),
    }
    passes = (
        *mesh_passes(scene, pipeline, "mesh_depth"),
        *mesh_passes(scene, pipeline, "mesh_color"),
        *box_passes(scene, pipeline),
        *mesh_passes(scene, pipeline, IMAGE),
        volume_pass(scene, pipeline),
    )
    textures = {"atlas": volume_upload(uploads, pipeline), "table": table_upload(uploads, pipeline)}
    images = drawn(engine, Job(scene.width, scene.height, passes, textures, targets))
    if depth == "rgba32f":
        images |= {name: images[name][..., :1] for name in ("mesh_depth", "back_depth")}
    return images


def mesh_passes(scene: Scene, pipeline: Pipeline, target: str) -> list[Pass]:
    """All meshes, one after the other, with a depth test; the first one clears."""
    passes: list[Pass] = []
    for mesh in scene.meshes:
        if target == "mesh_depth":
            drawing, uniforms = depth_drawing(scene, pipeline, np.eye(4))
            geometry = Geometry({"position": mesh.vertices}, mesh.faces)
        else:
            drawing, uniforms, geometry = color_drawing(mesh)
        uniforms = uniforms | {"clip_from_model": clip_from_world(scene)}
        background = scene.background if target == IMAGE else EMPTY
        clear = None if passes else background
        cull = CULLED[mesh.sides]
        passes.append(Pass(drawing, geometry, uniforms, target, clear, depth_test="less", cull=cull))
    return passes


def color_drawing(mesh: Mesh) -> tuple[Program, dict[str, object], Geometry]:
    """Program of pass 2, its uniforms but for `clip_from_model`, and what it draws."""
    assert mesh.coloring != "texture"
    assert mesh.back_color is None
    names = "arbelaz_mesh.vertex", "arbelaz_mesh.fragment"
    if mesh.coloring == "uniform":
        geometry = Geometry({"position": mesh.vertices}, mesh.faces)
        return program(*names, {"ONE_COLOR": 1}), {"shown": mesh.colors[:3]}, geometry
    vertices, colors, faces = mesh.vertices, mesh.colors[:, :3], mesh.faces
    if mesh.coloring == "face":
        # No two triangles share a vertex.
        vertices, colors = vertices[faces].reshape(-1, 3), np.repeat(colors, 3, axis=0)
        faces = np.arange(len(vertices)).reshape(-1, 3)
    return program(*names), {}, Geometry({"position": vertices, "color": colors}, faces)


def box_passes(scene: Scene, pipeline: Pipeline) -> tuple[Pass, ...]:
    """Back depth, back coordinates, and the varying of the last pass as a colour."""
    box = box_of(scene)
    drawing, uniforms = depth_drawing(scene, pipeline, box.world_from_texture)
    uniforms |= {"clip_from_model": clip_from_texture(scene)}
    faces = Geometry({"position": CORNERS}, box.triangles)
    coordinates = program("coordinates.vertex", "coordinates.fragment")
    matrix = {"clip_from_texture": clip_from_texture(scene)}
    return (
        Pass(drawing, faces, uniforms, "back_depth", EMPTY, cull="front"),
        Pass(coordinates, box_geometry(scene), matrix, "back_coordinates", EMPTY, cull="front"),
        Pass(coordinates, box_geometry(scene), matrix, "front_coordinates", EMPTY, cull="back"),
    )


def depth_drawing(
    scene: Scene, pipeline: Pipeline, world_from_model: np.ndarray
) -> tuple[Program, dict[str, object]]:
    """Program of passes 1 and 3, and its uniforms but for `clip_from_model`."""
    defines = depth_defines(pipeline)
    fragment = shader("arbelaz_packing") + shader("arbelaz_depth.fragment")
    drawing = Program(shader("arbelaz_depth.vertex"), fragment, defines)
    return drawing, depth_uniforms(scene, pipeline, world_from_model)


def depth_defines(pipeline: Pipeline) -> dict[str, object]:
    flags = {
        "WINDOW_OVER_W": pipeline.meshes.depth == "window-over-w",
        "PACKING_PRINTED": pipeline.meshes.packing == "printed",
        "FLOAT_DEPTH": pipeline.meshes.packing == "exact",
    }
    return {name: 1 for name, on in flags.items() if on}


def depth_uniforms(scene: Scene, pipeline: Pipeline, world_from_model: np.ndarray) -> dict[str, object]:
    if pipeline.meshes.depth == "window-over-w":
        return {}
    view = float32(scene.camera.view_from_world @ world_from_model)
    return {"view_from_model": view, "planes": (scene.camera.near, scene.camera.far)}


def volume_pass(scene: Scene, pipeline: Pipeline) -> Pass:
    """The box's front faces, tested against the meshes, and the loop."""
    uploads, box = uploads_of(scene, pipeline), box_of(scene)
    flags = {
        "ONE_STEP_EARLY": pipeline.meshes.comparison == "one-step-early",
        "OBJECT_PRINTED": pipeline.meshes.composition == "printed",
        "OUTSIDE_ABOVE": pipeline.stepping.end == "outside-above",
    }
    defines = depth_defines(pipeline) | {name: 1 for name, on in flags.items() if on}
    defines |= {"STEPS": pipeline.stepping.steps, "OPAQUE_AT": pipeline.stepping.opaque_at}
    fragment = shader("arbelaz_packing") + shader("arbelaz.fragment")
    names = ("mesh_depth", "mesh_color", "back_depth", "back_coordinates", "atlas", "table")
    uniforms = {name: name for name in names} | {
        "clip_from_model": clip_from_texture(scene),
        "tiles": (*uploads.tiles, uploads.size[2]),
        "opacity_factor": factor_of(scene, pipeline, box),
        **depth_uniforms(scene, pipeline, box.world_from_texture),
    }
    return Pass(
        Program(shader("arbelaz.vertex"), fragment, defines),
        Geometry({"position": CORNERS}, box.triangles),
        uniforms,
        IMAGE,
        None if scene.meshes else scene.background,
        depth_test="less",
        cull="back",
        blend=BLENDS[pipeline.output.blend],
    )


SYSTEM = System(draw, ("arbelaz2016", "arbelaz2016-printed"), frozenset({"mesh", "parallel"}))
