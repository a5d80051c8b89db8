"""Seed 000: Arbelaz and others, "Volume rendering ... with intersected 3D geometry", 2016.

Five passes: depth of the meshes, their colour, depth of the box's back, its coordinates, and the last one,
which draws the meshes and then the box's front faces, whose rays end where they meet a mesh.
`arbelaz2016-printed` is section 3.2 and 3.3 to the letter.  `arbelaz2016` has put right: a depth that is
linear along the ray, as its step is; its packing; the test at the surface instead of one step before it; the
object behind what has been accumulated; the blending of a premultiplied colour; an end by count.

The paper names no number of steps, no rule of opacity and no size of the table: 200, seed 001's and 256 are
readings, as is seed 001's atlas.
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

SOURCE = "Arbelaz, Moreno and Kabongo 2016, Deployment of volume rendering interactive visualizations"

WORKING = Pipeline(
    "arbelaz2016",
    "five passes with opaque meshes inside the volume, depth packed into bytes",
    SOURCE + ", put right",
    rays=RaySetup(kind="coordinates", front="varying", format="unorm8"),
    stepping=Stepping(rule="count", steps=200, advance="add", end="count", opaque_at=1.0),
    volume=VolumeTexture(layout="atlas", format="unorm8", slices="count", second_slice="unclamped"),
    table=TableTexture(size=256, baked="centers", coordinate="direct"),
    opacity=SampleOpacity(source="table", rule="per-step"),
    accumulation=Accumulation(rule="over"),
    meshes=MeshCut(kind="depth", depth="linear", packing="working", comparison="at", composition="over"),
    output=Output(blend="premultiplied", precision="mediump"),
)

PRINTED = WORKING.with_switches(
    "arbelaz2016-printed",
    stepping={"end": "outside-above", "cap": 200},
    meshes={
        "depth": "window-over-w",
        "packing": "printed",
        "comparison": "one-step-early",
        "composition": "printed",
    },
    output={"blend": "straight"},
)

PIPELINES = (WORKING, PRINTED)
