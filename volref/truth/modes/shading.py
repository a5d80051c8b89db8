"""Isosurfaces in the light: the colour of points where rays meet them.

R rays.
"""

import numpy as np

from volref.arrays import Floats
from volref.planning import Plan
from volref.records import Rays
from volref.scene.scene import Scene
from volref.scene.transform import transform_points
from volref.stages.gradients import length_and_direction
from volref.stages.lighting import lit_colors
from volref.stages.sampling import PAD
from volref.truth.fields.shaded import ShadedField, shaded_field
from volref.workspace import Workspace

# The light is computed this much of a voxel before and behind the hit too.
NEARBY = 1e-6


class LitSurface:
    """The isosurface of a scene with its lights; its gradient is made ready once."""

    def __init__(self, scene: Scene, plan: Plan) -> None:
        self._field: ShadedField = shaded_field(scene, plan)

    def shade(
        self, rays: Rays, hit: Floats, off: Floats, rgba: Floats, bound: Floats
    ) -> tuple[Floats, Floats]:
        """Return rgba (R, 4) and bound (R,) with the surface lit where rays meet it, at `hit` (R,).

        `off` (R,) is how far the hit may be off.  The light may be off by as much as it changes from a little
        before to a little behind the hit: an estimate.
        """
        met = np.flatnonzero(np.isfinite(hit))
        here = Rays(rays.origins[met], rays.directions[met])
        color = rgba[met, :3].T
        lit = self._lit(here, hit[met], color)
        away = NEARBY * min(self._field.volume.spacing) + np.where(np.isfinite(off[met]), off[met], 0.0)
        beside = [self._lit(here, hit[met] + way * away, color) for way in (-1.0, 1.0)]
        change = np.maximum(*(np.abs(other - lit).max(axis=0) for other in beside))
        shaded, wider = rgba.copy(), bound.copy()
        shaded[met, :3] = lit.T
        # Where it is not certain that a ray meets the surface, its contrast to what lies behind is new too.
        sure = np.isfinite(off)
        wider[met] += np.where(sure[met], 0.0, np.abs(lit - color).max(axis=0)) + change
        missed = np.flatnonzero(~sure & ~np.isfinite(hit))
        wider[missed] = np.maximum(wider[missed], self._field.color_limit)
        return shaded, wider

    def _lit(self, rays: Rays, distance: Floats, colors: Floats) -> Floats:
        """Return the lit colours (3, R) of the points at a distance along rays."""
        field = self._field
        points = (rays.origins + distance[:, None] * rays.directions).T
        position = transform_points(field.space_from_world, points.T).T + PAD
        _, upwards = length_and_direction(field.gradient_at(position, Workspace()))
        return lit_colors(field.lights, field.material, points, -upwards, -rays.directions.T, colors)
