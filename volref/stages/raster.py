"""Stage: the fragments that a GPU makes of triangles, with its snapped vertices and its clipping.

V vertices, T triangles, P pieces (what clipping leaves of triangles), N corners of the largest piece,
E edges, S spans (one piece in one row), F fragments (one triangle at one pixel centre), K varyings.

Window positions are in pixels with y upwards, as GL has them: the lower left corner of the image is (0, 0).
A GPU rounds them to a grid of 2^-b pixel (b = 4 in SwiftShader, 8 in Mesa and in most hardware) and decides
coverage there in integers.  A pixel centre on an edge belongs to the triangle to the right of the edge, or
above it if the edge is level:

    pixel      0   |   1   |   2              edges at x = 0.5 and 2.5 cover pixels 0 and 1:
    centre     o       o       o              first_center(0.5) = 0, first_center(2.5) = 2, 2 excluded
    x      0  0.5  1  1.5  2  2.5  3          first_center(0.6) = 1

Without a grid the same rule holds for the crossings of edges and rows as float64 has them; an edge is
computed from its lower to its upper end, so two triangles that share it agree on every centre.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import DTypeLike

from volref.arrays import Booleans, Floats, Indices, Integers, Numbers

# How far triangles may reach before they are cut, in half viewports from its centre: software GPUs cut there.
GUARD_BAND = 1.0
LEAST_W = 1e-30


class Fragments(NamedTuple):
    """Fragments in the order of the triangles, then of the pixels; (F,), the varyings (K, F)."""

    pixel: Integers
    triangle: Integers
    window_z: Floats
    inverse_w: Floats
    varyings: Floats
    front: Booleans


class _Pieces(NamedTuple):
    """Convex polygons: clip positions of their corners (P, N, 4), number of these, index of the triangle."""

    position: Numbers
    sides: Integers
    triangle: Integers


class _Spans(NamedTuple):
    """Runs of pixels: piece, row from below, first column, length; all (S,)."""

    piece: Integers
    row: Integers
    column: Integers
    length: Integers


class _Edges(NamedTuple):
    """Edges that cross rows: piece, 1 if on its right, first row, number of rows, ends by rising y; (E,)."""

    piece: Integers
    right: Integers
    first: Integers
    rows: Integers
    lower_x: Numbers
    lower_y: Numbers
    upper_x: Numbers
    upper_y: Numbers


def rasterize(
    clip: Floats,
    triangles: Integers,
    varyings: Floats,
    width: int,
    height: int,
    *,
    subpixel_bits: int | None = None,
    cull: str = "none",
    clip_z: str = "-1..1",
    guard_band: float = GUARD_BAND,
    planes: str = "snapped",
    dtype: DTypeLike = np.float64,
) -> Fragments:
    """Return the fragments of triangles (T, 3) of vertices with clip positions (V, 4) and varyings (V, K).

    `pixel` is flat, y * width + x with row 0 at the top.  `window_z` runs from 0 at the near plane to 1 at
    the far one; it and `inverse_w` (1 / clip w, gl_FragCoord.w) are linear on the screen, the varyings are
    perspective-correct.  `front` are counter-clockwise triangles.  `cull` leaves out "front" or "back" ones.

    `subpixel_bits` 1 to 16 rounds window positions to 2^-bits pixel, half to even, after a viewport transform
    in float32; None keeps them in float64.  Coverage is exact while guard_band * size * 2^bits <= 2^30.
    Attributes are those of the plane through the "snapped" corners (SwiftShader) or through the "unsnapped"
    ones (Mesa).  Triangles are cut at the near and far planes of `clip_z` ("-1..1" or "0..1") and where |x|
    or |y| exceeds `guard_band` * w; attributes remain those of the whole triangle.

    Examples
    --------
    >>> clip = np.array([[-1.0, -1.0, 0.0, 1.0], [3.0, -1.0, 0.0, 1.0], [-1.0, 3.0, 0.0, 1.0]])
    >>> fragments = rasterize(clip, np.array([[0, 1, 2]]), clip[:, :1], 2, 1, subpixel_bits=4)
    >>> fragments.pixel.tolist(), fragments.window_z.tolist(), fragments.varyings.tolist()
    ([0, 1], [0.5, 0.5], [[-0.5, 0.5]])
    """
    corners: Numbers = clip[triangles] if subpixel_bits is None else clip.astype(np.float32)[triangles]
    pieces = _clipped(corners, 0.0 if clip_z == "0..1" else -1.0, guard_band)
    x, y = _window(pieces.position, width, height, subpixel_bits)
    area = _doubled_area(x, y, pieces.sides)
    wanted = np.flatnonzero(((area > 0) & (cull != "front")) | ((area < 0) & (cull != "back")))
    x, y, front = x[wanted], y[wanted], area[wanted] > 0
    spans = _spans(x, y, pieces.sides[wanted], front, width, height, subpixel_bits)
    # Most triangles of a fine mesh lie between pixel centres: attributes are for the others.
    drawn = np.unique(spans.piece)
    spans = spans._replace(piece=np.searchsorted(drawn, spans.piece))
    triangle = pieces.triangle[wanted][drawn]
    scale = 1.0 if subpixel_bits is None else 2.0**-subpixel_bits
    anchor = x[drawn, 0] * scale, y[drawn, 0] * scale
    screen = _homogeneous(corners[triangle], width, height, subpixel_bits if planes == "snapped" else None)
    attributes = _attributes(corners[triangle].astype(np.float64), varyings[triangles[triangle]], clip_z)
    return _expanded(spans, _planes(screen, anchor, attributes), triangle, front[drawn], width, height, dtype)


def depth_test(
    fragments: Fragments, pixels: int, clear: float = 1.0, *, depth_bits: int | None = 32
) -> Indices:
    """Return the fragment that a depth test LESS leaves at each pixel that has one, in the order of pixels.

    Fragments are drawn in their order: of equal depths the first stays, and none at or beyond `clear`.
    Depths are compared as the buffer holds them: in float32 (32 bits), as whole steps (16 or 24 bits), or as
    they were computed (None).

    Examples
    --------
    >>> zero = np.zeros(3)
    >>> pixel = np.array([5, 5, 2])
    >>> fragments = Fragments(pixel, pixel, np.array([0.25, 0.25, 0.5]), zero, zero[None], zero == 0)
    >>> depth_test(fragments, 6).tolist()
    [2, 0]
    """
    depth, empty = (_stored(np.asarray(value), depth_bits) for value in (fragments.window_z, clear))
    nearest = np.full(pixels, empty)
    np.minimum.at(nearest, fragments.pixel, depth)
    alive = np.flatnonzero((depth == nearest[fragments.pixel]) & (depth < empty))
    _, first = np.unique(fragments.pixel[alive], return_index=True)
    return alive[first]


def _stored(depth: Floats, bits: int | None) -> Numbers:
    if bits is None:
        return depth
    if bits == 32:
        return depth.astype(np.float32)
    return np.asarray(np.rint(np.clip(depth, 0, 1) * (2.0**bits - 1)))


def _clipped(corners: Numbers, near: float, band: float) -> _Pieces:
    """Return what lies inside the planes of triangles with clip positions (T, 3, 4): whole or as polygons."""
    planes = np.array(
        [
            [0, 0, 1, -near],
            [0, 0, -1, 1],
            [1, 0, 0, band],
            [-1, 0, 0, band],
            [0, 1, 0, band],
            [0, -1, 0, band],
        ],
        dtype=corners.dtype,
    )
    outside = np.stack([_distance(corners, plane) < 0 for plane in planes], axis=2)
    reached = ~np.any(outside.all(axis=1), axis=1)
    crossed = np.asarray(outside.any(axis=1))
    source = np.flatnonzero(reached)
    polygons = corners[source]
    count = np.full(len(source), 3)
    for plane, some in zip(planes, crossed[source].T, strict=True):
        if some.any():
            polygons, count = _cut_some(polygons, count, plane, np.flatnonzero(some))
    left = np.flatnonzero(count >= 3)
    return _Pieces(polygons[left], count[left], source[left])


def _distance(position: Numbers, plane: Numbers) -> Numbers:
    x, y, z, w = np.moveaxis(position, -1, 0)
    return np.asarray(plane[0] * x + plane[1] * y + plane[2] * z + plane[3] * w)


def _cut_some(polygons: Floats, count: Integers, plane: Floats, which: Indices) -> tuple[Floats, Integers]:
    """Cut the polygons `which` at one plane; there is room for one more corner afterwards."""
    cut, cut_count = _cut(polygons[which], count[which], plane)
    wider = np.zeros((polygons.shape[0], cut.shape[1], polygons.shape[2]), polygons.dtype)
    wider[:, : polygons.shape[1]] = polygons
    wider[:, polygons.shape[1] :] = polygons[:, :1]
    wider[which] = cut
    count = count.copy()
    count[which] = cut_count
    return wider, count


def _cut(polygons: Floats, count: Integers, plane: Floats) -> tuple[Floats, Integers]:
    """Cut convex polygons (P, N, 4) at one plane (Sutherland and Hodgman 1974).

    A new corner is computed from the inner to the outer end of its edge, so that neighbours get equal ones.
    """
    size = polygons.shape[1]
    here = np.arange(size)
    following = np.where(here + 1 < count[:, None], here + 1, 0)
    ahead = np.take_along_axis(polygons, following[:, :, None], axis=1)
    distance = _distance(polygons, plane)
    distance_ahead = np.take_along_axis(distance, following, axis=1)
    inside, inside_ahead = distance >= 0, distance_ahead >= 0
    present = here < count[:, None]
    crossing = present & (inside != inside_ahead)
    apart = np.where(crossing, distance_ahead - distance, 1)
    # Either order of the ends gives the same products and the same bits.
    new = (distance_ahead[..., None] * polygons - distance[..., None] * ahead) * (1 / apart)[..., None]
    corners = np.stack([polygons, new], axis=2).reshape(len(polygons), 2 * size, -1)
    kept = np.stack([present & inside, crossing], axis=2).reshape(len(polygons), 2 * size)
    order = np.argsort(~kept, axis=1, kind="stable")[:, : size + 1]
    return np.take_along_axis(corners, order[:, :, None], axis=1), kept.sum(axis=1)


def _window(position: Floats, width: int, height: int, bits: int | None) -> tuple[Numbers, Numbers]:
    """Return window x and y of clip positions (..., 4): integers in 2^-bits pixel, or floats in pixels.

    In float32 the products are SwiftShader's, x (1 / w) (scale width / 2), and so is the half pixel by which
    it shifts the origin before it rounds.
    """
    x, y, _, w = np.moveaxis(position, -1, 0)
    # Corners in the plane of the eye have no place; 1 / w of any number stands for one and does not overflow.
    inverse = 1 / np.where(np.abs(w) < LEAST_W, w.dtype.type(1), w)
    if bits is None:
        return (x * inverse + 1) * (width / 2), (y * inverse + 1) * (height / 2)
    grid = []
    for along, size in ((x, width), (y, height)):
        half_size, half_pixel = np.float32(size * 2.0 ** (bits - 1)), np.float32(2.0 ** (bits - 1))
        shifted = along * inverse * half_size + (half_size - half_pixel)
        grid.append(np.rint(np.clip(shifted, -(2.0**30), 2.0**30)).astype(np.int64) + 2 ** (bits - 1))
    return grid[0], grid[1]


def _ahead(values: Numbers, sides: Integers) -> Numbers:
    """Return the value (P, N) of the next corner; of corners beyond the count the first one's."""
    here = np.arange(values.shape[1])
    following = np.where(here + 1 < sides[:, None], here + 1, 0)
    return np.asarray(np.take_along_axis(values, following, axis=1))


def _doubled_area(x: Numbers, y: Numbers, count: Integers) -> Numbers:
    """Return twice the signed area (P,) of polygons, positive if counter-clockwise."""
    present = np.arange(x.shape[1]) < count[:, None]
    across, up = x - x[:, :1], y - y[:, :1]
    return np.asarray(np.sum(present * (across * _ahead(up, count) - _ahead(across, count) * up), axis=1))


def _first_center(place: Numbers, bits: int | None) -> Integers:
    """Return the first pixel whose centre is at or after a place: ceil(place - 1/2) in pixels."""
    if bits is None:
        return np.ceil(np.clip(place, -(2.0**40), 2.0**40) - 0.5).astype(np.int64)
    return np.asarray((place + (2 ** (bits - 1) - 1)) >> bits)


def _spans(
    x: Numbers, y: Numbers, sides: Integers, front: Booleans, width: int, height: int, bits: int | None
) -> _Spans:
    """Return the runs of pixels of convex polygons (P, N), those of a piece from the top down."""
    row = np.clip(_first_center(y, bits), 0, height)
    present = np.arange(x.shape[1]) < sides[:, None]
    highest = np.where(present, row, 0).max(axis=1, initial=0)
    rows = highest - np.where(present, row, height).min(axis=1, initial=height)
    piece, from_top = _counted(rows)
    # Row r of a piece is at top[piece] - r.
    top = np.cumsum(rows) - rows + highest - 1
    bounds = np.zeros((2, len(piece)), dtype=np.int64)
    edges = _edges(x, y, row, sides, present, front)
    edge, step = _counted(edges.rows)
    at_row = edges.first[edge] + step
    crossing = np.clip(_crossings(edges, edge, at_row, bits), 0, width)
    bounds[edges.right[edge], top[edges.piece[edge]] - at_row] = crossing
    left, right = bounds
    full = np.flatnonzero(right > left)
    piece = piece[full]
    return _Spans(piece, highest[piece] - 1 - from_top[full], left[full], (right - left)[full])


def _edges(
    x: Numbers, y: Numbers, row: Integers, sides: Integers, present: Booleans, front: Booleans
) -> _Edges:
    """Return the edges of polygons that cross rows; counter-clockwise, the upward ones bound on the right."""
    next_row = _ahead(row, sides)
    which = np.nonzero(present & (row != next_row))
    start, end = row[which], next_row[which]
    up = end > start
    ends = [(x[which], _ahead(x, sides)[which]), (y[which], _ahead(y, sides)[which])]
    (lower_x, lower_y), (upper_x, upper_y) = (
        [np.where(up == first, a, b) for a, b in ends] for first in (True, False)
    )
    right = (up == front[which[0]]).astype(np.int64)
    return _Edges(
        which[0], right, np.minimum(start, end), np.abs(end - start), lower_x, lower_y, upper_x, upper_y
    )


def _counted(lengths: Integers) -> tuple[Integers, Integers]:
    """Return for every item of consecutive runs which run it is in and its number there."""
    run = np.repeat(np.arange(len(lengths)), lengths)
    return run, np.arange(len(run)) - (np.cumsum(lengths) - lengths)[run]


def _crossings(edges: _Edges, which: Integers, row: Integers, bits: int | None) -> Integers:
    """Return the first pixel whose centre is at or to the right of where edges cross rows."""
    x, y = edges.lower_x, edges.lower_y
    dx, dy = edges.upper_x - x, edges.upper_y - y
    if bits is None:
        return _first_center(x[which] + (row + 0.5 - y[which]) * (dx / dy)[which], bits)
    half = 2 ** (bits - 1)
    # ceil((x - half) / 2^bits) of x = lower_x + (y - lower_y) dx / dy at y = row 2^bits + half.
    offset = (x - half) * dy + (half - y) * dx
    divisor = dy << bits
    return np.asarray(-((-offset[which] - (dx << bits)[which] * row) // divisor[which]))


def _homogeneous(position: Numbers, width: int, height: int, bits: int | None) -> Floats:
    """Return (x w, y w, w) of corners (P, 3, 4), x and y in pixels, snapped if there are bits; (3, P, 3)."""
    clip_x, clip_y, _, w = np.moveaxis(position.astype(np.float64), -1, 0)
    if bits is None:
        return np.stack([(clip_x + w) * (width / 2), (clip_y + w) * (height / 2), w])
    x, y = _window(position, width, height, bits)
    return np.stack([x * 2.0**-bits * w, y * 2.0**-bits * w, w])


def _attributes(position: Floats, varyings: Floats, clip_z: str) -> Floats:
    """Return what at three corners is linear on the screen after division by w (P, 3, 2 + K).

    It is window_z * w, 1 and the varyings, so the quotients are window_z, 1 / w and varyings / w.
    """
    z, w = position[:, :, 2:3], position[:, :, 3:4]
    return np.concatenate([z if clip_z == "0..1" else 0.5 * (z + w), np.ones_like(w), varyings], axis=2)


class _Planes(NamedTuple):
    """Values at an anchor, steps per column and per row (P, 2 + K); x and y of the anchor in pixels (P,)."""

    value: Floats
    step_x: Floats
    step_y: Floats
    x: Floats
    y: Floats


def _planes(screen: Floats, anchor: tuple[Floats, Floats], attributes: Floats) -> _Planes:
    """Return the planes of attributes / w over the screen (Olano and Greer 1997), without a division by w.

    A weight over w is linear in x and y: the cross product of the other two corners (x w, y w, w), over the
    determinant of the three.  So corners at or behind the eye do no harm.
    """
    w = screen[2]
    x_w, y_w = screen[0] - anchor[0][:, None] * w, screen[1] - anchor[1][:, None] * w
    x_j, y_j, w_j = (np.roll(part, -1, axis=1) for part in (x_w, y_w, w))
    x_k, y_k, w_k = (np.roll(part, -2, axis=1) for part in (x_w, y_w, w))
    weights = np.stack([x_j * y_k - x_k * y_j, y_j * w_k - y_k * w_j, x_k * w_j - x_j * w_k])
    determinant = np.sum(weights[0] * w, axis=1)
    # Flat on the screen, a triangle has no plane, though a snapped piece of it may have pixels: they get the
    # mean of its corners.
    flat = np.flatnonzero(determinant == 0)
    determinant[flat] = 1
    weights /= determinant[:, None]
    weights[:, flat] = 0
    weights[0, flat] = 1 / np.abs(w[flat]).sum(axis=1, keepdims=True)
    value, step_x, step_y = np.einsum("spc,pck->spk", weights, attributes)
    return _Planes(value, step_x, step_y, *anchor)


def _expanded(
    spans: _Spans,
    planes: _Planes,
    triangle: Integers,
    front: Booleans,
    width: int,
    height: int,
    dtype: DTypeLike,
) -> Fragments:
    """Return the fragments of spans with their attributes, which are computed in `dtype`."""
    value, step_x, step_y, x, y = (field.astype(dtype) for field in planes)
    piece = spans.piece
    up = (spans.row + 0.5).astype(dtype) - y[piece]
    across = (spans.column + 0.5).astype(dtype) - x[piece]
    at_start = value[piece] + step_y[piece] * up[:, None] + step_x[piece] * across[:, None]
    step_x = step_x[piece]
    span, step = _counted(spans.length)
    pixel = ((height - 1 - spans.row) * width + spans.column)[span] + step
    count = step.astype(dtype)
    values = np.stack(
        [start[span] + by[span] * count for start, by in zip(at_start.T, step_x.T, strict=True)]
    )
    values[2:] /= values[1]
    return Fragments(pixel, triangle[piece][span], values[0], values[1], values[2:], front[piece][span])
