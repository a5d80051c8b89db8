"""Which test chart tells the faults of a row from others, by the rows of the table of faults.

The charts themselves are made by `volref.golden.charts`; here are their names only.
"""

from types import MappingProxyType

SEPARATING = MappingProxyType(
    {
        "A1": "f-atlas",
        "A2": "ramp-by-bright",
        "A3": "ramp-by-bright",
        "G1": "f-shape",
        "G2": "opaque-border",
        "G3": "long-voxels-x",
        "G4": "f-shape",
        "G5": "turned",
        "G6": "f-shape",
        "O1": "long-voxels-x",
        "O2": "bright-back",
        "O3": "grey-slab",
        "O4": "long-voxels-y",
        "O5": "on-a-background",
        "T1": "bright-back",
        "T2": "opaque-border",
        "T3": "long-rays",
        "T4": "thin-slab",
        "J1": "lit-sphere",
        "L1": "two-entries",
        "L2": "spike",
        "L3": "checkers",
        "F1": "checkers",
        "F2": "fine-values",
        "F3": "spike",
        "F4": "no-data",
        "D1": "wide-sphere",
        "D2": "wide-sphere",
        "C1": "grey-slab",
        "B1": "on-a-background",
        "N1": "lit-sphere",
        "M1": "checkers",
    }
)


def charts_for(one: str, other: str) -> tuple[str, ...]:
    """Return the charts that tell faults of two rows apart, each once.

    Examples
    --------
    >>> charts_for("L1", "T4"), charts_for("O2", "T1")
    (('two-entries', 'thin-slab'), ('bright-back',))
    """
    return tuple(dict.fromkeys((SEPARATING[one], SEPARATING[other])))
