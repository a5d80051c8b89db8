"""Intervals of lit samples: what a device draws lies inside, highlights among it."""

import dataclasses

import numpy as np
import pytest

import volref as vr
from tests.webgl.scenes import EXAMPLES

LIT = vr.pipelines()["texture3d"].with_switches("lit", lighting={"model": "lit", "gradient": "central"})


@pytest.mark.parametrize("example", ["lit", "lit from near"])
@pytest.mark.parametrize("device", ["exact", "swiftshader"])
def test_highlights_that_no_colour_dims_are_inside(example, device):
    scene = dataclasses.replace(EXAMPLES[example].make(), width=12, height=9)
    image = vr.emulate(scene, LIT, device).rgba
    accepted = vr.accept(scene, LIT, device)
    assert np.ptp(image[..., :3]) > 0.1
    assert vr.check(image, accepted).status == "inside"


def test_a_device_that_leaves_nothing_free_is_accepted_to_the_bit():
    scene = dataclasses.replace(EXAMPLES["lit from near"].make(), width=12, height=9)
    accepted = vr.accept(scene, LIT, "exact")
    # Sums in another order: 1e-12 is a thousand roundings of numbers about 1.
    np.testing.assert_allclose(accepted.raw_lo, accepted.raw_hi, rtol=0, atol=1e-12)
