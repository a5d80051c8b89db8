"""A field: where it lies, and what it looks like at samples.

n samples, b corners; n = S b, S rows of one sample for each corner.
"""

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from volref.arrays import Floats, Indices
from volref.planning import Plan
from volref.scene.volume import Volume
from volref.workspace import Workspace


@dataclass(frozen=True, eq=False)
class Samples:
    """Points of a field's padded space: position (3, n), counted from the whole numbers corner (3, b).

    towards_viewer (3, b): unit world directions, or (0, b) where the field does not ask for them.
    """

    position: Floats
    corner: Indices
    towards_viewer: Floats

    def absolute(self) -> Floats:
        """Return the positions (3, n) counted from 0."""
        corners = self.corner.shape[1]
        return np.asarray((self.position.reshape(3, -1, corners) + self.corner[:, None]).reshape(3, -1))

    def viewer_of(self, chosen: Indices) -> Floats:
        """Return the directions towards the viewer (3, k) of the samples `chosen` (k,)."""
        return np.asarray(self.towards_viewer.take(chosen % self.corner.shape[1], axis=1))


@dataclass(frozen=True, eq=False)
class Field(ABC):
    """A volume made ready to be sampled and classified along rays.

    space_from_world: 4x4 matrix to the space of the field, index space for a volume on a grid.
    low, high: its box there.
    reach: more units of that space than a block of segments goes along any axis.
    color_limit: no colour is brighter.
    interpolation, unit_distance: what `look` returns as the strength of samples, "extinction" per world unit
    or "opacity" per unit distance.
    dtype: in what it computes.
    """

    space_from_world: Floats
    low: Floats
    high: Floats
    reach: int
    color_limit: float
    interpolation: str
    unit_distance: float
    dtype: np.dtype[Any]

    # Whether `look` needs the directions towards the viewer.
    sees_viewer: ClassVar[bool] = False

    @abstractmethod
    def look(self, samples: Samples, work: Workspace) -> tuple[Floats, Floats]:
        """Return the straight colours (c, n) and the strength (n,) of samples; may destroy their positions.

        The result may lie in `work` until the next call.
        """


def reach_of(plan: Plan, space_from_world: Floats) -> int:
    """Return more units than a block of segments goes along any axis of a space."""
    furthest = float(np.linalg.norm(space_from_world[:3, :3], axis=1).max())
    return math.ceil(plan.step * plan.block * furthest) + 1


def box_of(volume: Volume) -> dict[str, Any]:
    """Return the fields that say where a volume on a grid lies."""
    low, high = volume.index_bounds
    return {"space_from_world": volume.index_from_world, "low": low, "high": high}
