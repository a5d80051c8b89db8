"""The exact integrator against closed forms, and against 30 digits on rays chosen to break its certificate.

Rays are given in index space: the volumes lie so that it is the world.  Every case of `BROKEN` once was
outside its certificate, or could be.
"""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import volref as vr
from tests.scenes import rough_scene, rough_volume
from volref import Camera, Scene, TransferFunction, Volume
from volref.phantoms import scenes as known
from volref.phantoms import transfer as known_tables
from volref.phantoms.meshes import sphere_mesh
from volref.phantoms.views import view_around
from volref.records import Rays
from volref.truth import exact
from volref.truth.digits.integral import ray_integral

ULP = 2.0**-52
COLORS = [
    (0.2, 0.0, 1.0),
    (1.0, 0.6, 0.1),
    (0.9, 0.9, 0.3),
    (0.1, 0.9, 0.3),
    (0.5, 0.5, 0.5),
    (0.0, 0.1, 0.0),
]
CAMERA = Camera.look_at((0, 0, -9), (0, 0, 0), (0, 1, 0), 30.0, 0.1, 100.0)
CLEAR = (0.0, 0.0, 0.0, 0.0)
GREEN = (0.0, 1.0, 0.0, 1.0)
TOLERANCES = (1e-2, 1e-6, 1e-12)


def table(values, extinction=None, **opacity):
    colors = [COLORS[i % len(COLORS)] for i in range(len(values))]
    return TransferFunction(values, colors, extinction, **opacity)


def shoot(volume, transfer, origins, directions, tolerance=1e-12, behind=CLEAR, distance=np.inf):
    """The exact integrator on rays (R, 3) of index space: rgba (R, 4) and bound (R,)."""
    origins, directions = (np.array(x, float).reshape(-1, 3) for x in (origins, directions))
    count = len(origins)
    scene = Scene(volume, transfer, CAMERA, count, 1)
    prepared = exact.prepare(scene, vr.plan(scene, method="exact"))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(exact, "pixel_rays", lambda *words: Rays(origins[words[3]], directions[words[3]]))
        lights = np.tile(np.array(behind, float), (count, 1))
        found = exact.integrate_pixels(
            scene, prepared, np.arange(count), 0.0, np.full(count, float(distance)), lights, tolerance
        )
    return found.rgba, found.bound


def assert_certified(volume, transfer, origins, directions, *, useful=None, **more):
    """Every ray is within its certificate at every tolerance, and at 1e-12 no bound exceeds `useful`."""
    origins, directions = (np.array(x, float).reshape(-1, 3) for x in (origins, directions))
    truths = [
        ray_integral(volume, transfer, o, d, more.get("distance", np.inf), more.get("behind", CLEAR))
        for o, d in zip(origins.tolist(), directions.tolist(), strict=True)
    ]
    for tolerance in TOLERANCES:
        rgba, bound = shoot(volume, transfer, origins, directions, tolerance, **more)
        assert (bound >= 0).all()
        for k, truth in enumerate(truths):
            error = max(abs(a - b) for a, b in zip(truth.rgba, rgba[k].tolist(), strict=True))
            assert error <= bound[k] + truth.remainder, (tolerance, k, float(error), bound[k])
    if useful is not None:
        assert bound.max() <= useful


def noise(scale=1.0, offset=0.0, shape=(4, 4, 4), seed=0, **place):
    return Volume(offset + scale * np.random.default_rng(seed).random(shape), **place)


def some_rays(count=4, seed=1, size=3.0):
    rng = np.random.default_rng(seed)
    return rng.random((count, 3)) * size, rng.normal(size=(count, 3))


# --- certificates that an adversary could break

HIDDEN = [0.0, 0.5, 0.5 + ULP / 2, 0.5 + ULP, 1.0]
ONE_VOXEL = Volume(np.where(np.arange(125).reshape(5, 5, 5) == 62, 1.0, 0.0))
BLOCK = np.zeros((6, 6, 6))
BLOCK[2:4, 2:4, 2:4] = 1.0
WALL = table([1.0, 1.0], opacity=[0.1, 1.0])


def through(target, seed, count=25, *, dyadic=False):
    """Rays through one point, of random or of short dyadic directions."""
    directions = np.random.default_rng(seed).normal(size=(count, 3))
    if dyadic:
        directions = np.round(directions * 4) / 4
        directions = directions[np.abs(directions).sum(axis=1) > 0]
    return np.array(target) - 3 * directions, directions


def slab(plane, *, above):
    """A field that falls or rises along x up to a plane and is 1/2 beyond: flat there."""
    values = np.zeros((4, 4, 12))
    if above:
        values[:, :, plane:] = 0.5
    else:
        values[:, :, : plane + 1] = 0.5
    return Volume(values)


def along_plane(plane):
    """Rays along a plane of the lattice, on it but for rounding."""
    rays = [
        ((np.nextafter(plane, side), 1.2, -1.0), d) for side in (-9, 99) for d in ((0, 0, 1), (0, 0.1, 1))
    ]
    slopes = [1e-16, -1e-16, 1e-15, -1e-13]
    rays += [((plane - steps * s, 1.2, -1.0), (s, 0, 1)) for s in slopes for steps in (0, 0.5, 2)]
    return tuple(zip(*rays, strict=True))


def grazing():
    """Rays that leave a long box through a face they are nearly parallel to."""
    rng = np.random.default_rng(2)
    slope = 1e-6
    origins = [(127.5 + slope * (1 + 4 * rng.random()), 1.0, -0.3 - rng.random()) for _ in range(8)]
    return origins, [(slope * -1.0, 0.0, 1.0)] * 8


def from_a_power_of_two():
    rng = np.random.default_rng(3)
    origins = np.stack(
        [2.0**24 - 0.9 * rng.random(8), 2.0**24 + 3 * rng.random(8), 3 + rng.random(8)], axis=1
    )
    directions = 3 + rng.normal(size=(8, 3)) - origins
    return origins, directions / np.linalg.norm(directions, axis=1, keepdims=True)


def through_an_edge_of_the_box(seed, count=12):
    """Rays that touch the box of 4 x 4 x 4 voxels at its edge x = y = -1/2, from outside."""
    rng = np.random.default_rng(seed)
    directions = np.stack([-0.1 - rng.random(count), 0.1 + rng.random(count), rng.normal(size=count)], axis=1)
    return np.array([-0.5, -0.5, 1.2]) - 3 * directions, directions


STEP = slab(2, above=True)

BROKEN = {
    "a spike among knots an ulp apart, constant field": (
        Volume(np.full((3, 3, 3), HIDDEN[2]), centering="node"),
        table(HIDDEN, [0, 0, 5, 0, 0]),
        [(1, 1, -1)],
        [(0, 0, 1)],
    ),
    "a spike of 1e12 among knots an ulp apart": (
        noise(),
        table(HIDDEN, [0.1, 0.1, 1e12, 0.1, 0.1]),
        *some_rays(),
    ),
    "a far knot of great extinction": (noise(0.5), table([-1e6, 1.0], [1e6, 0.0]), *some_rays()),
    "a knot at 1e20": (noise(0.5), table([-1e20, 1.0], [1e20, 0.0]), *some_rays()),
    "nearly opaque, values tiny against the table": (
        noise(-1e-10),
        table([-1, 0], opacity=[0.2, 1.0], unit_distance=50.0),
        *some_rays(),
    ),
    "nearly opaque, values small against the table": (
        noise(-1e-5),
        table([-1, 0], opacity=[0.2, 1.0], unit_distance=50.0),
        *some_rays(),
    ),
    "nearly opaque between far knots": (
        noise(),
        table([0, 1000.0], opacity=[1 - 1e-13, 1 - 3e-13], unit_distance=30.0),
        *some_rays(),
    ),
    "nearly opaque between knots on both far sides": (
        noise(),
        table([-1e5, 1e5], opacity=[1 - 1e-9, 1 - 1e-12], unit_distance=30.0),
        *some_rays(),
    ),
    "nearly opaque between knots very far away": (
        noise(),
        table([-1e7, 1e8], opacity=[1 - 1e-13, 1 - 3e-13], unit_distance=30.0),
        *some_rays(),
    ),
    "knots 33 ulp apart": (
        Volume(np.full((3, 3, 3), 1 + 16 * ULP)),
        table([1, 1 + 33 * ULP], [0, 1.0]),
        [(1, 1, -1)],
        [(0, 0, 1)],
    ),
    "opacities at knots 33 ulp apart": (
        Volume(np.full((3, 3, 3), 1 + 16 * ULP)),
        table([1, 1 + 33 * ULP], opacity=[0, 0.9]),
        [(1, 1, -1)],
        [(0, 0, 1)],
    ),
    "values that vary by 1e-10 of themselves": (
        noise(1e-10, 1.0),
        table(1 + 1e-10 * np.array([0.1, 0.35, 0.6, 0.95]), [0.5, 3.0, 0.2, 4.0]),
        *some_rays(8),
    ),
    "opacities of values that vary by 1e-10 of themselves": (
        noise(1e-10, 1.0),
        table(1 + 1e-10 * np.array([0.1, 0.35, 0.6, 0.95]), opacity=[0.1, 0.9, 0.2, 1.0]),
        *some_rays(8),
    ),
    "values about 1e8": (
        noise(1.0, 1e8),
        table(1e8 + np.array([0, 0.3, 0.6, 1.0]), [0, 0.4, 0.1, 2.0]),
        *some_rays(8),
    ),
    "runs of values that vary by 1e-9 of themselves": (
        noise(1e-9, 1.0),
        table(1 + 1e-9 * np.linspace(0, 1, 90), 1 + np.sin(np.arange(90.0))),
        *some_rays(),
    ),
    "opacity 1 at one voxel": (ONE_VOXEL, WALL, *through((2, 2, 2), 4)),
    "opacity 1 at one voxel, dyadic rays": (ONE_VOXEL, WALL, *through((2, 2, 2), 5, dyadic=True)),
    "an edge of an opaque block": (Volume(BLOCK), WALL, *through((2, 2, 2.5), 6)),
    "a corner of an opaque block": (Volume(BLOCK), WALL, *through((3, 3, 3), 7)),
    "a steep colour where the value is constant": (
        STEP,
        TransferFunction([0, 0.15 - 1e-8, 0.15 + 1e-8, 1], [(0, 0, 0)] * 2 + [(1, 1, 1)] * 2, [1] * 4),
        [(1.3 + k * 1e-16, 1.2, -1) for k in range(5)],
        [(0, 0, 1)] * 5,
    ),
    "an edge of a box of extinction 1e10": (
        Volume(np.full((4, 4, 4), 0.5)),
        table([0.5], [1e10]),
        *through_an_edge_of_the_box(11),
    ),
    "an edge of an opaque box": (
        Volume(np.full((4, 4, 4), 0.5)),
        table([0.5], opacity=[1.0]),
        *through_an_edge_of_the_box(12),
    ),
    "a jump to opaque along the ray": (
        STEP,
        table([0.15, 0.15], opacity=[0.1, 1.0]),
        [(np.nextafter(1.3, s), 1.2, -1.0) for s in (0, 1.3, 2)],
        [(0, 0, 1)] * 3,
    ),
    "opacities of hundreds of thousands of unit distances": (
        noise(),
        table([0, 0.5, 1], opacity=[0.3, 1.0, 0.5], unit_distance=1e-5),
        *some_rays(),
    ),
    "from opaque to clear within millionths": (
        noise(),
        table([0, 0.5, 1], opacity=[0.0, 1.0, 0.0], unit_distance=1e-6),
        *some_rays(),
    ),
    "grazing a face": (Volume(np.full((4, 4, 128), 0.5)), table([0.5], [1.0]), *grazing()),
    "an origin that the padding takes over a power of two": (
        noise(shape=(8, 8, 8)),
        table([0, 0.3, 0.6, 1], [0, 0.4, 0.1, 2.0]),
        *from_a_power_of_two(),
    ),
    "a constant field where the opacity is 1 at a knot": (
        Volume(np.full((3, 3, 3), 2.0)),
        table([1, 2, 3], opacity=[0, 1, 0.3]),
        [(1, 1, -1)],
        [(0.1, 0, 1)],
    ),
    "a touch of opacity 1 in plateaus of whole numbers": (
        Volume(np.random.default_rng(8).integers(0, 4, (6, 6, 6)).astype(np.uint8)),
        table([1, 1, 2, 2, 3, 3], opacity=[0, 0.5, 0.5, 0, 0, 0.9]),
        *through((2, 3, 2), 9, 8, dyadic=True),
    ),
}


@pytest.mark.parametrize("behind", [CLEAR, GREEN])
@pytest.mark.parametrize("name", BROKEN)
def test_no_ray_breaks_its_certificate(name, behind):
    assert_certified(*BROKEN[name], behind=behind)


@pytest.mark.parametrize("above", [False, True])
@pytest.mark.parametrize("plane", [1, 2, 3, 4])
@pytest.mark.parametrize("sides", ["extinction below", "extinction above", "opaque below", "opaque above"])
def test_rays_on_a_plane_by_rounding_may_be_on_its_other_side(plane, sides, above):
    below = [1.0, 0.0] if sides.endswith("below") else [0.0, 1.0]
    jump = table([0.5, 0.5], below) if "extinction" in sides else table([0.5, 0.5], opacity=below)
    assert_certified(slab(plane, above=above), jump, *along_plane(plane), behind=GREEN)


# --- and stay of use


def test_certificates_of_noise_are_below_1e_minus_12():
    smooth = table([0, 0.3, 0.6, 1], [0, 0.4, 0.1, 2.0])
    assert_certified(noise(shape=(5, 6, 7)), smooth, *some_rays(12, 4, 5.0), useful=2e-13)
    opacity = table([0, 0.3, 0.6, 1], opacity=[0, 0.4, 0.1, 0.9])
    assert_certified(noise(shape=(5, 6, 7)), opacity, *some_rays(12, 4, 5.0), useful=1e-12)


def test_a_jump_crossed_in_earnest_costs_little():
    jumps = table([0, 0.3, 0.3, 0.6, 0.6, 1], [0, 0.4, 4.0, 0.1, 0.0, 1.0])
    assert_certified(noise(shape=(5, 6, 7)), jumps, *some_rays(12, 4, 5.0), useful=1e-11)


def test_an_opaque_wall_met_in_earnest_costs_little():
    origins, directions = through((2.5, 2.5, 2.5), 10, 12)
    wall = table([0.5, 0.5], opacity=[0.1, 1.0])
    # What shows at a slanting entrance is unsure to the roundings of its place.
    assert_certified(Volume(BLOCK), wall, origins, directions, behind=GREEN, useful=1e-9)


def test_surfaces_end_rays_at_their_distance():
    smooth = table([0, 0.3, 0.6, 1], [0, 0.4, 0.1, 2.0])
    origins, directions = some_rays(6, 5)
    assert_certified(noise(), smooth, origins, directions, distance=0.7, behind=GREEN, useful=2e-13)


# --- closed forms

SIZES = {"cube": {}, "uneven": {"spacing": (0.5, 1.0, 2.0)}}
KNOWN = {
    "homogeneous": lambda **more: known.homogeneous_scene(12, 9, **more),
    "ramp": lambda **more: known.ramp_scene(12, 9, **more),
    "ramp, 9 knots": lambda **more: known.ramp_scene(12, 9, transfer=known_tables.smooth(knots=9), **more),
    "exponential": lambda **more: known.exponential_scene(12, 9, **more),
    "ball": lambda **more: known.ball_scene(12, 9, **more),
}


def assert_known(scene, image, tolerance):
    out = vr.render(scene, method="exact", tolerance=tolerance)
    error = np.abs(out.rgba - image).max(axis=-1)
    # The closed form is rounded too: some ulp of 1 a plane.
    assert (error <= out.bound + 1e-13).all()
    assert out.bound.max() <= tolerance
    assert out.met_tolerance
    assert out.bound_kind == "certified"


@pytest.mark.parametrize("tolerance", [1e-2, 1 / 510, 1e-5, 1e-9, 1e-12])
@pytest.mark.parametrize("name", KNOWN)
def test_images_are_those_of_the_closed_form_within_the_tolerance(name, tolerance):
    assert_known(*KNOWN[name](background=(0.1, 0.2, 0.3, 0.5)), tolerance)


@pytest.mark.parametrize("centering", ["cell", "node"])
@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("name", KNOWN)
def test_spacing_and_centering_are_in_it(name, size, centering):
    for parallel in (False, True):
        assert_known(*KNOWN[name](centering=centering, parallel=parallel, **SIZES[size]), 1e-9)


@pytest.mark.parametrize("name", KNOWN)
def test_a_camera_inside_sees_what_is_in_front_of_it(name):
    scene, _ = KNOWN[name]()
    camera = view_around(scene.volume, distance=0.8, fov_y=60.0)
    assert_known(*KNOWN[name](camera=camera), 1e-10)


def turned(angle):
    """A rotation about an axis that is no axis of the grid."""
    axis = np.array([1.0, 2.0, 2.0]) / 3
    cross = np.cross(np.eye(3), axis)
    return np.cos(angle) * np.eye(3) - np.sin(angle) * cross + (1 - np.cos(angle)) * np.outer(axis, axis)


@pytest.mark.parametrize("centering", ["cell", "node"])
def test_turned_and_uneven_volumes_about_a_mesh_are_within_their_certificates(centering):
    place = {"spacing": (0.5, 1.0, 2.0), "direction": turned(0.4), "origin": (3.0, -2.0, 1e3)}
    volume = rough_volume(shape=(6, 7, 8), centering=centering, **place)
    ball = sphere_mesh(0.8, volume.corners.mean(axis=0), colors=(0.9, 0.4, 0.1))
    opacity = table([0, 0.3, 0.6, 1], opacity=[0, 0.4, 0.1, 0.9])
    scene = Scene(
        volume, opacity, view_around(volume), 12, 12, meshes=[ball], background=(0.1, 0.2, 0.3, 0.5)
    )
    for tolerance in (1e-2, 1e-11):
        out = vr.render(scene, method="exact", tolerance=tolerance)
        assert out.met_tolerance
        assert vr.verify(scene, out, rays=12).ok


# --- what must not matter


@pytest.mark.parametrize("tolerance", [1e-2, 1e-6])
def test_threads_do_not_matter(tolerance):
    scene = rough_scene(70, 40)
    one, three = (vr.render(scene, method="exact", tolerance=tolerance, threads=n) for n in (1, 3))
    assert one.rgba.tobytes() == three.rgba.tobytes()
    assert one.bound.tobytes() == three.bound.tobytes()


@pytest.mark.parametrize("tolerance", [1e-2, 1e-9])
@pytest.mark.parametrize("interpolation", ["extinction", "opacity"])
def test_rays_beside_it_do_not_matter_beyond_the_bounds(tolerance, interpolation):
    smooth = table([0, 0.3, 0.6, 1], **{interpolation: [0, 0.4, 0.1, 0.9]})
    origins, directions = some_rays(30, 6)
    rgba, bound = shoot(noise(), smooth, origins, directions, tolerance)
    for k in range(0, 30, 7):
        alone, its_bound = shoot(noise(), smooth, origins[k], directions[k], tolerance)
        assert np.abs(alone[0] - rgba[k]).max() <= bound[k] + its_bound[0]
        # Sums are taken over all rays at once, each rounded at its own size.
        assert np.abs(alone[0] - rgba[k]).max() <= 1e-14
        assert its_bound[0] == pytest.approx(bound[k], rel=1e-9)


@pytest.mark.parametrize("tolerance", [1e-2, 1e-9])
def test_empty_space_changes_nothing_beyond_the_bounds(tolerance):
    values = np.random.default_rng(7).random((12, 13, 14)) ** 12
    scene = Scene(Volume(values), table([0.5, 0.9], [0, 3.0]), view_around(Volume(values)), 24, 18)
    plan = vr.plan(scene, method="exact", tolerance=tolerance)
    skipped, full = (
        vr.render(scene, method="exact", plan=plan),
        vr.render(scene, method="exact", plan=plan.everything()),
    )
    assert (np.abs(skipped.rgba - full.rgba).max(axis=-1) <= skipped.bound + full.bound).all()
    assert (np.abs(skipped.rgba - full.rgba) <= 1e-12).all()
    assert skipped.rgba[..., 3].max() > 0.1


def test_a_transparent_volume_leaves_what_lies_behind_it():
    rgba, bound = shoot(noise(), table([2.0, 3.0], [0, 1.0]), *some_rays(), behind=GREEN)
    assert (rgba == GREEN).all()
    assert (bound <= 1e-13).all()


def test_bounds_are_what_met_tolerance_says():
    # A constant field on a jump: no bound can be small.
    flat = Volume(np.full((4, 4, 4), 0.3) + np.arange(4) * 0.0)
    scene = Scene(flat, table([0.3, 0.3], [0.1, 0.4]), view_around(flat), 8, 8)
    for candidate in (scene, dataclasses.replace(scene, volume=noise())):
        out = vr.render(candidate, method="exact", tolerance=1e-9)
        assert out.met_tolerance == bool((out.bound <= 1e-9).all())


# --- any scene

knots = st.lists(st.integers(-2, 12).map(lambda k: k / 10), min_size=1, max_size=7).map(sorted)


@st.composite
def cases(draw):
    """A small volume, a table, and rays, many of them special."""
    seed = draw(st.integers(0, 9999))
    rng = np.random.default_rng(seed)
    shape = tuple(draw(st.integers(1, 5)) for _ in "xyz")
    values = {
        "noise": rng.random(shape),
        "levels": np.round(rng.random(shape) * 10) / 10,
        "bytes": (rng.random(shape) * 10).astype(np.uint8) / np.float32(10),
    }[draw(st.sampled_from(["noise", "levels", "bytes"]))]
    positions = draw(knots)
    positions = [v for i, v in enumerate(positions) if positions[max(0, i - 2) : i].count(v) < 2]
    strength = rng.random(len(positions)) * (rng.random(len(positions)) < 0.8)
    extinction = draw(st.booleans())
    size = 10.0 ** draw(st.integers(-2, 3))
    if extinction:
        transfer = table(positions, strength * size)
    else:
        transfer = table(
            positions, opacity=np.where(rng.random(len(positions)) < 0.2, 1.0, strength), unit_distance=size
        )
    directions = rng.normal(size=(3, 3)) * rng.choice([1.0, 1.0, 0.0, 1e-9], (3, 3))
    directions[np.abs(directions).max(axis=1) < 1e-6] = [0.0, 1.0, 0.5]
    targets = np.where(rng.random((3, 3)) < 0.3, rng.integers(0, 4, (3, 3)), rng.random((3, 3)) * 4)
    return Volume(values), transfer, targets - 5 * directions, directions


@settings(max_examples=6)
@given(cases(), st.sampled_from([CLEAR, GREEN]))
def test_any_ray_through_any_small_scene_is_within_its_certificate(case, behind):
    assert_certified(*case, behind=behind)


@pytest.mark.slow
@settings(max_examples=300)
@given(cases(), st.sampled_from([CLEAR, GREEN]))
def test_hundreds_of_such_scenes_are(case, behind):
    assert_certified(*case, behind=behind)
