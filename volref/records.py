"""What one stage hands to the next.

R rays.  Distances t are in world units along unit directions from the ray's origin.
"""

from dataclasses import dataclass

import numpy as np

from volref.arrays import Floats, Indices, Integers


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


@dataclass(frozen=True, eq=False)
class Pieces:
    """n parts of rays, front to back along each ray, ray after ray; gaps between them are transparent.

    ray (n,): index of the ray in its chunk, rising.
    length (n,): world length.
    cubic (4, n): the value along the piece is the sum of cubic[j] v^j, from v = -1/2 (near) to 1/2 (far).
    slack (n,): how far the true value may be from that, but for the share `astray` (n,) of the piece, which
    may lie in the next cell. row (n,): the row of the models that holds on the piece, or -1 where it is yet
    to be found. edge (n,): the share of the piece where the value is within `slack` of the ends of that row,
    if exact.
    """

    ray: Indices
    length: Floats
    cubic: Floats
    slack: Floats
    astray: Floats
    row: Indices
    edge: Floats

    def take(self, chosen: Indices) -> "Pieces":
        """Return the pieces at the indices `chosen`."""
        return Pieces(
            self.ray.take(chosen),
            self.length.take(chosen),
            self.cubic.take(chosen, axis=1),
            self.slack.take(chosen),
            self.astray.take(chosen),
            self.row.take(chosen),
            self.edge.take(chosen),
        )

    def part(self, start: int, end: int) -> "Pieces":
        """Return the pieces from `start` to `end`."""
        return Pieces(
            self.ray[start:end],
            self.length[start:end],
            self.cubic[:, start:end],
            self.slack[start:end],
            self.astray[start:end],
            self.row[start:end],
            self.edge[start:end],
        )

    def and_then(self, more: "Pieces") -> "Pieces":
        """Return these pieces, and `more` after them."""
        return Pieces(
            np.append(self.ray, more.ray),
            np.append(self.length, more.length),
            np.concatenate([self.cubic, more.cubic], axis=1),
            np.append(self.slack, more.slack),
            np.append(self.astray, more.astray),
            np.append(self.row, more.row),
            np.append(self.edge, more.edge),
        )
