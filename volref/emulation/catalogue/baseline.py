"""`texture3d`: a clean modern renderer, the baseline that a team's own program can be held against.

One pass, a slab test from the eye, a 3-D texture, steps of one world length with a sample in the middle of
each, the last one partial; opacity corrected for the step's length; premultiplied *over*, front to back.
"""

from volref.emulation.groups import Accumulation, MeshCut, RaySetup, SampleOpacity, Stepping, VolumeTexture
from volref.emulation.pipeline import Pipeline

PIPELINES = (
    Pipeline(
        "texture3d",
        "a clean modern renderer: 3-D texture, middle of each step, corrected opacity",
        "volref",
        rays=RaySetup(kind="slab", direction="eye"),
        stepping=Stepping(rule="world-length", offset=0.5, advance="multiply", opaque_at=0.999),
        volume=VolumeTexture(layout="3d", format="unorm8"),
        opacity=SampleOpacity(rule="corrected"),
        accumulation=Accumulation(rule="over"),
        meshes=MeshCut(kind="distance"),
    ),
)
