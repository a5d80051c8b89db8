"""What is tried and how well it explains: faults with strengths, alone or together, in the order of belief.

What explains more comes first.  Where two explain equally well, to a two hundredth, the simpler one does: one
fault before two, one at a strength that it is listed with before one whose strength was fitted, the earlier
one of the table before the later one.
"""

from dataclasses import dataclass

import numpy as np

from volref.oracle.faults.fault import Fault
from volref.oracle.faults.table import FAULTS

PLACES = {key: place for place, key in enumerate(FAULTS)}

# What one more number is worth: a fitted strength, and five times that a second fault.
FITTED_COST, FAULT_COST = 0.005, 0.025


@dataclass(frozen=True)
class Part:
    """A fault at a strength."""

    fault: Fault
    strength: float

    @property
    def fitted(self) -> bool:
        """Whether the strength is none of those that are listed."""
        return self.strength not in self.fault.strengths


@dataclass(frozen=True)
class Finding:
    """Faults, one or two, and the share of what is outside that they explain."""

    parts: tuple[Part, ...]
    explained: float

    @property
    def key(self) -> str:
        """The faults' keys."""
        return " + ".join(part.fault.key for part in self.parts)

    @property
    def rows(self) -> tuple[str, ...]:
        """The faults' rows in the table: O1 of O1-stale."""
        return tuple(part.fault.key.partition("-")[0] for part in self.parts)

    @property
    def belief(self) -> float:
        """What is explained, less the price of what it took."""
        fitted = sum(part.fitted for part in self.parts)
        return self.explained - FITTED_COST * fitted - FAULT_COST * (len(self.parts) - 1)


def ranked(findings: list[Finding]) -> list[Finding]:
    """Return findings, the best strength of each, in the order of belief."""
    best: dict[str, Finding] = {}
    for one in findings:
        if one.key not in best or one.belief > best[one.key].belief:
            best[one.key] = one
    return sorted(best.values(), key=_order)


def _order(one: Finding) -> tuple[float, list[int]]:
    level = -round(one.belief / FITTED_COST) if np.isfinite(one.belief) else np.inf
    return level, [PLACES[part.fault.key] for part in one.parts]
