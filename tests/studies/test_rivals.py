import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import volref as vr
from tests.oracles import rivals as textbook
from tests.oracles import scalar
from tests.scenes import camera_towards, colorful_transfer, rough_volume
from volref.phantoms import closed
from volref.phantoms import scenes as phantoms
from volref.phantoms import transfer as tables
from volref.studies.rivals import RIVALS, Loss, Rival, integrate
from volref.studies.rivals import harness as harness_module
from volref.studies.rivals.cells import cell_pieces
from volref.studies.rivals.gauss import gauss_rule
from volref.studies.rivals.medium import Bundle, medium_of, steepest_slope
from volref.studies.rivals.preintegration import entries_along, look_up, segment_table

EPS = np.finfo(np.float64).eps
FAST = [name for name in RIVALS if not name.endswith("1024")]
SETTINGS = {"step": 0.6, "parts": 2, "tolerance": 1e-3}


def setting_of(name):
    return SETTINGS[RIVALS[name].knob]


def fine_setting(name):
    """Errors below 5e-3 on the scenes here: of 1/64 in the rules of first order, far less in the others."""
    return {"step": 1 / 64, "parts": 8, "tolerance": 1e-6}[RIVALS[name].knob]


def opaque_transfer():
    colors = [(0.2, 0.0, 1.0), (0.2, 0.4, 1.0), (1.0, 0.6, 0.1), (0.9, 0.9, 0.3), (0.1, 0.9, 0.3)]
    return vr.TransferFunction(
        [0, 0.4, 0.4, 0.7, 0.9], colors, opacity=[0, 0, 0.3, 0.6, 1.0], unit_distance=0.7
    )


def rough_scene(transfer, width=4, height=3, **volume):
    field = rough_volume(3, (4, 5, 3), **volume)
    return vr.Scene(field, transfer, camera_towards(field), width, height, background=(0.1, 0.2, 0.3, 0.5))


def textbook_image(name, scene):
    volume, setting = scene.volume, setting_of(name)
    low, high = volume.corners.min(axis=0), volume.corners.max(axis=0)
    eye, middle = scene.camera.world_from_view[:3, 3], (low + high) / 2
    image = np.empty((scene.height, scene.width, 4))
    for y in range(scene.height):
        for x in range(scene.width):
            world = scalar.look_at_ray(eye, middle, (0, 0, 1), 35.0, scene.width, scene.height, x, y)
            ray = textbook.ray_of(volume, scene.transfer, *world)
            through, light = textbook.by_name(name)(ray, setting) if ray else (1.0, [0.0] * 3)
            image[y, x] = [*light, 1 - through] + through * np.array(scene.background)
    return image


# Positions agree to some ulp of the distance, 1e-14, times slopes of the table of about 10 a voxel; where a
# table is integrated anew, to what 32 parts and 300 midpoints differ by: a colour that changes by C over an
# optical depth that changes by D in a segment is off by C D / (12 32^2) <= 4e-5, with C <= 1 and D <= 0.5
# of a step of 0.6, and a ray has at most 10 segments.
@pytest.mark.parametrize("name", [name for name in FAST if not name.startswith("pre")])
@pytest.mark.parametrize("centering", ["cell", "node"])
def test_images_equal_the_textbook_loop(name, centering):
    for transfer in (colorful_transfer(), opaque_transfer()):
        scene = rough_scene(transfer, centering=centering)
        image = integrate(scene, RIVALS[name], setting_of(name)).rgba
        np.testing.assert_allclose(image, textbook_image(name, scene), rtol=0, atol=1e-12)


@pytest.mark.parametrize("name", ["preintegrated-256", "preintegrated-parabola-256"])
def test_pre_integrated_images_equal_segments_integrated_one_by_one(name):
    scene = rough_scene(colorful_transfer(), 2, 2)
    image = integrate(scene, RIVALS[name], setting_of(name)).rgba
    np.testing.assert_allclose(image, textbook_image(name, scene), rtol=0, atol=4e-4)


@pytest.mark.parametrize("name", FAST)
def test_the_image_does_not_depend_on_chunks_or_neighbours(name, monkeypatch):
    scene = rough_scene(colorful_transfer(), 24, 16)
    setting = 0.1 if RIVALS[name].knob == "step" else setting_of(name)
    whole = integrate(scene, RIVALS[name], setting)
    monkeypatch.setattr(harness_module, "RAYS_PER_CHUNK", dict.fromkeys(SETTINGS, 17))
    parts = integrate(scene, RIVALS[name], setting)
    np.testing.assert_array_equal(parts.rgba, whole.rgba)
    pixels = np.array([3, 200, 201, 380])
    few = integrate(scene, RIVALS[name], setting, pixels=pixels)
    np.testing.assert_array_equal(few.rgba, whole.rgba.reshape(-1, 4)[pixels])


@pytest.mark.parametrize("name", FAST)
def test_a_surface_ends_the_ray_and_shines_through(name):
    extinction, color = 0.3, np.array([0.9, 0.5, 0.25])
    volume = vr.Volume(np.zeros((4, 4, 4)), centering="node")
    camera = vr.Camera.orthographic((1.5, 1.5, 9.0), (1.5, 1.5, 0.0), (0, 1, 0), 2.0, 0.1, 20.0)
    square = vr.Mesh(
        [(-9, -9, 1), (9, -9, 1), (9, 9, 1), (-9, 9, 1)], [(0, 1, 2), (0, 2, 3)], colors=(0, 1, 0)
    )
    transfer = vr.TransferFunction([0.0], [color], [extinction])
    scene = vr.Scene(volume, transfer, camera, 3, 3, meshes=[square])
    through = math.exp(-extinction * 2.0)  # from z = 3 to z = 1
    expected = [*(color * (1 - through) + through * np.array([0, 1, 0])), 1.0]
    image = integrate(scene, RIVALS[name], fine_setting(name)).rgba
    np.testing.assert_allclose(image, np.broadcast_to(expected, (3, 3, 4)), rtol=0, atol=5e-3)


@pytest.mark.parametrize("name", FAST)
def test_a_camera_inside_sees_what_lies_in_front(name):
    volume = vr.Volume(np.zeros((5, 5, 5)), centering="node")
    transfer = vr.TransferFunction([0.0], [(1.0, 0.5, 0.0)], [0.7])
    camera = vr.Camera.orthographic((2.0, 2.0, 1.0), (2.0, 2.0, 0.0), (0, 1, 0), 2.0, 0.0, 20.0)
    scene = vr.Scene(volume, transfer, camera, 2, 2, background=(0, 0, 1, 1))
    through = math.exp(-0.7)  # from z = 1 to z = 0
    expected = [1 - through, 0.5 * (1 - through), through, 1.0]
    image = integrate(scene, RIVALS[name], fine_setting(name)).rgba
    np.testing.assert_allclose(image, np.broadcast_to(expected, (2, 2, 4)), rtol=0, atol=5e-3)


@pytest.mark.parametrize("name", FAST)
def test_nothing_overflows_where_the_table_is_opaque(name):
    # Warnings are errors in these tests, so reaching the end says that none was raised.
    image = integrate(rough_scene(opaque_transfer()), RIVALS[name], fine_setting(name)).rgba
    assert np.isfinite(image).all()
    assert (image[..., 3] > -EPS).all()
    assert (image[..., 3] <= 1 + EPS).all()


@pytest.mark.parametrize("name", FAST)
def test_rays_that_miss_show_the_background(name):
    scene = rough_scene(colorful_transfer())
    away = vr.Camera.look_at((50, 50, 50), (99, 99, 99), (0, 0, 1), 35.0, 0.1, 10.0)
    out = integrate(dataclasses.replace(scene, camera=away), RIVALS[name], fine_setting(name))
    np.testing.assert_array_equal(out.rgba, np.broadcast_to(scene.background, out.rgba.shape))
    assert out.samples == 0


def test_samples_are_those_of_the_rule_and_seconds_are_reported():
    # One ray, 4 units long: 8 segments of 0.5, 4 cells.
    expected = {
        "left-riemann": 8, "midpoint-exponential": 8, "trapezoid": 9, "preintegrated-256": 9,
        "preintegrated-parabola-256": 17, "cell-gauss-3": 12, "halving-gauss-2": 4 * 2 + 8 * 2,
    }  # fmt: skip
    for name, samples in expected.items():
        setting = {"step": 0.5, "parts": 1, "tolerance": 1.0}[RIVALS[name].knob]
        out = integrate(homogeneous_scene(1.0), RIVALS[name], setting)
        assert out.samples == samples, name
        assert 0 <= out.preparation <= out.seconds


@pytest.mark.parametrize(
    ("name", "setting"),
    [
        ("trapezoid", 0.0),
        ("trapezoid", math.inf),
        ("cell-gauss-2", 0),
        ("cell-gauss-2", 0.5),
        ("halving-gauss-2", -1),
    ],
)
def test_a_setting_that_the_knob_has_not_is_refused(name, setting):
    with pytest.raises(vr.SceneError, match=f"of {name} must be"):
        integrate(rough_scene(colorful_transfer()), RIVALS[name], setting)


def test_a_scene_of_meshes_only_is_refused():
    mesh = vr.Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)])
    camera = vr.Camera.look_at((0, 0, 5), (0, 0, 0), (0, 1, 0), 35.0, 0.1, 10.0)
    with pytest.raises(vr.SceneError, match=r"scene\.volume must be given for a rival"):
        integrate(vr.Scene(None, None, camera, 2, 2, meshes=[mesh]), RIVALS["trapezoid"], 0.5)


@pytest.mark.parametrize(
    "change",
    [
        {"knob": "samples"},
        {"order": 0},
        {"losses": (Loss("fog", 1, ""),)},
        {"losses": (Loss("kinks", 2, ""),)},
        {"losses": (Loss("kinks", 1, ""), Loss("kinks", 0, ""))},
    ],
)
def test_a_row_with_a_mistake_is_refused(change):
    with pytest.raises(vr.SceneError, match="correct the row"):
        dataclasses.replace(RIVALS["trapezoid"], **change)


def test_rows_bear_the_names_they_are_found_by():
    assert all(isinstance(row, Rival) and row.name == name for name, row in RIVALS.items())
    assert all(row.ladder and row.source for row in RIVALS.values())


# The quadrature


@pytest.mark.parametrize("count", [1, 2, 3, 4, 16, 32])
def test_the_depth_in_front_of_nodes_is_exact_to_its_degree_and_not_beyond(count):
    rule = gauss_rule(count)
    for degree in range(count):
        exact = rule.nodes ** (degree + 1) / (degree + 1)
        # sums of `count` terms below 1
        np.testing.assert_allclose(rule.before @ rule.nodes**degree, exact, rtol=0, atol=count * EPS)
    if count <= 4:
        exact = rule.nodes ** (count + 1) / (count + 1)
        assert np.abs(rule.before @ rule.nodes**count - exact).max() > 1e-4
    for degree, is_exact in ((2 * count - 1, True), (2 * count, False)):
        error = abs(rule.weights @ rule.nodes**degree - 1 / (degree + 1))
        # the error at degree 2k falls as 16^-k: at 16 nodes it is that of rounding
        assert error <= count * EPS if is_exact or count > 4 else error > 1e-6


@given(st.integers(0, 999))
def test_cell_pieces_fill_the_span_and_stay_within_cells(seed):
    random = np.random.default_rng(seed)
    start, slope = random.uniform(0.5, 4.5, (3, 6)), random.normal(size=(3, 6))
    slope[random.integers(0, 3), 0] = 0.0  # along a face plane or between two
    length = np.sort(random.uniform(0.1, 5, 6))[::-1]
    ray, t, part = cell_pieces(Bundle(start, slope, length))
    np.testing.assert_allclose(np.bincount(ray, part, 6), length, rtol=1e-14)  # 20 parts, an ulp each
    ends = [start[:, ray] + slope[:, ray] * (t + share * part) for share in (1e-6, 1 - 1e-6)]
    np.testing.assert_array_equal(np.floor(ends[0]), np.floor(ends[1]))


# Tables


def test_an_entry_is_the_closed_form_of_a_segment():
    volume = vr.Volume(np.array([[[0.0, 1.0], [0.5, 0.2]], [[0.0, 1.0], [0.5, 0.2]]]), centering="node")
    front, back = (0.9, 0.1, 0.2), (0.1, 0.6, 1.0)
    transfer = vr.TransferFunction([0, 1], [front, back], [0.5, 3.0])
    scene = vr.Scene(volume, transfer, camera_towards(volume), 2, 2)
    table = segment_table(medium_of(scene), 1.0, 65, 1)
    for i, j in ((0, 0), (0, 64), (64, 0), (13, 40), (41, 40)):
        a, b = i / 64, j / 64
        colors = [np.array(front) + u * (np.array(back) - np.array(front)) for u in (a, b)]
        exact = closed.linear_both(*colors, 0.5 + 2.5 * a, 0.5 + 2.5 * b, 1.0)
        light = look_up(table, np.array([a]), np.array([b]), None)[:, 0]
        assert light[3] == pytest.approx(exact[3], abs=4 * EPS)
        # 32 parts taken as homogeneous: C D / (12 32^2) with C < 1, D <= 2.5
        np.testing.assert_allclose(light[:3], exact[:3], rtol=0, atol=2.5 / (12 * 32**2))


def linear_medium(size=2):
    """A field with values from 0 to 1 whose extinction is half the value."""
    values = np.linspace(0, 1, size)[None, None].repeat(2, 0).repeat(2, 1)
    volume = vr.Volume(values, centering="node")
    transfer = vr.TransferFunction([0, 1], np.ones((2, 3)), [0.0, 0.5])
    return medium_of(vr.Scene(volume, transfer, camera_towards(volume), 2, 2))


def test_a_bent_entry_has_the_optical_depth_of_its_parabola():
    # The mean of front + (back - front) u + 4 b u (1 - u) is the mean of the ends plus 2/3 b.
    table = segment_table(linear_medium(), 0.5, 65, 2)
    assert table.bulge == 0.25
    for front, back, bulge in ((0.25, 0.5, 0.25), (0.5, 0.75, -0.25), (0.5, 0.5, 0.25), (0.25, 0.25, 0.0)):
        light = look_up(table, *(np.array([number]) for number in (front, back, bulge)))[:, 0]
        depth = 0.5 * 0.5 * ((front + back) / 2 + 2 / 3 * bulge)
        # 32 parts, each a difference of integrals of up to 0.25 over a rise of values of 1e-3 or more
        assert light[3] == pytest.approx(-math.expm1(-depth), abs=32 * EPS)


@pytest.mark.parametrize("size", [7, 256, 1000])
def test_the_integral_of_the_extinction_misses_no_knot(size):
    volume = vr.Volume(np.linspace(0, 1, 5)[None, None].repeat(2, 0).repeat(2, 1), centering="node")
    transfer = tables.spiky()
    medium = medium_of(vr.Scene(volume, transfer, camera_towards(volume), 2, 2))
    area = np.trapezoid(transfer.extinction, transfer.values)
    # a sum of up to 1255 intervals, each of 8 numbers of one sign
    assert entries_along(medium, size).integral[-1] == pytest.approx(area, rel=1300 * EPS)


def test_a_table_sees_the_spike_that_samples_miss():
    # A spike of the table between two samples: 1/255 of the values wide and 1e4 dense.
    volume = vr.Volume(np.linspace(0, 1, 5)[None, None].repeat(2, 0).repeat(2, 1), centering="node")
    camera = vr.Camera.orthographic((-3, 0.5, 0.5), (0, 0.5, 0.5), (0, 0, 1), 0.5, 0.0, 20.0)
    scene = vr.Scene(volume, tables.spiky(), camera, 1, 1)
    names = ("preintegrated-256", "preintegrated-parabola-256", "midpoint-exponential", "cell-gauss-1")
    seen = {name: integrate(scene, RIVALS[name], 1).rgba[0, 0, 3] for name in names}
    assert seen["preintegrated-256"] > 0.999
    assert seen["preintegrated-parabola-256"] > 0.999
    assert seen["midpoint-exponential"] == seen["cell-gauss-1"] == 0


@given(st.integers(0, 999))
def test_no_line_is_steeper_than_the_bound(seed):
    random = np.random.default_rng(seed)
    axes = np.eye(3) + random.uniform(-0.5, 0.5, (3, 3))
    axes /= np.linalg.norm(axes, axis=0)
    volume = vr.Volume(random.random((3, 4, 5)), random.uniform(0.5, 2, 3), direction=axes, centering="node")
    bound = steepest_slope(volume)
    points = random.uniform(0, 1, (2, 20, 3)) * (np.array(volume.size) - 1)
    value = [[scalar.trilinear(volume.values, p) for p in ends] for ends in points]
    world = (points[1] - points[0]) @ volume.world_from_index[:3, :3].T
    slope = np.abs(np.diff(value, axis=0)[0]) / np.linalg.norm(world, axis=1)
    assert slope.max() <= bound * (1 + 4 * EPS)


def test_the_bound_on_slopes_is_reached_by_a_linear_field():
    z, y, x = np.meshgrid(*[np.arange(3.0)] * 3, indexing="ij")
    volume = vr.Volume(x + 2 * y - 3 * z, (1.0, 0.5, 2.0))
    assert steepest_slope(volume) == pytest.approx(math.hypot(1, 4, 1.5), rel=4 * EPS)
    # With axes (1, 0) and (0.6, 0.8) the indices are X - 0.75 Y and 1.25 Y, and x - y is X - 2 Y.
    oblique = vr.Volume(x - y, direction=[(1, 0.6, 0), (0, 0.8, 0), (0, 0, 1)])
    assert steepest_slope(oblique) == pytest.approx(math.sqrt(5), rel=8 * EPS)
    # Likewise z is 1.25 Z, x is X - 0.75 Y - 0.75 Z, and x - y - z is X - 2 Y - 2 Z.
    oblique = vr.Volume(x - y - z, direction=[(1, 0.6, 0.6), (0, 0.8, 0), (0, 0, 0.8)])
    assert steepest_slope(oblique) == pytest.approx(3, rel=8 * EPS)


# What costs accuracy


def homogeneous_scene(extinction):
    """One ray, 4 units long, through one extinction."""
    volume = vr.Volume(np.zeros((5, 5, 5)), centering="node")
    camera = vr.Camera.orthographic((2, 2, 9), (2, 2, 0), (0, 1, 0), 2.0, 0.0, 20.0)
    transfer = vr.TransferFunction([0.0], [(0.5, 0.5, 0.5)], [extinction])
    return vr.Scene(volume, transfer, camera, 1, 1)


def homogeneous_pixel(extinction, name, setting):
    return integrate(homogeneous_scene(extinction), RIVALS[name], setting).rgba[0, 0]


def test_clamped_opacities_are_wrong_however_the_samples_lie():
    # tau = 4: opaque while sigma h >= 1, then (1 - sigma h)^n.
    for name in ("left-riemann", "midpoint-riemann"):
        assert homogeneous_pixel(1.0, name, 1.0)[3] == 1.0
        assert homogeneous_pixel(1.0, name, 0.5)[3] == pytest.approx(1 - 0.5**8, abs=8 * EPS)
    for name in ("left-exponential", "midpoint-exponential", "preintegrated-256"):
        assert homogeneous_pixel(1.0, name, 1.0)[3] == pytest.approx(-math.expm1(-4.0), abs=8 * EPS)


def test_the_trapezoid_rule_shines_brighter_than_its_colour_in_thick_segments():
    # h sigma / 2 (1 + exp(-sigma h)) c of the first segment, where the truth is at most c.
    assert homogeneous_pixel(20.0, "trapezoid", 1.0)[0] == pytest.approx(5.0, rel=1e-7)  # exp(-20) = 2e-9
    assert homogeneous_pixel(20.0, "midpoint-exponential", 1.0)[0] == pytest.approx(0.5, rel=1e-7)


def test_adaptive_halving_never_sees_a_feature_between_its_nodes():
    # A jump of the table just before a face of the cells: both rules sample in front of it, and agree.
    scene, truth = phantoms.ramp_scene(1, 1, parallel=True, transfer=tables.jump(1e-3, extinction=0.3))
    errors = [
        np.abs(integrate(scene, RIVALS["halving-gauss-4"], tolerance).rgba - truth).max()
        for tolerance in (1e-3, 1e-12)
    ]
    assert errors[0] > 1e-4
    assert errors[1] == pytest.approx(errors[0], rel=1e-9)


def test_the_depth_between_nodes_is_that_of_a_polynomial_and_can_be_far_off():
    # Extinctions of 100 and 1e4 at the two nodes: the line through them starts far below 0, and so no depth
    # is seen in front of the first node, whose light h w c sigma = 50 c nothing then holds to the colour.
    volume = vr.Volume(np.linspace(0, 1, 2)[None, None].repeat(2, 0).repeat(2, 1), centering="node")
    camera = vr.Camera.orthographic((-3, 0.5, 0.5), (0, 0.5, 0.5), (0, 0, 1), 0.5, 0.0, 20.0)
    first, second = gauss_rule(2).nodes
    knots = [first - 0.01, first, first + 0.01, second - 0.01, second, second + 0.01]
    transfer = vr.TransferFunction(knots, np.ones((6, 3)), [0, 100, 0, 0, 1e4, 0])
    image = integrate(vr.Scene(volume, transfer, camera, 1, 1), RIVALS["cell-gauss-2"], 1).rgba
    # the slope of the table at the knot is 1e4 to 1e6, the node off by an ulp
    assert image[0, 0, 0] == pytest.approx(50.0, abs=1e-8)


def test_scenes_that_a_rival_would_draw_without_a_part_are_refused():
    volume = rough_volume()
    scene = vr.Scene(volume, colorful_transfer(), camera_towards(volume), 4, 3)
    for change, words in (
        ({"clip": [vr.Plane((0, 0, 0), (1, 0, 0))]}, "clipping planes"),
        ({"lights": [vr.Light.headlight()]}, "a lit volume"),
        ({"mode": "mip"}, "mode 'mip'"),
    ):
        with pytest.raises(vr.SceneError, match=f"up to an opaque surface for a study, got {words}"):
            integrate(dataclasses.replace(scene, **change), RIVALS["trapezoid"], 0.5)
