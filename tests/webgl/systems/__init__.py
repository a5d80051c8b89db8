"""The systems of the catalogue in GLSL, written from their papers: a second implementation of each."""

from tests.webgl.systems import burkalo, cej, congote

SYSTEMS = (congote.SYSTEM, burkalo.SYSTEM, cej.SYSTEM)
