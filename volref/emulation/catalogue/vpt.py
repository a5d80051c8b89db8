"""VPT's emission-absorption renderer (EAM), the base of seed 004: Lesar and others (github.com/terier/vpt).

One triangle covers the screen; near and far plane are unprojected into the unit cube of texture space, and a
slab test cuts the ray.  Each ray has the same number of samples, at an offset that is drawn anew for each
frame and is the same for all pixels of it.  Frames and their running mean are RGBA8; a tone map, "artistic"
by default, draws the mean on the canvas.  Alpha is 1 everywhere: what is accumulated stays in the shader.
"""

from volref.emulation.groups import (
    Accumulation,
    MeshCut,
    Output,
    RaySetup,
    SampleOpacity,
    Stepping,
    TableTexture,
    VolumeTexture,
)
from volref.emulation.pipeline import Pipeline

PIPELINES = (
    Pipeline(
        "vpt-eam",
        "slab test, the same number of samples on every ray, a mean of frames in 8 bits, tone map",
        "VPT, src/glsl/renderers/EAMRenderer.glsl and src/glsl/tonemappers/ArtisticToneMapper.glsl",
        rays=RaySetup(kind="slab", direction="unproject"),
        stepping=Stepping(
            rule="count", steps=64, jitter=True, advance="parameter", end="parameter", opaque_at=0.99
        ),
        volume=VolumeTexture(layout="3d", format="unorm8"),
        table=TableTexture(size=256, coordinate="direct", srgb=True),
        opacity=SampleOpacity(source="table", rule="per-length"),
        accumulation=Accumulation(rule="over", alpha="one", normalize="above-one"),
        meshes=MeshCut(kind="none"),
        output=Output(tone_map="artistic", gamma=2.2, blend="none", missed="black", mean_format="unorm8"),
    ),
)
