"""Radars on a regular grid."""

import numpy as np
import pytest

from tests.oracles import polar as loop
from tests.radars import uneven
from volref.errors import SceneError
from volref.scene.radar import RadarVolume
from volref.truth.radar.resampling import resample_radar


def test_each_voxel_has_the_value_at_its_centre():
    radar = uneven(6)
    volume = resample_radar(radar, (500, 400, 300), ((-2500, -2000, 0), (2500, 2000, 1500)))
    assert volume.size == (10, 10, 5)
    assert volume.spacing == (500.0, 400.0, 300.0)
    found = 0
    for k, j, i in np.ndindex(volume.values.shape):
        place = volume.world_from_index @ (i, j, k, 1)
        value = loop.value_at(radar, place[:3])
        found += value is not None
        expected = radar.no_echo if value is None else value
        assert volume.values[k, j, i] == pytest.approx(expected, abs=1e-9)
    assert 50 < found < 450


def test_the_grid_spans_all_that_can_be_seen():
    radar = uneven(6)
    volume = resample_radar(radar, 400)
    low, high = radar.box
    least, greatest = volume.corners.min(axis=0), volume.corners.max(axis=0)
    assert least == pytest.approx(low, abs=1e-6)
    assert (greatest >= high - 1e-6).all()
    assert (greatest < high + 400).all()


def test_where_nothing_is_seen_a_voxel_is_worth_what_is_said():
    radar = uneven(6)
    far = ((1e6, 0, 0), (1e6 + 2, 2, 2))
    assert np.unique(resample_radar(radar, 1, far).values).tolist() == [radar.no_echo]
    assert np.unique(resample_radar(radar, 1, far, empty=-99).values).tolist() == [-99.0]
    speed = RadarVolume(radar.sweeps, units="m/s")
    assert np.unique(resample_radar(speed, 1, far).values).tolist() == [speed.value_bounds[0]]


@pytest.mark.parametrize(
    ("spacing", "box", "says"),
    [
        (0, None, "must be above 0 along each axis"),
        ((1, 1), None, "spacing must have shape"),
        (1, ((0, 0, 0), (1, 1, 0)), "give the lower corner first"),
        (1, ((0, 0, 0), (1e3, 1e3, 1e3)), "at most 268435456 voxels, got 1000 x 1000 x 1000"),
        (1, ((0, 0, 0), (1, np.inf, 1)), "box high must be finite"),
    ],
)
def test_a_grid_that_cannot_be_is_refused(spacing, box, says):
    with pytest.raises(SceneError, match=says):
        resample_radar(uneven(6), spacing, box)
