"""The systems of the catalogue in GLSL, written from their papers: a second implementation of each."""

from tests.webgl.systems import barbagallo, burkalo, cej, congote, vpt, x3dom

SYSTEMS = (barbagallo.SYSTEM, congote.SYSTEM, burkalo.SYSTEM, cej.SYSTEM, vpt.SYSTEM, x3dom.SYSTEM)
