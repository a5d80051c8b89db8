"""Seed 002: Barbagallo, "WebGL Volume Rendering made simple", the article and today's page.

Two passes: the box's back faces go to a float target as coordinates, its front faces are walked from their
varying on, by steps of one length in texture space.  The value itself is the opacity; the table has colours
only and is looked up in both slices, which are then mixed.

`barbagallo-article` is the article to the letter: exits are read with a linear filter, alpha is added without
what is in front, at most 512 steps.  `barbagallo` is the page that is served today: exits are read as they
are, fragments without one are left, opacity is divided by the number of steps, at most 887 steps.
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

PAGE = Pipeline(
    "barbagallo",
    "two passes over float coordinates, atlas in PNG alpha, colours of two slices mixed",
    "Barbagallo, WebGL Volume Rendering made simple: the page as it is served today",
    rays=RaySetup(kind="coordinates", front="varying", no_exit="left", format="float", filter="nearest"),
    stepping=Stepping(
        rule="texture-length", steps=256, advance="add", end="length-after", cap=887, opaque_at=1.0
    ),
    volume=VolumeTexture(
        layout="atlas",
        format="unorm8",
        channel="alpha",
        first_tile="v1",
        rows="with-v",
        tile_column="mod",
        slices="last",
        second_slice="clamped",
    ),
    table=TableTexture(size=256, baked="canvas", coordinate="direct", last_column="empty", order="per-slice"),
    opacity=SampleOpacity(source="value", rule="per-step", factor=25.6),
    accumulation=Accumulation(rule="over", alpha="weighted"),
    meshes=MeshCut(kind="none"),
    output=Output(blend="none", precision="mediump"),
)

ARTICLE = PAGE.with_switches(
    "barbagallo-article",
    rays={"filter": "linear", "no_exit": "walked"},
    stepping={"cap": 512},
    opacity={"rule": "as-is", "factor": 1.0},
    accumulation={"rule": "add-alpha"},
)

PIPELINES = (PAGE, ARTICLE)
