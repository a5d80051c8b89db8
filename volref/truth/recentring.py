"""The spans of rays about their own middle, and what rounding may have made of their ends.

R rays in index space: origins and directions are (3, R), and t is in world units.
"""

import numpy as np

from volref.arrays import Booleans, Floats
from volref.records import Spans
from volref.stages.cells import ROUNDOFF, recentred
from volref.stages.sampling import PAD


def recentred_spans(
    low: Floats,
    high: Floats,
    origins: Floats,
    directions: Floats,
    spans: Spans,
    begin: Floats | float,
    distance: Floats,
) -> tuple[Floats, Floats, Spans, Spans]:
    """Return padded origins in the middle of the spans, their rests, the spans from there, and their errors.

    The ends of the spans are computed afresh but for one where the ray begins, or at a surface.  The distance
    of a face, (face - o) / d, is off by 3 u of itself with u the unit roundoff, and by the rest of the origin
    over d.
    """
    moved, rests, kept = recentred(origins, directions, spans, PAD)  # empty spans keep their origins
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        faces = [(face[:, None] + PAD - moved) / directions for face in (low, high)]
        errors = np.abs(rests / directions) * (1 + 4 * ROUNDOFF)
    parallel = directions == 0
    errors[parallel] = 0.0
    sides = np.where(parallel, -np.inf, np.minimum(*faces)), np.where(parallel, np.inf, np.maximum(*faces))
    off = [np.where(np.isfinite(side), errors + 3 * ROUNDOFF * np.abs(side), 0.0) for side in sides]
    near, far = sides[0].max(axis=0), sides[1].min(axis=0)
    # Near an edge of the box the face that the ray truly meets first may be another one.
    at_near = np.maximum(near - (sides[0] - off[0]).max(axis=0), (sides[0] + off[0]).max(axis=0) - near)
    at_far = np.maximum(far - (sides[1] - off[1]).min(axis=0), (sides[1] + off[1]).min(axis=0) - far)
    inside = spans.t_far > spans.t_near
    # Where a ray begins, and a surface, are what they are, unless rounding alone puts them before a face.
    at_face = spans.t_near > begin, spans.t_far < distance
    at_near[~(inside & (at_face[0] | (near + at_near > kept.t_near)))] = 0.0
    at_far[~(inside & (at_face[1] | (far - at_far < kept.t_far)))] = 0.0
    near, far = (
        np.where(inside & at_face[0], near, kept.t_near),
        np.where(inside & at_face[1], far, kept.t_far),
    )
    near, at_near = _touching(spans, at_face, near, at_near)
    return moved, rests, Spans(near, np.maximum(near, far)), Spans(at_near, at_far)


def _touching(
    spans: Spans, at_face: tuple[Booleans, Booleans], near: Floats, at_near: Floats
) -> tuple[Floats, Floats]:
    """Return near and its error with those of rays that touch the box, although their span is empty.

    Their chord is at most what rounding may have taken off it.
    """
    with np.errstate(invalid="ignore"):
        chord = spans.t_far - spans.t_near
        chord += 3 * ROUNDOFF * (at_face[0] * np.abs(spans.t_near) + at_face[1] * np.abs(spans.t_far))
    touching = (spans.t_far <= spans.t_near) & np.isfinite(spans.t_near) & (chord >= 0)
    return np.where(touching, spans.t_near, near), np.where(touching, chord, at_near)
