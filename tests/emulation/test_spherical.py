"""Radars in the texture of seed 001: held to volref's own definition; what eq. 18 to 20 make of them."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.oracles import polar
from volref import Camera, RadarVolume, Scene, SceneError, Sweep, TransferFunction, Volume, emulate, render
from volref.emulation.agreement import check_drawable
from volref.emulation.catalogue import named
from volref.emulation.device import Device
from volref.emulation.limit import limit_scene, refined
from volref.emulation.rays.box import box_of
from volref.emulation.textures.lookup import look_up, textures_of
from volref.emulation.textures.spherical import spherical, sweep_pair
from volref.emulation.textures.uploads import uploads_of
from volref.phantoms.storms import make_storm, radar_of_scan, sample_polar
from volref.workspace import Workspace

TILTS = (-3.0, 1.0, 2.0, 10.0, 50.0, 80.0)
EXACT = {"format": "exact"}
DEVICE = Device.named("exact")
LOW, HIGH = -32.0, 95.5


def noise(tilts=TILTS, *, radials=20, gates=8, turned=4.0):
    """Radar of noise, no two gates alike, 80 km far."""
    rng = np.random.default_rng(6)
    azimuths = turned + 360 * np.arange(radials) / radials
    sweeps = [Sweep(azimuths, tilt, rng.uniform(-20, 60, (radials, gates)), 5e3, 10e3) for tilt in tilts]
    return RadarVolume(sweeps)


def look(transparent=LOW):
    return TransferFunction.from_opacity(
        [transparent, 20, HIGH], [(0, 0.2, 1), (0.4, 1, 0.2), (1, 0.5, 0)], [0, 0.3, 0.8], 30e3
    )


def scene_of(radar, eye=(120e3, -180e3, 90e3), size=(16, 12), transfer=None):
    camera = Camera.look_at(eye, (0, 0, 0), (0, 0, 1), 42.0, 1e3, 1e6)
    return Scene(radar, transfer or look(), camera, *size)


def widened(name="congote2012-radar", **groups):
    groups = {"rays": EXACT, "table": EXACT, "output": EXACT} | groups
    groups["volume"] = EXACT | groups.get("volume", {})
    return named(name).with_switches(**groups)


def looked_up(scene, pipeline, world):
    """Values, in dBZ, at world points (3, n)."""
    textures = textures_of(uploads_of(scene, pipeline), pipeline, DEVICE)
    to_texture = box_of(scene).texture_from_world
    places = to_texture[:3, :3] @ world + to_texture[:3, 3:]
    return LOW + (HIGH - LOW) * look_up(textures, places, Workspace()).value


RADAR = noise()
SCENE = scene_of(RADAR)
# Nearer to the antenna than 100 m the difference from 1/2 loses too many digits.
PLACES = st.tuples(st.floats(100.0, 79.9e3), st.floats(0, 360), st.floats(-2.999, 79.999))


@settings(max_examples=60, deadline=None)
@given(st.lists(PLACES, min_size=1, max_size=8))
def test_a_program_put_right_finds_what_the_definition_says(places):
    world = np.array([polar.point_of(*place) for place in places]).T
    found = looked_up(SCENE, widened(), world)
    expected = [polar.value_at(RADAR, point) for point in world.T]
    # Angles are rounded in the 16th digit and noise rises by 80 dBZ per degree between sweeps 1 apart.
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-7)


@pytest.mark.parametrize("place", [(40e3, 10.0, 80.1), (40e3, 10.0, -3.1), (80.1e3, 10.0, 20.0)])
def test_above_below_and_beyond_the_sweeps_the_value_is_that_of_byte_0(place):
    world = np.array([polar.point_of(*place)]).T
    assert looked_up(SCENE, widened(), world)[0] == LOW
    assert polar.value_at(RADAR, world[:, 0]) is None


def test_at_the_antenna_itself_nothing_is_found():
    """There r is 0 and eq. 20 divides 0 by 0."""
    assert looked_up(SCENE, widened(), np.zeros((3, 1)))[0] == LOW


def test_without_a_copied_column_there_is_a_seam_at_the_first_radial():
    """Half a column to each side of the seam the outer radials are repeated; in the middle they jump."""
    radar = noise(radials=20, turned=0.0)
    scene = scene_of(radar)
    first, last = (radar.sweeps[1].values[k, 3] for k in (0, -1))
    seam = 351.0
    at = np.array([polar.point_of(35e3, seam + turn, 1.0 + 1e-9) for turn in (-1e-6, 1e-6)]).T
    wrapped = looked_up(scene, widened(), at)
    clamped = looked_up(scene, widened(volume={"seam": "clamped"}), at)
    np.testing.assert_allclose(wrapped, (first + last) / 2, atol=1e-4)
    np.testing.assert_allclose(clamped, [last, first], atol=1e-4)


def test_rows_that_bleed_show_the_next_sweep_at_the_antenna_and_the_last_gate():
    """Stacked images share their edges: the last gate is mixed half and half with the next sweep's first."""
    farthest = np.array([polar.point_of(80e3 - 1e-6, 4.0, 2.0 + 1e-9)]).T
    sweep, above = RADAR.sweeps[2].values[0], RADAR.sweeps[3].values[0]
    assert looked_up(SCENE, widened(), farthest)[0] == pytest.approx(sweep[-1], abs=1e-4)
    bled = looked_up(SCENE, widened(volume={"in_tile": "bleeds"}), farthest)[0]
    assert bled == pytest.approx((sweep[-1] + above[0]) / 2, abs=1e-3)


def test_the_image_has_sweeps_upwards_gates_in_rows_and_radials_in_columns():
    uploads = uploads_of(SCENE, named("congote2012-radar"))
    image = uploads.volume[..., 0]
    assert image.shape == (6 * 8, 20 + 2)
    assert (uploads.size, uploads.tiles) == ((20, 8, 6), (1, 6))
    for s, sweep in enumerate(RADAR.sweeps):
        codes = np.rint((sweep.values - LOW) * 2).T
        np.testing.assert_array_equal(image[8 * s : 8 * s + 8, 1:-1], codes)
        np.testing.assert_array_equal(image[8 * s : 8 * s + 8, 0], codes[:, -1])
        np.testing.assert_array_equal(image[8 * s : 8 * s + 8, -1], codes[:, 0])


def test_sweeps_of_their_own_grids_are_brought_to_one_gate_by_gate():
    wide = Sweep([30, 150, 270], 5.0, np.array([[1.0, 2, 3], [4, 5, 6], [7, 8, np.nan]]), 1e3, 2e3)
    fine = Sweep([30, 90, 150, 210, 270, 330], 1.0, 10.0 + np.arange(24.0).reshape(6, 4), 5e2, 1e3)
    scene = scene_of(RadarVolume([wide, fine], no_echo=LOW))
    pipeline = named("congote2012-radar").with_switches(volume={"seam": "clamped"})
    codes = uploads_of(scene, pipeline).volume[..., 0] / 2 + LOW
    np.testing.assert_array_equal(codes[:4], fine.values.T)
    assert (codes[4:6] == LOW).all()
    # Gates of 2 km are repeated; of radials 120 degrees apart each second column is nearer to one of them.
    np.testing.assert_array_equal(codes[6:12, 0], [1, 1, 2, 2, 3, 3])
    np.testing.assert_array_equal(codes[6:12, 4], [7, 7, 8, 8, LOW, LOW])
    floats = uploads_of(scene, pipeline.with_switches(volume={"format": "float"})).volume[..., 0]
    np.testing.assert_array_equal(floats[10:12, 4], 0)


def test_on_a_sweep_the_one_above_is_the_second_as_the_last_match_of_the_search_is_kept():
    radar = noise((-5.0, 0.0, 5.0))
    grid = uploads_of(scene_of(radar), named("congote2012-radar")).grid
    level = np.array([[0.7], [0.4], [0.5]])
    pair, seen = sweep_pair(named("congote2012-radar").volume, grid, level, DEVICE)
    assert (pair.first.item(), pair.share.item(), seen.item()) == (1.0, 0.0, True)


# Printed.


def cube(n=41):
    """Places (3, n^3) throughout the cube."""
    axis = np.linspace(0, 1, n)
    return np.stack(np.meshgrid(axis, axis, axis, indexing="ij")).reshape(3, -1)


def test_printed_angles_are_those_of_a_quarter_turn_and_of_low_elevations():
    """phi counts from a corner of the cube, not from the antenna: 180 to 270 degrees.  acos(z / phi) of it is
    71.4 to 90 degrees, so all of the cube lies 0 to 18.6 degrees above the horizon, what is below it too."""
    r, phi, theta = spherical(cube(), DEVICE, printed=True)
    turned, tilt = np.degrees(phi), 90 - np.degrees(theta)
    assert (turned.min(), turned.max()) == pytest.approx((180, 270))
    assert (tilt.min(), tilt.max()) == pytest.approx((0, np.degrees(np.arcsin(1 / np.pi))))
    assert np.degrees(np.arcsin(1 / np.pi)) == pytest.approx(18.56, abs=0.005)
    np.testing.assert_array_equal(r, spherical(cube(), DEVICE, printed=False)[0])


@pytest.mark.parametrize(
    ("azimuth", "elevation", "column", "tilt"),
    [
        # 0.4 of the cube's side from the antenna; column: the azimuth whose radial is read.
        (0.0, 0.0, 240.9, 6.83),
        (90.0, 0.0, 209.1, 7.87),
        (180.0, 0.0, 191.3, 8.61),
        (270.0, 0.0, 258.7, 6.36),
        (0.0, 30.0, 239.4, 9.64),
        (0.0, -30.0, 239.4, 4.12),
        (0.0, 90.0, 225.0, 13.25),
        (0.0, -90.0, 225.0, 1.46),
    ],
)
def test_where_printed_equations_look(azimuth, elevation, column, tilt):
    place = 0.5 + 0.4 * np.array(polar.point_of(1.0, azimuth, elevation))[:, None]
    _, phi, theta = spherical(place, DEVICE, printed=True)
    assert np.degrees(phi).item() == pytest.approx(column, abs=0.1)
    assert 90 - np.degrees(theta).item() == pytest.approx(tilt, abs=0.01)


def test_columns_by_phi_would_be_mirrored_even_with_the_antenna_in_the_middle():
    """phi runs anticlockwise from the west, radials clockwise from north: by phi west is the first column."""
    angles = (0.0, 90.0, 180.0, 270.0)
    places = np.array([0.5 + 0.3 * np.array(polar.point_of(1.0, azimuth, 5.0)) for azimuth in angles]).T
    phi = np.degrees(spherical(places, DEVICE, printed=False)[1])
    np.testing.assert_allclose(phi, [270, 180, 90, 0], atol=1e-9)


def test_printed_programs_draw_below_the_horizon():
    """Twelve degrees below the lowest sweep there is nothing; the printed program finds an echo there."""
    radar = RadarVolume(
        [Sweep(np.arange(20) * 18.0, t, np.full((20, 8), 40.0), 5e3, 10e3) for t in (0.5, 5, 20)]
    )
    scene = scene_of(radar)
    below = np.array([polar.point_of(40e3, azimuth, -12.0) for azimuth in range(0, 360, 10)]).T
    assert (looked_up(scene, widened(), below) == LOW).all()
    printed = widened(volume={"geometry": "spherical-printed"})
    np.testing.assert_allclose(looked_up(scene, printed, below), 40.0)


# Convergence.


def far_from(program, exact):
    return float(np.sqrt(np.mean((program - exact) ** 2)))


def test_a_program_put_right_tends_to_the_truth_as_its_step_is_refined_and_the_printed_one_does_not():
    """The sum of a fixed number of samples per ray: its error goes down with their number, first order."""
    scan = sample_polar(
        make_storm(), azimuths=36, gates=40, gate_length=2.5e3, elevations_deg=(0.5, 2, 5, 12, 25)
    )
    scene = scene_of(radar_of_scan(scan), (90e3, -170e3, 110e3), (20, 15), look(0.0))
    # Halving this step changes 2e-5.
    truth = render(scene, method="march", step=25.0, certified=False).rgba
    corrected = {"opacity": {"rule": "corrected"}}
    fine = {"table": EXACT | {"size": 4096}}

    def error(pipeline, steps):
        program = pipeline.with_switches(stepping={"steps": steps})
        return far_from(emulate(scene, program, "exact").rgba, truth)

    errors = [error(widened(**corrected, **fine), steps) for steps in (250, 1000, 4000)]
    # Four times the samples: a quarter of it, but for the edge of the lowest sweep, met by chance.
    assert errors[0] < 8e-4
    assert errors[1] < errors[0] / 3
    assert errors[2] < errors[1] / 3
    misplaced = widened(volume={"geometry": "spherical-printed"}, **corrected)
    printed = [error(misplaced, steps) for steps in (250, 1000)]
    assert printed == pytest.approx([0.0387] * 2, abs=1e-4)
    assert far_from(0.0, truth) == pytest.approx(0.0258, abs=1e-4)


def test_the_truth_that_it_tends_to_is_that_of_the_bytes_it_has_uploaded():
    """As it is in the catalogue but for the canvas and the colour cube, from straight above: order 1."""
    scan = sample_polar(make_storm(), azimuths=36, gates=40, gate_length=2.5e3, elevations_deg=(1, 4, 12, 40))
    radar = radar_of_scan(scan)
    camera = Camera.orthographic((0, 0, 200e3), (0, 0, 0), (0, 1, 0), 170e3, 1e3, 6e5)
    scene = Scene(radar, look(0.0), camera, 12, 12)
    program = named("congote2012-radar").with_switches(rays=EXACT, output=EXACT | {"precision": "highp"})
    limit = limit_scene(scene, program)
    assert [sweep.elevation for sweep in limit.volume.sweeps] == pytest.approx([1, 4, 12, 40])
    truth = render(limit, method="march", step=25.0, certified=False).rgba
    found = [far_from(emulate(scene, refined(scene, program, k), DEVICE).rgba, truth) for k in (1, 4, 16)]
    assert found[1] < found[0] / 3
    assert found[2] < found[1] / 3


@pytest.mark.parametrize("changes", [{"geometry": "spherical-printed"}, {"seam": "clamped"}])
def test_programs_with_another_lookup_tend_to_no_truth(changes):
    with pytest.raises(
        SceneError, match="must tend to an integral of emission and absorption, got one where a radar"
    ):
        limit_scene(SCENE, named("congote2012-radar").with_switches(volume=changes))


# What is refused.


def test_a_grid_is_refused_by_programs_for_radars_and_a_radar_by_those_for_grids():
    camera, grid = SCENE.camera, Volume(np.zeros((3, 3, 3)))
    with pytest.raises(
        SceneError, match="must be a RadarVolume for pipeline 'congote2012-radar', got Volume"
    ):
        emulate(Scene(grid, look(), camera, 16, 12), "congote2012-radar")
    with pytest.raises(SceneError, match="must be a Volume for pipeline 'congote2012', got RadarVolume"):
        emulate(SCENE, "congote2012")


@pytest.mark.parametrize(
    ("group", "switches", "words"),
    [
        (
            "volume",
            {"layout": "3d"},
            "pipeline.volume.layout must be 'atlas' where volume.geometry is 'spherical'",
        ),
        ("volume", {"tiles_across": 2}, "pipeline.volume.tiles_across must be 1"),
        ("volume", {"padding": 1}, "pipeline.volume.padding must be 0"),
        ("table", {"order": "per-slice"}, "pipeline.table.order must be 'post'"),
        ("lighting", {"gradient": "central"}, "pipeline.lighting.gradient must be 'none'"),
        ("stepping", {"rule": "voxel-count"}, "must be one without voxels for a radar"),
    ],
)
def test_switches_that_a_radar_has_no_use_for_are_refused(group, switches, words):
    with pytest.raises(SceneError, match=words):
        check_drawable(SCENE, named("congote2012-radar").with_switches(**{group: switches}))


def test_a_single_sweep_has_nothing_between_two():
    scene = scene_of(noise((0.0,)))
    assert not emulate(scene, "congote2012-radar").rgba.any()
    on_it = np.array([[30e3], [20e3], [0.0]])
    assert looked_up(scene, widened(), on_it)[0] == LOW


def test_steps_by_length_follow_the_gates():
    pipeline = named("congote2012-radar").with_switches(
        stepping={"rule": "world-length", "end": "length-before"}
    )
    samples = emulate(SCENE, pipeline.with_switches(stepping={"advance": "multiply"})).samples
    # Half a gate of 10 km, in a cube of 160 km whose diagonal is 277.
    assert 30 < samples.max() <= 56
