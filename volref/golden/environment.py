"""What the digits of an image follow from beside its recipe: NumPy, and what its functions return here.

Additions, products, quotients and square roots are the same everywhere.  exp, log, sin and their kin are
within some ulp of each other, and NumPy picks their code by the processor when it starts: float64 `exp`
differs between AVX2 and AVX-512, float32 `exp` between SSE and AVX2, `pow` between versions of the C library.
Products of matrices are summed in an order that the BLAS picks in the same way.  No list of versions names
all of that, so a probe is computed: equal digests of it, equal digits.
"""

import hashlib
import platform
from collections.abc import Iterator, Mapping
from functools import cache
from typing import Any

import numpy as np

from volref.arrays import Numbers

# Functions whose code depends on the processor, as NumPy calls them.
FUNCTIONS = ("arccos", "arcsin", "arctan", "cos", "exp", "expm1", "log", "log1p", "log2", "sin", "tan")

PROBES = 4096


def environment() -> dict[str, Any]:
    """Return what the digits follow from, as plain data.

    Examples
    --------
    >>> sorted(environment())
    ['digits', 'machine', 'numpy', 'simd']
    """
    found = np.lib.introspect.opt_func_info(func_name="^(exp|log|sin)$", signature="float(32|64)")
    simd = {
        f"{name}.{kind}": str(target["current"])
        for name, kinds in sorted(found.items())
        for kind, target in sorted(kinds.items())
    }
    return {"numpy": np.__version__, "machine": platform.machine(), "simd": simd, "digits": digits()}


def same_digits(one: Mapping[str, Any]) -> bool:
    """Whether an environment is as good as this one: its NumPy and what its functions return."""
    here = environment()
    return all(one.get(key) == here[key] for key in ("numpy", "digits"))


@cache
def digits() -> str:
    """Return the digest of what NumPy's functions and products of matrices return here."""
    found = hashlib.sha256()
    for array in _probe():
        found.update(np.ascontiguousarray(array, array.dtype.newbyteorder("<")).tobytes())
    return found.hexdigest()


def _probe() -> Iterator[Numbers]:
    # Multiples of the golden ratio: evenly spread over 0..1, and the same everywhere.
    spread = np.arange(1, PROBES + 1) * 0.6180339887498949 % 1.0
    for kind in (np.float32, np.float64):
        places: Numbers = spread.astype(kind)
        yield from (getattr(np, name)(places) for name in FUNCTIONS)
        yield from (np.power(places, kind(power)) for power in (0.37, 2.2, 5.0))
        yield np.arctan2(places, places[::-1])
        square: Numbers = places[:16].reshape(4, 4)
        points: Numbers = places.reshape(-1, 4)
        yield from (square @ square, points @ square, points[:, :3] @ square[:3, :3], square @ square[0])
        yield from (np.linalg.inv(square), np.linalg.norm(points, axis=1))
