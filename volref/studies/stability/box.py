"""Cases of the slab test: where a ray is inside the box of the volume."""

import math

import numpy as np

from volref.arrays import Floats
from volref.records import Spans
from volref.stages import spans as spans_stage
from volref.studies.stability import textbook
from volref.studies.stability.case import EPS, Case, Measured, measured
from volref.studies.stability.segments import OPACITY, segment_opacities
from volref.truth import march

FAMILY = "Ray and box"

HALF = math.sqrt(0.5)

# On faces and edges of the unit box, along each axis both ways: origin, direction; the chord is 1.
IN_FACES = tuple(
    ((-1.0, y, z), (1.0, 0.0, 0.0)) for y, z in ((0.0, 0.5), (1.0, 0.5), (0.5, 0.0), (0.0, 0.0), (1.0, 1.0))
)

Ray = tuple[tuple[float, float, float], tuple[float, float, float]]


def chords(rays: tuple[Ray, ...]) -> Floats:
    """Return volref's chords of rays in the unit box."""
    origins, directions = (np.array(part).T for part in zip(*rays, strict=True))
    spans = spans_stage.box_spans(origins, directions, np.zeros(3), np.ones(3))
    return np.maximum(spans.t_far - spans.t_near, 0.0)


def _naive_chords(rays: tuple[Ray, ...], pick: str) -> Floats:
    ends = [textbook.slab(origin, direction, pick) for origin, direction in rays]
    return np.array([far - near for near, far in ends])


def _in_faces(pick: str) -> Measured:
    return measured(np.ones(len(IN_FACES)), _naive_chords(IN_FACES, pick), chords(IN_FACES), 0.0)


def _negative_zero() -> Measured:
    rays: tuple[Ray, ...] = (((0.5, -1.0, 0.5), (-0.0, 1.0, -0.0)), ((0.5, -1.0, 0.5), (0.0, 1.0, -0.0)))
    return measured([1.0, 1.0], _naive_chords(rays, "sign"), chords(rays), 0.0)


def _tiny_direction() -> Measured:
    rays: tuple[Ray, ...] = (((-1.0, 0.0, 0.5), (1.0, 1e-310, 0.0)), ((-1.0, 1.0, 0.5), (1.0, -1e-310, 0.0)))
    return measured([1.0, 1.0], _naive_chords(rays, "minimum"), chords(rays), 0.0)


def _inside() -> Measured:
    rays: tuple[Ray, ...] = (((0.5, 0.5, 0.5), (0.0, 0.0, 1.0)), ((0.25, 0.5, 0.5), (-1.0, 0.0, 0.0)))
    return measured([0.5, 0.25], _naive_chords(rays, "fmin"), chords(rays), 0.0)


def _on_a_face() -> Measured:
    """Put the eye on a face: looking in it sees the whole box, looking out nothing."""
    rays: tuple[Ray, ...] = (((0.5, 0.5, 1.0), (0.0, 0.0, -1.0)), ((0.5, 0.5, 1.0), (0.0, 0.0, 1.0)))
    return measured([1.0, 0.0], _naive_chords(rays, "fmin"), chords(rays), 0.0)


def _past_an_edge() -> Measured:
    """Aim rays at points of the edge x = y = 1, from outside; they only touch it."""
    origin = np.array([3.3, -1.7, 0.4])
    points = np.stack([np.ones(4096), np.ones(4096), np.linspace(0.0, 1.0, 4096)], axis=1)
    direction = points - origin
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    ends = spans_stage.box_spans(np.tile(origin, (4096, 1)).T, direction.T, np.zeros(3), np.ones(3))
    found = np.maximum(ends.t_far - ends.t_near, 0.0)
    o, d = origin.astype(np.float32), direction.astype(np.float32)
    with np.errstate(divide="ignore"):
        first, second = (0 - o) / d, (1 - o) / d
    naive = np.maximum(first, second).min(axis=1) - np.minimum(first, second).max(axis=1)
    farthest = float(np.linalg.norm(points - origin, axis=1).max())
    return measured(np.zeros(4096), np.maximum(naive, 0), found, 8 * EPS * farthest)


def _surface_on_the_face() -> Measured:
    ends = Spans(np.array([3.0, 3.0]), np.array([7.0, 7.0]))
    cut = spans_stage.cut_spans(ends, 0.0, np.array([3.0, np.nextafter(3.0, 4.0)]))
    length = cut.t_far - cut.t_near
    whole_steps = np.ceil(np.maximum(length, 1e-4) / 0.5) * 0.5
    return measured([0.0, 2 * EPS], whole_steps, length, 0.0)


def _opaque_without_length() -> Measured:
    """Take spans of length 0, one ulp, and three steps of 0.1 in a table of opacity 1."""
    spans = Spans(np.full(3, 3.0), np.array([3.0, np.nextafter(3.0, 4.0), 3.0 + 0.1 + 0.1 + 0.1]))
    counts, lengths = march.segments_of(spans, 0.1)
    found = [
        segment_opacities(OPACITY, [1.0], length)[0] if count else 0.0
        for count, length in zip(counts.tolist(), lengths.tolist(), strict=True)
    ]
    naive = textbook.logarithmic_opacity(np.ones(3), spans.t_far - spans.t_near)
    return measured([0.0, 1.0, 1.0], naive, found, 0.0)


IN_FACE = "the chord of a ray that runs in a face: 1, as the face belongs to the box"
EXACT_ENDS = "exact: the ends are differences and quotients of whole numbers and halves"

CASES = (
    Case(
        "ray-in-a-face",
        FAMILY,
        "Is a ray that runs exactly in a face or an edge of the box inside it?",
        IN_FACE,
        "products by 1 / direction: 0 x infinity is NaN, and np.minimum keeps it",
        EXACT_ENDS,
        lambda: _in_faces("minimum"),
    ),
    Case(
        "ray-in-a-face-fmin",
        FAMILY,
        "And against the advice to use fmin and fmax, which drop the NaN?",
        IN_FACE,
        "fmin and fmax: the axis that is left out leaves an infinite end, so that the ray misses",
        EXACT_ENDS,
        lambda: _in_faces("fmin"),
    ),
    Case(
        "direction-minus-zero",
        FAMILY,
        "Is a direction of -0 the same as one of 0?",
        "the chord between two opposite faces: 1",
        "ends swapped where direction < 0, which -0 is not",
        EXACT_ENDS,
        _negative_zero,
    ),
    Case(
        "direction-1e-310",
        FAMILY,
        "Is a direction with a component of 1e-310, from a point on the face, harmless?",
        "the chord of the ray, along which that component moves nothing: 1",
        "1 / 1e-310 is infinite, and 0 x infinity NaN",
        EXACT_ENDS,
        _tiny_direction,
    ),
    Case(
        "camera-inside",
        FAMILY,
        "Does a ray that starts inside end at the wall in front of it only?",
        "the distance to the wall: 1/2 and 1/4",
        "t_far - t_near without a clamp at 0: half the box lies behind the eye",
        EXACT_ENDS,
        _inside,
    ),
    Case(
        "camera-on-a-face-of-the-box",
        FAMILY,
        "From a point on a face, is the box seen inwards and not outwards?",
        "1 inwards, 0 outwards",
        "t_far - t_near without a clamp at 0: the box behind the eye is seen too",
        EXACT_ENDS,
        _on_a_face,
    ),
    Case(
        "rays-past-an-edge",
        FAMILY,
        "Of 4096 rays aimed at points of an edge, how long is the longest chord?",
        "0: they touch the edge.  Hit or miss is chance, the chord is continuous",
        "the slab test in float32",
        "the direction is off by 3 ulp, each end by one more for the difference and the quotient: "
        "8 eps of the distance for both",
        _past_an_edge,
    ),
    Case(
        "zero-length-span",
        FAMILY,
        "How long is the span up to a surface on the very face of the box, or one ulp behind it?",
        "0, and one ulp",
        "whole steps of 1/2 after a least length of 1e-4",
        "exact: a minimum of two numbers",
        _surface_on_the_face,
    ),
    Case(
        "opacity-1-over-no-length",
        FAMILY,
        "In a table of opacity 1, how opaque are spans of length 0, of one ulp, and of three steps?",
        "0, as there is nothing, then 1 and 1",
        "1 - exp(length log(1 - alpha)): 0 x infinity is NaN",
        "exact: no segment without length is made, and over any other opacity 1 stays 1",
        _opaque_without_length,
    ),
)
