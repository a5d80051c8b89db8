"""Tests of volref.stages.raster."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.oracles import gpu_triangles
from volref.scene.camera import Camera
from volref.stages.raster import Fragments, depth_test, rasterize

SQUARE = np.array(
    [[-1.0, -1.0, 0.0, 1.0], [1.0, -1.0, 0.0, 1.0], [1.0, 1.0, 0.0, 1.0], [-1.0, 1.0, 0.0, 1.0]]
)
HALVES = np.array([[0, 1, 2], [0, 2, 3]])
ONE = np.array([[0, 1, 2]])
WIDTH, HEIGHT = 9, 7

# Quarters of a pixel: many corners and edges lie on pixel centres.
quarters = st.integers(0, 4 * WIDTH)
flat_corner = st.tuples(quarters, quarters, st.integers(-8, 8), st.sampled_from([0.25, 1.0, 3.0]))
seeds = st.integers(0, 2**32 - 1)


def corners_of(places):
    """Clip positions of (x, y in quarter pixels, z in eighths, w)."""
    x, y, z, w = np.array(places, dtype=float).T
    y = np.minimum(y, 4 * HEIGHT)
    return np.stack([(x / (2 * WIDTH) - 1) * w, (y / (2 * HEIGHT) - 1) * w, z / 8 * w, w], axis=1)


def jittered_mesh(seed, reach):
    """Triangles that tile the square |x|, |y| <= reach with moved vertices of different w."""
    random = np.random.default_rng(seed)
    steps = 5
    y, x = np.meshgrid(np.linspace(-1, 1, steps + 1), np.linspace(-1, 1, steps + 1), indexing="ij")
    inner = (np.abs(x) < 1) & (np.abs(y) < 1)
    # A quarter of the spacing would be the most that never turns a triangle over.
    x, y = (part + inner * random.integers(-2, 3, part.shape) / 32 for part in (x, y))
    w = random.choice([0.5, 1.0, 2.0], x.shape)
    vertices = np.stack([reach * x * w, reach * y * w, 0 * w, w], axis=2).reshape(-1, 4)
    a = (np.arange(steps)[:, None] * (steps + 1) + np.arange(steps)).ravel()
    b, c, d = a + 1, a + steps + 2, a + steps + 1
    return vertices, np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])


@given(st.tuples(flat_corner, flat_corner, flat_corner), st.sampled_from([2, 4, 8]))
@settings(max_examples=60)
def test_fragments_are_those_of_the_exact_half_planes(places, bits):
    corners = corners_of(places)
    varyings = np.array([[0.0, 1.0], [0.5, -2.0], [3.0, 0.25]])
    expected = gpu_triangles.fragments(corners, varyings, WIDTH, HEIGHT, bits)
    found = rasterize(corners, ONE, varyings, WIDTH, HEIGHT, subpixel_bits=bits)
    assert found.pixel.tolist() == [pixel for pixel, *_ in expected]
    assert found.front.tolist() == [front for *_, front in expected]
    for i, (_, window_z, inverse, values, _) in enumerate(expected):
        # Some twenty float64 roundings of numbers of the size of the corners' (w down to 1/4).
        np.testing.assert_allclose(found.window_z[i], float(window_z), rtol=0, atol=1e-13)
        np.testing.assert_allclose(found.inverse_w[i], float(inverse), rtol=1e-12)
        np.testing.assert_allclose(found.varyings[:, i], [float(v) for v in values], rtol=1e-12, atol=1e-12)


@given(seeds, st.sampled_from([4, 8, None]), st.sampled_from([1.0, 1.3, 4.0]))
@settings(max_examples=60)
def test_triangles_that_tile_the_viewport_cover_every_pixel_once(seed, bits, reach):
    vertices, triangles = jittered_mesh(seed, reach)
    fragments = rasterize(vertices, triangles, vertices, 32, 16, subpixel_bits=bits)
    np.testing.assert_array_equal(np.bincount(fragments.pixel, minlength=512), 1)
    assert fragments.front.all()


@given(seeds, st.sampled_from([4, None]), st.permutations([0, 1, 2]))
@settings(max_examples=40)
def test_the_order_of_corners_changes_nothing_but_the_front(seed, bits, order):
    vertices, triangles = jittered_mesh(seed, 1.3)
    plain, turned = (
        rasterize(vertices, some, vertices, 32, 16, subpixel_bits=bits)
        for some in (triangles, triangles[:, order])
    )
    np.testing.assert_array_equal(plain.pixel, turned.pixel)
    np.testing.assert_array_equal(plain.triangle, turned.triangle)
    even = order in ([0, 1, 2], [1, 2, 0], [2, 0, 1])
    np.testing.assert_array_equal(turned.front, even)
    # Rounding of float64 only.
    np.testing.assert_allclose(plain.varyings, turned.varyings, rtol=0, atol=1e-12)


@given(seeds)
@settings(max_examples=60)
def test_triangles_through_the_near_and_far_planes_keep_what_is_between(seed):
    random = np.random.default_rng(seed)
    corners = random.uniform(-2, 2, (3, 4))
    corners[:, 3] = random.uniform(-1, 2, 3)
    judged = [gpu_triangles.visible(corners, WIDTH, HEIGHT, pixel) for pixel in range(WIDTH * HEIGHT)]
    fragments = rasterize(corners, ONE, np.eye(3), WIDTH, HEIGHT)
    found = np.zeros(WIDTH * HEIGHT, dtype=bool)
    found[fragments.pixel] = True
    for pixel, (_, margin) in enumerate(judged):
        # Nearer to an edge than rounding decides nothing.
        assert found[pixel] == (margin > 0) or abs(margin) < 1e-9
    if not len(fragments.pixel):
        return
    weights = np.stack([judged[pixel][0] for pixel in fragments.pixel], axis=1)
    scale = np.abs(weights).max()
    np.testing.assert_allclose(fragments.inverse_w, weights.sum(axis=0), rtol=0, atol=1e-9 * scale)
    np.testing.assert_allclose(fragments.varyings * fragments.inverse_w, weights, rtol=0, atol=1e-9 * scale)
    np.testing.assert_array_equal(fragments.front, np.linalg.det(corners[:, [0, 1, 3]]) > 0)


def test_varyings_are_where_the_rays_of_the_pixels_meet_the_plane():
    camera = Camera.look_at((1.0, 2.0, 3.0), (0.1, 0.0, 0.0), (0.0, 1.0, 0.0), 40.0, 0.5, 20.0)
    world = np.array([[-2.0, 0.0, 1.0], [3.0, 0.5, 2.5], [0.0, -0.5, -4.0]])
    points = np.concatenate([world, np.ones((3, 1))], axis=1)
    clip = points @ (camera.clip_from_view(40, 30) @ camera.view_from_world).T
    fragments = rasterize(clip, ONE, world, 40, 30)
    normal = np.cross(world[1] - world[0], world[2] - world[0])
    assert len(fragments.pixel) > 200
    for i in range(0, len(fragments.pixel), 17):
        row, column = divmod(int(fragments.pixel[i]), 40)
        ndc = np.array([2 * (column + 0.5) / 40 - 1, 1 - 2 * (row + 0.5) / 30, 0.0, 1.0])
        there = np.linalg.solve(camera.clip_from_view(40, 30) @ camera.view_from_world, ndc)
        eye = np.array([1.0, 2.0, 3.0])
        direction = there[:3] / there[3] - eye
        met = eye + direction * (normal @ (world[0] - eye)) / (normal @ direction)
        # The solve with the projection loses about three digits of sixteen.
        np.testing.assert_allclose(fragments.varyings[:, i], met, rtol=0, atol=1e-11)
        view_z = camera.view_from_world[2] @ [*met, 1.0]
        np.testing.assert_allclose(fragments.inverse_w[i], -1 / view_z, rtol=1e-11)


def test_a_pixel_centre_on_an_edge_belongs_to_the_right_and_to_above():
    # A square from centre to centre of a 4 x 4 image: 3 x 3 centres on or in it, 2 x 2 are covered.
    small = SQUARE * [0.5, 0.5, 1, 1] + np.array([-0.25, 0.25, 0, 0])
    for bits in (4, None):
        fragments = rasterize(small, HALVES, SQUARE, 4, 4, subpixel_bits=bits)
        assert np.sort(fragments.pixel).tolist() == [4, 5, 8, 9]


def test_window_positions_are_rounded_half_to_even():
    # Edges at 8/16 + 1/32 and at 24/16 - 1/32 pixel: both go to an even sixteenth, so to pixel centres.
    left, right = ((sixteenths / 16 - 1) for sixteenths in (8.5, 23.5))
    corners = np.array([[left, -1, 0, 1], [right, -1, 0, 1], [right, 1, 0, 1], [left, 1, 0, 1]])
    snapped = rasterize(corners, HALVES, SQUARE, 2, 1, subpixel_bits=4)
    assert snapped.pixel.tolist() == [0]
    assert rasterize(corners, HALVES, SQUARE, 2, 1).pixel.tolist() == []


def test_culling_leaves_the_other_side():
    both = np.array([[0, 1, 2], [0, 3, 2]])
    assert set(rasterize(SQUARE, both, SQUARE, 4, 4, cull="front").triangle) == {1}
    assert set(rasterize(SQUARE, both, SQUARE, 4, 4, cull="back").triangle) == {0}
    assert set(rasterize(SQUARE, both, SQUARE, 4, 4).triangle) == {0, 1}


@pytest.mark.parametrize(("clip_z", "expected"), [("-1..1", 0.625), ("0..1", 0.25)])
def test_window_z_runs_from_near_to_far(clip_z, expected):
    fragments = rasterize(SQUARE + np.array([0, 0, 0.25, 0]), HALVES, SQUARE, 4, 4, clip_z=clip_z)
    np.testing.assert_array_equal(fragments.window_z, expected)
    before = rasterize(SQUARE - np.array([0, 0, 0.25, 0]), HALVES, SQUARE, 4, 4, clip_z=clip_z)
    assert len(before.pixel) == (16 if clip_z == "-1..1" else 0)


def test_attributes_of_snapped_and_unsnapped_corners_differ_by_the_snapping():
    # Corners at x = 2 + 1/32 and 6 + 1/32 pixels, rounded half to even to 2 and 6; the varying grows by 1/2
    # in a pixel, so 1/32 pixel is 1/64.
    corners = SQUARE * [0.5, 1, 1, 1] + np.array([1 / 128, 0, 0, 0])
    snapped, unsnapped = (
        rasterize(corners, HALVES, SQUARE[:, :1], 8, 2, subpixel_bits=4, planes=planes)
        for planes in ("snapped", "unsnapped")
    )
    np.testing.assert_array_equal(snapped.pixel, unsnapped.pixel)
    np.testing.assert_array_equal(snapped.varyings[0], (snapped.pixel % 8 + 0.5 - 2) / 2 - 1)
    np.testing.assert_array_equal(unsnapped.varyings, snapped.varyings - 1 / 64)


def test_a_guard_band_keeps_the_edges_of_what_it_does_not_cut():
    # From the lower left corner to far outside: cut at the frame, the edge ends on the grid there.
    corners = np.array([[-1.0, -1.0, 0.0, 1.0], [5.0, -1.0, 0.0, 1.0], [5.0, 0.7, 0.0, 1.0]])
    kept, cut = (
        rasterize(corners, ONE, corners, 64, 64, subpixel_bits=1, guard_band=band) for band in (8.0, 1.0)
    )
    assert len(kept.pixel) != len(cut.pixel)
    exact = rasterize(corners, ONE, corners, 64, 64)
    assert abs(len(kept.pixel) - len(exact.pixel)) < abs(len(cut.pixel) - len(exact.pixel))


def test_a_triangle_seen_edge_on_has_no_nan_where_snapping_gave_it_pixels():
    # Corners on the line y = x / 4, all numbers dyadic: exactly flat, but not on a grid of half pixels.
    x = np.array([-115.0, 10.0, 119.0]) / 128
    w = np.array([1.0, 2.0, 4.0])
    corners = np.stack([x * w, x / 4 * w, 0 * w, w], axis=1)
    fragments = rasterize(corners, ONE, np.eye(3), 64, 64, subpixel_bits=1, planes="unsnapped")
    assert len(fragments.pixel) > 0
    np.testing.assert_array_equal(fragments.inverse_w, 3 / 7)
    np.testing.assert_allclose(fragments.varyings, 1 / 3, rtol=1e-15)


def test_corners_in_the_plane_of_the_eye_do_no_harm():
    corners = np.array([[0.0, 0.0, 0.0, 1.0], [1.0, 0.0, 0.5, 0.0], [0.0, 1.0, 0.5, 0.0]])
    for bits in (4, None):
        fragments = rasterize(corners, ONE, corners, 8, 8, subpixel_bits=bits, planes="unsnapped")
        # On the screen x = u / (1 - u - v): the whole upper right quarter as far as the far plane.
        assert set(fragments.pixel % 8) == set(range(4, 8))
        place = (fragments.pixel % 8 + 0.5) / 4 - 1
        np.testing.assert_allclose(fragments.varyings[0] * fragments.inverse_w, place, rtol=0, atol=1e-12)


def test_float32_is_float64_rounded_to_a_few_ulp():
    vertices, triangles = jittered_mesh(1, 1.3)
    fine, coarse = (
        rasterize(vertices, triangles, vertices, 32, 16, subpixel_bits=4, dtype=dtype)
        for dtype in (np.float64, np.float32)
    )
    assert coarse.varyings.dtype == coarse.window_z.dtype == np.float32
    # Ten operations on numbers up to 4, each rounded to 2^-24 relative.
    np.testing.assert_allclose(coarse.varyings, fine.varyings, rtol=0, atol=40 * 2.0**-24)


@pytest.mark.parametrize("triangles", [np.zeros((0, 3), dtype=int), np.array([[0, 0, 1]]), ONE])
def test_nothing_to_draw_is_no_fragments(triangles):
    behind = SQUARE * [1, 1, 1, -1]
    fragments = rasterize(behind, triangles, SQUARE, 4, 4, subpixel_bits=4)
    assert fragments.pixel.shape == (0,)
    assert fragments.varyings.shape == (4, 0)
    assert depth_test(fragments, 16).shape == (0,)


def drawn(pixel, window_z):
    zero = np.zeros(len(pixel))
    return Fragments(np.array(pixel), zero.astype(int), np.array(window_z), zero, zero[None], zero == 0)


@given(
    st.lists(st.tuples(st.integers(0, 5), st.integers(0, 4)), min_size=1), st.sampled_from([16, 24, 32, None])
)
def test_a_depth_test_is_the_loop_over_fragments(given_fragments, bits):
    pixel, steps = (list(part) for part in zip(*given_fragments, strict=True))
    buffer, owner = dict.fromkeys(range(6), 4), {}
    for i, (place, step) in enumerate(given_fragments):
        if step < buffer[place]:
            buffer[place], owner[place] = step, i
    survivors = depth_test(drawn(pixel, np.array(steps) / 4), 6, depth_bits=bits)
    assert survivors.tolist() == [owner[place] for place in sorted(owner)]


def test_depths_tie_as_the_buffer_holds_them():
    near = drawn([0, 0], [0.4, 0.4 - 1e-9])
    assert [int(depth_test(near, 1, depth_bits=bits)[0]) for bits in (None, 32, 24, 16)] == [1, 0, 0, 0]
    apart = drawn([0, 0], [0.4, 0.4 - 2.0**-20])
    assert [int(depth_test(apart, 1, depth_bits=bits)[0]) for bits in (32, 24, 16)] == [1, 1, 0]
    assert depth_test(drawn([0], [0.5]), 1, clear=0.5).tolist() == []
