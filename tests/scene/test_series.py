"""A series in time held to the mix of two numbers, voxel by voxel."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.scenes import rough_volume
from volref import RadarVolume, SceneError, Series, Sweep, Volume

TIMES = [-60.0, 0.0, 300.0, 900.0]
PLACE = {"spacing": (1, 2, 3), "origin": (4, 5, 6), "centering": "node"}
VOLUMES = [rough_volume(seed, dtype=np.uint8, **PLACE) for seed in range(4)]
SERIES = Series(VOLUMES, TIMES)


@pytest.mark.parametrize("interpolation", ["nearest", "linear"])
def test_at_the_time_of_a_volume_it_is_that_volume_itself(interpolation):
    assert [SERIES.at(time, interpolation) for time in TIMES] == VOLUMES


@given(st.floats(-60, 900))
def test_the_nearest_is_the_one_with_the_least_difference(time):
    nearest = min(range(4), key=lambda i: abs(TIMES[i] - time))  # of two, min takes the earlier
    assert SERIES.at(time) is VOLUMES[nearest]


@given(st.floats(-60, 900))
def test_a_linear_mix_is_that_of_each_voxel(time):
    volume = SERIES.at(time, "linear")
    track = np.stack([v.values.ravel().astype(float) for v in VOLUMES])
    expected = [np.interp(time, TIMES, voxel) for voxel in track.T]
    # np.interp adds slope * time to the first value: 4 roundings of numbers up to 255.
    np.testing.assert_allclose(volume.values.ravel(), expected, rtol=0, atol=4 * 255 * 2.0**-52)
    assert (volume.spacing, volume.origin, volume.centering) == ((1, 2, 3), (4, 5, 6), "node")


@given(st.floats(0, 300))
def test_a_mix_stays_between_its_two(time):
    values = SERIES.at(time, "linear").values
    low, high = (pick(VOLUMES[1].values, VOLUMES[2].values) for pick in (np.minimum, np.maximum))
    # (1 - w) a + w b of equal a and b rounds three times.
    assert (values >= low * (1 - 2.0**-51)).all()
    assert (values <= high * (1 + 2.0**-51)).all()


def test_halfway_the_earlier_one_is_nearest():
    assert SERIES.at(150.0) is VOLUMES[1]
    assert SERIES.at(np.nextafter(150.0, 200)) is VOLUMES[2]


def test_a_function_is_called_when_its_volume_is_needed_and_not_before():
    called = []

    def loader(i):
        def load():
            called.append(i)
            return VOLUMES[i]

        return load

    series = Series([loader(i) for i in range(4)], TIMES)
    assert called == []
    assert series.at(310.0) is VOLUMES[2]
    assert called == [2]
    assert np.array_equal(series.at(10.0, "linear").values, SERIES.at(10.0, "linear").values)
    assert called == [2, 1, 2]


def test_radars_are_taken_at_their_own_times():
    sweeps = [Sweep([0, 120, 240], e, np.full((3, 2), 10.0), 500, 1000) for e in (1, 2)]
    radars = [RadarVolume(sweeps) for _ in range(2)]
    series = Series(radars, [0, 60])
    assert series.at(40) is radars[1]


def test_radars_are_mixed_gate_by_gate():
    low, high = (
        RadarVolume([Sweep([0, 120, 240], e, np.full((3, 2), dbz), 500, 1000) for e in (1, 2)])
        for dbz in (10.0, 30.0)
    )
    mixed = Series([low, high], [0, 60]).at(15, "linear")
    assert mixed.sweeps[1].values.tolist() == [[15, 15]] * 3
    with pytest.raises(SceneError, match="must be of one kind to be mixed"):
        Series([low, VOLUMES[0]], [0, 60]).at(15, "linear")


@pytest.mark.parametrize(
    ("call", "fragment"),
    [
        (lambda: Series([], []), "series.volumes must be a list of volumes"),
        (lambda: Series(None, []), "series.volumes must be a list of volumes"),
        (lambda: Series([np.zeros((2, 2, 2))], [0]), "series.volumes[0] must be a volref.Volume"),
        (lambda: Series([lambda: 7], [0]).at(0), "series.volumes[0] must be a volref.Volume"),
        (lambda: Series(VOLUMES, [0, 1, 2]), "series.times must have shape (4), got (3)"),
        (lambda: Series(VOLUMES, [0, 1, 1, 2]), "series.times must rise, got 1 before 1 at index 1"),
        (lambda: Series(VOLUMES, [0, 1, 2, np.nan]), "series.times must be finite"),
        (lambda: SERIES.at(-61), "time must be at least -60"),
        (lambda: SERIES.at(901), "time must be at most 900"),
        (lambda: SERIES.at(np.nan), "time must be finite"),
        (lambda: SERIES.at(0, "cubic"), "interpolation must be 'nearest' or 'linear'"),
    ],
)
def test_what_is_no_series_is_refused_in_one_sentence(call, fragment):
    with pytest.raises(SceneError) as refusal:
        call()
    assert fragment in str(refusal.value)


@pytest.mark.parametrize(
    "other",
    [
        Volume(np.zeros((7, 6, 4)), **PLACE),
        Volume(np.zeros((7, 6, 5)), **(PLACE | {"spacing": (1, 2, 4)})),
        Volume(np.zeros((7, 6, 5)), **(PLACE | {"origin": (4, 5, 7)})),
        Volume(np.zeros((7, 6, 5)), **(PLACE | {"centering": "cell"})),
        Volume(np.zeros((7, 6, 5)), **PLACE, direction=np.diag([1, -1, 1])),
    ],
)
def test_volumes_in_different_places_are_not_mixed(other):
    series = Series([VOLUMES[0], other], [0, 1])
    assert series.at(0.9) is other
    with pytest.raises(SceneError, match="must lie in one place to be mixed"):
        series.at(0.5, "linear")
