"""Values of a radar at points, against a scalar loop, closed forms and laws."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.oracles import polar as loop
from tests.radars import knmi, uneven
from volref.scene.beams import world_of_beam
from volref.scene.radar import RadarVolume
from volref.scene.sweep import Sweep
from volref.stages.polar import centred_spherical, polar_lookup, printed_spherical, radar_table

# Polar coordinates are rounded to about 4 eps; the steepest step is some 80 dB over a share of a gate, a
# radial or a sweep, and counts of up to 10^3 gates and 360 degrees multiply it: 80 * 1e3 * 1e-15 < 1e-9.
CLOSE = 1e-9

# Over the 4/3 earth the loop takes the difference of two lengths of 8.5e6 m, rounded to 2e-9 m: 100 m from
# the antenna that is 1e-9 degrees of elevation, and sweeps of 80 dB difference lie 4 degrees apart.
CLOSE_OVER_EARTH = 1e-7


def looked_up(radar, points):
    return polar_lookup(radar_table(radar), np.asarray(points, dtype=np.float64))


def random_points(radar, rng, n):
    """Points anywhere in the box, and as many along the beams, where it is not mostly empty."""
    low, high = radar.box
    anywhere = rng.uniform(low - 100, high + 100, (n, 3))
    top = radar.sweeps[-1].elevation
    beams = [
        loop.point_of(r, a, e, radar.beam)
        for r, a, e in zip(
            rng.uniform(0, max(s.last_range for s in radar.sweeps), n),
            rng.uniform(0, 360, n),
            rng.uniform(0, top + 2, n),
            strict=True,
        )
    ]
    return np.concatenate((anywhere, np.array(beams) + radar.origin)).T


def assert_as_in_the_loop(radar, points):
    values, seen = looked_up(radar, points)
    wanted = [loop.value_at(radar, point) for point in points.T]
    assert seen.tolist() == [value is not None for value in wanted]
    assert np.isnan(values[~seen]).all()
    close = CLOSE if radar.beam == "straight" else CLOSE_OVER_EARTH
    assert values[seen].tolist() == pytest.approx([v for v in wanted if v is not None], abs=close)
    return seen


@pytest.mark.parametrize("beam", ["straight", "4/3-earth"])
@pytest.mark.parametrize("level", [True, False])
def test_values_are_those_of_a_scalar_loop(beam, level):
    found = []
    for seed in range(6):
        radar = uneven(seed, beam=beam, level=level)
        found += assert_as_in_the_loop(radar, random_points(radar, np.random.default_rng(seed), 60)).tolist()
    assert 100 < sum(found) < len(found) - 100


def test_values_of_the_real_storms_are_those_of_a_scalar_loop():
    radar = knmi()
    seen = assert_as_in_the_loop(radar, random_points(radar, np.random.default_rng(3), 25))
    assert 10 <= seen.sum() <= 40


@pytest.mark.parametrize("beam", ["straight", "4/3-earth"])
def test_at_the_centre_of_a_gate_its_own_value_counts_and_no_other(beam):
    radar = uneven(5, beam=beam, nodata=0.3)
    for sweep in radar.sweeps:
        for k, j in itertools.product(range(len(sweep.azimuths)), range(sweep.values.shape[1])):
            slant = sweep.first_gate + j * sweep.gate_spacing
            if slant <= 0:
                continue
            place = world_of_beam(np.array(slant), sweep.azimuths[k], sweep.elevations[k], beam)
            values, seen = looked_up(radar, (np.array(place) + radar.origin)[:, None])
            gate = sweep.values[k, j]
            assert seen[0] == (not np.isnan(gate))
            if seen[0]:
                assert values[0] == (radar.no_echo if gate == -np.inf else gate)


def cone(values, *, azimuths=(0.0, 90.0, 180.0, 270.0), elevation=1.0, first=500.0, spacing=1000.0):
    return Sweep(azimuths, elevation, np.array(values, dtype=np.float64), first, spacing)


def test_north_is_0_and_360_degrees():
    rows = [[1.0], [3.0], [5.0], [7.0]]
    radars = [
        RadarVolume([cone(rows, azimuths=turned, elevation=e) for e in (0.0, 10.0)])
        for turned in ((0, 90, 180, 270), (360, 90, 180, 270), (0, 450, -180, -90))
    ]
    points = np.array([loop.point_of(500.0, a, 5.0) for a in np.linspace(-10, 370, 77)]).T
    first, seen = looked_up(radars[0], points)
    assert seen.all()
    for radar in radars[1:]:
        np.testing.assert_array_equal(looked_up(radar, points)[0], first)
    # Halfway between the last radial (7) and the first (1), across north.
    halfway = loop.point_of(500.0, 315.0, 5.0)
    assert looked_up(radars[0], np.array(halfway)[:, None])[0][0] == pytest.approx(4.0, abs=CLOSE)


def test_azimuth_runs_clockwise_from_north():
    radar = RadarVolume([cone([[1.0], [2.0], [3.0], [4.0]], elevation=e) for e in (-1.0, 1.0)])
    north, east, south, west = (0, 500, 0), (500, 0, 0), (0, -500, 0), (-500, 0, 0)
    values, _ = looked_up(radar, np.array([north, east, south, west], dtype=np.float64).T)
    assert values.tolist() == [1.0, 2.0, 3.0, 4.0]


@pytest.mark.parametrize(
    ("slant", "elevation", "seen"),
    [
        (1500.0, 0.9, False),
        (1500.0, 1.1, True),
        (1500.0, 9.9, True),
        (1500.0, 10.1, False),
        (2999.0, 5.0, True),
        (3001.0, 5.0, False),
        (999.0, 5.0, False),
        (1001.0, 5.0, True),
        (3001.0, 1.0, True),
        (3999.0, 1.0, True),
    ],
)
def test_nothing_is_seen_above_below_and_beyond_either_sweep(slant, elevation, seen):
    low = cone([[1.0] * 3] * 4, elevation=1.0, first=1500.0)  # 1000 to 4000 m
    high = cone([[1.0] * 2] * 4, elevation=10.0, first=1500.0)  # 1000 to 3000 m
    place = loop.point_of(slant, 33.0, elevation)
    assert looked_up(RadarVolume([low, high]), np.array(place)[:, None])[1].tolist() == [seen]


def test_no_echo_takes_its_value_and_no_data_takes_the_point_away():
    quiet = [[10.0, -np.inf, 10.0, np.nan, 10.0]] * 4
    radar = RadarVolume([cone(quiet, elevation=e) for e in (0.0, 10.0)], no_echo=-30.0)
    points = np.array([loop.point_of(r, 45.0, 5.0) for r in (500, 1000, 1500, 2500, 2600, 3500, 4400, 4500)])
    values, seen = looked_up(radar, points.T)
    assert seen.tolist() == [True, True, True, True, False, False, False, True]
    assert values[seen].tolist() == pytest.approx([10, -10, -30, 10, 10], abs=CLOSE)


def test_gates_without_echo_are_empty_where_the_quantity_has_no_floor():
    radar = RadarVolume(
        [cone([[3.0, -np.inf]] * 4, elevation=e) for e in (0.0, 9.0)], quantity="VRADH", units="m/s"
    )
    points = np.array([loop.point_of(r, 45.0, 5.0) for r in (500.0, 1000.0, 1500.0)])
    assert looked_up(radar, points.T)[1].tolist() == [True, False, False]


def test_a_missing_radial_leaves_a_gap():
    azimuths = np.delete(np.arange(0.0, 360.0, 10.0), 5)
    sweeps = [cone([[1.0]] * 35, azimuths=azimuths, elevation=e) for e in (0.0, 10.0)]
    points = np.array([loop.point_of(500.0, a, 5.0) for a in (39, 40, 41, 50, 59, 60, 61)])
    assert looked_up(RadarVolume(sweeps), points.T)[1].tolist() == [
        True,
        True,
        False,
        False,
        False,
        True,
        True,
    ]


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 10**6), turns=st.integers(1, 11))
def test_turning_radials_and_points_by_whole_radials_changes_nothing(seed, turns):
    rng = np.random.default_rng(seed)
    tables = [rng.uniform(-10, 50, (12, 4)) for _ in range(3)]

    def radar(turn):
        return RadarVolume(
            [cone(t, azimuths=30.0 * np.arange(12) + turn, elevation=3.0 * s) for s, t in enumerate(tables)]
        )

    polar = rng.uniform((10, 0, 0.1), (3990, 360, 5.9), (50, 3))
    still = looked_up(radar(0), np.array([loop.point_of(*p) for p in polar]).T)
    turned = looked_up(
        radar(30.0 * turns), np.array([loop.point_of(r, a + 30.0 * turns, e) for r, a, e in polar]).T
    )
    assert still[1].all()
    assert turned[1].all()
    np.testing.assert_allclose(turned[0], still[0], rtol=0, atol=CLOSE)


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 10**6), beam=st.sampled_from(["straight", "4/3-earth"]))
def test_every_value_lies_within_the_bounds_and_every_place_within_the_box(seed, beam):
    radar = uneven(seed, beam=beam)
    points = random_points(radar, np.random.default_rng(seed), 100)
    values, seen = looked_up(radar, points)
    low, high = radar.value_bounds
    assert ((values[seen] >= low) & (values[seen] <= high)).all()
    corner, opposite = radar.box
    assert (points.T[seen] >= corner).all()
    assert (points.T[seen] <= opposite).all()


@settings(max_examples=30, deadline=None)
@given(shift=st.tuples(*[st.floats(-1e5, 1e5)] * 3))
def test_a_radar_can_stand_anywhere(shift):
    sweeps = uneven(8, nodata=0.0).sweeps
    points = random_points(RadarVolume(sweeps), np.random.default_rng(1), 40)
    still = looked_up(RadarVolume(sweeps), points)
    moved = looked_up(RadarVolume(sweeps, origin=shift), points + np.array(shift)[:, None])
    np.testing.assert_array_equal(moved[1], still[1])
    # The points are rounded by 1e-11 m: a step of 80 dB in 200 m makes 4e-12 dB of it, and near the antenna,
    # where a metre is many radials, more.
    np.testing.assert_allclose(moved[0], still[0], rtol=0, atol=1e-8)


@pytest.mark.parametrize("height", [0.0, 300.0, 900.0])
def test_chords_of_a_shell_of_constant_echo_are_those_of_two_spheres(height):
    """The shell from 2000 to 3000 m has an echo, inside it none; rays run level at `height`, eastwards."""
    gates = np.full((36, 30), -np.inf)
    gates[:, 20:] = 40.0
    sweeps = [Sweep(np.arange(36) * 10.0, e, gates, 50.0, 100.0) for e in (-40, -10, 5, 20, 60)]
    radar = RadarVolume(sweeps, no_echo=-20.0)
    beside = 400.0
    n = 60_001
    x = np.linspace(-3500.0, 3500.0, n)
    points = np.stack((x, np.full(n, beside), np.full(n, height)))
    values, seen = looked_up(radar, points)
    # Between the gate centres at 1950 and 2050 m the value passes from -20 to 40: 10 dB is at 2000 m.
    length = 7000.0 / (n - 1) * (seen & (values >= 10.0)).sum()
    chord = [2 * np.sqrt(r**2 - beside**2 - height**2) for r in (2000.0, 3000.0)]
    # The count is off by up to one step at each of the four ends.
    assert length == pytest.approx(chord[1] - chord[0], abs=4 * 7000.0 / (n - 1))


def test_the_printed_equations_differ_from_those_put_right_as_described():
    rng = np.random.default_rng(0)
    points = rng.uniform(0, 1, (3, 1000))
    r, phi, theta = printed_spherical(points)
    right_r, right_phi, right_theta = centred_spherical(points)
    np.testing.assert_array_equal(r, right_r)
    # As printed, the azimuth turns about a corner of the box: it fills a quarter of the circle.
    assert phi.min() >= np.pi
    assert phi.max() <= 1.5 * np.pi
    assert np.ptp(right_phi) > 6.2
    # As printed, the polar angle divides by an angle of at least pi: it stays within 19 degrees of level.
    assert theta.min() >= np.arccos(1 / np.pi)
    assert theta.max() <= np.pi / 2
    assert np.ptp(right_theta) > 2.8


def test_the_equations_put_right_are_azimuth_and_elevation_in_another_dress():
    points = np.random.default_rng(0).uniform(0, 1, (3, 300))
    r, phi, theta = centred_spherical(points)
    for k, point in enumerate((points - 0.5).T):
        slant, azimuth, elevation = loop.polar_of(*point)
        # A few roundings of numbers up to 360.
        assert r[k] == pytest.approx(slant, abs=1e-15)
        assert np.degrees(1.5 * np.pi - phi[k]) % 360 == pytest.approx(azimuth, abs=1e-12)
        assert 90 - np.degrees(theta[k]) == pytest.approx(elevation, abs=1e-11)
