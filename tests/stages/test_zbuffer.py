from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from volref.scene.camera import Camera
from volref.stages.zbuffer import all_fragments, guard_band, nearest_triangles, subpixel_bits

# Seen along -z, so that vertices (x, y, depth) stand for themselves.
PARALLEL = Camera.orthographic((0, 0, 0), (0, 0, -1), (0, 1, 0), 1.0, 0.0, 100.0)
PERSPECTIVE = Camera.look_at((0, 0, 0), (0, 0, -1), (0, 1, 0), 60.0, 1.0, 100.0)
GRID = 2.0**-16


def drawn(triangles, width, height, camera=PARALLEL, source=None, **options):
    """Draw triangles (T, 3, 3) with corners (x, y, depth); return the image of their numbers."""
    corners = np.asarray(triangles, dtype=np.float64)
    x, y, depth = corners.reshape(-1, 3).T
    w = 1.0 if camera.is_parallel else depth
    vertices = np.stack([x * w, y * w, depth])
    faces = np.arange(3 * len(corners)).reshape(-1, 3).T
    source = np.arange(len(corners)) if source is None else np.asarray(source)
    return nearest_triangles(vertices, faces, source, camera, width, height, **options).reshape(height, width)


def covered_by_edge_functions(triangle, width, height, grid=GRID):
    """Return the pixels of one triangle, one at a time, with integer edge functions (Pineda 1988).

    The top-left rule in its textbook form: a centre on an edge counts if the edge is a top edge (level,
    the triangle below it) or a left edge.
    """
    (xa, ya), (xb, yb), (xc, yc) = [[round(Fraction(p) / Fraction(grid)) for p in q[:2]] for q in triangle]
    area = (xb - xa) * (yc - ya) - (xc - xa) * (yb - ya)
    corners = [(xa, ya), (xb, yb), (xc, yc)] if area > 0 else [(xa, ya), (xc, yc), (xb, yb)]
    result = np.zeros((height, width), bool)
    unit = round(1 / grid)
    for row in range(height):
        for column in range(width):
            x, y = column * unit + unit // 2, row * unit + unit // 2
            result[row, column] = area != 0
            for (x0, y0), (x1, y1) in zip(corners, corners[1:] + corners[:1], strict=True):
                side = (x1 - x0) * (y - y0) - (y1 - y0) * (x - x0)
                owns = (y1 < y0) or (y1 == y0 and x1 > x0)
                result[row, column] &= side > 0 or (side == 0 and owns)
    return result


def shuffled_grid(cells, side, seed):
    """Return the triangles of a grid that covers a square image; 30 % of its vertices on pixel centres."""
    rng = np.random.default_rng(seed)
    along = np.linspace(-side / 12, side * 13 / 12, cells + 1)
    spacing = along[1] - along[0]
    points = (
        np.stack(np.meshgrid(along, along), axis=-1)
        + rng.uniform(-0.12, 0.12, (cells + 1, cells + 1, 2)) * spacing
    )
    on_centre = rng.random((cells + 1, cells + 1)) < 0.3
    points[on_centre] = np.floor(points[on_centre]) + 0.5
    corner, right, below, across = points[:-1, :-1], points[:-1, 1:], points[1:, :-1], points[1:, 1:]
    flat = np.concatenate([np.stack([corner, right, below], 2), np.stack([right, across, below], 2)])
    flat = flat.reshape(-1, 3, 2)
    return np.concatenate([flat, np.ones((len(flat), 3, 1))], axis=2)


@pytest.mark.parametrize(("cells", "side"), [(100, 512), (7, 64), (60, 60)])
def test_a_grid_of_triangles_puts_exactly_one_fragment_on_each_pixel(cells, side):
    """All keys are equal, so a pixel with two fragments shows the lower number, whichever way one counts."""
    triangles = shuffled_grid(cells, side, seed=cells)
    upwards = drawn(triangles, side, side)
    downwards = len(triangles) - 1 - drawn(triangles, side, side, source=np.arange(len(triangles))[::-1])
    assert (upwards >= 0).all()
    np.testing.assert_array_equal(upwards, downwards)


def test_two_fragments_on_a_pixel_would_be_noticed():
    """The control of the test above: a triangle drawn twice is seen."""
    triangles = shuffled_grid(7, 64, seed=7)
    triangles = np.concatenate([triangles, triangles[20:21]])
    upwards = drawn(triangles, 64, 64)
    downwards = len(triangles) - 1 - drawn(triangles, 64, 64, source=np.arange(len(triangles))[::-1])
    assert (upwards != downwards).any()


half_pixels = st.integers(-4, 20).map(lambda n: n / 2)
corner_on_lattice = st.tuples(half_pixels, half_pixels, st.just(1.0))
corner_anywhere = st.tuples(st.floats(-3, 10), st.floats(-3, 10), st.just(1.0))


@given(triangle=st.tuples(*[st.one_of(corner_on_lattice, corner_anywhere)] * 3))
@settings(max_examples=300, deadline=None)
def test_coverage_is_that_of_integer_edge_functions_with_the_top_left_rule(triangle):
    expected = covered_by_edge_functions(triangle, 8, 7)
    for order in ((0, 1, 2), (1, 2, 0), (2, 1, 0)):
        np.testing.assert_array_equal(drawn([[triangle[i] for i in order]], 8, 7) == 0, expected)


@given(triangle=st.tuples(*[st.tuples(*[st.sampled_from([-16384.0, -9000.1, 0.5, 3.25, 16384.0])] * 2)] * 3))
@settings(max_examples=100, deadline=None)
def test_edges_are_exact_up_to_the_guard_band(triangle):
    assert guard_band(8, 7) == 16384.0
    corners = [(*corner, 1.0) for corner in triangle]
    np.testing.assert_array_equal(drawn([corners], 8, 7) == 0, covered_by_edge_functions(corners, 8, 7))


def test_an_image_65536_pixels_wide_is_covered_exactly_once():
    assert subpixel_bits(65536, 3) == 13
    corners = [(-10.0, -9.0, 1.0), (131072.0, -9.0, 1.0), (131072.0, 40.3, 1.0), (-10.0, 12.7, 1.0)]
    triangles = [corners[:3], [corners[0], *corners[2:]]]
    upwards = drawn(triangles, 65536, 3)
    assert set(np.unique(upwards)) == {0, 1}
    np.testing.assert_array_equal(upwards, 1 - drawn(triangles, 65536, 3, source=[1, 0]))


def random_triangles(seed, count, side):
    rng = np.random.default_rng(seed)
    return rng.uniform((-4, -4, 2), (side + 4, side + 4, 50), (count, 3, 3))


@pytest.mark.parametrize("camera", [PARALLEL, PERSPECTIVE], ids=["parallel", "perspective"])
@given(seed=st.integers(0, 2**32 - 1), data=st.data())
@settings(max_examples=50, deadline=None)
def test_the_order_of_triangles_and_of_their_corners_changes_nothing(camera, seed, data):
    triangles = random_triangles(seed, 12, 16)
    order = data.draw(st.permutations(range(12)))
    turned = np.stack([triangles[i][data.draw(st.permutations(range(3)))] for i in order])
    expected = drawn(triangles, 16, 16, camera)
    np.testing.assert_array_equal(drawn(turned, 16, 16, camera, source=order), expected)


@pytest.mark.parametrize("camera", [PARALLEL, PERSPECTIVE], ids=["parallel", "perspective"])
@pytest.mark.parametrize("batch", [1, 7, 300, 5000])
def test_the_batch_size_changes_nothing(camera, batch):
    triangles = random_triangles(3, 200, 48)
    triangles = np.concatenate([triangles, triangles[50:]])
    expected = drawn(triangles, 48, 48, camera, batch=10**9)
    np.testing.assert_array_equal(drawn(triangles, 48, 48, camera, batch=batch), expected)


def test_nothing_is_drawn_of_no_triangles():
    assert (drawn(np.zeros((0, 3, 3)), 4, 3) == -1).all()


@pytest.mark.parametrize("camera", [PARALLEL, PERSPECTIVE], ids=["parallel", "perspective"])
@pytest.mark.parametrize("second_y", [3.1, -2.0], ids=["oblique", "with a level edge"])
def test_of_coincident_triangles_the_lowest_source_wins(camera, second_y):
    triangle = np.array([(1.3, -2.0, 5.0), (14.7, second_y, 9.0), (4.9, 15.2, 31.0)])
    copies = [triangle[list(order)] for order in ((0, 1, 2), (2, 1, 0), (1, 2, 0), (1, 0, 2))]
    for source in ([5, 3, 8, 4], [3, 4, 5, 8], [8, 5, 4, 3]):
        image = drawn(copies, 16, 16, camera, source=source)
        assert set(np.unique(image)) == {-1, 3}


def test_depth_between_the_corners_is_linear_in_space_not_on_the_screen():
    """A wall from depth 2 at x = 0 to depth 6 at x = 8 has depth 3, not 4, at x = 4 (1/depth is linear)."""
    wall = [(0, -9, 2), (0, 30, 2), (8, -9, 6)], [(8, 30, 6), (0, 30, 2), (8, -9, 6)]
    for depth, wins in ((2.9, True), (3.1, False)):
        # A narrow strip around x = 3.5, the centre of column 3, where 1 / depth is 0.5 - 3.5 / 24.
        at_centre = 1 / (0.5 - 3.5 / 24)
        strip = [
            (3.2, -9, depth - 3 + at_centre),
            (3.8, -9, depth - 3 + at_centre),
            (3.5, 99, depth - 3 + at_centre),
        ]
        image = drawn([*wall, strip], 8, 8, PERSPECTIVE)
        assert (image[0, 3] == 2) == wins


def test_fragments_beyond_the_far_plane_are_left_out_one_by_one():
    """Depth grows by 10 per pixel from 50 at x = 0, so far = 100 is at x = 5."""
    wall = [(0, -9, 50), (0, 30, 50), (8, -9, 130)], [(8, 30, 130), (0, 30, 50), (8, -9, 130)]
    image = drawn(wall, 8, 8, PARALLEL)
    assert (image[:, :5] >= 0).all()
    assert (image[:, 5:] == -1).all()


def test_a_triangle_on_the_far_plane_is_seen():
    upon = [(-9, -9, 100.0), (99, -9, 100.0), (-9, 99, 100.0)]
    beyond = [(-9, -9, 101.0), (99, -9, 100.0), (-9, 99, 101.0)]
    for camera in (PERSPECTIVE, PARALLEL):
        assert (drawn([upon], 4, 4, camera) == 0).all()
        assert (drawn([beyond, upon], 4, 4, camera) == 1).all()


def test_a_sliver_seen_edge_on_never_reaches_beyond_its_own_corners():
    """A tenth of a grid step wide, it is rounded to a whole one, and the pixel centre lies beside it.

    Its depth runs from 5 to 6 within 1.5e-6 pixel; extended to the centre it would be 0.5.
    """
    sliver = [(2.5 + 0.45 * GRID, -9, 5), (2.5 + 0.45 * GRID, 30, 5), (2.5 + 0.55 * GRID, 10, 6)]
    front = [(-9, -9, 4), (99, -9, 4), (-9, 99, 4)]
    behind = [(-9, -9, 7), (99, -9, 7), (-9, 99, 7)]
    assert (drawn([sliver, front], 6, 6)[:, 2] == 1).all()
    assert (drawn([sliver, behind], 6, 6)[:, 2] == 0).any()


def test_a_triangle_without_area_before_rounding_is_harmless():
    """On the screen its corners lie on one line, which the grid bends by one step."""
    line = [(0.1, 0.1, 5), (1.5 + 0.4 * GRID, 1.5 + 0.4 * GRID, 6), (5.1, 5.1, 7)]
    image = drawn([line, [(-9, -9, 9), (99, -9, 9), (-9, 99, 9)]], 6, 6)
    assert set(np.unique(image)) <= {0, 1}


def test_interpenetrating_planes_cross_where_their_depths_are_equal():
    """Depths 10 + x and 18 - x are equal at x = 4."""
    rising = [(-100, -100, -90), (100, -100, 110), (0, 300, 10)]
    falling = [(-100, -100, 118), (100, -100, -82), (0, 300, 18)]
    image = drawn([rising, falling], 8, 8, PARALLEL)
    assert (image[:, :4] == 0).all()
    assert (image[:, 4:] == 1).all()


def fragment_counts(triangles, width, height, camera=PARALLEL, **options):
    """Return how often each triangle has a fragment at each pixel (height, width, T)."""
    corners = np.asarray(triangles, dtype=np.float64)
    x, y, depth = corners.reshape(-1, 3).T
    w = 1.0 if camera.is_parallel else depth
    vertices = np.stack([x * w, y * w, depth])
    faces, source = np.arange(3 * len(corners)).reshape(-1, 3).T, np.arange(len(corners))
    counts = np.zeros((height * width, len(corners)), int)
    for pixel, which in all_fragments(vertices, faces, source, camera, width, height, **options):
        np.add.at(counts, (pixel, which), 1)
    return counts.reshape(height, width, -1)


@pytest.mark.parametrize("batch", [1, 40, 2**15])
def test_all_fragments_are_those_of_integer_edge_functions_once_each(batch):
    triangles = random_triangles(seed=4, count=12, side=16)
    counts = fragment_counts(triangles, 16, 16, batch=batch)
    for number, triangle in enumerate(triangles):
        np.testing.assert_array_equal(counts[..., number], covered_by_edge_functions(triangle, 16, 16))


def test_the_nearest_of_all_fragments_is_what_the_z_buffer_keeps():
    """All triangles are level here, so the depth of a fragment is that of its triangle."""
    triangles = random_triangles(seed=5, count=30, side=24)
    triangles[:, :, 2] = np.random.default_rng(6).permutation(30)[:, None] + 1.0
    counts = fragment_counts(triangles, 24, 24)
    depth = np.where(counts == 1, triangles[:, 0, 2], np.inf)
    expected = np.where(counts.any(axis=2), depth.argmin(axis=2), -1)
    np.testing.assert_array_equal(drawn(triangles, 24, 24), expected)


def test_all_fragments_may_be_asked_for_beyond_the_far_plane():
    triangle = [[(0, 0, 50), (30, 0, 150), (0, 30, 150)]]
    near, all_of_it = (fragment_counts(triangle, 16, 16, far=far).sum() for far in (None, np.inf))
    assert 0 < near < all_of_it
    assert all_of_it == covered_by_edge_functions(triangle[0], 16, 16).sum()
