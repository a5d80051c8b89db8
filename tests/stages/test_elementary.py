"""NumPy's exponentials and logarithms are as good as the certificate takes them to be."""

import mpmath as mp
import numpy as np
import pytest

ULPS = 2  # what the certificate grants them


def ulps_off(function, truth, arguments):
    values = function(arguments)
    with mp.workdps(40):
        exact = [truth(mp.mpf(float(x))) for x in arguments]
        return max(
            abs(mp.mpf(float(value)) - true) / mp.mpf(float(np.spacing(abs(value))))
            for value, true in zip(values, exact, strict=True)
        )


@pytest.mark.parametrize("size", [1e-300, 1e-17, 1e-8, 1e-3, 0.1, 1.0, 30.0, 700.0])
def test_exponentials_are_right_to_two_ulp(size):
    arguments = np.random.default_rng(1).uniform(-size, size, 500)
    assert ulps_off(np.exp, mp.exp, arguments) <= ULPS
    assert ulps_off(np.expm1, mp.expm1, arguments) <= ULPS


@pytest.mark.parametrize("size", [1e-300, 1e-17, 1e-8, 1e-3, 0.1, 0.5])
def test_logarithms_are_right_to_two_ulp(size):
    near_zero = np.random.default_rng(2).uniform(0.0, size, 500)
    assert ulps_off(np.log1p, mp.log1p, -near_zero) <= ULPS
    assert ulps_off(np.log, mp.log, near_zero) <= ULPS
