"""The colour of lit points against a scalar loop written from the papers, and the laws of light."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.oracles import lit_ray
from volref.scene.lights import Light, Material
from volref.stages.lighting import brightest_lit, lit_colors

EPS = np.finfo(np.float64).eps

LIT_MODELS = ("lambert", "phong", "blinn-phong")
SEEDS = st.integers(0, 2**32 - 1)


def unit_vectors(random, n):
    vectors = random.normal(size=(3, n))
    return vectors / np.linalg.norm(vectors, axis=0)


def some_lights(random):
    """One of each kind, and a second one of two."""

    def color():
        return random.uniform(0, 2, 3)

    return [
        Light.ambient(color()),
        Light.directional(random.normal(size=3), color()),
        Light.directional(random.normal(size=3), color()),
        Light.point(random.normal(size=3) * 3, color(), (1, 0.3, 0.1)),
        Light.point(random.normal(size=3) * 3, color()),
        Light.headlight(color()),
    ]


def a_material(random, model, **changed):
    numbers = {name: random.uniform(0, 1.5) for name in ("ambient", "diffuse", "specular")}
    return Material(model, **(numbers | {"shininess": random.uniform(0.5, 60)} | changed))


def points(random, n=40):
    """Positions, normals, directions to the viewer, colours; two points have no normal."""
    normals = unit_vectors(random, n)
    normals[:, :2] = 0.0
    return random.normal(size=(3, n)) * 4, normals, unit_vectors(random, n), random.uniform(0, 1, (3, n))


@pytest.mark.parametrize("two_sided", [False, True])
@pytest.mark.parametrize("model", LIT_MODELS)
def test_colours_are_those_of_the_scalar_loop(model, two_sided):
    random = np.random.default_rng(LIT_MODELS.index(model))
    lights, material = some_lights(random), a_material(random, model, two_sided=two_sided)
    arrays = points(random, 300)
    found = lit_colors(lights, material, *arrays)
    for k in range(300):
        expected = lit_ray.lit_color(lights, material, *(array[:, k].tolist() for array in arrays))
        # Cosines to 4 ulp, to the power of at most 60, and a sum of five lights of brightness 2 at most 1.5.
        np.testing.assert_allclose(found[:, k], expected, rtol=0, atol=60 * 4 * 5 * 3 * EPS)


def test_one_light_at_45_degrees_has_the_numbers_of_the_papers():
    half = math.sqrt(0.5)
    up, viewer = np.array([[0.0], [0], [1]]), np.array([[0.0], [half], [half]])
    sun, color = [Light.directional((0, half, -half))], np.array([[0.5], [0.25], [0.0]])

    def shown(model, towards=viewer):
        material = Material(model, ambient=9, diffuse=0.8, specular=0.5, shininess=2)
        return lit_colors(sun, material, up, up, towards, color).ravel()

    diffuse = 0.8 * half * color.ravel()
    # The light comes from -y: its mirror image goes to +y, to the viewer; halfway lies the normal.
    np.testing.assert_allclose(shown("lambert"), diffuse, rtol=0, atol=4 * EPS)
    np.testing.assert_allclose(shown("phong"), diffuse + 0.5, rtol=0, atol=4 * EPS)
    np.testing.assert_allclose(shown("blinn-phong"), diffuse + 0.5, rtol=0, atol=4 * EPS)
    # Seen from above: cos 45 degrees to the mirror image, and cos 22.5 degrees to the normal, both squared.
    np.testing.assert_allclose(shown("phong", up), diffuse + 0.5 * 0.5, rtol=0, atol=4 * EPS)
    halfway = 0.5 * math.cos(math.pi / 8) ** 2
    np.testing.assert_allclose(shown("blinn-phong", up), diffuse + halfway, rtol=0, atol=4 * EPS)


@pytest.mark.parametrize("model", ["phong", "blinn-phong"])
def test_behind_the_horizon_of_the_normal_nothing_shines(model):
    # The mirror image of a light below the surface lies below too, and a viewer there would see it.
    up, low = np.array([[0.0], [0], [1]]), np.array([[0.6], [0], [-0.8]])
    material = Material(model, specular=1.0, shininess=1.0)
    sun = [Light.directional((0.6, 0, 0.8))]
    assert not lit_colors(sun, material, up, up, low, np.ones((3, 1))).any()
    assert not lit_colors(sun, material, up, up, up, np.ones((3, 1))).any()


def test_a_point_light_weakens_with_the_distance_as_its_three_numbers_say():
    normal, material = np.array([[0.0], [0], [1]]), Material("lambert", diffuse=1.0)
    for distance, attenuation in (
        (2.0, (1, 0, 0)),
        (2.0, (1, 0.5, 0)),
        (2.0, (0.25, 0, 1)),
        (8.0, (1, 2, 3)),
    ):
        lamp = [Light.point((5, 5, 1 + distance), attenuation=attenuation)]
        found = lit_colors(lamp, material, np.array([[5.0], [5], [1]]), normal, normal, np.ones((3, 1)))
        c0, c1, c2 = attenuation
        assert found[0, 0] == pytest.approx(1 / (c0 + c1 * distance + c2 * distance**2), rel=2 * EPS)


@pytest.mark.parametrize("model", LIT_MODELS)
def test_a_light_at_the_point_itself_lights_nothing_and_is_no_number_short(model):
    at, up = np.array([[1.0], [2], [3]]), np.array([[0.0], [0], [1]])
    lights = [Light.point((1, 2, 3)), Light.ambient()]
    material = Material(model, ambient=0.25, shininess=0.0)
    assert lit_colors(lights, material, at, up, up, np.ones((3, 1))).ravel().tolist() == [0.25] * 3


@pytest.mark.parametrize("model", ["phong", "blinn-phong"])
def test_a_headlight_shines_full_where_the_surface_faces_the_viewer(model):
    viewer = np.array([[0.0], [0.6], [0.8]])
    material = Material(model, diffuse=0.5, specular=0.25, shininess=100.0)
    found = lit_colors([Light.headlight()], material, 9 * viewer, viewer, viewer, np.ones((3, 1)))
    np.testing.assert_allclose(found, 0.75, rtol=0, atol=100 * EPS)  # an ulp to the power of 100


@given(seed=SEEDS, model=st.sampled_from(LIT_MODELS))
def test_turning_everything_together_changes_nothing(seed, model):
    random = np.random.default_rng(seed)
    turn = np.linalg.qr(random.normal(size=(3, 3)))[0]  # some of them mirror too
    lights, material = some_lights(random), a_material(random, model, shininess=random.uniform(1, 60))
    turned = [
        Light(
            light.kind,
            light.color,
            None if light.direction is None else turn @ light.direction,
            None if light.position is None else turn @ light.position,
            light.attenuation,
        )
        for light in lights
    ]
    position, normals, viewer, colors = points(random)
    expected = lit_colors(lights, material, position, normals, viewer, colors)
    found = lit_colors(turned, material, turn @ position, turn @ normals, turn @ viewer, colors)
    # A power of 60 makes 60 of an ulp; where the light grazes a surface, a highlight of Phong's is on or off.
    ways = [
        lit_ray.arriving(light, position[:, k], viewer[:, k])[0]
        for light in lights[1:]
        for k in range(len(colors.T))
    ]
    facing = [lit_ray.dot(way, normals[:, k % len(colors.T)]) for k, way in enumerate(ways)]
    clear = np.abs(np.reshape(facing, (len(lights) - 1, -1))).min(axis=0) > 1e-12
    clear[:2] = True
    np.testing.assert_allclose(found[:, clear], expected[:, clear], rtol=0, atol=60 * 100 * EPS)


@given(seed=SEEDS, model=st.sampled_from(LIT_MODELS))
def test_two_sided_is_the_same_as_turning_normals_that_look_away(seed, model):
    random = np.random.default_rng(seed)
    lights, one_sided = some_lights(random), a_material(random, model)
    position, normals, viewer, colors = points(random)
    away = (normals * viewer).sum(axis=0) < 0
    two_sided = dataclasses.replace(one_sided, two_sided=True)
    found = lit_colors(lights, two_sided, position, normals, viewer, colors)
    turned = np.where(away, -normals, normals)
    np.testing.assert_array_equal(found, lit_colors(lights, one_sided, position, turned, viewer, colors))
    np.testing.assert_array_equal(found, lit_colors(lights, two_sided, position, -normals, viewer, colors))


@given(seed=SEEDS, model=st.sampled_from(LIT_MODELS), two_sided=st.booleans())
def test_without_a_normal_there_is_ambient_light_only(seed, model, two_sided):
    random = np.random.default_rng(seed)
    lights, material = some_lights(random), a_material(random, model, two_sided=two_sided, shininess=0.0)
    position, normals, viewer, colors = points(random)
    found = lit_colors(lights, material, position, 0 * normals, viewer, colors)
    ambient = material.ambient * np.array(lights[0].color)[:, None]
    np.testing.assert_array_equal(found, ambient * colors)


@given(seed=SEEDS, model=st.sampled_from(LIT_MODELS), factor=st.floats(0, 8))
def test_light_adds_up(seed, model, factor):
    random = np.random.default_rng(seed)
    lights, material, arrays = some_lights(random), a_material(random, model), points(random)
    alone = [lit_colors([light], material, *arrays) for light in lights]
    together = lit_colors(lights, material, *arrays)
    np.testing.assert_allclose(together, sum(alone), rtol=20 * EPS, atol=0)  # six positive terms
    brighter = [
        Light(light.kind, factor * np.array(light.color), light.direction, light.position, light.attenuation)
        for light in lights
    ]
    # The directions are brought to length 1 again, an ulp off, and a power of 60 makes 60 of it.
    found, most = lit_colors(brighter, material, *arrays), 8 * 5 * 3
    np.testing.assert_allclose(found, factor * together, rtol=0, atol=60 * 4 * most * EPS)


@given(seed=SEEDS, model=st.sampled_from(LIT_MODELS), alone=st.booleans())
def test_nothing_is_brighter_than_the_bound(seed, model, alone):
    random = np.random.default_rng(seed)
    lights = some_lights(random)[-1:] if alone else some_lights(random)
    material = a_material(random, model, shininess=random.choice([0.0, 1.0, 30.0, 1e6]))
    position, normals, viewer, colors = points(random)
    # The brightest there is: every second point faces the viewer, and his light with him, in one colour.
    normals[:, ::2], colors[:, ::2] = viewer[:, ::2], 1.0
    found = lit_colors(lights, material, position, normals, viewer, colors)
    most = brightest_lit(lights, material, float(colors.max()))
    assert found.max() <= most * (1 + 20 * EPS)  # the additions; 1 + EPS to the power of 1e6 is more


def test_the_bound_is_reached_by_grey_light_from_the_front():
    lights, up = [Light.ambient((0.5,) * 3), Light.headlight((2, 2, 2))], np.array([[0.0], [0], [1]])
    found = lit_colors(lights, Material("phong"), up, up, up, np.full((3, 1), 0.75))
    assert found[0, 0] == pytest.approx(brightest_lit(lights, Material("phong"), 0.75), rel=4 * EPS)


def test_no_light_is_darkness():
    arrays = points(np.random.default_rng(0))
    assert not lit_colors([], Material(), *arrays).any()
    assert brightest_lit([], Material(), 1.0) == 0.0
