"""What one stage hands to the next.

R rays.  Distances t are in world units along unit directions from the ray's origin.
"""

from dataclasses import dataclass

from volref.arrays import Floats, Integers


@dataclass(frozen=True, eq=False)
class Rays:
    """Viewing rays in the world: origins (R, 3) and unit directions (R, 3)."""

    origins: Floats
    directions: Floats


@dataclass(frozen=True, eq=False)
class Spans:
    """The part of each ray that is integrated: t_near (R,) to t_far (R,), empty where t_near >= t_far."""

    t_near: Floats
    t_far: Floats


@dataclass(frozen=True, eq=False)
class Surface:
    """The nearest opaque surface at each pixel centre.

    distance (H, W): world distance from the ray's origin, +inf where there is none.
    color (H, W, 3): its working-space colour, 0 where there is none.
    mesh (H, W): index of the mesh in the scene, -1 where there is none.
    face (H, W): index of the triangle in that mesh's `faces`, -1 where there is none.
    """

    distance: Floats
    color: Floats
    mesh: Integers
    face: Integers
