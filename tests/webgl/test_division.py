"""Divisions by numbers that the compiler knows, held to device presets: they decide where slices change."""

import numpy as np

from tests.webgl.computing import computed
from volref.emulation.device import Device


def test_a_known_divisor_is_multiplied_with_where_the_preset_says_so(every_webgl):
    inputs = np.random.default_rng(0).random(4096, np.float32)
    drawn = computed(every_webgl, "c = x / 200.0;", inputs)[:, 0]
    products, quotients = inputs * (np.float32(1) / np.float32(200)), inputs / np.float32(200)
    multiplied = Device.named(every_webgl.name).constant_divisor == "multiplied"
    np.testing.assert_array_equal(drawn, products if multiplied else quotients)
    # The other one would not do.
    assert (products != quotients).mean() > 0.1
