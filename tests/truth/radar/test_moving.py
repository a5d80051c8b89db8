"""Echoes carried along, and radars mixed in time."""

import numpy as np
import pytest

from tests.oracles import polar as loop
from tests.radars import knmi, uneven
from volref.errors import SceneError
from volref.scene.beams import world_of_beam
from volref.scene.radar import RadarVolume
from volref.scene.radar_mixing import between
from volref.scene.sweep import Sweep
from volref.truth.radar.moving import moving


def test_at_time_0_the_radar_is_as_it_was():
    radar = knmi()
    (still,) = moving(radar, [0.0], (10, 5))
    for found, wanted in zip(still.sweeps, radar.sweeps, strict=True):
        np.testing.assert_array_equal(found.values, wanted.values)
    assert still.no_echo == radar.no_echo


def test_a_gate_has_the_value_that_was_upwind():
    radar = uneven(9, sweeps=6, nodata=0.05)
    velocity, time = np.array((7.0, -4.0, 0.0)), 30.0
    (moved,) = moving(radar, [time], velocity[:2])
    checked = 0
    for s, sweep in enumerate(moved.sweeps):
        for k, j in np.ndindex(sweep.values.shape):
            slant = sweep.first_gate + j * sweep.gate_spacing
            place = np.array(
                world_of_beam(np.array(max(slant, 0)), sweep.azimuths[k], sweep.elevations[k], "straight")
            )
            wanted = loop.value_at(radar, place + radar.origin - velocity * time)
            if wanted is None:  # held to the outer sweeps, or without data
                continue
            gate = sweep.values[k, j]
            assert (radar.no_echo if gate == -np.inf else gate) == pytest.approx(wanted, abs=1e-8)
            checked += s > 0
    assert checked > 50


def test_what_the_radar_did_not_see_above_and_below_is_taken_from_the_outer_sweeps():
    rows = np.tile(np.arange(1.0, 21.0), (36, 1))
    radar = RadarVolume([Sweep(np.arange(36) * 10.0, e, rows * s, 500, 1000) for s, e in ((1, 1), (2, 10))])
    (moved,) = moving(radar, [100.0], (30.0, 0.0))
    # 3 km further west, at the same height, a beam of 1 degree is above these places: they were not seen.
    assert moved.sweeps[0].values[27, 10] == pytest.approx(14.0, abs=1e-2)
    # 3 km further in, gates of the upper sweep lie above it.
    assert np.isfinite(moved.sweeps[1].values[9]).all()
    # Westwards the last 3 km come from beyond the range.
    assert np.isnan(moved.sweeps[0].values[27, -3:]).all()
    assert np.isfinite(moved.sweeps[0].values[27, :-3]).all()


def test_the_whole_pattern_moves_with_the_wind():
    rows = np.full((72, 40), -np.inf)
    rows[18, 20] = 50.0  # 20.5 km east
    radar = RadarVolume(
        [Sweep(np.arange(72) * 5.0, e, rows, 500, 1000) for e in (0.5, 5.0)], time="2020-01-01T00:00:00+00:00"
    )
    at = {volume.time: volume for volume in moving(radar, [0.0, 500.0], (-10.0, 0.0))}
    later = at["2020-01-01T00:08:20+00:00"].sweeps[0].values
    k, j = np.unravel_index(np.nanargmax(later), later.shape)
    assert (k, j) == (18, 15)


@pytest.mark.parametrize(
    ("times", "velocity", "says"),
    [
        ([np.nan], (1, 2), "times must be finite"),
        ([0], (1,), "velocity must have shape"),
        ([0], (1e9, 0), "velocity must lie within 1000"),
        ([1e9], (1, 0), "times must lie within"),
    ],
)
def test_a_motion_that_cannot_be_is_refused(times, velocity, says):
    with pytest.raises(SceneError, match=says):
        moving(uneven(1), times, velocity)


def one_gate(value, **fields):
    sweep = Sweep([0, 180], (1.0, 1.5), np.array([[value, 4.0], [1.0, 2.0]]), 500, 1000)
    return RadarVolume([sweep], **fields)


@pytest.mark.parametrize(
    ("first", "second", "mixed"),
    [
        (10.0, 20.0, 12.5),
        (-np.inf, 8.0, -22.0),
        (8.0, -np.inf, -2.0),
        (-np.inf, -np.inf, -np.inf),
        (np.nan, 8.0, np.nan),
        (8.0, np.nan, np.nan),
        (np.nan, -np.inf, np.nan),
    ],
)
def test_gates_are_mixed_in_time(first, second, mixed):
    found = between(one_gate(first), one_gate(second), 0.25).sweeps[0]
    np.testing.assert_array_equal(found.values, [[mixed, 4.0], [1.0, 2.0]])
    assert found.elevations.tolist() == [1.0, 1.5]


def test_a_gate_that_has_no_floor_and_no_echo_has_no_data():
    speeds = [one_gate(v, units="m/s", quantity="VRADH") for v in (-np.inf, 8.0)]
    assert np.isnan(between(*speeds, 0.5).sweeps[0].values[0, 0])


def test_the_ends_are_the_radars_themselves_and_times_are_mixed():
    first, second = (one_gate(v, time=f"2020-01-01T00:{m}:00") for v, m in ((1.0, "00"), (3.0, "10")))
    assert between(first, second, 0) is first
    assert between(first, second, 1) is second
    assert between(first, second, 0.5).time == "2020-01-01T00:05:00"
    assert between(first, one_gate(3.0), 0.5).time is None
    assert between(first, one_gate(3.0, time="2020-01-01T00:10:00+00:00"), 0.5).time is None


@pytest.mark.parametrize(
    ("other", "share", "says"),
    [
        (one_gate(1.0), 1.5, "share must be at most 1"),
        (one_gate(1.0, beam="4/3-earth"), 0.5, "the same beam to be mixed, got straight and 4/3-earth"),
        (one_gate(1.0, quantity="TH"), 0.5, "the same quantity"),
        (uneven(1), 0.5, "the same origin"),
        (RadarVolume(uneven(1).sweeps), 0.5, "the same gates to be mixed, got others in sweep 0"),
        (
            RadarVolume([*one_gate(1.0).sweeps, Sweep([0], 9.0, np.ones((1, 1)), 500, 1000)]),
            0.5,
            "as many sweeps to be mixed, got 1 and 2",
        ),
    ],
)
def test_radars_that_differ_are_not_mixed(other, share, says):
    with pytest.raises(SceneError, match=says):
        between(one_gate(1.0), other, share)
