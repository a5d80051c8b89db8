"""Seed 004: Cej, "Volumetric Ray Casting Implementation in VPT", 2020.

VPT's ray caster with a random start for each pixel and frame, a texture of value and gradient, a table of
value and gradient magnitude, lights and materials.  Frames and their running mean are RGBA8; the environment,
here the scene's background, is added in the shader.

`cej2020-printed` is the published code.  `cej2020` has four things put right that the paper does not say so:
the misprint in the kernel of z, bytes in which no gradient is 0, samples without a gradient left out, and
lights in texture space.
"""

from volref.emulation.groups import (
    Accumulation,
    Lighting,
    MeshCut,
    Output,
    RaySetup,
    SampleOpacity,
    Stepping,
    TableTexture,
    VolumeTexture,
)
from volref.emulation.pipeline import Pipeline

WORKING = Pipeline(
    "cej2020",
    "a random start for each ray, gradients in the texture, lights, a mean of frames in 8 bits",
    "Cej 2020, Volumetric Ray Casting Implementation in VPT, with its code's gradients put right",
    rays=RaySetup(kind="slab", direction="unproject"),
    stepping=Stepping(
        rule="count", steps=100, jitter=True, advance="parameter", end="parameter", opaque_at=0.999
    ),
    volume=VolumeTexture(layout="3d", format="unorm8"),
    table=TableTexture(size=256, rows=256, coordinate="direct"),
    opacity=SampleOpacity(source="table", rule="per-length"),
    lighting=Lighting(model="cej", gradient="sobel-bytes", zero="exact", flat="ambient", space="world"),
    accumulation=Accumulation(rule="over", alpha="one", normalize="above-one"),
    meshes=MeshCut(kind="none"),
    output=Output(blend="environment", mean_format="unorm8"),
)

PRINTED = WORKING.with_switches(
    "cej2020-printed",
    lighting={
        "gradient": "sobel-bytes-printed",
        "zero": "half",
        "flat": "skipped",
        "space": "texture",
    },
)

PIPELINES = (WORKING, PRINTED)
