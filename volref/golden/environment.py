"""What the digits of an image follow from beside its recipe: NumPy and the instruction sets it uses.

Additions, products, quotients and square roots are the same everywhere.  exp, log, sin and their kin are
within some ulp of each other, and NumPy picks their code by the processor when it starts: float64 `exp`
differs between AVX2 and AVX-512, float32 `exp` between SSE and AVX2.
"""

import platform
import re
from typing import Any

import numpy as np

# Functions of emulations whose code depends on the processor, as NumPy calls them.
FUNCTIONS = ("arccos", "arctan2", "cos", "exp", "expm1", "log", "log1p", "log2", "power", "sin", "tan")


def environment() -> dict[str, Any]:
    """Return what the digits follow from, as plain data: NumPy's version, machine, instruction sets.

    Examples
    --------
    >>> sorted(environment())
    ['blas', 'machine', 'numpy', 'simd']
    """
    pattern = f"^({'|'.join(FUNCTIONS)})$"
    found = np.lib.introspect.opt_func_info(func_name=pattern, signature="float(32|64)")
    simd = {
        f"{name}.{kind}": target["current"]
        for name, kinds in sorted(found.items())
        for kind, target in sorted(kinds.items())
    }
    return {"numpy": np.__version__, "machine": platform.machine(), "simd": simd, "blas": _blas()}


def _blas() -> str:
    """Return which BLAS multiplies matrices, without the folders it was built in."""
    config: Any = np.show_config(mode="dicts")
    found = config.get("Build Dependencies", {}).get("blas", {})
    return re.sub(r"[^A-Za-z0-9 ._-]", "", f"{found.get('name', 'none')} {found.get('version', '')}").strip()
