"""The baseline in WebGL 2: distance and colour of meshes, then one pass through a 3-D texture."""

from dataclasses import replace

import numpy as np

from tests.webgl.engine import Engine, Job, Pass, Program, Target
from tests.webgl.systems.common import (
    BLENDS,
    IMAGE,
    System,
    drawn,
    float32,
    mesh_geometry,
    program,
    table_upload,
    target_of,
    volume_upload,
)
from volref import Scene
from volref.emulation.pipeline import Pipeline
from volref.emulation.rays.box import box_of
from volref.emulation.rays.paths import world_step_of
from volref.emulation.surfaces.meshes import NOWHERE
from volref.emulation.textures.uploads import uploads_of


def draw(
    engine: Engine, scene: Scene, pipeline: Pipeline, *, jitter: None = None, frames: int = 1
) -> dict[str, np.ndarray]:
    """Targets of the meshes, if there are any, and canvas."""
    assert jitter is None
    assert frames == 1
    targets, passes = mesh_passes(scene, pipeline) if scene.meshes else ({}, ())
    uploads = uploads_of(scene, pipeline)
    job = Job(
        scene.width,
        scene.height,
        (*passes, _walk(scene, pipeline)),
        {
            "volume": volume_upload(uploads, pipeline, version=2),
            "table": table_upload(uploads, pipeline, version=2),
        },
        targets | {IMAGE: target_of(pipeline.output.format)},
        version=2,
    )
    images = drawn(engine, job)
    return {name: image[..., :1] if name == "mesh_distance" else image for name, image in images.items()}


def mesh_passes(scene: Scene, pipeline: Pipeline) -> tuple[dict[str, Target], tuple[Pass, ...]]:
    """Draw the nearest meshes' distances and colours."""
    uniforms = {
        "view_from_world": float32(scene.camera.view_from_world),
        "clip_from_view": float32(scene.camera.clip_from_view(scene.width, scene.height)),
        "near": scene.camera.near,
        "far": scene.camera.far,
    }
    clears = {"mesh_distance": (float(NOWHERE), 0.0, 0.0, 0.0), "mesh_color": (0.0, 0.0, 0.0, 0.0)}
    passes = [
        Pass(_mesh_program(scene, target), mesh_geometry(mesh), uniforms, target, depth_test="less")
        for target in clears
        for mesh in scene.meshes
    ]
    for target, clear in clears.items():
        first = next(i for i, one in enumerate(passes) if one.target == target)
        passes[first] = replace(passes[first], clear=clear)
    color = target_of(pipeline.meshes.format, depth=True)
    return {"mesh_distance": Target("rgba32f", depth=True), "mesh_color": color}, tuple(passes)


def _mesh_program(scene: Scene, target: str) -> Program:
    names = "texture3d_mesh.vertex", "texture3d_mesh.fragment"
    if target == "mesh_color":
        return program(*names, {"COLOR": 1})
    return program(*names, {"PARALLEL": 1} if scene.camera.is_parallel else {})


def _walk(scene: Scene, pipeline: Pipeline) -> Pass:
    assert scene.transfer is not None
    assert pipeline.stepping.opaque_at is not None
    box, camera = box_of(scene), scene.camera
    clip_from_view = camera.clip_from_view(scene.width, scene.height)
    defines = {"PARALLEL": 1} if camera.is_parallel else {}
    uniforms = {
        "volume": "volume",
        "table": "table",
        "texture_from_view": float32(box.texture_from_world @ camera.world_from_view),
        "world_from_texture": float32(box.world_from_texture[:3, :3]),
        "half_size": (1 / clip_from_view[0, 0], 1 / clip_from_view[1, 1]),
        "near": camera.near,
        "step_length": world_step_of(pipeline.stepping, scene),
        "offset": pipeline.stepping.offset,
        "unit_distance": scene.transfer.unit_distance,
        "opaque_at": pipeline.stepping.opaque_at,
    }
    if scene.meshes:
        defines |= {"MESHES": 1}
        uniforms |= {"mesh_distance": "mesh_distance", "mesh_color": "mesh_color"}
    drawing = program("texture3d.vertex", "texture3d.fragment", defines)
    blend = BLENDS[pipeline.output.blend]
    return Pass(drawing, uniforms=uniforms, target=IMAGE, clear=scene.background, blend=blend)


SYSTEM = System(draw, ("texture3d",), frozenset({"parallel", "mesh"}))
