"""Seed 004 in WebGL 2: gradient volume, frames and their mean; as published and put right by `#define`s."""

from collections.abc import Iterator

import numpy as np

from tests.webgl.engine import Engine, Job, Pass, Target, Texture
from tests.webgl.systems.common import (
    IMAGE,
    System,
    drawn,
    float32,
    image_texture,
    program,
    table_upload,
    target_of,
    texture,
)
from volref import Light, Material, Scene
from volref.emulation.loop.opacity import factor_of
from volref.emulation.pipeline import Pipeline
from volref.emulation.rays.box import box_of
from volref.emulation.textures.uploads import uploads_of
from volref.formats import codes_of

KINDS = {"ambient": 0, "point": 1, "directional": 2}
MATERIALS = {"lambert": "LAMBERT", "phong": "PHONG", "blinn-phong": "BLINN"}
SCREEN = "cej_screen.vertex"


def draw(
    engine: Engine, scene: Scene, pipeline: Pipeline, *, jitter: np.ndarray | None = None, frames: int = 1
) -> dict[str, np.ndarray]:
    """Every target by name; the gradient volume is drawn first, read back, and uploaded as a 3-D texture."""
    uploads = uploads_of(scene, pipeline)
    gradients = gradient_volume(engine, uploads.volume[..., 0], pipeline)
    offsets = np.zeros((frames, scene.height, scene.width)) if jitter is None else jitter
    kind, mean_kind = pipeline.output.format, pipeline.output.mean_format
    textures = {
        "volume": texture(gradients, pipeline.volume.filter, version=2),
        "colors": table_upload(uploads, pipeline, version=2),
        "environment": environment(scene, kind),
        **{f"jitter {number}": image_texture(offset) for number, offset in enumerate(offsets, start=1)},
    }
    targets = {"frame": target_of(kind), IMAGE: target_of(kind)}
    targets |= dict.fromkeys(("mean", "other"), target_of(mean_kind))
    passes = tuple(_passes(scene, pipeline, frames))
    job = Job(scene.width, scene.height, passes, textures, targets, ("frame", "mean", IMAGE), version=2)
    images = drawn(engine, job)
    images["running_mean"] = images.pop("mean")
    return {"gradient_volume": gradients, **images}


def gradient_volume(engine: Engine, values: np.ndarray, pipeline: Pipeline) -> np.ndarray:
    """Bytes (D, H, W, 4) of value and gradient for bytes (D, H, W) of the value."""
    assert values.dtype == np.uint8
    depth, height, width = values.shape
    making = program(SCREEN, "cej_gradient.fragment", gradient_defines(pipeline))
    uniforms = {"values": "values", "size": (width, height, depth)}
    job = Job(
        width,
        height * depth,
        (Pass(making, uniforms=uniforms, target="slices"),),
        {"values": Texture(values, "r8")},
        {"slices": Target("rgba8")},
        version=2,
    )
    return engine.run(job)["slices"][::-1].reshape(depth, height, width, 4)


def environment(scene: Scene, kind: str) -> Texture:
    """One texel of the background, which surrounds the volume on all sides."""
    texel = np.array([[scene.background]])
    return Texture(codes_of(texel), "rgba8") if kind == "unorm8" else Texture(float32(texel), "rgba32f")


def _passes(scene: Scene, pipeline: Pipeline, frames: int) -> Iterator[Pass]:
    generate = program("unproject.vertex", "cej.fragment", defines_of(scene, pipeline))
    generated = {
        "texture_from_clip": float32(np.linalg.inv(box_of(scene).clip_from_texture)),
        "volume": "volume",
        "colors": "colors",
        "environment": "environment",
        "step_size": 1 / pipeline.stepping.steps,
        "extinction": factor_of(scene, pipeline, box_of(scene)),
        **light_uniforms(scene, pipeline),
    }
    integrate, show = (program(SCREEN, f"cej_{name}.fragment") for name in ("integrate", "show"))
    # The mean of the last frame is to be in "mean": the two targets take turns.
    turns = ["mean", "other"] if frames % 2 == 0 else ["other", "mean"]
    for number in range(1, frames + 1):
        before, after = turns[(number - 1) % 2], turns[number % 2]
        yield Pass(generate, uniforms={**generated, "jitter": f"jitter {number}"}, target="frame")
        mixed = {"mean": before, "frame": "frame", "share": 1 / number}
        yield Pass(integrate, uniforms=mixed, target=after)
    yield Pass(show, uniforms={"mean": "mean"}, target=IMAGE)


def gradient_defines(pipeline: Pipeline) -> dict[str, object]:
    """What both shaders that know the gradients' bytes are told."""
    flags = {
        "MISPRINT": pipeline.lighting.gradient == "sobel-bytes-printed",
        "ZERO_HALF": pipeline.lighting.zero == "half",
    }
    return {name: 1 for name, on in flags.items() if on}


def defines_of(scene: Scene, pipeline: Pipeline) -> dict[str, object]:
    """What the frame's shader is told before it is compiled."""
    defines = gradient_defines(pipeline)
    if pipeline.lighting.flat == "skipped":
        defines["SKIP_FLAT"] = 1
    if pipeline.opacity.by_gradient:
        defines["BY_GRADIENT"] = f"{pipeline.opacity.by_gradient:.9e}"
    material = scene.material or Material()
    if scene.lights and material.model != "unlit":
        defines |= {"LIGHTS": len(scene.lights), MATERIALS[material.model]: 1}
        if material.two_sided:
            defines["TWO_SIDED"] = 1
    return defines


def light_uniforms(scene: Scene, pipeline: Pipeline) -> dict[str, object]:
    """Lights, material, and the space in which they are."""
    if not scene.lights:
        return {}
    box, material = box_of(scene), scene.material or Material()
    in_world = pipeline.lighting.space == "world"
    lit_from_world = np.eye(4) if in_world else box.texture_from_world
    # A light of the program has no c0, and its k is for lengths of the space that it is in.
    square = 1.0 if in_world else box.sides.mean() ** 2
    base = np.array([light.attenuation[0] for light in scene.lights])
    far = np.array([light.attenuation[2] for light in scene.lights])
    vectors = [vector_of(light, lit_from_world) for light in scene.lights]
    return {
        "lit_from_texture": float32(box.world_from_texture if in_world else np.eye(4)),
        "normal_from_gradient": float32(scene.volume.index_from_world[:3, :3].T if in_world else np.eye(3)),
        "kinds": [KINDS[light.kind] for light in scene.lights],
        # Flat: three lights of three numbers are no matrix.
        "lights": (np.array([light.color for light in scene.lights]) / base[:, None]).ravel(),
        "vectors": np.ravel(vectors),
        "falloffs": far / base * square,
        "ambient": material.ambient,
        "diffuse": material.diffuse,
        "specular": material.specular,
        "shininess": material.shininess,
    }


def vector_of(light: Light, lit_from_world: np.ndarray) -> np.ndarray:
    """Where a point light is, or the unit vector towards a directional one."""
    if light.kind == "point":
        return (lit_from_world @ np.append(light.position, 1.0))[:3]
    if light.kind == "directional":
        towards = lit_from_world[:3, :3] @ -light.direction
        return towards / np.linalg.norm(towards)
    return np.zeros(3)


SUITS = frozenset({"parallel", "lit", "gradients"})
SYSTEM = System(draw, ("cej2020", "cej2020-printed"), SUITS, p99=1e-5, jitter=True, frames=4)
