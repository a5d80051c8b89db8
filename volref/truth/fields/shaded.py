"""A field whose look depends on its gradient: lights, gradient opacity, tables of value and gradient.

The gradient is taken only where something is seen.  Positions are padded, (3, n).
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from volref.arrays import Floats, Indices
from volref.planning import Plan
from volref.scene.lights import Light, Material
from volref.scene.scene import Scene
from volref.scene.transfer import TransferFunction
from volref.scene.transfer2d import TransferFunction2D
from volref.scene.volume import Volume
from volref.stages.classify import Table, classify, lookup_table
from volref.stages.gradients import cell_gradient, in_world, length_and_direction, sobel
from volref.stages.lighting import brightest_lit, lit_colors
from volref.stages.lookup2d import gradient_factor, lookup_2d
from volref.stages.sampling import PAD, Grid, cell_corners, grid_of, padded_samples, trilinear
from volref.truth.fields.field import Field, Samples, box_of, reach_of
from volref.workspace import Workspace


@dataclass(frozen=True, eq=False)
class ShadedField(Field):
    """A grid of samples, how its gradient is taken, and what is done with it.

    table: of the value; of a two-dimensional transfer function that of its envelope, which says where
    anything can be seen.  sobel: the grids of the three components, if these are taken.
    """

    volume: Volume
    transfer: TransferFunction | TransferFunction2D
    lights: tuple[Light, ...]
    material: Material
    gradient: str
    grid: Grid
    table: Table
    sobel: tuple[Grid, ...]

    sees_viewer: ClassVar[bool] = True

    def look(self, samples: Samples, work: Workspace) -> tuple[Floats, Floats]:
        """Return the colours (3, n) and the strength (n,)."""
        position = samples.absolute()
        values = trilinear(self.grid, position.copy(), work).copy()
        colors, strength = classify(self.table, values, work)
        seen = np.flatnonzero(strength > 0)
        gradient = self.gradient_at(position.take(seen, axis=1), work)
        magnitude, uphill = length_and_direction(gradient)
        if isinstance(self.transfer, TransferFunction2D):
            seen_colors, strength[seen] = lookup_2d(self.transfer, values.take(seen), magnitude)
        else:
            seen_colors = colors.take(seen, axis=1)
            strength[seen] *= gradient_factor(self.transfer, magnitude)
        if self.lights:
            points = self._in_the_world(position.take(seen, axis=1))
            viewer = samples.viewer_of(seen)
            # Outwards: from the greater values to the lesser.
            seen_colors = lit_colors(self.lights, self.material, points, -uphill, viewer, seen_colors)
        colors[:, seen] = seen_colors
        return colors, strength

    def gradient_at(self, position: Floats, work: Workspace) -> Floats:
        """Return the world gradient (3, n) at padded positions."""
        if self.gradient == "sobel":
            components = [trilinear(grid, position.copy(), work).copy() for grid in self.sobel]
            return in_world(np.stack(components), self.volume.index_from_world)
        if self.gradient == "analytic":
            return in_world(self._cell_gradient(position), self.volume.index_from_world)
        return in_world(self._central_gradient(position, work), self.volume.index_from_world)

    def _central_gradient(self, position: Floats, work: Workspace) -> Floats:
        """Return the central differences of the samples, interpolated.

        They are the central differences of the interpolated field, which is linear in the samples.
        """
        last = np.array(self.volume.size, np.float64)[:, None]
        inside = np.clip(position, PAD, last - 1 + PAD)
        gradient = np.empty_like(position)
        for axis in range(3):
            ends = []
            for way in (1.0, -1.0):
                moved = inside.copy()
                np.clip(inside[axis] + way, PAD, last[axis] - 1 + PAD, out=moved[axis])
                ends.append(trilinear(self.grid, moved, work).copy())
            np.subtract(ends[0], ends[1], out=gradient[axis])
        gradient *= 0.5
        return gradient

    def _cell_gradient(self, position: Floats) -> Floats:
        """Return the gradient of the interpolated field itself; on a face that of the cell behind it."""
        whole: Indices = np.floor(position).astype(np.intp)
        if self.volume.centering == "node":
            # The outer faces are those of the cells within: nothing lies beyond them, not even by rounding.
            np.clip(whole, PAD, np.array(self.volume.size)[:, None] - 2 + PAD, out=whole)
        return cell_gradient(cell_corners(self.grid, list(whole)), position - whole)

    def _in_the_world(self, position: Floats) -> Floats:
        matrix = self.volume.world_from_index
        x, y, z = position - PAD
        return np.stack([row[0] * x + row[1] * y + row[2] * z + row[3] for row in matrix[:3]])


def shaded_field(scene: Scene, plan: Plan) -> ShadedField:
    """Prepare the volume of `scene`; Sobel's operator costs three passes and three grids."""
    volume, transfer = scene.volume, scene.transfer
    assert isinstance(volume, Volume)
    assert transfer is not None
    material = scene.material or Material()
    brightest, lights = float(scene.envelope.colors.max()), scene.lights if scene.lights_volume else ()
    components: tuple[Grid, ...] = ()
    if scene.gradient == "sobel":
        components = tuple(padded_samples(sobel(volume.values, axis)) for axis in range(3))
    return ShadedField(
        **box_of(volume),
        reach=reach_of(plan, volume.index_from_world),
        color_limit=brightest_lit(lights, material, brightest) if lights else brightest,
        interpolation=transfer.interpolation,
        unit_distance=transfer.unit_distance,
        dtype=np.dtype(np.float64),
        volume=volume,
        transfer=transfer,
        lights=lights,
        material=material,
        gradient=scene.gradient,
        grid=grid_of(volume),
        table=lookup_table(scene.envelope, volume.value_bounds),
        sobel=components,
    )
