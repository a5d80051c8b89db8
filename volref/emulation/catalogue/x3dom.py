"""x3dom's VolumeData node, the descendant of seed 001 (github.com/x3dom/x3dom, VolumeRendering component).

One pass over the box: a fragment's varying is where its ray enters, the rest is the eye's.  85 steps of
1.4142 / 85 in texture space, whatever the box's sides are; the loop stops behind the box.  The atlas has no
clamp of any kind.  Only the style without light is here: OpacityMapVolumeStyle, colour times 1.2.
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

STEPS = 85
DIAGONAL = 1.4142  # of a face of the unit cube; its own is 1.7321, and longer rays are cut short

PIPELINES = (
    Pipeline(
        "x3dom",
        "one pass over the front faces, at most 85 steps of 1.4142 / 85, atlas without clamps",
        "x3dom, src/nodes/VolumeRendering/X3DVolumeDataNode.js and OpacityMapVolumeStyle.js",
        rays=RaySetup(kind="front-face"),
        stepping=Stepping(
            rule="texture-length",
            steps=STEPS,
            length=DIAGONAL / STEPS,
            advance="add",
            end="outside",
            cap=STEPS,
            opaque_at=1.0,
        ),
        volume=VolumeTexture(layout="atlas", format="unorm8", slices="count", second_slice="unclamped"),
        table=TableTexture(size=256, coordinate="direct"),
        opacity=SampleOpacity(source="table", rule="per-step"),
        lighting=Lighting(factor=1.2),
        accumulation=Accumulation(rule="over"),
        meshes=MeshCut(kind="none"),
        output=Output(blend="additive-alpha"),
    ),
)
