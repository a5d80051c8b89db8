"""The base of seed 003 in real WebGL: where its alpha gets to 1, the last bits of alpha make the image."""

import dataclasses

import numpy as np
import pytest

from tests.webgl.cases import Case, compared, jitter_of
from tests.webgl.scenes import EXAMPLES
from tests.webgl.systems import burkalo
from volref.emulation.catalogue import named
from volref.emulation.device import Device
from volref.emulation.passes import emulate

SCENES = ("oblique", "turned", "dense", "full", "inside")


def pixels(engine, name, pipeline):
    """What the engine draws of a scene, and the scene and its start offsets."""
    scene = EXAMPLES[name].make()
    jitter = jitter_of(burkalo.BASE, scene)
    return burkalo.draw(engine, scene, pipeline, jitter=jitter)["canvas"], scene, jitter


@pytest.mark.parametrize("name", ["oblique", "full"])
def test_what_differs_hangs_on_a_comparison(webgl, name):
    found = compared(webgl, Case(burkalo.BASE, "mpilia2018", "unorm8", name))["canvas"]
    assert found.unexplained == 0, found


@pytest.mark.parametrize("name", SCENES)
def test_rays_that_never_get_opaque_are_the_same(webgl, name):
    # Alpha is never 2: every ray ends at its exit, and the last bits of alpha decide nothing.
    pipeline = named("mpilia2018").with_switches(output={"format": "float"}, stepping={"opaque_at": 2.0})
    theirs, scene, jitter = pixels(webgl, name, pipeline)
    ours = emulate(scene, pipeline, Device.named(webgl.name), jitter).rgba
    apart = np.abs(ours - theirs).max(axis=-1)[theirs[..., 3] == 1]
    assert np.percentile(apart, 50) <= 1e-6
    assert np.percentile(apart, 99) <= 1e-5


@pytest.mark.parametrize("name", SCENES)
def test_colours_in_float32_too_are_mesas_to_the_last_bits(engine_of, name):
    engine = engine_of("llvmpipe")
    pipeline = named("mpilia2018").with_switches(output={"format": "float"})
    theirs, scene, jitter = pixels(engine, name, pipeline)
    device = dataclasses.replace(Device.named("llvmpipe"), values="float32")
    ours = emulate(scene, pipeline, device, jitter).rgba
    assert np.percentile(np.abs(ours - theirs), 99) <= 1e-6


def test_two_implementations_draw_two_images_of_one_scene(engine_of):
    pipeline = named("mpilia2018")
    one, other = (pixels(engine_of(name), "oblique", pipeline)[0] for name in ("swiftshader", "llvmpipe"))
    apart = np.abs(one.astype(int) - other).max(axis=-1)
    assert apart.max() > 80
    assert (apart > 1).sum() > 200
