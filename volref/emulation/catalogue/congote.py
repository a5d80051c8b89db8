"""Seed 001: Congote and others, "Volume Ray Casting in WebGL", 2012.

Two passes draw the colour cube into RGB8 targets; the last one walks a fixed number of steps between them
through an atlas of slices.  `congote2012-printed` is the chapter to the letter: the row of a tile by eq. 8
and 10, the column of the second slice by eq. 9, slices mixed by x (eq. 17), the opacity of the value itself
(eq. 1), alpha added without what is in front (eq. 4) and set to 1 when all is done.  `congote2012` has these
put right.
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
    "congote2012",
    "two passes over an RGB8 colour cube, atlas, opacity by the number of steps",
    "Congote et al. 2012, Volume Ray Casting in WebGL, eq. 1 to 17 put right",
    rays=RaySetup(kind="coordinates", front="target", format="unorm8"),
    stepping=Stepping(rule="count", steps=200, advance="add", end="count", opaque_at=1.0),
    volume=VolumeTexture(layout="atlas", format="unorm8", slices="count", second_slice="unclamped"),
    table=TableTexture(size=256, baked="centers", coordinate="direct"),
    opacity=SampleOpacity(source="table", rule="per-step"),
    accumulation=Accumulation(rule="over"),
    meshes=MeshCut(kind="none"),
    output=Output(blend="premultiplied", precision="mediump"),
)

PRINTED = WORKING.with_switches(
    "congote2012-printed",
    volume={"tile_row": "printed", "second_column": "printed", "between": "x"},
    opacity={"source": "value"},
    accumulation={"rule": "add-alpha", "alpha": "one"},
)

PIPELINES = (WORKING, PRINTED)
