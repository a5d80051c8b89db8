"""What one stage hands to the next.

R rays.  Distances t are in world units along unit directions from the ray's origin.
"""

from dataclasses import dataclass

import numpy as np

from volref.arrays import Booleans, Floats, Indices, Integers


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
    face (H, W): index of the triangle in that mesh's `faces`, -1 where there is none, or where a clipping
    plane cuts through the inside of the mesh.
    """

    distance: Floats
    color: Floats
    mesh: Integers
    face: Integers


@dataclass(frozen=True, eq=False)
class Layers:
    """The transparent surfaces before the opaque one: L layers, pixel after pixel, front to back in each.

    starts (R + 1,): the layers of pixel r are those from starts[r] to starts[r + 1].
    distance (L,), straight working-space color (L, 3), opacity (L,), and mesh and face (L,) as in `Surface`.
    Layers at one distance are in the order of (mesh, face).
    """

    starts: Indices
    distance: Floats
    color: Floats
    opacity: Floats
    mesh: Integers
    face: Integers

    @property
    def counts(self) -> Indices:
        """How many layers each pixel has (R,)."""
        return np.diff(self.starts)

    def of_pixels(self, pixels: Indices) -> "Layers":
        """Return the layers of some pixels, in their order."""
        counts = self.counts[pixels]
        starts = np.append(0, np.cumsum(counts)).astype(np.intp)
        where = np.arange(starts[-1]) + np.repeat(self.starts[pixels] - starts[:-1], counts)
        return Layers(
            starts,
            self.distance[where],
            self.color[where],
            self.opacity[where],
            self.mesh[where],
            self.face[where],
        )


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


def first_of_each(ray: Indices) -> Indices:
    """Return the index of the first piece of each ray that has any; `ray` (n,) does not fall.

    Examples
    --------
    >>> first_of_each(np.array([0, 0, 3, 3, 3, 4])).tolist()
    [0, 2, 5]
    """
    begins: Booleans = np.ones(len(ray), np.bool_)
    np.not_equal(ray[1:], ray[:-1], out=begins[1:])
    return np.flatnonzero(begins)
