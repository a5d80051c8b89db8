"""Stage: which triangles cover each pixel centre, and which of them is nearest.

V vertices, T triangles, S spans (one triangle in one row), F fragments (one triangle at one pixel centre).
Vertices are (3, V), rows (x w, y w, depth) as `stages.clipping` describes; pixels are flat, y * width + x.

Coverage is decided in integers on a grid of 2^-16 pixel.  A pixel centre on an edge belongs to the triangle
to the right of the edge, or below it if the edge is level (the top-left rule of every GPU), so an interval
is closed on the left and open on the right.  Along a row, centres at 0.5, 1.5, 2.5:

    pixel      0   |   1   |   2              edges at x = 0.5 and 2.5 cover pixels 0 and 1:
    centre     o       o       o              first_center(0.5) = 0, first_center(2.5) = 2, 2 excluded
    x      0  0.5  1  1.5  2  2.5  3          first_center(0.6) = 1

Which fragment is nearest is decided in float64 from the vertices before they were rounded to that grid.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from volref.arrays import Floats, Indices, Integers
from volref.scene.camera import Camera

# Grid coordinates up to 2^30 keep every product below exact: (2^30 + 2^15) 2^31 + 2^30 2^31 < 2^63.
LARGEST_GRID_COORDINATE = 2**30
FINEST_SUBPIXEL_BITS = 16
# Temporary arrays of this length stay in the second-level cache of current processors.
BATCH = 2**15
NOTHING = np.iinfo(np.int64).max


class _Screen(NamedTuple):
    """Vertices on the screen: x, y in pixels, key, and the same x, y on the grid; all (V,)."""

    x: Floats
    y: Floats
    key: Floats
    grid_x: Integers
    grid_y: Integers
    column: Integers
    row: Integers


class _Spans(NamedTuple):
    """Runs of pixels: the first one's flat index, its key, the step of the key, its bounds; all (S,)."""

    pixel: Integers
    length: Integers
    key: Floats
    step: Floats
    least: Floats
    most: Floats
    source: Integers

    def part(self, which: slice) -> "_Spans":
        """Return some of the spans."""
        first, length, key, step = self.pixel[which], self.length[which], self.key[which], self.step[which]
        return _Spans(first, length, key, step, self.least[which], self.most[which], self.source[which])


class _Fragments(NamedTuple):
    """Pixel, key and source of fragments, all (F,)."""

    pixel: Integers
    key: Floats
    source: Integers


def subpixel_bits(width: int, height: int) -> int:
    """Return b of the grid of 2^-b pixel: 16 up to 8192 pixels, one less for each doubling of the side.

    Examples
    --------
    >>> subpixel_bits(512, 512), subpixel_bits(8192, 100), subpixel_bits(65536, 1)
    (16, 16, 13)
    """
    return min(FINEST_SUBPIXEL_BITS, 29 - (max(width, height) - 1).bit_length())


def guard_band(width: int, height: int) -> float:
    """Return the largest |x| and |y| in pixels that the grid can hold; at least twice the image's side.

    Examples
    --------
    >>> guard_band(512, 512)
    16384.0
    """
    return LARGEST_GRID_COORDINATE / 2.0 ** subpixel_bits(width, height)


def nearest_triangles(
    vertices: Floats,
    corners: Indices,
    source: Integers,
    camera: Camera,
    width: int,
    height: int,
    batch: int = BATCH,
) -> Integers:
    """Return `source` (T,) of the nearest triangle at each pixel (height * width,), -1 where there is none.

    Corners are (3, T); vertices that they use lie in front of the near plane and within `guard_band`.
    Triangles have two sides.  Of triangles with equal keys the one with the lowest source wins, whatever
    their order and the order of their corners, so the result is the same in every run.

    `batch` bounds the fragments held at a time (a row of the image is never split) and changes nothing else.

    Examples
    --------
    >>> camera = Camera.orthographic((0, 0, 1), (0, 0, 0), (0, 1, 0), 2.0, 0.0, 2.0)
    >>> vertices = np.array([[0.0, 4.0, 0.0], [0.0, 0.0, 2.0], [1.0, 1.0, 1.0]])
    >>> nearest_triangles(vertices, np.array([[0], [1], [2]]), np.array([7]), camera, 4, 2).tolist()
    [7, 7, 7, -1, 7, -1, -1, -1]
    """
    nearest_key = np.full(width * height, np.inf)
    nearest = np.full(width * height, NOTHING)
    for spans in _all_spans(vertices, corners, source, camera, width, height, batch):
        keep_nearest(*_expanded(spans, camera.far, camera), nearest_key, nearest)
    nearest[nearest == NOTHING] = -1
    return nearest


def all_fragments(
    vertices: Floats,
    corners: Indices,
    source: Integers,
    camera: Camera,
    width: int,
    height: int,
    *,
    far: float | None = None,
    batch: int = BATCH,
) -> Iterator[tuple[Integers, Integers]]:
    """Yield (pixel (F,), source (F,)) of every fragment of the triangles, in parts; see `nearest_triangles`.

    `far` takes the place of the camera's far plane, beyond which there are none.  Coverage is that of the
    z-buffer: of a mesh whose every edge has two triangles each pixel has an even number.

    Examples
    --------
    >>> camera = Camera.orthographic((0, 0, 1), (0, 0, 0), (0, 1, 0), 2.0, 0.0, 2.0)
    >>> vertices = np.array([[0.0, 4.0, 0.0], [0.0, 0.0, 2.0], [1.0, 1.0, 1.0]])
    >>> corners = np.array([[0, 0], [1, 1], [2, 2]])
    >>> fragments = all_fragments(vertices, corners, np.array([7, 8]), camera, 4, 2)
    >>> [(pixel.tolist(), source.tolist()) for pixel, source in fragments]
    [([0, 1, 2, 4, 0, 1, 2, 4], [7, 7, 7, 7, 8, 8, 8, 8])]
    """
    limit = camera.far if far is None else far
    for spans in _all_spans(vertices, corners, source, camera, width, height, batch):
        pixel, _, which = _expanded(spans, limit, camera)
        yield pixel, which


def keep_nearest(
    pixel: Integers, key: Floats, source: Integers, nearest_key: Floats, nearest: Integers
) -> None:
    """Put fragments (F,) into the buffers, in place; the order of calls does not matter.

    Of equal keys the lowest source stays.  Buffers begin with keys of +inf and sources `NOTHING`.
    """
    before = nearest_key[pixel]
    np.minimum.at(nearest_key, pixel, key)
    wins = np.flatnonzero(key == nearest_key[pixel])
    pixel = pixel[wins]
    nearest[pixel[key[wins] < before[wins]]] = NOTHING
    np.minimum.at(nearest, pixel, source[wins])


def _all_spans(
    vertices: Floats,
    corners: Indices,
    source: Integers,
    camera: Camera,
    width: int,
    height: int,
    batch: int,
) -> Iterator[_Spans]:
    """Yield the runs of pixels of all triangles, of about `batch` pixels at a time."""
    bits = subpixel_bits(width, height)
    screen = _on_screen(vertices, camera, width, height, bits)
    live = _with_pixels(screen, corners)
    for chunk in np.array_split(live, 1 + len(live) // batch):
        ordered = _top_down(screen, corners[:, chunk])
        rows = screen.row[ordered[2]] - screen.row[ordered[0]]
        for part in _batches(rows, batch):
            spans = _spans(screen, ordered[:, part], source[chunk[part]], width, bits)
            for some in _batches(spans.length, batch):
                yield spans.part(some)


def _key(depth: Floats, camera: Camera) -> Floats:
    """Return what orders fragments, smaller is nearer: affine along the screen, unlike depth itself.

    In perspective -near / depth, from -1 on the near plane to 0 at infinity; else the depth.
    """
    return depth if camera.is_parallel else -camera.near / depth


def _on_screen(vertices: Floats, camera: Camera, width: int, height: int, bits: int) -> _Screen:
    x_w, y_w, depth = vertices
    x, y = (x_w, y_w) if camera.is_parallel else (x_w / depth, y_w / depth)
    grid_x, grid_y = (np.rint(place * 2.0**bits).astype(np.int64) for place in (x, y))
    # The first centre is clamped to the image: what lies to one side of it has equal first centres.
    column = np.clip(_first_center(grid_x, bits), 0, width)
    row = np.clip(_first_center(grid_y, bits), 0, height)
    return _Screen(x, y, _key(depth, camera), grid_x, grid_y, column, row)


def _first_center(grid: Integers, bits: int) -> Integers:
    """Return the first pixel whose centre is at or after a grid coordinate: ceil(grid / 2^bits - 1/2)."""
    return np.asarray((grid + (2 ** (bits - 1) - 1)) >> bits)


def _with_pixels(screen: _Screen, corners: Indices) -> Indices:
    """Return the triangles whose bounding box holds a pixel centre of the image."""
    a, b, c = corners
    top, left = screen.row[a], screen.column[a]
    tall = (top != screen.row[b]) | (top != screen.row[c])
    wide = (left != screen.column[b]) | (left != screen.column[c])
    return np.flatnonzero(tall & wide)


def _top_down(screen: _Screen, corners: Indices) -> Indices:
    """Sort the corners of each triangle by (grid_y, grid_x): three compare-and-swaps.

    Beside the spans this makes the key of a triangle independent of the order of its corners.
    """
    place = (screen.grid_y << 32) + screen.grid_x
    ordered = [(corner, place[corner]) for corner in corners]
    for i, j in ((0, 1), (1, 2), (0, 1)):
        (corner_a, place_a), (corner_b, place_b) = ordered[i], ordered[j]
        swap = place_a > place_b
        ordered[i] = np.where(swap, corner_b, corner_a), np.minimum(place_a, place_b)
        ordered[j] = np.where(swap, corner_a, corner_b), np.maximum(place_a, place_b)
    return np.stack([corner for corner, _ in ordered])


def _batches(sizes: Integers, limit: int) -> Iterator[slice]:
    """Yield slices that cover `sizes` in order, each with a sum of at most `limit` or with one item."""
    ends = np.cumsum(sizes, dtype=np.int64)
    start, done = 0, 0
    while start < len(sizes):
        stop = max(start + 1, int(np.searchsorted(ends, done + limit, side="right")))
        yield slice(start, stop)
        start, done = stop, int(ends[stop - 1])


def _spans(screen: _Screen, corners: Indices, source: Integers, width: int, bits: int) -> _Spans:
    """Return the runs of pixels between the edges of triangles whose corners run from top to bottom.

    In each row one edge is the long one, from the first corner to the last; the other is the upper or the
    lower short one.  Which of the two is on the left does not matter.
    """
    top, middle, bottom = corners
    first_row = screen.row[top]
    count = screen.row[bottom] - first_row
    triangle = np.repeat(np.arange(len(count)), count)
    row = np.arange(len(triangle)) + (first_row - (np.cumsum(count) - count))[triangle]
    long = _crossings(_edges(screen, top, bottom, bits), triangle, row)
    short = _edges(screen, corners[:2].ravel(), corners[1:].ravel(), bits)
    lower = row >= screen.row[middle][triangle]
    other = _crossings(short, triangle + lower * len(count), row)
    start = np.clip(np.minimum(long, other), 0, width)
    length = np.clip(np.maximum(long, other), 0, width) - start
    full = np.flatnonzero(length > 0)
    triangle, row, start, length = triangle[full], row[full], start[full], length[full]
    keys = screen.key[corners]
    step_x, step_y = _steps(screen, corners, keys)
    across = start + 0.5 - screen.x[top][triangle]
    down = row + 0.5 - screen.y[top][triangle]
    return _Spans(
        pixel=row * width + start,
        length=length,
        key=keys[0][triangle] + step_x[triangle] * across + step_y[triangle] * down,
        step=step_x[triangle],
        least=keys.min(axis=0)[triangle],
        most=keys.max(axis=0)[triangle],
        source=source[triangle],
    )


def _edges(screen: _Screen, upper: Indices, lower: Indices, bits: int) -> tuple[Integers, Integers, Integers]:
    """Return (offset, slope, divisor) of edges, all integers.

    The first centre to the right of the edge in a row is ceil((offset + slope row) / divisor): that is
    x = x_upper + (y - y_upper) dx / dy at y = (row + 1/2) 2^bits put into `_first_center`.
    """
    half = 2 ** (bits - 1)
    x, y = screen.grid_x[upper], screen.grid_y[upper]
    dx, dy = screen.grid_x[lower] - x, screen.grid_y[lower] - y
    # A level edge crosses no row; it must only not divide by 0.
    return (x - half) * dy + (half - y) * dx, dx << bits, np.maximum(dy << bits, 1)


def _crossings(edges: tuple[Integers, Integers, Integers], which: Indices, row: Integers) -> Integers:
    offset, slope, divisor = (field[which] for field in edges)
    return -((-offset - slope * row) // divisor)


def _steps(screen: _Screen, corners: Indices, key: Floats) -> tuple[Floats, Floats]:
    """Return how much the key (3, T) of triangles grows per column and per row, each (T,)."""
    x, y = screen.x[corners], screen.y[corners]
    x1, y1, key1 = x[1] - x[0], y[1] - y[0], key[1] - key[0]
    x2, y2, key2 = x[2] - x[0], y[2] - y[0], key[2] - key[0]
    area = x1 * y2 - x2 * y1
    # Seen exactly edge-on a triangle has no plane in x and y; the first corner's key stands for it.
    area[area == 0] = np.inf
    return (key1 * y2 - key2 * y1) / area, (x1 * key2 - x2 * key1) / area


def _expanded(spans: _Spans, far: float, camera: Camera) -> _Fragments:
    """Return the fragments of `spans` up to the depth `far`."""
    span = np.repeat(np.arange(len(spans.length)), spans.length)
    offset = np.arange(len(span)) - (np.cumsum(spans.length) - spans.length)[span]
    pixel = spans.pixel[span] + offset
    # A centre may lie 2^-16 pixel outside the triangle, which is far in depth if it is nearly edge-on.
    key = np.clip(spans.key[span] + spans.step[span] * offset, spans.least[span], spans.most[span])
    farthest = _key(np.array([far]), camera)[0]
    if spans.most.max(initial=-np.inf) > farthest:
        near = np.flatnonzero(key <= farthest)
        pixel, key, span = pixel[near], key[near], span[near]
    return _Fragments(pixel, key, spans.source[span])
