"""Seed 004 beyond what `test_systems.py` draws: opacity by the gradient, one frame, gradients of noise."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from tests.webgl.figures import figures
from tests.webgl.scenes import EXAMPLES
from tests.webgl.systems.cej import SYSTEM, draw, gradient_volume
from volref.emulation.ambiguity import ambiguous
from volref.emulation.catalogue import named
from volref.emulation.device import Device
from volref.emulation.passes import emulate
from volref.emulation.textures.gradient_volume import with_gradient


@pytest.mark.parametrize("name", SYSTEM.pipelines)
@pytest.mark.parametrize("kind", ["unorm8", "float"])
@pytest.mark.parametrize("place", ["lit from near", "edges", "inside"])
def test_a_first_frame_with_opacity_by_the_gradient_is_the_one_that_webgl_draws(webgl, name, kind, place):
    scene, device = EXAMPLES[place].make(), Device.named(webgl.name)
    targets = {"format": kind, "mean_format": kind}
    pipeline = named(name).with_switches(opacity={"by_gradient": 8.0}, output=targets)
    jitter = np.random.default_rng(7).random((1, scene.height, scene.width), np.float32)
    ours = emulate(scene, pipeline, device, jitter).passes
    theirs = draw(webgl, scene, pipeline, jitter=jitter)
    for target in ("frame", "running_mean", "canvas"):
        found = figures(
            ours[target],
            theirs[target],
            lambda: ambiguous(scene, pipeline, device, jitter),
            scene.background,
        )
        said = f"{webgl.name}, {name}, {kind}, {place}, {target}: {found}"
        print(said)
        assert found.unexplained == 0, said
        if kind == "unorm8":
            assert found.exact >= 0.995, said
        else:
            assert found.percentile(50) <= 1e-6, said
            assert found.percentile(99) <= SYSTEM.p99, said


@pytest.mark.parametrize("name", SYSTEM.pipelines)
@pytest.mark.parametrize("most", [1, 255])
def test_gradients_of_noise_are_equal_byte_by_byte(webgl, name, most):
    """Bytes of 0 and `most` reach the largest gradients, and those of 0 and 1 all ties of the rounding."""
    pipeline = named(name)
    values = most * np.random.default_rng(1).integers(0, 2, (11, 12, 13), np.uint8)
    ours = with_gradient(values[..., None], pipeline.lighting, "unorm8")
    assert_array_equal(gradient_volume(webgl, values, pipeline), ours)
