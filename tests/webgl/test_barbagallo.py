"""Seed 002 held to real WebGL where the common scenes do not reach: mip levels, a far plane in the box."""

import dataclasses

import numpy as np
import pytest

from tests.webgl.scenes import EXAMPLES
from tests.webgl.systems import barbagallo
from volref import emulate
from volref.emulation.catalogue import named

FLOAT = {"format": "float"}


def apart(engine, scene, pipeline):
    """Largest difference of each drawn pixel's channels."""
    out = emulate(scene, pipeline, engine.name)
    theirs = barbagallo.draw(engine, scene, pipeline)["canvas"]
    drawn = (out.rgba != 0).any(axis=-1) | (theirs != 0).any(axis=-1)
    assert drawn.sum() > 400
    return np.abs(out.rgba - theirs)[drawn].max(axis=-1)


@pytest.mark.parametrize("scene", ["turned", "dense"])
def test_mip_levels_are_those_of_swiftshader(swiftshader, scene):
    pipeline = named("barbagallo").with_switches(output=FLOAT, table={"filter": "linear-mipmap"})
    error = apart(swiftshader, EXAMPLES[scene].make(), pipeline)
    assert np.median(error) <= 1e-6
    # Helpers beyond an edge are extrapolated by other arithmetic.
    assert np.percentile(error, 99) <= 1e-3
    plain = apart(swiftshader, EXAMPLES[scene].make(), named("barbagallo").with_switches(output=FLOAT))
    assert np.percentile(plain, 99) <= 1e-3


@pytest.mark.parametrize("name", barbagallo.SYSTEM.pipelines)
def test_a_far_plane_in_the_box_leaves_fragments_without_an_exit(webgl, name):
    scene = EXAMPLES["full"].make()
    low, high = scene.volume.corners.min(axis=0), scene.volume.corners.max(axis=0)
    far = float(1.6 * np.linalg.norm(high - low))  # the middle of the box
    scene = dataclasses.replace(scene, camera=dataclasses.replace(scene.camera, far=far))
    out = emulate(scene, named(name), webgl.name)
    back, front = (out.passes[f"{side}_coordinates"] for side in ("back", "front"))
    assert ((back == 0).all(axis=-1) & (front != 0).any(axis=-1)).sum() > 500
    error = apart(webgl, scene, named(name).with_switches(output=FLOAT))
    assert np.median(error) <= 1e-6
    assert np.percentile(error, 99) <= 1e-3
