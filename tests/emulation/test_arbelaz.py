"""Seed 000 held to a scalar loop, pixel by pixel; what its printed formulas cost, by number."""

import numpy as np
import pytest

from tests.oracles.arbelaz import Pixel, Setting
from volref import Camera, Mesh, Scene, TransferFunction, Volume, emulate
from volref.emulation.catalogue import named
from volref.emulation.device import Device
from volref.emulation.drawing import prepare
from volref.emulation.loop.opacity import factor_of
from volref.emulation.surfaces.composition import with_object
from volref.emulation.surfaces.packing import unpacked
from volref.emulation.textures.uploads import uploads_of

WIDTH, HEIGHT, STEPS = 20, 15, 25
EXACT = Device.named("exact")
SPACING = (1.0, 1.5, 2.0)

# (corner, one edge, other edge, colour) in front of the box, in it, through it and behind it.
PLATES = {
    "none": [],
    "in front": [((2, 2, 19), (7, 1, 0), (0, 6, 0.5), (1.0, 0.5, 0.0))],
    "inside": [((2, 4, 5), (8, 1, 3), (0, 9, 1), (0.2, 0.9, 0.3))],
    "behind": [((-2, -3, -4), (12, 0, 1), (0, 12, 0), (0.1, 0.4, 1.0))],
    "through": [((-6, 3, -3), (24, 1, 4), (1, 2, 19), (0.9, 0.9, 0.9))],
}
CAMERA = ((9.0, 11.0, 38.0), (5.0, 7.0, 6.0), (0.1, 1.0, 0.0), 33.0, 4.0, 90.0)


def slices(size=(11, 10, 7)):
    nx, ny, nz = size
    z, y, x = np.meshgrid(*(np.arange(n) / n for n in (nz, ny, nx)), indexing="ij")
    waves = 0.5 + 0.3 * np.sin(9 * x + 4 * z) * np.cos(5 * y) + 0.2 * np.cos(8 * z * y)
    return np.rint(255 * waves).astype(np.uint8)


def plate_mesh(corner, one, other, color):
    corner, one, other = (np.array(part, float) for part in (corner, one, other))
    return Mesh([corner, corner + one, corner + one + other, corner + other], [(0, 1, 2), (0, 2, 3)], color)


def scene_of(plates, camera=CAMERA, **more):
    volume = Volume(slices(), spacing=SPACING)
    transfer = TransferFunction.from_opacity(
        [0, 100, 255], [(0.1, 0.2, 0.9), (0.9, 0.7, 0.2), (1, 1, 1)], [0.0, 0.3, 0.8], unit_distance=5.0
    )
    meshes = [plate_mesh(*plate) for plate in plates]
    return Scene(volume, transfer, Camera.look_at(*camera), WIDTH, HEIGHT, meshes, **more)


def setting_of(scene, plates, pipeline, camera=CAMERA):
    uploads = uploads_of(scene, pipeline)
    drawing = prepare(scene, pipeline, EXACT)
    low, high = scene.volume.corners.min(axis=0), scene.volume.corners.max(axis=0)
    return Setting(
        (slices() / 255).tolist(),
        tuple(low.tolist()),
        tuple(high.tolist()),
        (uploads.table[0] / 255).tolist(),
        plates,
        camera,
        WIDTH,
        HEIGHT,
        uploads.tiles[0],
        pipeline.stepping.steps,
        factor_of(scene, pipeline, drawing.box),
    )


@pytest.mark.parametrize("name", ["arbelaz2016", "arbelaz2016-printed"])
@pytest.mark.parametrize("where", PLATES)
def test_every_pixel_is_that_of_a_scalar_loop(where, name):
    scene = scene_of(PLATES[where])
    pipeline = named(name).with_switches(output={"format": "exact"}, stepping={"steps": STEPS})
    if name.endswith("printed"):
        pipeline = pipeline.with_switches(stepping={"cap": STEPS})
    found = emulate(scene, pipeline, EXACT)
    setting = setting_of(scene, PLATES[where], pipeline)
    hits = 0
    for y in range(HEIGHT):
        for x in range(WIDTH):
            color, samples, hit = Pixel(setting, x, y, name.endswith("printed")).drawn()
            assert found.samples[y, x] == samples
            # Some hundred float64 operations, and the uploaded table's k / 255.
            np.testing.assert_allclose(found.rgba[y, x], color, rtol=0, atol=1e-11)
            hits += hit
    assert (hits > 8) == (where in ("inside", "through"))


def facing(near=4.0, plates=(), name="arbelaz2016", **switches):
    """Numbers of the middle pixel, whose ray runs along z through the middle of the box."""
    camera = ((5.0, 7.0, 36.0), (5.0, 7.0, 0.0), (0, 1, 0), 30.0, near, 90.0)
    scene = Scene(
        Volume(slices(), spacing=SPACING),
        TransferFunction.from_opacity([0, 255], [(1, 1, 1)] * 2, [0.0, 0.1]),
        Camera.look_at(*camera),
        21,
        15,
        [plate_mesh(*plate) for plate in plates],
    )
    return emulate(scene, named(name).with_switches(**switches), EXACT)


# The box of `facing` is 14 deep and a step 0.07 long: this plate lies between samples 99 and 100.
HALFWAY = ((-20, -20, 6.02), (60, 0, 0), (0, 60, 0), (1.0, 0.0, 0.0))


def test_as_printed_alpha_dips_to_three_quarters():
    """A A + (1 - A) has its least value at A = 1/2; an opaque object must give 1."""
    alpha = np.linspace(0, 1, 1001)
    gray = np.stack([alpha * 0.5] * 3 + [alpha], axis=1)
    white = np.ones((1, 4))
    printed, working = (with_object(gray, white, rule) for rule in ("printed", "over"))
    assert printed[:, 3].min() == printed[500, 3] == 0.75
    assert (working[:, 3] == 1).all()


def test_as_printed_a_premultiplied_color_is_darkened_by_up_to_a_quarter():
    alpha = np.linspace(0, 1, 1001)
    white_fog = np.stack([alpha] * 4, axis=1)
    black = np.zeros((1, 4))
    printed, working = (with_object(white_fog, black, rule)[:, 0] for rule in ("printed", "over"))
    assert (working - printed).max() == pytest.approx(0.25, abs=1e-15)
    # Of a straight colour the printed form is right.
    straight = np.concatenate([np.ones((1001, 3)), alpha[:, None]], axis=1)
    np.testing.assert_array_equal(with_object(straight, black, "printed")[:, 0], alpha)


def test_as_printed_blending_multiplies_by_alpha_once_more():
    straight, right = (
        facing(output={"blend": blend, "format": "exact"}) for blend in ("straight", "premultiplied")
    )
    color, alpha = right.rgba[7, 10, 0], right.rgba[7, 10, 3]
    assert 0.2 < alpha < 0.8
    assert straight.rgba[7, 10, 0] == pytest.approx(color * alpha, rel=1e-14)


def test_as_printed_the_ray_ends_one_step_before_the_surface():
    early, at = (
        facing(plates=[HALFWAY], meshes={"comparison": rule, "packing": "exact"}).samples[7, 10]
        for rule in ("one-step-early", "at")
    )
    assert (early, at) == (99, 100)


@pytest.mark.parametrize(("near", "steps"), [(4.0, 119), (0.001, 124)])
def test_as_printed_a_mesh_halfway_is_met_further_on(near, steps):
    """Of v = z / w it is (v(middle) - v(front)) / (v(back) - v(front)) of the way."""
    found = facing(near, [HALFWAY], meshes={"depth": "window-over-w", "packing": "exact"}).samples[7, 10]
    front, middle, back = ((1 - near / d) / d for d in (36.0 - 13.0, 36.0 - 6.02, 36.0 + 1.0))
    expected = (middle - front) / (back - front)
    assert found == int(np.ceil(200 * expected)) == steps
    assert facing(near, [HALFWAY], meshes={"packing": "exact"}).samples[7, 10] == 100


def test_as_printed_depth_runs_backwards_between_the_near_plane_and_twice_that():
    """Window z / w is greatest at w = 2 near; here the front face is nearer and the back further away."""
    camera = ((5.0, 7.0, 16.0), (5.0, 7.0, 0.0), (0, 1, 0), 30.0, 2.9, 90.0)
    printed, linear = (
        prepare(scene_of([], camera), named(name), EXACT).cut
        for name in ("arbelaz2016-printed", "arbelaz2016")
    )
    assert (printed.step < 0).all()
    assert (linear.step > 0).all()


def test_cleared_to_white_a_depth_target_would_end_every_ray_at_once():
    white = unpacked(np.ones((1, 4)), "printed")[0]
    depths = prepare(scene_of([]), named("arbelaz2016-printed"), EXACT).cut.depth
    assert 1 - white == pytest.approx(-0.0039, abs=5e-5)
    assert (depths > 1 - white).all()


def test_rays_that_leave_through_a_face_at_0_are_ended_by_the_count_alone():
    """`any(rpos > 1)` ends a ray beyond 1 only; with more steps than lead to the exit it shows."""
    through_0 = facing(name="arbelaz2016-printed", stepping={"cap": 300}).samples[7, 10]
    behind = ((5.0, 7.0, -24.0), (5.0, 7.0, 0.0), (0, 1, 0), 30.0, 4.0, 90.0)
    through_1 = emulate(
        scene_of([], behind), named("arbelaz2016-printed").with_switches(stepping={"cap": 300}), EXACT
    ).samples[HEIGHT // 2, WIDTH // 2]
    assert through_0 == 300
    # Sample 200 lies on the exit, 1 but for the rounding of 200 sums; sample 201 is beyond it.
    assert through_1 in (201, 202)


@pytest.mark.parametrize("depth", ["linear", "window-over-w"])
def test_targets_hold_1_minus_the_depth_that_the_switch_names(depth):
    """A plate 30 before the eye and the box's back 37, between planes at 4 and 90."""
    plate = ((-20, -20, 6), (60, 0, 0), (0, 60, 0), (1.0, 0.0, 0.0))
    passes = facing(plates=[plate], meshes={"depth": depth, "packing": "exact"}).passes
    for name, away in (("mesh_depth", 30.0), ("back_depth", 37.0)):
        window_z = 90 / (90 - 4) * (1 - 4 / away)
        expected = {"linear": (90 - away) / (90 - 4), "window-over-w": window_z / away}[depth]
        assert passes[name][7, 10, 0] == pytest.approx(expected, rel=1e-13)
    assert passes["back_depth"][0, 0, 0] == 0
