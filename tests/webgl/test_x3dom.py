"""x3dom on real WebGL beyond what all systems are held to: the atlas as its older versions read it."""

import numpy as np
import pytest

from tests.webgl.scenes import EXAMPLES
from tests.webgl.systems.x3dom import draw
from volref.emulation.catalogue import named
from volref.emulation.device import Device
from volref.emulation.passes import emulate

OLDER = named("x3dom").with_switches(volume={"tile_row": "rows"}, output={"format": "float"})


@pytest.mark.parametrize("name", ["oblique", "eleven slices", "full", "inside"])
def test_older_versions_mix_up_the_same_tiles(webgl, name):
    scene = EXAMPLES[name].make()
    found = emulate(scene, OLDER, Device.named(webgl.name))
    theirs = draw(webgl, scene, OLDER)["canvas"]
    error = np.abs(found.rgba - theirs)[found.samples > 0].max(axis=-1)
    assert np.median(error) <= 1e-6
    assert np.quantile(error, 0.99) <= 1e-3
