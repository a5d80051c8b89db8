"""atan(y, x) and acos(x): each implementation's own polynomial, held to what it computes."""

import numpy as np
import pytest

from tests.webgl.computing import computed
from volref.emulation.device import Device
from volref.emulation.textures.angles import arccosine, arctangent

POINTS = 4096


def places():
    """Points (N, 2) all around, near and far, those of the axes first."""
    rng = np.random.default_rng(11)
    turn, size = rng.uniform(-np.pi, np.pi, POINTS), rng.uniform(0.01, 0.9, POINTS)
    points = np.stack([size * np.sin(turn), size * np.cos(turn)], axis=1)
    points[:5] = (0.5, 0.5), (0.5, -0.5), (-0.5, 0.5), (-0.5, -0.5), (0.3, 0.2)
    return np.float32(points)


def test_arccosines_are_those_of_the_implementation(every_webgl):
    x = np.float32(np.random.default_rng(12).uniform(-1, 1, POINTS))
    got = computed(every_webgl, "c = vec4(acos(x.r));", x)[:, 0]
    # 1 ulp of pi: Mesa's compiler may fuse a product and a sum.
    np.testing.assert_allclose(arccosine(Device.named(every_webgl.name), x), got, rtol=0, atol=2.5e-7)


def test_arctangents_are_those_of_the_implementation(every_webgl):
    y, x = places().T
    got = computed(every_webgl, "c = vec4(atan(x.r, x.g));", places())[:, 0]
    np.testing.assert_allclose(arctangent(Device.named(every_webgl.name), y, x), got, rtol=0, atol=5e-7)


@pytest.mark.parametrize(
    ("name", "arccosines", "arctangents"),
    [("ideal", 2e-7, 2.4e-7), ("swiftshader", 6.8e-5, 3.1e-7), ("llvmpipe", 1.7e-4, 3.6e-6)],
)
def test_they_are_as_far_off_as_their_sources_say(name, arccosines, arctangents):
    """Abramowitz and Stegun give 6.7e-5 for 4.4.45."""
    device, (y, x) = Device.named(name), places().T
    numbers = np.linspace(-1, 1, 4001, dtype=np.float32)
    worst = np.abs(arccosine(device, numbers) - np.arccos(numbers.astype(np.float64))).max()
    assert worst <= arccosines
    worst = np.abs(arctangent(device, y, x) - np.arctan2(y.astype(np.float64), x)).max()
    assert worst <= arctangents
