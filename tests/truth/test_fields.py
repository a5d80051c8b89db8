"""What a march goes through, against scalar loops: gradients, lights, tables, orders of look-up, radars.

Images are small and their volumes rough: every difference of a formula shows.
"""

import dataclasses
import functools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import volref as vr
from tests.oracles import lit_ray, polar, scalar
from tests.radars import uneven
from tests.scenes import colorful_transfer, rough_volume, sparse_scene
from volref.scene.scene import GRADIENTS
from volref.stages.sampling import PAD, bare_grid
from volref.truth.fields import field_of
from volref.truth.fields.field import Samples
from volref.truth.fields.plain import plain_field
from volref.truth.fields.shaded import shaded_field
from volref.workspace import Workspace

EPS = np.finfo(np.float64).eps
WIDTH, HEIGHT = 8, 6
STEP = 0.5

march = functools.partial(vr.render, method="march", tolerance=1e-12)
march_plan = functools.partial(vr.plan, method="march", tolerance=1e-12)

TURN = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
SKEW = np.array([[1.0, 0.28, 0.0], [0.0, 0.96, 0.6], [0.0, 0.0, 0.8]])
PLACES = {
    "straight": {"spacing": (1.0, 0.8, 1.7), "origin": (3, -2, 5)},
    "turned": {"spacing": (1.0, 0.6, 1.3), "origin": (-1, 2, 0.5), "direction": TURN},
    "left-handed": {"spacing": (0.9, 1.1, 0.7), "direction": TURN * [1, -1, 1], "centering": "node"},
    "skew": {"spacing": (1.2, 0.8, 0.9), "origin": (0, 0, 4), "direction": SKEW},
}

LAMPS = {
    "ambient": [vr.Light.ambient((0.5, 0.8, 1.0))],
    "directional": [vr.Light.directional((1, 2, -1), (0.9, 0.7, 1.0))],
    "point": [vr.Light.point((6, 2, 4), (1.0, 0.9, 0.8), (1.0, 0.05, 0.02))],
    "headlight": [vr.Light.headlight((0.8, 0.9, 1.0))],
}
LAMPS["all"] = [light for lamps in LAMPS.values() for light in lamps]

EDGES = ([0.1, 0.4, 0.4, 1.2], [0.0, 0.3, 0.6, 1.0])


def opacity_transfer(**more):
    """Opacities that change throughout, up to 0.9, without a jump."""
    colors = [(0.2, 0.0, 1.0), (0.2, 0.4, 1.0), (1.0, 0.6, 0.1), (0.9, 0.9, 0.3)]
    knots, opacity = [0, 0.3, 0.6, 1], [0, 0.1, 0.5, 0.9]
    return vr.TransferFunction(knots, colors, opacity=opacity, unit_distance=1.5, **more)


def extinction_transfer(**more):
    plain = colorful_transfer()
    return vr.TransferFunction(plain.values, plain.colors, plain.extinction, **more)


def square_transfer():
    """A random table of value and gradient magnitude, clear for the lowest values."""
    rgba = np.random.default_rng(2).random((4, 6, 4))
    rgba[:, 0, 3] = 0.0
    return vr.TransferFunction2D(rgba, (0, 1), (0, 1.5), unit_distance=0.8)


def seen_from(volume, direction=(1.1, 0.7, 0.9), kind="perspective"):
    """A camera that sees the whole volume, and a function that gives its rays, both from the same numbers."""
    low, high = volume.corners.min(axis=0), volume.corners.max(axis=0)
    center, size = (low + high) / 2, float(np.linalg.norm(high - low))
    eye = center + np.array(direction) / np.linalg.norm(direction) * size * 1.25
    up, place = (0, 0, 1), (WIDTH, HEIGHT)
    if kind == "perspective":
        camera = vr.Camera.look_at(eye, center, up, 35.0, size / 100, size * 10)
        return camera, lambda x, y: scalar.look_at_ray(eye.tolist(), center, up, 35.0, *place, x, y)
    camera = vr.Camera.orthographic(eye, center, up, size * 0.8, 0.5, size * 10)
    return camera, lambda x, y: lit_ray.orthographic_ray(eye, center, up, size * 0.8, 0.5, *place, x, y)


def scene_with(place="straight", transfer=None, kind="perspective", seed=0, **more):
    volume = rough_volume(seed, (5, 4, 6), **PLACES[place])
    camera, ray = seen_from(volume, kind=kind)
    background = (0.1, 0.2, 0.3, 0.5)
    transfer = transfer or extinction_transfer()
    return vr.Scene(volume, transfer, camera, WIDTH, HEIGHT, background=background, **more), ray


def check_against_the_loop(scene, ray, tolerance=1e-12):
    """Positions agree to some ulp of distances of 20, 1e-14, times slopes of the look of up to 30 or so."""
    out = march(scene, plan=march_plan(scene, step=STEP))
    look = lit_ray.Look(scene)
    for y in range(HEIGHT):
        for x in range(WIDTH):
            expected = lit_ray.lit_ray(look, *ray(x, y), STEP)
            np.testing.assert_allclose(out.rgba[y, x], expected, rtol=0, atol=tolerance)
    assert np.ptp(out.rgba[..., 3]) > 0.05  # there is something to see


# Each gradient, model, light and place at least twice, and in pairs that do not repeat.
LIT = [
    ("central", "lambert", "directional", "straight", "perspective"),
    ("central", "phong", "point", "turned", "orthographic"),
    ("central", "blinn-phong", "all", "left-handed", "perspective"),
    ("sobel", "lambert", "headlight", "left-handed", "orthographic"),
    ("sobel", "phong", "all", "skew", "perspective"),
    ("sobel", "blinn-phong", "directional", "turned", "perspective"),
    ("analytic", "lambert", "point", "skew", "perspective"),
    ("analytic", "phong", "headlight", "straight", "orthographic"),
    ("analytic", "blinn-phong", "all", "turned", "perspective"),
    ("analytic", "unlit", "all", "straight", "perspective"),
    ("central", "phong", "ambient", "skew", "orthographic"),
]


@pytest.mark.parametrize(("gradient", "model", "lamps", "place", "kind"), LIT)
def test_lit_images_equal_the_scalar_loop(gradient, model, lamps, place, kind):
    material = vr.Material(model, specular=0.5, shininess=4.0, two_sided=place == "skew")
    more = {"gradient": gradient, "lights": LAMPS[lamps], "material": material}
    transfer = opacity_transfer() if kind == "orthographic" else None
    check_against_the_loop(*scene_with(place, transfer, kind, **more))


@pytest.mark.parametrize("gradient", GRADIENTS)
@pytest.mark.parametrize("lamps", ["none", "all"])
@pytest.mark.parametrize("make", [extinction_transfer, opacity_transfer])
def test_images_with_gradient_opacity_equal_the_scalar_loop(gradient, lamps, make):
    lights = LAMPS.get(lamps, [])
    transfer = make(gradient_opacity=EDGES)
    check_against_the_loop(*scene_with("turned", transfer, gradient=gradient, lights=lights))


@pytest.mark.parametrize("gradient", GRADIENTS)
@pytest.mark.parametrize("lamps", ["none", "point"])
def test_images_of_tables_of_value_and_gradient_equal_the_scalar_loop(gradient, lamps):
    lights = LAMPS.get(lamps, [])
    check_against_the_loop(*scene_with("skew", square_transfer(), gradient=gradient, lights=lights))


@pytest.mark.parametrize("place", ["straight", "left-handed"])
@pytest.mark.parametrize("classification", ["pre", "per-slice"])
@pytest.mark.parametrize("make", [extinction_transfer, opacity_transfer])
def test_images_classified_before_interpolation_equal_the_scalar_loop(classification, place, make):
    check_against_the_loop(*scene_with(place, make(), classification=classification))


@pytest.mark.parametrize("beam", ["straight", "4/3-earth"])
@pytest.mark.parametrize("make", [extinction_transfer, opacity_transfer])
def test_images_of_radars_equal_the_scalar_loop(make, beam):
    radar = uneven(3, beam=beam)
    plain = make()
    knots = plain.values * 60 - 10
    # Even what has no echo is seen, and what has no data is not.
    opacity = None if plain.opacity is None else 0.05 + plain.opacity
    extinction = None if plain.extinction is None else (0.1 + plain.extinction) / 200
    transfer = vr.TransferFunction(
        knots, plain.colors, opacity=opacity, extinction=extinction, unit_distance=300.0
    )
    low, high = (bound.tolist() for bound in radar.box)
    center, size = (radar.box[0] + radar.box[1]) / 2, float(np.linalg.norm(radar.box[1] - radar.box[0]))
    eye, up = center + size * np.array([0.9, -0.7, 0.4]), (0, 0, 1)
    camera = vr.Camera.look_at(eye, center, up, 40.0, size / 100, size * 10)
    scene = vr.Scene(radar, transfer, camera, WIDTH, HEIGHT, background=(0.1, 0.2, 0.3, 0.5))
    step = size / 60
    out = march(scene, step=step)
    for y in range(HEIGHT):
        for x in range(WIDTH):
            ray = scalar.look_at_ray(eye.tolist(), center, up, 40.0, WIDTH, HEIGHT, x, y)
            expected = lit_ray.radar_ray(
                radar, transfer, polar.value_at, (low, high), *ray, step, scene.background
            )
            # Polar coordinates are rounded in the 12th digit, and a gate is a few hundred of them wide.
            np.testing.assert_allclose(out.rgba[y, x], expected, rtol=0, atol=1e-9)
    assert np.ptp(out.rgba[..., 3]) > 0.1


def prepared(volume, gradient="central", **more):
    """The shaded field of a scene that shows all of a volume."""
    camera, _ = seen_from(volume)
    scene = vr.Scene(volume, colorful_transfer(), camera, WIDTH, HEIGHT, gradient=gradient, **more)
    return shaded_field(scene, march_plan(scene))


def somewhere(volume, count=300, seed=0):
    """Padded positions (3, n) all over a volume, on its outer faces too."""
    low, high = volume.index_bounds
    position = np.random.default_rng(seed).uniform(low[:, None], high[:, None], (3, count))
    position[:, :3] = low[:, None]
    position[:, 3:6] = high[:, None]
    position[0, 6:9], position[1, 9:12] = high[0], low[1]
    return position + PAD


@pytest.mark.parametrize("bare", [False, True])
@pytest.mark.parametrize("centering", ["cell", "node"])
@pytest.mark.parametrize("shape", [(4, 5, 6), (2, 2, 3)])
def test_central_differences_are_those_of_the_samples_interpolated(shape, centering, bare):
    volume = rough_volume(5, shape, centering=centering)
    field = prepared(volume)
    if bare:
        field = dataclasses.replace(field, grid=bare_grid(volume))
    position, lists = somewhere(volume), volume.values.tolist()
    found = field.gradient_at(position, Workspace())
    for k, place in enumerate((position - PAD).T.tolist()):
        expected = lit_ray.weighted(place, lambda *at: lit_ray.central_difference(lists, *at))
        # Two trilinear means of numbers below 1, 7 roundings each, and positions to an ulp of 8.
        np.testing.assert_allclose(found[:, k], expected, rtol=0, atol=32 * EPS)


@pytest.mark.parametrize("shape", [(1, 4, 3), (1, 1, 1)])
def test_along_an_axis_with_one_sample_nothing_changes(shape):
    volume = rough_volume(6, shape)
    for gradient in GRADIENTS:
        found = prepared(volume, gradient).gradient_at(somewhere(volume), Workspace())
        for axis, count in enumerate(volume.size):
            assert (count > 1) == found[axis].any()


@pytest.mark.parametrize("bare", [False, True])
def test_the_analytic_gradient_is_that_of_the_interpolated_field(bare):
    volume = rough_volume(7, (4, 5, 6))
    field = prepared(volume, "analytic")
    if bare:
        field = dataclasses.replace(field, grid=bare_grid(volume))
    position, lists = somewhere(volume), volume.values.tolist()
    found = field.gradient_at(position, Workspace())
    for k, place in enumerate((position - PAD).T.tolist()):
        expected = lit_ray.cell_slope(lists, place)
        np.testing.assert_allclose(found[:, k], expected, rtol=0, atol=32 * EPS)


@pytest.mark.parametrize("bare", [False, True])
def test_on_the_outer_faces_of_a_node_volume_the_analytic_gradient_is_that_of_the_cells_within(bare):
    z, y, x = np.indices((4, 5, 6)).astype(np.float64)
    volume = vr.Volume(3 * x - 2 * y + z, centering="node")
    field = prepared(volume, "analytic")
    if bare:
        field = dataclasses.replace(field, grid=bare_grid(volume))
    low, high = (bound[:, None] + PAD for bound in volume.index_bounds)
    for at in (low, high, np.nextafter(low, 0), np.nextafter(high, 99)):
        found = field.gradient_at(np.array(at), Workspace())
        # whole numbers, and positions that are off by an ulp of 6 at most
        np.testing.assert_allclose(found.ravel(), [3, -2, 1], rtol=0, atol=100 * EPS)


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("gradient", GRADIENTS)
def test_a_ramp_in_the_world_has_its_own_gradient_however_the_volume_lies(gradient, place):
    slope = np.array([0.7, -1.1, 0.4])
    empty = rough_volume(0, (5, 6, 7), **PLACES[place])
    z, y, x = np.indices((5, 6, 7))
    index = np.stack([x, y, z, np.ones_like(x)]).reshape(4, -1)
    values = (slope @ (empty.world_from_index @ index)[:3]).reshape(5, 6, 7)
    volume = vr.Volume(values, empty.spacing, empty.origin, empty.direction, empty.centering)
    inside = np.random.default_rng(0).uniform(1, np.array(volume.size)[:, None] - 2, (3, 50)) + PAD
    found = prepared(volume, gradient).gradient_at(inside, Workspace())
    # Values of up to 20, differences of a unit between them, and an inverse matrix.
    np.testing.assert_allclose(found.T, np.tile(slope, (50, 1)), rtol=0, atol=1e-13)


def test_beyond_the_outer_samples_of_a_cell_volume_the_gradient_goes_on():
    # At the outer sample one of the two neighbours is the sample itself: half the slope, whoever looks.
    values = np.arange(4.0) * np.ones((4, 4, 1))
    volume = vr.Volume(values)
    at = np.array([[-0.5, -0.2, 0.0, 0.5, 1.0, 3.0, 3.4], [1.5] * 7, [1.5] * 7]) + PAD
    for gradient in ("central", "sobel"):
        found = prepared(volume, gradient).gradient_at(at.copy(), Workspace())[0]
        np.testing.assert_allclose(found, [0.5, 0.5, 0.5, 0.75, 1.0, 0.5, 0.5], rtol=0, atol=8 * EPS)
    found = prepared(volume, "analytic").gradient_at(at.copy(), Workspace())[0]
    np.testing.assert_allclose(found, [0, 0, 1, 1, 1, 0, 0], rtol=0, atol=0)


@pytest.mark.parametrize("gradient", GRADIENTS)
def test_a_flat_volume_gets_ambient_light_only(gradient):
    # 0.1 is no sum of powers of two: any difference that is not exactly 0 would be a normal.
    volume = vr.Volume(np.full((4, 4, 4), 0.1))
    transfer = vr.TransferFunction([0], [(0.5, 0.5, 0.5)], [1e9])
    lights = [vr.Light.ambient((0.25,) * 3), vr.Light.headlight(), vr.Light.directional((-1, -1, -1))]
    material = vr.Material(ambient=1.0, shininess=0.0)
    camera, _ = seen_from(volume)
    scene = vr.Scene(volume, transfer, camera, WIDTH, HEIGHT, (), lights, material, gradient=gradient)
    out = march(scene)
    np.testing.assert_array_equal(np.unique(out.rgba[..., 0]), [0.0, 0.125])


def test_the_kinds_of_gradient_differ():
    images = [march(scene_with(gradient=kind, lights=LAMPS["all"])[0]).rgba for kind in GRADIENTS]
    for first, second in ((0, 1), (0, 2), (1, 2)):
        assert np.abs(images[first] - images[second]).max() > 0.02


def test_lights_at_work_make_the_same_image_on_one_thread_or_three_and_for_every_ray_alone():
    scene, _ = scene_with("turned", lights=LAMPS["all"], gradient="sobel")
    expected = march(scene, threads=1).rgba
    np.testing.assert_array_equal(march(scene, threads=3).rgba, expected)
    larger = dataclasses.replace(scene, width=2 * WIDTH, height=2 * HEIGHT)
    assert march(larger).rgba.shape == (2 * HEIGHT, 2 * WIDTH, 4)


def dimmed(volume, part=slice(2, 9)):
    """The volume with a slab in which nothing can be seen."""
    values = volume.values.copy()
    values[:, :, part] *= 0.2
    return dataclasses.replace(volume, values=values)


@given(seed=st.integers(0, 99), look=st.integers(0, 6))
def test_skipping_empty_space_changes_nothing(seed, look):
    volume = dimmed(rough_volume(seed, (9, 10, 17)), slice(4, 14))
    transfer = extinction_transfer()
    lit = {"lights": LAMPS["all"], "gradient": GRADIENTS[look % 3]}
    looks = [
        lit,
        lit,
        lit,
        {"classification": "pre"},
        {"classification": "per-slice"},
        {"transfer": extinction_transfer(gradient_opacity=EDGES)},
        lit | {"transfer": square_transfer()},
    ]
    more = {"transfer": transfer} | looks[look]
    transfer = more.pop("transfer")
    scene = vr.Scene(volume, transfer, seen_from(volume)[0], WIDTH, HEIGHT, **more)
    planned = dataclasses.replace(march_plan(scene), termination=0.0)
    forced = march(scene, plan=planned.everything())
    np.testing.assert_array_equal(march(scene, plan=planned).rgba, forced.rgba)


@pytest.mark.parametrize(
    "more",
    [
        {"lights": LAMPS["all"]},
        {"classification": "pre"},
        {"classification": "per-slice"},
        {"transfer": square_transfer()},
    ],
    ids=["lit", "pre", "per-slice", "2-D"],
)
def test_empty_space_is_left_out_of_these_scenes_too_and_saves_samples(more):
    scene = dataclasses.replace(sparse_scene(40, 24), **more)
    plan = march_plan(scene)
    assert plan.includes("empty space")
    planned, forced = march(scene, plan=plan), march(scene, plan=plan.everything())
    np.testing.assert_allclose(planned.rgba, forced.rgba, rtol=0, atol=2e-6)  # early ends are within 1e-6
    assert planned.samples < forced.samples / 3


@pytest.mark.parametrize("strong", [1.0, 8.0])
def test_what_an_early_end_leaves_out_of_a_lit_scene_is_within_the_bound(strong):
    lights = [vr.Light.headlight((strong,) * 3), vr.Light.ambient((strong,) * 3)]
    material = vr.Material(ambient=1.0, diffuse=1.0)
    scene, _ = scene_with(transfer=extinction_transfer(), lights=lights, material=material)
    plan = dataclasses.replace(march_plan(scene, step=0.02), termination=0.2)
    early, full = march(scene, plan=plan), march(scene, plan=dataclasses.replace(plan, termination=0.0))
    difference = np.abs(early.rgba - full.rgba).max(axis=-1)
    assert difference.max() > 1e-3
    assert (difference <= early.bound).all()


@given(seed=st.integers(0, 99), gradient=st.sampled_from(GRADIENTS), make=st.sampled_from([0, 1]))
def test_without_lights_and_gradient_opacity_a_shaded_field_is_the_plain_one(seed, gradient, make):
    volume = rough_volume(seed, (4, 5, 6))
    transfer = (extinction_transfer, opacity_transfer)[make]()
    scene = vr.Scene(volume, transfer, seen_from(volume)[0], WIDTH, HEIGHT, gradient=gradient)
    plan = march_plan(scene)
    corner = np.random.default_rng(seed).integers(0, 4, (3, 10))
    position = np.random.default_rng(seed).random((3, 30))
    looks = [
        field.look(Samples(position.copy(), corner, np.zeros((3, 10))), Workspace())
        for field in (plain_field(scene, plan.everything()), shaded_field(scene, plan))
    ]
    for plain, shaded in zip(*looks, strict=True):
        # Positions are added to their corners first: an ulp of 8, times a slope of at most 4 a unit.
        np.testing.assert_allclose(shaded, plain, rtol=0, atol=32 * EPS)


def test_ambient_light_of_full_strength_shows_a_volume_as_it_is():
    scene, _ = scene_with("turned")
    material = vr.Material(ambient=1.0, diffuse=0.0, specular=0.0)
    lit = dataclasses.replace(scene, lights=[vr.Light.ambient()], material=material)
    plain, shaded = march(scene), march(lit)
    np.testing.assert_allclose(shaded.rgba, plain.rgba, rtol=0, atol=1e-13)  # positions, as above
    unlit = dataclasses.replace(lit, material=vr.Material("unlit"))
    np.testing.assert_array_equal(march(unlit).rgba, plain.rgba)
    assert not march_plan(unlit).includes("gradients")


@given(seed=st.integers(0, 99))
def test_before_or_after_is_the_same_for_a_look_that_is_linear_in_the_value(seed):
    volume = rough_volume(seed, (4, 5, 6))
    linear = vr.TransferFunction([0, 1], [(0.1, 0.9, 0.4), (1.0, 0.2, 0.6)], [0.1, 2.0])
    scene = vr.Scene(volume, linear, seen_from(volume)[0], WIDTH, HEIGHT)
    post = march(scene).rgba
    for classification in ("pre", "per-slice"):
        found = march(dataclasses.replace(scene, classification=classification)).rgba
        np.testing.assert_allclose(found, post, rtol=0, atol=1e-13)


def test_before_and_after_differ_for_a_look_that_is_bent():
    images = [march(scene_with(classification=kind)[0]).rgba for kind in ("post", "pre", "per-slice")]
    for first, second in ((0, 1), (0, 2), (1, 2)):
        assert np.abs(images[first] - images[second]).max() > 0.02


@pytest.mark.parametrize("centering", ["cell", "node"])
def test_on_a_slice_looking_up_per_slice_is_looking_up_after(centering):
    volume = rough_volume(8, (4, 5, 6), centering=centering)
    scene = vr.Scene(volume, extinction_transfer(), seen_from(volume)[0], WIDTH, HEIGHT)
    sliced = dataclasses.replace(scene, classification="per-slice")
    position = somewhere(volume)
    position[2] = np.random.default_rng(0).integers(0, 4, position.shape[1]) + PAD
    looks = [look_of(one, position) for one in (scene, sliced)]
    for post, per_slice in zip(*looks, strict=True):
        np.testing.assert_array_equal(per_slice, post)
    position[2] += 0.5
    looks = [look_of(one, position[:, position[2] < 4]) for one in (scene, sliced)]
    assert np.abs(looks[0][1] - looks[1][1]).max() > 0.1


def look_of(scene, position):
    samples = Samples(position.copy(), np.zeros((3, 1), np.intp), np.empty((0, 1)))
    return field_of(scene, march_plan(scene).everything()).look(samples, Workspace())


@pytest.mark.parametrize("classification", ["pre", "per-slice"])
def test_at_the_samples_looking_up_first_is_looking_up_after(classification):
    volume = rough_volume(9, (4, 5, 6))
    for make in (extinction_transfer, opacity_transfer):
        scene = vr.Scene(volume, make(), seen_from(volume)[0], WIDTH, HEIGHT)
        position = np.stack(np.indices(volume.size)).reshape(3, -1) + float(PAD)
        first = look_of(dataclasses.replace(scene, classification=classification), position)
        for found, expected in zip(first, look_of(scene, position), strict=True):
            np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize("classification", ["pre", "per-slice"])
def test_opacities_mixed_of_full_ones_stay_full(classification):
    transfer = vr.TransferFunction([0, 1], [(1, 1, 1)] * 2, opacity=[1.0, 1.0])
    volume = rough_volume(10)
    camera, _ = seen_from(volume)
    out = march(vr.Scene(volume, transfer, camera, WIDTH, HEIGHT, classification=classification))
    assert set(np.unique(out.rgba[..., 3])) == {0.0, 1.0}


@given(seed=st.integers(0, 2**32 - 1), classification=st.sampled_from(["pre", "per-slice"]))
def test_no_look_up_before_interpolation_leaves_the_range_of_opacities(seed, classification):
    # Rounded past 1 an opacity has no logarithm; 0.1, 0.21 and numbers next to 0 and 1 round worst.
    random = np.random.default_rng(seed)
    opacity = random.choice([0.0, 2.0**-60, 0.1, 0.21, 1 - 2.0**-53, 1.0], 5)
    transfer = vr.TransferFunction(np.arange(5.0), [(1, 1, 1)] * 5, opacity=opacity)
    volume = vr.Volume(random.integers(0, 5, (3, 3, 3)))
    scene = vr.Scene(volume, transfer, seen_from(volume)[0], WIDTH, HEIGHT, classification=classification)
    low, high = volume.index_bounds
    position = random.uniform(low[:, None], high[:, None], (3, 200)) + PAD
    position[:, ::2] = np.nextafter(np.rint(position[:, ::2]), 0)  # the largest parts there are
    strength = look_of(scene, position)[1]
    assert strength.min() >= 0
    assert strength.max() <= 1


@pytest.mark.parametrize("dtype", [np.uint8, np.int16, np.float16, np.float32, np.int64])
@pytest.mark.parametrize("look", ["sobel", "central", "analytic", "pre", "per-slice"])
def test_volumes_of_every_type_are_drawn_as_their_numbers_in_float64(dtype, look):
    values = np.random.default_rng(11).integers(0, 100, (4, 5, 6)).astype(dtype)
    how = {"gradient": look, "lights": LAMPS["all"]} if look in GRADIENTS else {"classification": look}
    images = []
    for kind in (dtype, np.float64):
        volume = vr.Volume(values.astype(kind))
        images.append(march(vr.Scene(volume, colorful_transfer(100), seen_from(volume)[0], 8, 6, **how)).rgba)
    np.testing.assert_array_equal(*images)


@pytest.mark.parametrize("scale", [1e-300, 1e-170, 1e160, 1e299])
@pytest.mark.parametrize("gradient", GRADIENTS)
def test_values_of_any_size_have_normals(scale, gradient):
    volume = rough_volume(12)
    lights, camera = LAMPS["all"], seen_from(volume)[0]
    images = []
    for factor in (1.0, scale):
        large = vr.Volume(volume.values * factor)
        transfer = colorful_transfer(factor)
        scene = vr.Scene(large, transfer, camera, WIDTH, HEIGHT, lights=lights, gradient=gradient)
        images.append(march(scene).rgba)
    # The values are rounded once more, which some normals of short gradients see.
    np.testing.assert_allclose(*images, rtol=0, atol=1e-11)


def test_a_radar_far_from_the_table_of_its_colours_is_drawn_without_a_warning():
    # Values whose distance from 0 is 1e11 buckets of the table.
    gates = 1e6 + np.random.default_rng(0).random((36, 5))
    gates[::3, 2] = np.nan
    sweeps = [vr.Sweep(np.arange(36) * 10.0, tilt, gates, 500, 1000) for tilt in (1.0, 10.0)]
    radar = vr.RadarVolume(sweeps, no_echo=1e6)
    knots = 1e6 + np.array([0.0, 0.5, 0.5001, 1.0])
    transfer = vr.TransferFunction(knots, [(1, 1, 1)] * 4, [0, 0, 1e-3, 1e-3])
    camera = vr.Camera.look_at((0, -20000, 8000), (0, 0, 0), (0, 0, 1), 40.0, 10, 1e5)
    out = march(vr.Scene(radar, transfer, camera, WIDTH, HEIGHT), step=200.0)
    assert 0 < out.rgba[..., 3].max() <= 1


SPHERE_VIEWS = {"front": (0, -5, 0.5), "side": (4, 3, -1), "top": (0.1, 0.2, 5), "below": (-2, 1, -4)}
SPHERE_LIGHTS = [
    vr.Light.ambient((0.4, 0.3, 0.2)),
    vr.Light.directional((-1.0, 2.0, -3.0), (0.9, 0.8, 1.0)),
    vr.Light.point((2.0, -3.0, 2.5), (0.7, 1.0, 0.6), (0.5, 0.1, 0.02)),
    vr.Light.headlight((0.1, 0.2, 0.1)),
]


def sphere_error(count, eye, model, gradient):
    """RMS error of a lit ball of radius 1 in exp(-r^2) on count^3 samples, away from its rim.

    The ball is opaque, and the step falls with the square of the spacing: what is left is the grid's error.
    """
    spacing = 3.0 / (count - 1)
    axis = np.arange(count) * spacing - 1.5
    z, y, x = np.meshgrid(axis, axis, axis, indexing="ij")
    volume = vr.Volume(np.exp(-(x * x + y * y + z * z)), (spacing,) * 3, (-1.5,) * 3, centering="node")
    edge, color = math.exp(-1.0), (0.9, 0.5, 0.2)
    transfer = vr.TransferFunction([0, edge, edge, 1], [color] * 4, [0, 0, 1e12, 1e12])
    camera, side = vr.Camera.look_at(eye, (0, 0, 0), (0, 1, 0.3), 22.0, 0.1, 100.0), 14
    material = vr.Material(model, specular=0.5, shininess=12.0)
    scene = vr.Scene(volume, transfer, camera, side, side, (), SPHERE_LIGHTS, material, gradient=gradient)
    out = march(scene, step=spacing**2 / 4)
    errors = []
    for pixel in range(side * side):
        x, y = divmod(pixel, side)
        origin, direction = scalar.look_at_ray(eye, (0, 0, 0), (0, 1, 0.3), 22.0, side, side, x, y)
        along = -lit_ray.dot(origin, direction)
        beside = lit_ray.dot(origin, origin) - along**2
        if beside > 0.8:
            continue
        hit = [o + (along - math.sqrt(1 - beside)) * d for o, d in zip(origin, direction, strict=True)]
        viewer = [-d for d in direction]
        expected = lit_ray.lit_color(SPHERE_LIGHTS, material, hit, hit, viewer, color)
        errors.append(out.rgba[y, x, :3] - expected)
    return math.sqrt(np.square(errors).mean())


@pytest.mark.parametrize("view", SPHERE_VIEWS)
@pytest.mark.parametrize("model", ["lambert", "phong", "blinn-phong"])
def test_a_lit_ball_tends_to_the_closed_form_with_the_square_of_the_spacing(model, view):
    counts = [13, 18, 25, 35]
    errors = [sphere_error(count, SPHERE_VIEWS[view], model, "central") for count in counts]
    order = -np.polyfit(np.log(np.array(counts) - 1), np.log(errors), 1)[0]
    assert order == pytest.approx(2.0, abs=0.25)  # where in its cell a pixel's point lies is chance
    assert errors[-1] < 1.2e-3


@pytest.mark.parametrize(("gradient", "order"), [("sobel", 2.0), ("analytic", 1.0)])
def test_the_gradient_of_the_cells_costs_one_order_and_sobels_none(gradient, order):
    counts = [13, 18, 25, 35]
    errors = [sphere_error(count, SPHERE_VIEWS["side"], "lambert", gradient) for count in counts]
    found = -np.polyfit(np.log(np.array(counts) - 1), np.log(errors), 1)[0]
    assert found == pytest.approx(order, abs=0.25)


def test_a_table_of_value_and_gradient_of_which_nothing_shows_is_drawn_and_traced():
    table = vr.TransferFunction2D(np.zeros((2, 3, 4)), (0, 1), (0, 1))
    scene = dataclasses.replace(sparse_scene(8, 6), transfer=table)
    assert not vr.render(scene).rgba.any()
    assert not vr.render(scene, plan=vr.plan(scene, method="march").everything()).rgba.any()
    assert vr.trace(scene, (3, 3)).head["rgba"] == [0, 0, 0, 0]
