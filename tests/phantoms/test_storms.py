import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from volref.phantoms import storms

CELL = storms.StormCell(3000, -2000, 12, 5, 2000, 0, 6000, 1500, 0.2, 0.1, 50.0, 0, 0)


def rain_centroid(storm, t):
    """Ground position of the mean of the reflectivity factor, on a grid that holds all of it."""
    side = np.arange(-300_000, 300_001, 1000.0)
    dbz = storms.reflectivity(storm, side[None, :], side[:, None], np.zeros((1, 1)), t)
    factor = 10 ** (dbz / 10) - 10 ** (storms.CLEAR_DBZ / 10)
    total = factor.sum()
    return np.array([(factor * side[None, :]).sum(), (factor * side[:, None]).sum()]) / total


def test_the_centroid_of_a_storm_drifts_with_its_velocity():
    storm = storms.make_storm(2, velocity=(9.0, 5.0), spread=0.0)
    # Without growth and fading, so that every cell keeps its weight.
    storm = storms.Storm(tuple(replace(cell, growth=0.0, fade=0.0) for cell in storm.cells))
    moved = rain_centroid(storm, 3600.0) - rain_centroid(storm, 0.0)
    # The grid sum of a Gaussian of radius s errs by exp(-2 pi^2 (s / h)^2) (1e-8 for s = 960 m), times the
    # positions of 1e5 m; 1 m is far above that and far below the drift of 32 km.
    assert moved == pytest.approx((9.0 * 3600, 5.0 * 3600), abs=1.0)


def test_a_single_cell_is_where_its_record_says():
    storm = storms.Storm((CELL,))
    at = rain_centroid(storm, 600.0)
    assert at == pytest.approx((3000 + 12 * 600, -2000 + 5 * 600), abs=1.0)  # as above


def test_a_cell_leans_with_height():
    up = np.array([5000.0])
    on_axis = storms.reflectivity(storms.Storm((CELL,)), np.array([4000.0]), np.array([-1500.0]), up)
    # The floor adds 10^-8.2 of the factor: 3e-8 dB.
    assert on_axis == pytest.approx(50.0, abs=1e-7)


def test_a_cell_grows_and_fades():
    cell = replace(CELL, growth=1e-4, fade=6.0, vx=0, vy=0)
    ground = np.zeros(1)
    storm = storms.Storm((cell,))
    peak = storms.reflectivity(storm, ground + 3000, ground - 2000, ground, 3600.0)
    assert peak == pytest.approx(44.0, abs=1e-6)  # the floor adds 10^-7.6 of the factor: 1e-7 dB
    edge = 3000 + 2000 * math.exp(0.36)
    side = storms.reflectivity(storm, ground + edge, ground - 2000, ground, 3600.0)
    # One standard deviation out: 10 log10(e) / 2 = 2.17 dB less.
    assert peak - side == pytest.approx(5 / math.log(10), abs=1e-6)


def test_echoes_of_cells_add_as_factors_not_as_decibels():
    ground = np.zeros(1)
    still = replace(CELL, x=0.0, y=0.0)
    two = storms.reflectivity(storms.Storm((still, still)), ground, ground, ground)
    assert two == pytest.approx(50.0 + 10 * math.log10(2), abs=1e-7)  # as above


@given(st.integers(0, 1000), st.floats(-3600, 7200))
def test_reflectivity_stays_in_the_range_of_weather(seed, t):
    storm = storms.make_storm(seed, cells=4)
    side = np.linspace(-120_000, 120_000, 9)
    dbz = storms.reflectivity(storm, side[None, None, :], side[None, :, None], side[:3, None, None] * 0, t)
    assert np.isfinite(dbz).all()
    # Rounding of the logarithm below; eight cells of 60 dBZ at one place above.
    assert dbz.min() >= storms.CLEAR_DBZ - 1e-12
    assert dbz.max() <= 60 + 10 * math.log10(8)


def test_beams_are_straight_and_azimuth_runs_clockwise_from_north():
    x, y, z = storms.polar_points(np.array(0.0), np.array([0.0, 90.0, 180.0, 270.0]), np.array(1000.0))
    # cos and sin of multiples of pi / 2 are off by up to 2e-16 in units of 1000 m.
    assert x == pytest.approx([0, 1000, 0, -1000], abs=1e-12)
    assert y == pytest.approx([1000, 0, -1000, 0], abs=1e-12)
    assert (z == 0).all()
    assert storms.polar_points(25.0, 10.0, 1000.0)[2] == pytest.approx(1000 * math.sin(math.radians(25)))


def test_a_polar_scan_is_the_storm_at_the_gate_centres():
    storm = storms.make_storm(1, cells=3)
    scan = storms.sample_polar(
        storm, 300.0, elevations_deg=(0.5, 3.0), azimuths=8, gates=5, gate_length=4000.0, sweep_seconds=20.0
    )
    assert scan.dbz.shape == (2, 8, 5)
    assert scan.azimuth_deg.tolist() == [22.5, 67.5, 112.5, 157.5, 202.5, 247.5, 292.5, 337.5]
    assert scan.range_m.tolist() == [2000.0, 6000.0, 10000.0, 14000.0, 18000.0]
    assert scan.time_s.tolist() == [300.0, 320.0]
    r, elevation, azimuth = 6000.0, math.radians(3.0), math.radians(112.5)
    point = (
        r * math.cos(elevation) * math.sin(azimuth),
        r * math.cos(elevation) * math.cos(azimuth),
        r * math.sin(elevation),
    )
    want = storms.reflectivity(storm, *(np.array(c) for c in point), 320.0)
    assert scan.dbz[1, 2, 1] == pytest.approx(
        want, abs=1e-11
    )  # positions of 6 km to an ulp, slopes of dB/100 m


def test_a_cartesian_box_spans_what_was_asked_with_either_centering():
    storm = storms.make_storm(1, cells=2)
    for centering in ("cell", "node"):
        volume = storms.sample_cartesian(
            storm, size=(8, 8, 4), reach=64_000.0, ceiling=16_000.0, centering=centering
        )
        assert volume.corners.min(axis=0) == pytest.approx((-64_000, -64_000, 0), abs=1e-9)  # ulp of 64 km
        assert volume.corners.max(axis=0) == pytest.approx((64_000, 64_000, 16_000), abs=1e-9)
        x, y, z = volume.origin
        want = storms.reflectivity(storm, np.array(x), np.array(y), np.array(z))
        assert volume.values[0, 0, 0] == want


def test_codes_hold_half_decibels():
    dbz = np.linspace(-31.5, 95, 200)
    back = storms.dbz_from_codes(storms.codes_from_dbz(dbz))
    assert np.abs(back - dbz).max() <= 0.25 + 1e-12  # half a code, and its rounding


def test_storms_follow_their_seed():
    assert storms.make_storm(5) == storms.make_storm(5)
    assert storms.make_storm(5) != storms.make_storm(6)
