"""The systems of the catalogue in GLSL, written from their papers: a second implementation of each."""

from tests.webgl.systems import (
    arbelaz,
    barbagallo,
    burkalo,
    cej,
    congote,
    congote_radar,
    texture3d,
    vpt,
    x3dom,
)

SYSTEMS = (
    texture3d.SYSTEM,
    arbelaz.SYSTEM,
    barbagallo.SYSTEM,
    congote.SYSTEM,
    congote_radar.SYSTEM,
    burkalo.SYSTEM,
    cej.SYSTEM,
    vpt.SYSTEM,
    x3dom.SYSTEM,
)
