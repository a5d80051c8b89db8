"""Seed 003: Burkalo, "Visualization of volumetric data", 2022, and its base: m-pilia/volume-raycasting.

One pass: a slab test along (x, y, -f), steps of one length in texture space from where the ray enters, a
cubic spline as a table, *over* until alpha is above 0.95, then a tone map and gamma.  There is no public code
of it.  `burkalo2022-printed` is the text to the letter: no aspect, the colour written as it is after gamma.
`burkalo2022` has the aspect, and meets the background as its base does.  `mpilia2018` is that base, whose sum
puts the deepest sample in front.
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

WORKING = Pipeline(
    "burkalo2022",
    "slab test along the focal length, spline as a table, stop above 0.95, tone map and gamma",
    "Burkalo 2022, Visualization of volumetric data; what it leaves open as in its base",
    rays=RaySetup(kind="slab", direction="focal"),
    stepping=Stepping(
        rule="texture-length",
        steps=200,
        advance="add",
        end="length-left",
        opaque_at=0.95,
        opaque_test="above",
    ),
    volume=VolumeTexture(layout="3d", format="unorm8"),
    table=TableTexture(size=256, baked="centers", coordinate="direct"),
    opacity=SampleOpacity(source="table", rule="as-is"),
    accumulation=Accumulation(rule="over"),
    meshes=MeshCut(kind="none"),
    output=Output(tone_map="reinhard", gamma=2.2, blend="shader"),
)

PRINTED = WORKING.with_switches(
    "burkalo2022-printed", rays={"direction": "focal-square"}, output={"blend": "none"}
)

BASE = Pipeline(
    "mpilia2018",
    "slab test along the focal length, jitter, the deepest sample in front, gamma",
    "m-pilia/volume-raycasting, shaders/alpha_blending.frag",
    rays=RaySetup(kind="slab", direction="focal"),
    stepping=Stepping(
        rule="texture-length", steps=200, jitter=True, advance="add", end="length-left", opaque_at=1.0
    ),
    volume=VolumeTexture(layout="3d", format="unorm8"),
    table=TableTexture(size=256, format="float", baked="ends", coordinate="centered"),
    opacity=SampleOpacity(source="table", rule="as-is"),
    accumulation=Accumulation(rule="reversed-over"),
    meshes=MeshCut(kind="none"),
    output=Output(gamma=2.2, blend="shader-straight"),
)

PIPELINES = (WORKING, PRINTED, BASE)
