"""Stage 2: the part of each ray that is integrated.

R rays in index space: origins and directions are (3, R), and t stays in world units because the
directions are the images of unit world directions.
"""

import numpy as np

from volref.arrays import Floats
from volref.records import Spans


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


def cut_at_surface(spans: Spans, distance: Floats) -> Spans:
    """End each span at the opaque surface `distance` (R,) away, +inf where there is none."""
    return Spans(spans.t_near, np.minimum(spans.t_far, distance))
