"""Fields that are classified before they are interpolated: at the samples, or in each slice.

A program that looks its samples up first interpolates colours, and blurs what the transfer function tells
apart; one that looks up in each slice does so along z only.

Mixing leaves 0..1 nowhere, beyond which an opacity has no logarithm: below + part (above - below) has a part
that is less than 1 by at least as much as the difference can be too large.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from volref.arrays import Floats
from volref.planning import Plan
from volref.scene.scene import Scene
from volref.scene.transfer import TransferFunction
from volref.scene.volume import Volume
from volref.stages.classify import Table, classify, lookup_table
from volref.stages.sampling import Grid, grid_of, padded_samples, trilinear
from volref.truth.fields.field import Field, Samples, box_of, reach_of
from volref.workspace import Workspace


@dataclass(frozen=True, eq=False)
class PreclassifiedField(Field):
    """Grids of red, green, blue and the strength, each of the samples."""

    channels: tuple[Grid, ...]

    def look(self, samples: Samples, work: Workspace) -> tuple[Floats, Floats]:
        """Return the interpolated straight colours (3, n) and strength (n,)."""
        position = samples.absolute()
        found = np.stack([trilinear(grid, position.copy(), work).copy() for grid in self.channels])
        return found[:3], found[3]


@dataclass(frozen=True, eq=False)
class SlicedField(Field):
    """A grid of samples and a table; looked up in the slices before and behind, then interpolated along z."""

    grid: Grid
    table: Table

    def look(self, samples: Samples, work: Workspace) -> tuple[Floats, Floats]:
        """Return the straight colours (3, n) and strength (n,) mixed of those in the two slices."""
        position = samples.absolute()
        before = np.floor(position[2])
        share = position[2] - before
        found = []
        for layer in (0.0, 1.0):
            position[2] = before + layer
            colors, strength = classify(self.table, trilinear(self.grid, position.copy(), work), work)
            found.append(np.concatenate([colors, strength[None]]))
        mixed = found[0] + share * (found[1] - found[0])
        return mixed[:3], mixed[3]


def preclassified_field(scene: Scene, plan: Plan) -> PreclassifiedField:
    """Prepare the volume of `scene`: a look-up of every sample, and four grids."""
    volume, transfer = scene.gridded
    table = lookup_table(transfer, volume.value_bounds)
    classified = np.empty((4, *volume.values.shape))
    for layer, channels in zip(volume.values, classified.transpose(1, 0, 2, 3), strict=True):
        colors, strength = classify(table, layer.astype(np.float64).ravel(), Workspace())
        channels[:3] = colors.reshape(3, *layer.shape)
        channels[3] = strength.reshape(layer.shape)
    return PreclassifiedField(
        **_common(volume, transfer, plan), channels=tuple(padded_samples(part) for part in classified)
    )


def sliced_field(scene: Scene, plan: Plan) -> SlicedField:
    """Prepare the volume of `scene` as the plain field does."""
    volume, transfer = scene.gridded
    table = lookup_table(transfer, volume.value_bounds)
    return SlicedField(**_common(volume, transfer, plan), grid=grid_of(volume), table=table)


def _common(volume: Volume, transfer: TransferFunction, plan: Plan) -> dict[str, Any]:
    return box_of(volume) | {
        "reach": reach_of(plan, volume.index_from_world),
        "color_limit": float(transfer.colors.max()),
        "interpolation": transfer.interpolation,
        "unit_distance": transfer.unit_distance,
        "dtype": np.dtype(np.float64),
    }
