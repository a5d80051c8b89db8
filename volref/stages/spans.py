"""Stage 2: the part of each ray that is integrated.

R rays; t is in world units.  Of rays in index space origins and directions are (3, R), and the directions are
the images of unit world directions.
"""

from collections.abc import Sequence

import numpy as np

from volref.arrays import Floats
from volref.records import Rays, Spans
from volref.scene.plane import Plane


def box_spans(origins: Floats, directions: Floats, low: Floats, high: Floats) -> Spans:
    """Return where each ray is inside the box from `low` to `high` (3,) at t >= 0.

    Per axis the ray is between the two faces for t from (face - o) / d to (other face - o) / d (the slab
    test, Kay & Kajiya 1986).  A ray parallel to the faces (d = 0) is always between them or never, which
    the quotient does not say: with o on a face it is 0/0.  Such a ray counts as inside, so that a camera
    that looks along a face sees it.  A camera inside the box starts at t = 0.

    Examples
    --------
    A ray along x from x = -1, on the lower y face of the unit box:

    >>> spans = box_spans(
    ...     np.array([[-1.0], [0.0], [0.5]]), np.array([[1.0], [0.0], [0.0]]), np.zeros(3), np.ones(3)
    ... )
    >>> spans.t_near.tolist(), spans.t_far.tolist()
    ([1.0], [2.0])
    """
    t_near = np.zeros(origins.shape[1])
    t_far = np.full(origins.shape[1], np.inf)
    for axis in range(3):
        o, d = origins[axis], directions[axis]
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            first, second = (low[axis] - o) / d, (high[axis] - o) / d
        parallel = d == 0
        if parallel.any():
            inside = (o >= low[axis]) & (o <= high[axis])
            first = np.where(parallel, np.where(inside, -np.inf, np.inf), first)
            second = np.where(parallel, np.inf, second)  # both +inf: it enters only after everything
        np.maximum(t_near, np.minimum(first, second), out=t_near)
        np.minimum(t_far, np.maximum(first, second), out=t_far)
    return Spans(t_near, t_far)


def cut_spans(spans: Spans, begin: Floats | float, end: Floats) -> Spans:
    """Return what lies of each span from `begin` (R,) to `end` (R,), as a surface there, +inf without one."""
    return Spans(np.maximum(spans.t_near, begin), np.minimum(spans.t_far, end))


def clip_spans(rays: Rays, planes: Sequence[Plane]) -> Spans:
    """Return where each ray is in front of all `planes` at t >= 0.

    The height over a plane is h + t (n . d) with h = n . (o - p): it is 0 at t = -h / (n . d).  A ray
    parallel to a plane is in front of it everywhere (h >= 0) or nowhere.

    Examples
    --------
    >>> rays = Rays(np.array([[0.0, 0.0, 5.0]] * 2), np.array([[0.0, 0.0, -1.0], [1.0, 0.0, 0.0]]))
    >>> spans = clip_spans(rays, [Plane((0, 0, 2), (0, 0, -1)), Plane((0, 0, 0), (0, 0, 1))])
    >>> spans.t_near.tolist(), spans.t_far.tolist()
    ([3.0, inf], [5.0, inf])
    """
    t_near = np.zeros(len(rays.directions))
    t_far = np.full(len(rays.directions), np.inf)
    for plane in planes:
        height = plane.height(rays.origins)
        x, y, z = (rays.directions * plane.normal).T  # summed one by one, so that a ray alone is the same
        rise = x + y + z
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            t = -height / rise
        hidden = (rise == 0) & (height < 0)
        np.maximum(t_near, np.where(rise > 0, t, np.where(hidden, np.inf, 0.0)), out=t_near)
        np.minimum(t_far, np.where(rise < 0, t, np.inf), out=t_far)
    return Spans(t_near, t_far)
