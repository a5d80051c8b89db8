"""Sweeps and radars refuse what they cannot hold, and keep what they are given."""

import numpy as np
import pytest

from tests.radars import knmi, uneven
from volref.errors import SceneError
from volref.scene.beams import EFFECTIVE_RADIUS, beam_of_world, world_of_beam
from volref.scene.radar import RadarVolume
from volref.scene.sweep import Sweep

ROWS = np.array([[1.0, 2.0], [3.0, 4.0], [5.0, 6.0]])


def sweep(elevation=1.0, values=ROWS, azimuths=(0.0, 120.0, 240.0), first=100.0, spacing=200.0):
    return Sweep(azimuths, elevation, values, first, spacing)


@pytest.mark.parametrize(
    ("fields", "says"),
    [
        ({"values": np.ones(3)}, "shape (radials, gates)"),
        ({"values": np.ones((3, 0))}, "each at least 1"),
        ({"values": np.ones((3, 2), np.uint8)}, "use Sweep.from_codes for codes"),
        ({"values": np.full((3, 2), np.inf)}, "-inf (no echo), got a larger one"),
        ({"values": np.full((3, 2), 1e301)}, "below 1e300"),
        ({"azimuths": (0.0, 1.0)}, "sweep.azimuths must have shape (3), got (2)"),
        ({"azimuths": (0.0, 1.0, np.nan)}, "sweep.azimuths must be finite"),
        ({"elevation": 91.0}, "sweep.elevations must lie within 90 of 0"),
        ({"elevation": (1.0, 2.0)}, "sweep.elevations must have shape (3), got (2)"),
        ({"spacing": 0.0}, "sweep.gate_spacing must be at least 0.001"),
        ({"spacing": np.nan}, "sweep.gate_spacing must be finite"),
        ({"first": -201.0}, "sweep.first_gate must be at least -200"),
        ({"first": 2.9e6, "spacing": 2e5}, "must end between 0 and 3e+06 m, got 3.2e+06 m"),
    ],
)
def test_a_sweep_that_cannot_be_is_refused(fields, says):
    with pytest.raises(SceneError) as caught:
        sweep(**fields)
    assert says in str(caught.value)


@pytest.mark.parametrize(
    ("sweeps", "fields", "says"),
    [
        ([], {}, "must be 1 to 200 sweeps, got 0"),
        (5, {}, "must be 1 to 200 sweeps, got int"),
        ([ROWS], {}, "give a list of vr.Sweep"),
        ([sweep(i / 4) for i in range(201)], {}, "got 201"),
        ([sweep(values=np.full((3, 2), np.nan))], {}, "must hold a gate with data, got none"),
        ([sweep()], {"beam": "bent"}, "radar.beam must be 'straight' or '4/3-earth'"),
        ([sweep()], {"no_echo": np.nan}, "radar.no_echo must be finite"),
        ([sweep()], {"origin": (1, 2)}, "radar.origin must have shape (3)"),
        ([sweep()], {"site": (91, 0, 0)}, "radar.site latitude must be at most 90"),
        ([sweep()], {"time": "yesterday"}, "radar.time must be a date and time in ISO 8601"),
        ([sweep()], {"time": 5}, "radar.time must be a date and time in ISO 8601"),
        ([sweep()], {"quantity": 5}, "radar.quantity must be a short word"),
        ([sweep()], {"units": "a\nb"}, "radar.units must be a short word"),
        ([sweep((0, 0, 3)), sweep((1, 1, 1))], {}, "got 3 and 1 degrees at azimuth 240"),
    ],
)
def test_a_radar_that_cannot_be_is_refused(sweeps, fields, says):
    with pytest.raises(SceneError) as caught:
        RadarVolume(sweeps, **fields)
    assert says in str(caught.value)


def test_more_radials_than_the_search_table_may_hold_are_refused():
    wide = [sweep(e, np.ones((90_000, 1)), np.arange(90_000) / 250) for e in np.linspace(0, 80, 20)]
    with pytest.raises(SceneError, match=r"at most 16777216, got 20 x 1800000"):
        RadarVolume(wide)


def test_radials_are_sorted_and_the_first_of_two_at_one_azimuth_is_kept():
    made = sweep(azimuths=(360.0, -90.0, 0.0))
    assert made.azimuths.tolist() == [0.0, 270.0]
    assert made.values.tolist() == [[1.0, 2.0], [3.0, 4.0]]


def test_codes_become_values_no_data_and_no_echo():
    codes = np.array([[0, 1, 2, 255]], np.uint8)
    made = Sweep.from_codes(codes, 0.5, -33, [0], 1, 500, 1000, undetect=0, nodata=(1, 255))
    np.testing.assert_array_equal(made.values, [[-np.inf, np.nan, -32.0, np.nan]])
    same = Sweep.from_codes(codes, 0.5, -33, [0], 1, 500, 1000, undetect=0, nodata=0)
    assert np.isnan(same.values[0, 0])


def test_codes_are_decoded_in_float64_where_float32_does_not_hold_them():
    codes = np.arange(4, dtype=np.uint8).reshape(1, 4)
    assert Sweep.from_codes(codes, 0.5, -32, [0], 1, 500, 1000).values.dtype == np.float32
    tenths = Sweep.from_codes(codes, 0.1, -32, [0], 1, 500, 1000).values
    assert tenths.tolist() == [[k * 0.1 - 32 for k in range(4)]]


def test_codes_that_are_no_numbers_are_refused():
    with pytest.raises(SceneError, match="must be integers or real numbers, got bool"):
        Sweep.from_codes(np.ones((1, 4), bool), 0.5, -32, [0], 1, 500, 1000)


def test_sweeps_are_sorted_and_of_two_at_one_elevation_the_first_given_is_kept():
    given = [sweep(e, ROWS + i) for i, e in enumerate((2.0, 0.5, 2.04, 0.48, 1.0))]
    radar = RadarVolume(given)
    assert [s.elevation for s in radar.sweeps] == [0.5, 1.0, 2.0]
    assert radar.dropped == (2, 3)
    assert radar.sweeps[0] is given[1]


def test_a_gate_without_echo_is_worth_the_floor():
    quiet = np.where(ROWS > 5, -np.inf, ROWS)
    assert RadarVolume([sweep(values=quiet)]).value_bounds == (-32.0, 5.0)
    assert RadarVolume([sweep(values=quiet - 40)]).value_bounds == (-39.0, -35.0)
    assert RadarVolume([sweep(values=quiet)], no_echo=7).value_bounds == (1.0, 7.0)
    assert RadarVolume([sweep()]).value_bounds == (1.0, 6.0)
    speed = RadarVolume([sweep(values=quiet)], quantity="VRADH", units="m/s")
    assert speed.no_echo is None
    assert speed.value_bounds == (1.0, 5.0)
    assert RadarVolume([sweep(values=np.full((3, 2), -np.inf))]).value_bounds == (-32.0, -32.0)


def test_the_storms_of_den_helder_are_what_their_page_says():
    radar = knmi()
    assert [s.values.shape[1] for s in radar.sweeps] == [320] + [240] * 4 + [340] * 2 + [300] * 2 + [240] * 5
    assert radar.gate_length == 500.0
    assert radar.value_bounds == (-31.5, 66.5)
    assert radar.sweeps[0].last_range == 320_000.0
    assert radar.dropped == ()
    low, high = radar.box
    # 240 gates of 500 m at 25 degrees.
    assert high[2] == pytest.approx(120_000 * np.sin(np.radians(25)), rel=1e-6)
    assert high[0] == pytest.approx(320_000 * np.cos(np.radians(0.3)), rel=1e-6)
    assert low.tolist() == pytest.approx([-high[0], -high[1], 0.0], abs=1e-3)


@pytest.mark.parametrize("beam", ["straight", "4/3-earth"])
def test_the_way_to_the_world_leads_back(beam):
    rng = np.random.default_rng(0)
    slant, azimuth, elevation = rng.uniform(1e3, 4e5, 500), rng.uniform(0, 360, 500), rng.uniform(-5, 89, 500)
    back = beam_of_world(*world_of_beam(slant, azimuth, elevation, beam), beam)
    # Heights are rounded at 1e-10 m and angles at 1e-14 degrees; a metre at 1 km is 0.06 degrees.
    np.testing.assert_allclose(back[0], slant, rtol=1e-13, atol=1e-9)
    np.testing.assert_allclose(back[1], azimuth, rtol=0, atol=1e-11)
    np.testing.assert_allclose(back[2], elevation, rtol=0, atol=1e-11)


def test_heights_over_the_earth_are_those_of_the_book():
    """Doviak and Zrnic, figure 2.7: a beam at 0 degrees is about 0.6 km up at 100 km and 2.4 km at 200 km."""
    height = world_of_beam(np.array((1e5, 2e5)), np.zeros(2), np.zeros(2), "4/3-earth")[2]
    # h = r^2 / 2R to the next order, r^4 / 8R^3.
    expected = np.array((1e5, 2e5)) ** 2 / (2 * EFFECTIVE_RADIUS)
    np.testing.assert_allclose(height, expected, rtol=1e-3)
    assert np.round(height / 1e3, 1).tolist() == [0.6, 2.4]


def test_a_beam_that_looks_down_has_its_lowest_point_in_the_box():
    radar = RadarVolume([sweep(e, np.ones((3, 3000)), spacing=100.0) for e in (-0.5, 0.5)], beam="4/3-earth")
    low, high = radar.box
    ranges = np.linspace(0, 300_000, 3001)
    _, y, z = world_of_beam(ranges, np.zeros(1), np.full(1, -0.5), "4/3-earth")
    assert low[2] <= z.min() < low[2] + 1.0
    assert high[1] >= y.max()


@pytest.mark.parametrize("beam", ["straight", "4/3-earth"])
def test_between_a_sweep_that_looks_down_and_one_that_looks_up_the_horizon_is_in_the_box(beam):
    radar = RadarVolume([sweep(e, np.ones((3, 1000)), spacing=300.0) for e in (-30, 40)], beam=beam)
    ranges = np.full(71, radar.sweeps[0].last_range)
    _, y, _ = world_of_beam(ranges, np.zeros(71), np.linspace(-30, 40, 71), beam)
    assert y.max() <= radar.box[1][1] < y.max() + 10.0


def test_random_radars_have_what_they_were_made_of():
    radar = uneven(3)
    assert len(radar.sweeps) == 4
    assert all((np.diff(s.azimuths) > 0).all() for s in radar.sweeps)
