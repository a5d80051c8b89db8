"""Modes that reduce a ray to one value, against the same at 60 digits and against scalar loops.

Rays are given in index space: the volumes lie so that it is the world.
"""

import dataclasses
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mpmath import mp

import volref as vr
from tests.oracles.scalar import table_value
from tests.scenes import camera_towards, colorful_transfer, rough_volume
from volref import Camera, Scene, TransferFunction, Volume
from volref.phantoms.meshes import sphere_mesh
from volref.records import Rays
from volref.scene.transform import transform_directions, transform_points
from volref.stages.rays import pixel_rays
from volref.truth.digits.lattice import cells_along, corner_samples, exact_point, exact_span
from volref.truth.digits.reduced import first_meeting, layer, reduced_value
from volref.truth.modes import reductions
from volref.truth.modes.reductions import prepare_reduction, reduce_pixels

EXTREMES = ("mip", "minip")
MODES = (*EXTREMES, "average")
CAMERA = Camera.look_at((0, 0, -9), (0, 0, 0), (0, 1, 0), 30.0, 0.1, 100.0)
BEHIND = (0.1, 0.2, 0.3, 0.5)
DIGITS = 60


def drawn(scene, begin=0.0, distance=np.inf, tolerance=1e-12):
    """All rays of a scene, reduced."""
    count = scene.width * scene.height
    behind = np.tile(np.array(scene.background), (count, 1))
    end = np.full(count, float(distance))
    return reduce_pixels(scene, prepare_reduction(scene), np.arange(count), begin, end, behind, tolerance)


def shot(volume, transfer, mode, origins, directions, *, begin=0.0, distance=np.inf, **words):
    """Rays (R, 3) of index space, reduced."""
    origins, directions = (np.array(x, float).reshape(-1, 3) for x in (origins, directions))
    scene = Scene(volume, transfer, CAMERA, len(origins), 1, mode=mode, background=BEHIND, **words)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(reductions, "pixel_rays", lambda *words: Rays(origins[words[3]], directions[words[3]]))
        return drawn(scene, begin, distance)


def index_rays(scene):
    rays = pixel_rays(scene.camera, scene.width, scene.height, np.arange(scene.width * scene.height))
    matrix = scene.volume.index_from_world
    origins = transform_points(matrix, rays.origins).tolist()
    return zip(origins, transform_directions(matrix, rays.directions).tolist(), strict=True)


def assert_certified(out, volume, transfer, mode, rays, *, begin=0.0, distance=np.inf, isovalue=None):
    """Every ray is within its bound of the same ray at 60 digits."""
    with mp.workdps(DIGITS):
        for k, (origin, direction) in enumerate(rays):
            ray = volume, origin, direction, begin, distance
            if mode == "isosurface":
                t = first_meeting(mp, isovalue, *ray)
                color = [table_value(transfer.values, c, isovalue) for c in transfer.colors.T]
                truth = BEHIND if t is None else (*color, 1.0)
                hit = np.inf if t is None else t
                off = 0.0 if hit == out.hit[k] else abs(hit - out.hit[k])
                assert off <= out.off[k], (k, float(off), out.off[k])
            else:
                value = reduced_value(mp, mode, *ray)
                truth = BEHIND if value is None else layer(mp, transfer, value, BEHIND)
            error = max(abs(a - b) for a, b in zip(truth, out.rgba[k].tolist(), strict=True))
            assert error <= out.bound[k], (k, float(error), out.bound[k])


@pytest.mark.parametrize("mode", [*MODES, "isosurface"])
def test_every_ray_through_noise_is_within_its_bound_which_is_near_rounding(mode):
    volume, transfer = rough_volume(1, spacing=(1.0, 1.3, 0.7)), colorful_transfer()
    words = {"isovalue": 0.5} if mode == "isosurface" else {}
    scene = Scene(volume, transfer, camera_towards(volume), 12, 9, mode=mode, background=BEHIND, **words)
    out = drawn(scene)
    assert_certified(out, volume, transfer, mode, index_rays(scene), **words)
    # The values are off by some 100 roundings of 1e-16, and the table's steepest slope is 2.5.
    assert out.bound.max() < 1e-12


COLORS = np.array(
    [(0.2, 0, 1), (1, 0.6, 0.1), (0.9, 0.9, 0.3), (0.1, 0.9, 0.3), (0.5, 0.5, 0.5), (0, 0.1, 0)]
)


@st.composite
def cases(draw):
    """A small volume, a table whose knots may lie at its values, and rays that like planes and edges."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    shape = draw(st.tuples(*[st.integers(2, 4)] * 3))
    values = draw(
        st.sampled_from(
            [
                rng.random(shape),
                rng.integers(0, 3, shape).astype(float),
                1.0 + (rng.random(shape) < 0.2),
                1e6 + rng.random(shape) * 10.0 ** rng.integers(-9, 3),
            ]
        )
    )
    volume = Volume(values, centering=draw(st.sampled_from(["cell", "node"])))
    low, high = volume.value_bounds
    count = draw(st.integers(1, 4))
    anywhere = low + max(high - low, 1e-3) * rng.random(count)
    knots = np.sort(np.where(rng.random(count) < 0.5, rng.choice(values.ravel(), count), anywhere)).tolist()
    knots = [v for i, v in enumerate(knots) if knots[max(0, i - 2) : i].count(v) < 2]
    strength = rng.random(len(knots)) * (rng.random(len(knots)) < 0.8)
    colors, size = COLORS[rng.integers(0, 6, len(knots))], 10.0 ** rng.integers(-2, 3)
    if draw(st.booleans()):
        transfer = TransferFunction(knots, colors, strength * size)
    else:
        opacity = np.where(rng.random(len(knots)) < 0.2, 1.0, strength)
        transfer = TransferFunction(knots, colors, opacity=opacity, unit_distance=size)
    directions = rng.normal(size=(4, 3)) * rng.choice([1.0, 1.0, 0.0, 1e-9], (4, 3))
    directions[np.abs(directions).max(axis=1) < 1e-6] = [0.0, 1.0, 0.5]
    targets = np.where(rng.random((4, 3)) < 0.4, rng.integers(-1, 8, (4, 3)) / 2, rng.random((4, 3)) * 4)
    origins = targets - rng.choice([0.0, 5.0, 1000.0]) * directions
    limits = {"begin": draw(st.sampled_from([0.0, 4.5])), "distance": draw(st.sampled_from([np.inf, 6.0]))}
    isovalue = draw(st.sampled_from([float(rng.choice(values.ravel())), float(anywhere[0])]))
    return volume, transfer, origins, directions, limits, isovalue


def assert_case_is_certified(case):
    volume, transfer, origins, directions, limits, isovalue = case
    rays = list(zip(origins.tolist(), directions.tolist(), strict=True))
    for mode in (*MODES, "isosurface"):
        words = {"isovalue": isovalue} if mode == "isosurface" else {}
        out = shot(volume, transfer, mode, origins, directions, **limits, **words)
        assert_certified(out, volume, transfer, mode, rays, **limits, **words)


@settings(max_examples=40)
@given(cases())
def test_any_ray_through_any_small_scene_is_within_its_bound(case):
    assert_case_is_certified(case)


@pytest.mark.slow
@settings(max_examples=2000)
@given(cases())
def test_thousands_of_them_are(case):
    assert_case_is_certified(case)


def assert_rays_are_certified(volume, origins, directions, isovalue):
    transfer = opacity_of(*volume.value_bounds)
    rays = list(zip(origins.tolist(), directions.tolist(), strict=True))
    for mode in (*MODES, "isosurface"):
        words = {"isovalue": isovalue} if mode == "isosurface" else {}
        out = shot(volume, transfer, mode, origins, directions, **words)
        assert_certified(out, volume, transfer, mode, rays, **words)


def test_rays_that_touch_an_edge_of_the_box_may_or_may_not_have_a_span():
    rng = np.random.default_rng(0)
    z, _, x = np.mgrid[:3, :3, :3].astype(float)
    # At the edge x = 0, z = 2 the value is 0, and forwards and upwards there is no room behind it.
    directions = np.stack([rng.random(200) + 0.1, rng.normal(size=200), rng.random(200) + 0.1], axis=1)
    edge = np.stack([np.zeros(200), rng.random(200) * 2, np.full(200, 2.0)], axis=1)
    origins = edge - np.where(rng.random(200) < 0.5, 3.0, 700.0)[:, None] * directions
    assert_rays_are_certified(Volume(x - (2 - z), centering="node"), origins, directions, 0.0)


def test_where_a_ray_leaves_by_a_face_that_it_hardly_moves_towards_is_known_to_few_digits():
    rng = np.random.default_rng(1)
    directions = rng.normal(size=(150, 3)) * [1.0, 1e-9, 0.3]
    exits = np.stack([rng.random(150) + 1, np.full(150, 3.5), rng.random(150) + 1], axis=1)
    directions[:, 1] = np.abs(directions[:, 1])
    origins = exits - 1.5 * directions
    volume = rough_volume(8, shape=(4, 4, 4))
    assert_rays_are_certified(volume, origins, directions, float(volume.values[1, 3, 1]))


def opacity_of(low, high):
    """A table whose opacity is the value, from 0 at `low` to 1 at `high`: an image then shows values."""
    return TransferFunction([low, high], [(1, 1, 1)] * 2, opacity=[0, 1])


def values_of(volume, mode, origins, directions):
    """The value that each ray is reduced to, where there is one."""
    low, high = volume.value_bounds
    return low + (high - low) * value_of_alpha(shot(volume, opacity_of(low, high), mode, origins, directions))


def value_of_alpha(out):
    return (out.rgba[:, 3] - BEHIND[3]) / (1 - BEHIND[3])


def exact_value(values, place):
    """The trilinear value at a point of index space, in fractions."""
    cell = tuple(int(p // 1) for p in place)
    x, y, z = (p - c for p, c in zip(place, cell, strict=True))
    total = Fraction(0)
    for k, sample in enumerate(corner_samples(values, cell)):
        total += (
            Fraction(sample) * (x if k & 1 else 1 - x) * (y if k & 2 else 1 - y) * (z if k & 4 else 1 - z)
        )
    return total


def rays_into(volume, count, seed=0):
    rng = np.random.default_rng(seed)
    targets = rng.random((count, 3)) * (np.array(volume.size) - 1)
    directions = rng.normal(size=(count, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    return targets - 40 * directions, directions


def test_extremes_are_within_4_ulp_of_the_true_ones():
    volume = rough_volume(3, shape=(32,) * 3)
    origins, directions = rays_into(volume, 25)
    ulp = np.spacing(volume.value_bounds[1])
    for mode in EXTREMES:
        found = values_of(volume, mode, origins, directions)
        with mp.workdps(DIGITS):
            for value, origin, direction in zip(found, origins.tolist(), directions.tolist(), strict=True):
                # 2 ulp more: the value is read off an opacity.
                assert abs(value - reduced_value(mp, mode, volume, origin, direction)) <= 6 * ulp


@pytest.mark.parametrize("size", [5, 24])
def test_the_greatest_value_is_never_below_a_dense_sampling_by_more_than_4_ulp(size):
    volume = rough_volume(3, shape=(size,) * 3)
    origins, directions = rays_into(volume, 12)
    found = values_of(volume, "mip", origins, directions)
    low, high = (exact_point(corner.tolist()) for corner in volume.index_bounds)
    for value, origin, direction in zip(found, origins.tolist(), directions.tolist(), strict=True):
        ray = exact_point(origin), exact_point(direction)
        start, end = exact_span(*ray, low, high, np.inf)
        sampled = max(
            exact_value(
                volume.values, [o + d * (start + (end - start) * k / 400) for o, d in zip(*ray, strict=True)]
            )
            for k in range(401)
        )
        # 2 ulp more: the value is read off an opacity.
        assert value >= float(sampled) - 6 * np.spacing(volume.value_bounds[1])


@settings(max_examples=20)
@given(st.integers(0, 1000))
def test_least_mean_and_greatest_are_in_order(seed):
    volume = rough_volume(seed)
    least, mean, most = (
        values_of(volume, mode, *rays_into(volume, 20, seed)) for mode in ("minip", "average", "mip")
    )
    # The mean is off by some roundings.
    assert (least <= mean + 1e-14).all()
    assert (mean <= most + 1e-14).all()
    assert (most - least).max() > 0.3


@settings(max_examples=20)
@given(st.integers(0, 1000))
def test_the_greatest_value_is_minus_the_least_of_minus_the_field(seed):
    volume = rough_volume(seed)
    rays = rays_into(volume, 20, seed)
    most = values_of(volume, "mip", *rays)
    least = values_of(Volume(-volume.values), "minip", *rays)
    # Values in 0..1 are read off opacities: a few ulp.
    np.testing.assert_allclose(most, -least, rtol=0, atol=8 * 2.0**-53)


def test_the_mean_of_a_straight_field_is_its_value_in_the_middle():
    z, y, x = np.mgrid[:5, :6, :7].astype(float)
    volume = Volume(0.25 * x + 0.5 * y - z, centering="node")
    # In through z = 4 at t = 25/6, but x = 0 only at t = 5; out through x = 6 and y = 5 at t = 12.5.
    origin, direction = np.array([[-4.0, 0.5, 6.0]]), np.array([[0.8, 0.36, -0.48]])
    found = values_of(volume, "average", origin, direction)[0]
    middle = origin[0] + 8.75 * direction[0]
    assert found == pytest.approx(0.25 * middle[0] + 0.5 * middle[1] - middle[2], abs=1e-13)


def sphere(size=24, radius=7.3):
    z, y, x = np.mgrid[:size, :size, :size] - (size - 1) / 2
    return Volume(np.sqrt(x * x + y * y + z * z)), radius


def test_the_isosurface_of_a_sphere_lies_within_1e_12_of_the_trilinear_root():
    volume, radius = sphere()
    origins, directions = rays_into(volume, 60)
    out = shot(volume, opacity_of(0, 20), "isosurface", origins, directions, isovalue=radius)
    low, high = (exact_point(corner.tolist()) for corner in volume.index_bounds)
    hits = 0
    for k, (origin, direction) in enumerate(zip(origins.tolist(), directions.tolist(), strict=True)):
        ray = exact_point(origin), exact_point(direction)
        span = exact_span(*ray, low, high, np.inf)

        def above(t, ray=ray):
            return exact_value(volume.values, [o + d * t for o, d in zip(*ray, strict=True)]) - Fraction(
                radius
            )

        edges = [t for t, _, _ in cells_along(*ray, span)]
        inside = next((i for i, t in enumerate(edges) if above(t) < 0), None)
        if inside is None:
            continue
        near, far = edges[inside - 1], edges[inside]
        while far - near > Fraction(1, 10**15):
            middle = (near + far) / 2
            near, far = (near, middle) if above(middle) < 0 else (middle, far)
        hits += 1
        assert abs(out.hit[k] - float(far)) <= 1e-12
        assert out.off[k] <= 1e-10  # which allows for slopes along the ray down to 0.01
        assert out.bound[k] < 1e-14
    assert hits > 20


@settings(max_examples=10)
@given(st.tuples(*[st.floats(-50, 50)] * 3), st.floats(-3, 3))
def test_the_distance_of_the_isosurface_stays_when_volume_and_camera_move_together(shift, angle):
    volume, radius = sphere(12, 4.0)
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])

    def distances(turn, shift):
        moved = Volume(volume.values, origin=shift, direction=turn)
        points = (turn @ np.array(p) + shift for p in [(30, 8, 9), (6, 6, 6)])
        camera = Camera.look_at(*points, turn @ np.array([0.0, 0.1, 1.0]), 20.0, 0.1, 100.0)
        return drawn(Scene(moved, opacity_of(0, 20), camera, 12, 12, mode="isosurface", isovalue=radius)).hit

    here, there = distances(np.eye(3), np.zeros(3)), distances(turn, np.array(shift))
    both = np.isfinite(here) & np.isfinite(there)
    assert both.sum() > 30
    # Rounding of coordinates up to 100, through a surface seen at an angle.
    np.testing.assert_allclose(there[both], here[both], rtol=0, atol=1e-10)


RAMP = Volume(np.array([0.0, 1.0, 2.0, 3.0, 4.0]).reshape(1, 1, 5), centering="cell")
ALONG = [(-1.0, 0.0, 0.0)], [(1.0, 0.0, 0.0)]


def test_a_ray_that_starts_above_the_isovalue_meets_it_where_it_crosses():
    back = [(4.0, 0.0, 0.0)], [(-1.0, 0.0, 0.0)]
    assert shot(RAMP, opacity_of(0, 4), "isosurface", *back, isovalue=1.5).hit.tolist() == [2.5]
    assert shot(RAMP, opacity_of(0, 4), "isosurface", *back, begin=3.0, isovalue=1.5).hit.tolist() == [np.inf]


def test_a_ray_that_starts_at_the_isovalue_meets_it_there_although_rounding_might_have_it_otherwise():
    out = shot(RAMP, opacity_of(0, 4), "isosurface", *ALONG, begin=2.5, isovalue=1.5)
    assert out.hit.tolist() == [2.5]
    assert out.bound[0] > 0.3  # white, or what lies behind


def test_an_isovalue_that_is_only_touched_has_the_contrast_as_its_bound():
    bump = Volume(np.array([0.0, 1.0, 0.0]).reshape(1, 1, 3))
    out = shot(bump, opacity_of(0, 1), "isosurface", *ALONG, isovalue=1.0)
    assert out.off.tolist() == [np.inf]
    assert out.bound[0] == pytest.approx(0.9)  # red: 1 here, 0.1 behind


def test_a_surface_and_where_a_ray_begins_cut_its_span():
    found = {
        mode: value_of_alpha(shot(RAMP, opacity_of(0, 4), mode, *ALONG, begin=2.0, distance=4.0))[0] * 4
        for mode in MODES
    }
    assert found == pytest.approx({"mip": 3.0, "minip": 1.0, "average": 2.0}, abs=1e-14)
    out = shot(RAMP, opacity_of(0, 4), "mip", *ALONG, begin=4.0, distance=4.0)
    assert out.rgba.tolist() == [list(BEHIND)]
    assert out.bound.tolist() == [0.0]


def test_a_ray_beside_the_volume_shows_what_lies_behind():
    for mode in MODES:
        out = shot(RAMP, opacity_of(0, 4), mode, [(-1.0, 3.0, 0.0)], [(1.0, 0.0, 0.0)])
        assert out.rgba.tolist() == [list(BEHIND)]
        assert out.bound.tolist() == [0.0]


def test_a_greatest_value_on_a_jump_of_the_table_may_have_either_colour_unless_no_value_lies_beyond():
    bump = Volume(np.array([0.0, 1.0, 0.5, 2.0]).reshape(1, 1, 4))
    jump = TransferFunction([1, 1], [(0, 0, 0), (1, 1, 1)], opacity=[1, 1])
    assert shot(bump, jump, "mip", *ALONG, distance=2.5).bound[0] == pytest.approx(1.0)
    top = TransferFunction([2, 2], [(0, 0, 0), (1, 1, 1)], opacity=[1, 1])
    assert shot(Volume(np.full((1, 1, 4), 2.0)), top, "mip", *ALONG).bound[0] < 1e-14


def test_rays_reduced_in_many_parts_are_the_same(monkeypatch):
    volume = rough_volume(2)
    scene = Scene(volume, colorful_transfer(), camera_towards(volume), 12, 9, mode="mip")
    whole = drawn(scene)
    monkeypatch.setattr(reductions, "CROSSINGS", 64)
    parts = drawn(scene)
    np.testing.assert_array_equal(parts.rgba, whole.rgba)
    np.testing.assert_array_equal(parts.bound, whole.bound)
    assert parts.pieces == whole.pieces


@pytest.mark.parametrize("mode", [*MODES, "isosurface", "slice"])
def test_verify_finds_images_of_all_modes_within_their_bounds_and_a_wrong_one_outside(mode):
    volume = rough_volume(7, spacing=(1.0, 1.3, 0.7), origin=(3.0, -2.0, 7.0))
    words = {"isovalue": 0.5} if mode == "isosurface" else {}
    words |= {"slice_plane": vr.Plane((5, 1, 9), (1, 0.3, 0.5))} if mode == "slice" else {}
    ball = sphere_mesh(1.0, (6.0, 1.0, 9.0), (0.9, 0.2, 0.1))
    scene = Scene(volume, colorful_transfer(), camera_towards(volume), 12, 9, [ball], mode=mode, **words)
    out = vr.render(scene)
    assert out.bound_kind == "certified"
    assert vr.verify(scene, out, 40).ok
    wrong = dataclasses.replace(out, rgba=np.where(out.rgba == 0, 0, out.rgba + 1e-9))
    assert not vr.verify(scene, wrong, 40).ok
