"""Isosurfaces in the light: the colour of points where rays meet them.

R rays.
"""

import numpy as np

from volref.arrays import Floats
from volref.planning import Plan
from volref.records import Rays
from volref.scene.scene import Scene
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
        # Where it is not certain that a ray meets the surface, the contrast to what lies behind changes too.
        wider[met] = np.where(bound[met] > 0, bound[met] + np.abs(lit - color).max(axis=0), 0.0) + change
        return shaded, wider

    def _lit(self, rays: Rays, distance: Floats, colors: Floats) -> Floats:
        """Return the lit colours (3, R) of the points at a distance along rays."""
        field = self._field
        points = (rays.origins + distance[:, None] * rays.directions).T
        matrix = field.space_from_world
        position = np.stack(
            [row[0] * points[0] + row[1] * points[1] + row[2] * points[2] + row[3] for row in matrix[:3]]
        )
        gradient = field.gradient_at(position + PAD, Workspace())
        length = np.sqrt(gradient[0] ** 2 + gradient[1] ** 2 + gradient[2] ** 2)
        normals = -gradient / np.where(length > 0, length, 1.0)
        return lit_colors(field.lights, field.material, points, normals, -rays.directions.T, colors)
