"""The ray integral at 30 digits against closed forms and against quadrature that knows nothing of it."""

import ast
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mpmath import mp, mpf

import volref.truth.digits
from tests.oracles.brute_ray import brute_ray
from volref.phantoms import closed, fields, transfer
from volref.scene import TransferFunction, Volume
from volref.truth.digits.integral import extra_digits, ray_integral

COLORS = [(0.2, 0.0, 1.0), (0.2, 0.4, 1.0), (1.0, 0.6, 0.1), (0.9, 0.9, 0.3), (0.1, 0.9, 0.3)]
BLACK_TO_WHITE = [(0, 0, 0), (1, 1, 1)]
ALONG_X = (-1.0, 0.5, 0.5), (1.0, 0.0, 0.0)
# What the integral promises, with a factor of 10 for good measure.
DIGITS_30 = mpf(10) ** -32


@pytest.fixture(autouse=True)
def _fifty_digits():
    with mp.workdps(50):
        yield


def ramp(low=0.0, high=1.0, axis=0):
    """A unit cell in which the value runs from low to high along an axis (0 is x)."""
    values = np.empty((2, 2, 2))
    for corner in np.ndindex(2, 2, 2):
        values[corner] = high if corner[2 - axis] else low
    return Volume(values, centering="node")


def noise(shape=(4, 4, 4), seed=1, **place):
    return Volume(np.random.default_rng(seed).random(shape), **place)


def assert_channels(found, expected, within=DIGITS_30):
    for channel, (a, b) in enumerate(zip(found.rgba, expected, strict=True)):
        assert abs(a - b) <= within, (channel, a, b)


# --- closed forms


def test_a_homogeneous_box_attenuates_by_its_exact_chord():
    volume = Volume(np.zeros((3, 4, 5)), centering="node")
    table = TransferFunction([0], [(0.9, 0.5, 0.25)], [0.3])
    # From (0, 1/2, 1) with slope 1/3: out at y = 3, after 7.5, though x would allow 12.
    found = ray_integral(volume, table, (0, 0.5, 1), (1 / 3, 1 / 3, 0.0))
    alpha = -mp.expm1(-mpf(0.3) * mpf(2.5) / mpf(1 / 3))
    assert_channels(found, [mpf(c) * alpha for c in (0.9, 0.5, 0.25)] + [alpha])


def rising_light(p, q):
    """int_0^1 s (p + 2 q s) exp(-p s - q s^2) ds for q != 0, by parts: K - exp(-p - q)."""
    r = mp.sqrt(abs(q))
    w = p / (2 * r)
    if q > 0:
        k = mp.sqrt(mp.pi) / (2 * r) * mp.exp(w * w) * (mp.erf(w + r) - mp.erf(w))
    else:
        # The square is completed the other way round: exp(q's^2 - p s), and erfi takes the place of erf.
        k = mp.sqrt(mp.pi) / (2 * r) * mp.exp(-w * w) * (mp.erfi(w) - mp.erfi(w - r))
    return k - mp.exp(-p - q)


@pytest.mark.parametrize("ends", [(0.0, 1.0), (2.0, 0.5), (0.0, 30.0), (5.0, 0.0), (1e-3, 2e-3), (0, 1e5)])
def test_a_linear_ramp_is_erf_or_dawson(ends):
    table = TransferFunction([0, 1], BLACK_TO_WHITE, ends)
    found = ray_integral(ramp(), table, *ALONG_X)
    first, last = map(mpf, ends)
    with mp.workdps(60):
        moment = rising_light(first, (last - first) / 2)
    assert_channels(found, [moment] * 3 + [-mp.expm1(-(first + last) / 2)])


def test_a_ray_the_other_way_is_the_ramp_mirrored():
    table = TransferFunction([0, 1], COLORS[:2], [0.5, 2.0])
    found = ray_integral(ramp(), table, (2, 0.5, 0.5), (-1, 0, 0))
    mirrored = ray_integral(ramp(1.0, 0.0), table, *ALONG_X)
    assert_channels(found, mirrored.rgba)


def test_opacities_that_rise_to_1_are_the_integral_of_a_logarithm():
    for strengths, interval in (([0, 1], (0, 1)), ([1, 0], (1, 0)), ([0.5, 1], (0.5, 1))):
        table = TransferFunction([0, 1], BLACK_TO_WHITE, opacity=strengths, unit_distance=0.5)
        found = ray_integral(ramp(), table, *ALONG_X)
        a, b = map(mpf, interval)

        def depth(s, a=a, b=b):  # int -log(1 - a - (b - a) s), by w - w log w of the clearness w
            first, last = (w - w * mp.log(w) if w else w for w in (1 - a, 1 - a - (b - a) * s))
            return 2 * (first - last) / (b - a)

        def light(s, a=a, b=b):
            return s * -2 * mp.log(1 - a - (b - a) * s) * mp.exp(-depth(s))

        # tanh-sinh quadrature is made for the end where the logarithm is infinite
        assert_channels(found, [mp.quad(light, [0, 1])] * 3 + [-mp.expm1(-depth(mpf(1)))])


def test_a_field_that_touches_an_opacity_of_1_passes_with_a_finite_depth():
    # Along x = y = t the field 4 x (1 - y) is 4 t (1 - t), so 1 - opacity = (1 - 2 t)^2.
    values = np.zeros((2, 2, 2))
    values[:, 0, 1] = 4.0
    volume = Volume(values, centering="node")
    table = TransferFunction([0, 1], [(1, 1, 1)] * 2, opacity=[0, 1])
    found = ray_integral(volume, table, (-1, -1, 0.5), (1, 1, 0))
    alpha = -mp.expm1(-2)  # int_0^1 -2 log|1 - 2 t| dt = 2
    assert_channels(found, [alpha] * 4)


def test_jumps_are_layers_of_their_own():
    table = transfer.steps([0.25, 0.5, 0.75], COLORS[:3], [0.5, 3.0, 1.0])
    found = ray_integral(ramp(), table, *ALONG_X)
    light, clear = [mpf(0)] * 3, mpf(1)
    for color, extinction in zip(COLORS, (0.5, 3.0, 1.0), strict=False):
        alpha = -mp.expm1(-mpf(extinction) / 4)
        light = [a + clear * alpha * mpf(c) for a, c in zip(light, color, strict=True)]
        clear *= 1 - alpha
    assert_channels(found, [*light, 1 - clear])


def test_phantoms_with_a_closed_form_agree_to_its_float64():
    table = TransferFunction([0, 1], COLORS[:2], [0.3, 1.7])
    volume = fields.linear_ramp(5, spacing=0.5, axis="x")  # from index 0 to 4, x world length 2
    found = ray_integral(volume, table, (-1, 1, 1), (2, 0, 0))
    expected = closed.linear_both(COLORS[0], COLORS[1], 0.3, 1.7, 2.0)
    np.testing.assert_allclose([float(c) for c in found.rgba], expected, rtol=0, atol=3e-16)  # its roundings


# --- quadrature that knows nothing of cells as cubics, roots and series


@pytest.mark.parametrize("kind", ["extinction", "opacity"])
@pytest.mark.parametrize(
    ("origin", "direction", "span"),
    [
        ((-2.0, 0.3, 0.4), (1.0, 0.25, 0.125), (1.5, 3.5)),
        ((1.0, -0.5, 1.5), (0.0, 0.5, -1.0), (0.0, 2.0)),  # in a plane of the lattice, from an edge on
    ],
)
def test_it_agrees_with_nested_quadrature(kind, origin, direction, span):
    table = TransferFunction([0.2, 0.45, 0.45, 0.9], COLORS[:4], **{kind: [0, 0.4, 0.1, 0.8]})
    volume = noise((2, 2, 2))
    found = ray_integral(volume, table, origin, direction)
    expected = brute_ray(volume, table, origin, direction, *span)
    assert_channels(found, expected, mpf(10) ** -28)  # nested quadrature at 30 digits loses two


def test_a_spike_is_not_stepped_over():
    table = TransferFunction([0.4, 0.41, 0.42], COLORS[:3], [0, 1e4, 0])
    ray = (-2.0, 0.3, 0.9), (1.0, 0.25, 0.125)
    volume = noise((2, 2, 2))
    found = ray_integral(volume, table, *ray)
    assert found.rgba[3] > 0.9999
    # The field meets the spike from one side first: its colour there is between those of the two knots.
    reds = [c * float(found.rgba[3]) for c in (0.2, 1.0)]
    assert min(reds) <= found.rgba[0] <= max(reds)
    more = ray_integral(volume, table, *ray, digits=45)
    assert_channels(found, more.rgba, found.remainder + mpf(10) ** -40)


# --- where the ray ends


def test_a_ray_that_misses_returns_what_lies_behind():
    behind = (0.1, 0.2, 0.3, 0.4)
    found = ray_integral(
        noise(), TransferFunction([0], [(1, 1, 1)], [1]), (-1, 9, 0), (1, 0, 0), behind=behind
    )
    assert [float(c) for c in found.rgba] == list(behind)
    assert (found.remainder, found.pieces) == (0, 0)


def test_what_lies_behind_shines_through():
    table = TransferFunction([0, 1], COLORS[:2], [0.5, 2.0])
    alone = ray_integral(ramp(), table, *ALONG_X)
    behind = (0.25, 0.5, 0.125, 0.75)
    found = ray_integral(ramp(), table, *ALONG_X, behind=behind)
    clear = 1 - alone.rgba[3]
    assert_channels(found, [c + clear * b for c, b in zip(alone.rgba, behind, strict=True)])


def test_what_shines_through_a_depth_of_40_counts():
    table = transfer.steps([0.25, 0.5, 1.0], COLORS[:3], [160.0, 1.0, 8.0])
    found = ray_integral(ramp(), table, *ALONG_X, behind=(1, 1, 1, 1))
    light, clear = mpf(0), mpf(1)
    for (red, _, _), depth in zip(COLORS, (40, 0.25, 4), strict=False):
        light, clear = light - clear * mp.expm1(-depth) * mpf(red), clear * mp.exp(-mpf(depth))
    assert abs(found.rgba[0] - light - clear) <= DIGITS_30  # of which the last two layers are 1e-18


@given(st.integers(1, 15), st.sampled_from(["extinction", "opacity"]))
def test_a_ray_cut_in_two_is_the_front_over_the_back(sixteenths, kind):
    table = TransferFunction([0.2, 0.45, 0.45, 0.9], COLORS[:4], **{kind: [0, 0.4, 0.1, 0.8]})
    # Dyadic numbers, so that the second half begins exactly where the first one ends.
    origin, direction = (-1.0, 0.25, 1.5), (1.0, 0.5, -0.25)
    cut = sixteenths / 4
    between = [o + cut * d for o, d in zip(origin, direction, strict=True)]
    whole = ray_integral(noise(), table, origin, direction)
    back = ray_integral(noise(), table, between, direction)
    front = ray_integral(noise(), table, origin, direction, cut)
    with mp.workdps(50):
        joined = [a + (1 - front.rgba[3]) * b for a, b in zip(front.rgba, back.rgba, strict=True)]
        assert_channels(whole, joined)


def test_a_ray_that_begins_inside_begins_there():
    table = TransferFunction([0], [(1, 1, 1)], [2.0])
    found = ray_integral(Volume(np.zeros((4, 4, 4))), table, (1.25, 1, 1), (1, 0, 0))
    assert_channels(found, [-mp.expm1(-2 * mpf("2.25"))] * 4)  # to 3.5


def test_an_opaque_interval_ends_the_ray_with_the_colour_at_its_edge():
    table = TransferFunction([0, 0.5, 1], COLORS[:3], opacity=[0.0, 1.0, 1.0])
    behind = (0.1, 0.2, 0.3, 0.4)
    found = ray_integral(ramp(), table, *ALONG_X, behind=behind)
    front = ray_integral(ramp(), table, *ALONG_X, distance=1.5)
    clear = 1 - front.rgba[3]
    light = [c + clear * mpf(e) for c, e in zip(front.rgba, COLORS[1], strict=False)]
    assert_channels(found, [*light, mpf(1)])
    inside = ray_integral(ramp(), table, (0.75, 0.5, 0.5), (1, 0, 0))
    assert_channels(inside, [(mpf(a) + mpf(b)) / 2 for a, b in zip(*COLORS[1:3], strict=True)] + [1])


# --- on knots, planes and edges


def test_a_constant_field_on_a_jump_belongs_above_it():
    volume = Volume(np.full((3, 3, 3), 0.1))
    table = TransferFunction([0.1, 0.1], COLORS[:2], [5.0, 0.25])
    found = ray_integral(volume, table, (-1, 0.3, 0.7), (0.7, 0.0, 0.1))
    chord = 3 / mpf(0.7)
    assert_channels(found, [mpf(c) * -mp.expm1(-chord / 4) for c in (*COLORS[1], 1)])


def test_a_field_that_is_constant_by_cancellation_is_on_the_jump_too():
    # 0.1 + 0.3 x - 0.3 y (with the very same float64 differences) along x = y.
    step = 0.3
    values = np.broadcast_to(np.array([[0.0, step], [-step, 0.0]]), (2, 2, 2)).copy()
    volume = Volume(values, centering="node")
    table = TransferFunction([0.0, 0.0], COLORS[:2], [5.0, 0.25])
    found = ray_integral(volume, table, (0.1, 0.1, 0.2), (0.37, 0.37, 0.11))
    chord = (1 - mpf(0.1)) / mpf(0.37)
    assert_channels(found, [mpf(c) * -mp.expm1(-chord / 4) for c in (*COLORS[1], 1)])


def test_touching_a_jump_from_below_is_not_crossing_it():
    values = np.zeros((2, 2, 2))
    values[:, 0, 1] = 4.0  # 4 t (1 - t) along the diagonal
    table = TransferFunction([1, 1], COLORS[:2], [0.5, 1e6])
    found = ray_integral(Volume(values, centering="node"), table, (-1, -1, 0.5), (1, 1, 0))
    assert_channels(found, [mpf(c) * -mp.expm1(-mpf(0.5)) for c in (*COLORS[0], 1)])


@pytest.mark.parametrize("place", [0.0, 1.0, 2.0, 3.0, -0.5, 3.5])
def test_a_ray_in_a_plane_of_the_lattice_or_in_a_face_is_the_limit_of_its_neighbours(place):
    table = TransferFunction([0.2, 0.9], COLORS[:2], [0.0, 2.0])
    on = ray_integral(noise(), table, (-1, place, 1.25), (1, 0, 0))
    assert on.rgba[3] > 0.05
    for beside in (np.nextafter(place, -9), np.nextafter(place, 9)):
        if -0.5 <= beside <= 3.5:
            near = ray_integral(noise(), table, (-1, beside, 1.25), (1, 0, 0))
            # extinction 2 / 0.7 per value, values within 1 a voxel, a length of 4, a step of 4e-16
            assert_channels(on, near.rgba, mpf("1e-14"))


def test_axes_may_change_places():
    table = TransferFunction([0.2, 0.5, 0.9], COLORS[:3], [0, 2, 0.5])
    volume = noise((3, 4, 5))
    origin, direction = (-1.0, 0.3, 0.9), (1.0, 0.25, 0.125)
    found = ray_integral(volume, table, origin, direction)
    turned = Volume(np.ascontiguousarray(volume.values.transpose(1, 2, 0)))  # x' = z, y' = x, z' = y
    same = ray_integral(
        turned, table, (origin[2], origin[0], origin[1]), (direction[2], direction[0], direction[1])
    )
    assert_channels(found, same.rgba)


def test_one_voxel_is_a_constant_block():
    table = TransferFunction([0, 1], COLORS[:2], [0, 2])
    found = ray_integral(Volume(np.full((1, 1, 1), 0.25)), table, (-1, 0, 0), (0.5, 0, 0))
    assert_channels(found, [mpf(c) * -mp.expm1(-1) for c in (0.2, 0.1, 1.0, 1.0)], mpf("1e-17"))  # 0.1


def test_integer_volumes_are_read_as_they_are():
    codes = np.random.default_rng(3).integers(0, 255, (3, 3, 3))
    table = TransferFunction([20, 128, 250], COLORS[:3], [0, 2, 0.5])
    ray = (-1, 0.3, 0.9), (1, 0.25, 0.125)
    found = [
        ray_integral(Volume(codes.astype(dtype)), table, *ray).rgba for dtype in ("u1", "i2", "f4", "f8")
    ]
    assert found[0] == found[1] == found[2] == found[3]


# --- extremes


def test_the_faintest_extinctions_keep_their_digits():
    tiny = 1e-310
    table = TransferFunction([0, 1], BLACK_TO_WHITE, [0, tiny])
    found = ray_integral(ramp(), table, *ALONG_X)
    assert abs(found.rgba[0] / (mpf(tiny) / 3) - 1) <= DIGITS_30  # int s s ds
    assert abs(found.rgba[3] / (mpf(tiny) / 2) - 1) <= DIGITS_30
    table = TransferFunction([0, 1], BLACK_TO_WHITE, opacity=[0, tiny])
    found = ray_integral(ramp(), table, *ALONG_X)
    assert abs(found.rgba[3] / (mpf(tiny) / 2) - 1) <= DIGITS_30


def test_the_greatest_extinction_shows_the_first_colour():
    table = TransferFunction([0, 0.25, 1], [(0, 0, 0), (0.5, 0.5, 0.5), (1, 1, 1)], [0, 0, 1e300])
    found = ray_integral(ramp(), table, *ALONG_X)
    # The colour at 1/4, and beyond it what half a 1e150th of the way adds.
    assert_channels(found, [mpf(0.5)] * 3 + [1])


def test_great_colours_have_as_many_digits_as_small_ones():
    colors = np.array([(1.0, 0.0, 0.25), (3.0, 0.5, 0.0)])
    great, small = (TransferFunction([0, 1], colors * f, [0.5, 2.0]) for f in (2.0**100, 1.0))
    found, expected = (ray_integral(ramp(), table, *ALONG_X) for table in (great, small))
    assert_channels(found, [c * 2**100 for c in expected.rgba[:3]] + [expected.rgba[3]], DIGITS_30 * 2**100)
    assert found.remainder <= 1e-33 * 2**100


@pytest.mark.parametrize("kind", ["extinction", "opacity"])
@pytest.mark.parametrize("scale", [1.0, 1e300, 1e-300])
def test_more_digits_change_no_more_than_the_remainder(kind, scale):
    values = np.array([0.2, 0.45, 0.45, 0.7, 0.9]) * scale
    table = TransferFunction(values, COLORS, **{kind: [0, 0.4, 0.1, 1.0, 0.8]})
    volume = Volume(noise().values * scale)
    for origin, direction in (((-1.0, 0.25, 1.5), (1.0, 0.5, -0.25)), ((-1.0, -1.0, 0.3), (0.3, 0.3, 0.1))):
        found = ray_integral(volume, table, origin, direction)
        more = ray_integral(volume, table, origin, direction, digits=48)
        assert 0 < found.remainder < 1e-33
        assert more.remainder < 1e-51
        assert_channels(found, more.rgba, mpf(found.remainder))


def test_close_knots_and_great_depths_ask_for_more_digits():
    ones = np.ones((2, 3))
    assert extra_digits(TransferFunction([0, 1], ones, [0, 1]), 1.0) == 0
    assert extra_digits(TransferFunction([0.5, np.nextafter(0.5, 1)], ones, [0, 1]), 1.0) == 16
    assert extra_digits(TransferFunction([0, 1], ones, opacity=[0, 1], unit_distance=1e-4), 1.0) == 6
    assert extra_digits(TransferFunction([0, 1], ones, [0, 1]), 1e-300) == 0


# --- independence


def test_it_imports_no_part_of_an_integrator():
    allowed = ("volref.arrays", "volref.scene.", "volref.truth.digits")
    for path in Path(volref.truth.digits.__file__).parent.glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = [node.module] if isinstance(node, ast.ImportFrom) else []
            names += [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            assert all(name.startswith(allowed) for name in names if name.startswith("volref")), path.name


def test_a_field_that_is_constant_on_a_knot_of_opacity_1_is_opaque():
    volume = Volume(np.full((3, 3, 3), 2.0))
    table = TransferFunction([1, 2, 3], [(0, 0, 0), (0.3, 0.5, 0.7), (1, 1, 1)], opacity=[0.0, 1.0, 0.3])
    done = ray_integral(volume, table, (1.0, 1.0, -5.0), (0.0, 0.0, 1.0))
    assert [float(c) for c in done.rgba] == [0.3, 0.5, 0.7, 1.0]
