"""VPT on real WebGL beyond what all systems are held to: one frame, and what its own shader counts."""

import numpy as np
import pytest

from tests.webgl.scenes import EXAMPLES
from tests.webgl.systems.vpt import draw
from volref.emulation.catalogue import named
from volref.emulation.device import Device
from volref.emulation.passes import emulate

VPT = named("vpt-eam")


@pytest.mark.parametrize("name", ["oblique", "eleven slices", "dense", "inside", "parallel"])
def test_of_one_frame_the_mean_is_the_frame(webgl, name):
    scene = EXAMPLES[name].make()
    jitter = np.full((1, scene.height, scene.width), 0.37)
    ours = emulate(scene, VPT, Device.named(webgl.name), jitter).passes
    theirs = draw(webgl, scene, VPT, jitter=jitter)
    np.testing.assert_array_equal(theirs["running_mean"], theirs["frame"])
    for pass_name in ("frame", "running_mean", "canvas"):
        # Half a byte away from both, float32's last digit decides: on some pixels in ten thousand.
        same = (np.rint(255 * ours[pass_name]) == theirs[pass_name]).all(axis=-1)
        assert same.mean() >= 0.995


@pytest.mark.parametrize(("steps", "count"), [(64, 64), (99, 99), (100, 101), (200, 201), (201, 201)])
def test_the_shader_takes_as_many_samples_as_float32_counts(webgl, steps, count):
    scene = EXAMPLES["full"].make()
    # So faint that no digit of alpha is lost: alpha is proportional to the count.
    pipeline = VPT.with_switches(
        stepping={"steps": steps},
        opacity={"factor": 1e-3},
        accumulation={"alpha": "accumulated"},
        output={"format": "float", "mean_format": "float"},
    )
    found = emulate(scene, pipeline, Device.named(webgl.name))
    theirs = draw(webgl, scene, pipeline)["frame"]
    drawn = found.samples > 0
    assert set(found.samples[drawn].tolist()) == {count}
    # One sample more or less would be some 1 / 200 of it; rays that graze an edge are 5e-4 off, and short.
    ratio = theirs[drawn][:, 3].sum() / found.passes["frame"][drawn][:, 3].sum()
    assert ratio == pytest.approx(1, abs=1e-4)
