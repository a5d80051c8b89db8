"""The image while it is filled in, and the parts that fill it."""

import dataclasses
import tracemalloc

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import volref as vr
from tests.scenes import camera_towards, rough_scene
from volref.phantoms.meshes import sphere_mesh
from volref.scene.footprint import Rectangle
from volref.truth.canvas import Canvas, light_behind
from volref.truth.integration import Integrated, worker
from volref.truth.meshes.surfaces import visible_surface
from volref.truth.parts import cut, runs, tiles

BACKGROUND = (0.1, 0.2, 0.3, 0.5)


def with_a_ball(scene):
    return dataclasses.replace(
        scene, meshes=[sphere_mesh(1.5, scene.volume.corners.mean(axis=0), colors=(0.9, 0.4, 0.1))]
    )


def every_pixel(parts):
    return [pixel for i in range(parts.count) for pixel in parts.pixels(i).tolist()]


@given(st.integers(1, 70), st.integers(1, 40))
def test_tiles_cover_each_pixel_once_and_are_connected(width, height):
    parts = tiles(rough_scene(width, height), Rectangle(0, width, 0, height))
    assert sorted(every_pixel(parts)) == list(range(width * height))
    for i in range(parts.count):
        y, x = np.divmod(parts.pixels(i), width)
        assert (np.ptp(x) < 32) & (np.ptp(y) < 16)
        assert len(parts.pixels(i)) == (np.ptp(x) + 1) * (np.ptp(y) + 1)


@given(st.integers(0, 50), st.integers(1, 60))
def test_runs_are_the_pixels_in_order(pixels, length):
    assert every_pixel(runs(pixels, length)) == list(range(pixels))
    chosen = np.arange(pixels) * 3
    assert every_pixel(cut(chosen, length)) == chosen.tolist()


@given(st.lists(st.integers(0, 6), max_size=5), st.integers(1, 4))
def test_some_parts_are_those_that_were_chosen_and_groups_hold_each_once(chosen, size):
    parts = runs(20, 3)
    some = parts.only(chosen)
    assert [some.pixels(i).tolist() for i in range(some.count)] == [parts.pixels(i).tolist() for i in chosen]
    groups = some.grouped(size)
    assert [i for group in groups for i in group] == list(range(len(chosen)))
    assert all(len(group) == size for group in groups[:-1])


def test_behind_lies_the_surface_or_the_background():
    scene = with_a_ball(rough_scene(24, 16, background=BACKGROUND))
    surface = visible_surface(scene)
    pixels = np.arange(24 * 16)
    behind = light_behind(scene, surface, pixels)
    hit = np.isfinite(surface.distance).ravel()
    assert hit.any()
    np.testing.assert_array_equal(behind[~hit], np.tile(BACKGROUND, ((~hit).sum(), 1)))
    np.testing.assert_array_equal(behind[hit], np.tile((0.9, 0.4, 0.1, 1.0), (hit.sum(), 1)))
    for given_surface in (surface, None):
        canvas = Canvas(scene, given_surface)
        np.testing.assert_array_equal(canvas.all_behind(), canvas.behind(pixels))
        canvas.show_what_lies_behind()
        np.testing.assert_array_equal(canvas.rgba, canvas.behind(pixels))
        assert not canvas.bound.any()


def test_of_a_pixel_that_nothing_reached_nothing_is_claimed():
    canvas = Canvas(rough_scene(4, 3), None)
    assert np.isinf(canvas.bound).all()


def test_what_was_known_better_stays():
    canvas = Canvas(rough_scene(2, 1), None)
    both = np.array([0, 1])

    def known(color, *bound, samples):
        return Integrated(np.full((len(bound), 4), color), np.array(bound), samples, worker())

    canvas.put(both, known(0.1, 0.3, 0.3, samples=5))
    canvas.put(both, known(0.2, 0.2, 0.4, samples=7), only_better=True)
    assert (canvas.rgba[:, 0].tolist(), canvas.bound.tolist(), canvas.samples) == ([0.2, 0.1], [0.2, 0.3], 12)
    canvas.put(both[:1], known(0.5, 0.9, samples=1))
    assert (canvas.rgba[:, 0].tolist(), canvas.bound.tolist()) == ([0.5, 0.1], [0.9, 0.3])


@pytest.mark.parametrize(
    ("side", "words"), [(384, {"method": "march"}), (192, {"method": "exact"}), (192, {"max_seconds": 1e6})]
)
def test_beside_the_image_memory_does_not_grow_with_the_image(side, words):
    scene = rough_scene(192, 192)
    scene = dataclasses.replace(scene, camera=camera_towards(scene.volume, distance=300.0))
    beside = []
    for length in (8, side, 2 * side):  # the first time something is imported
        tracemalloc.start()
        vr.render(dataclasses.replace(scene, width=length, height=length), threads=1, **words)
        # rgba, bound and distance are 6 numbers a pixel
        beside.append(tracemalloc.get_traced_memory()[1] - 6 * 8 * length**2)
        tracemalloc.stop()
    # One number more for each pixel would be 4 times as much.
    assert beside[2] - beside[1] < 8 * (4 - 1) * side**2 / 4
