"""Maps of a radar against a scalar loop over their pixels."""

import numpy as np
import pytest

from tests.oracles import polar as loop
from tests.radars import knmi, uneven
from volref.errors import SceneError
from volref.scene.beams import slant_of_ground, world_of_beam
from volref.scene.radar import RadarVolume
from volref.scene.sweep import Sweep
from volref.scene.transfer import TransferFunction
from volref.truth.radar.slices import cappi, ppi

GREEN_FROM_20 = TransferFunction([20, 20], [(1, 0, 0), (0, 1, 0)], opacity=[0.0, 0.1])


def pixel_places(width, reach):
    """East and north of the middle of each pixel, in rows from the north."""
    step = 2 * reach / width
    return [
        [(-reach + (i + 0.5) * step, reach - (j + 0.5) * step) for i in range(width)] for j in range(width)
    ]


def assert_same(found, wanted):
    for row, line in zip(found, wanted, strict=True):
        assert np.isnan(row).tolist() == [value is None for value in line]
        # The same interpolation, rounded otherwise: see CLOSE in the tests of the look-up.
        assert row[~np.isnan(row)].tolist() == pytest.approx([v for v in line if v is not None], abs=1e-8)


@pytest.mark.parametrize("beam", ["straight", "4/3-earth"])
def test_a_ppi_shows_the_value_on_the_sweep_above_each_place_on_the_ground(beam):
    radar = uneven(2, beam=beam, level=True)
    sweep = radar.sweeps[2]
    found = ppi(radar, 2, 24)
    assert found.reach == sweep.last_range
    wanted = []
    for line in pixel_places(24, found.reach):
        wanted.append([])
        for x, y in line:
            ground = np.array(np.hypot(x, y))
            slant = float(slant_of_ground(ground, np.array(sweep.elevation), beam))
            azimuth = np.degrees(np.arctan2(x, y)) % 360
            value, _ = loop.on_sweep(sweep, slant, azimuth, radar.no_echo)
            wanted[-1].append(value)
    assert_same(found.values, wanted)
    assert 50 < found.seen.sum() < 500


@pytest.mark.parametrize("beam", ["straight", "4/3-earth"])
def test_the_slant_range_over_a_place_is_where_the_beam_is_over_it(beam):
    slant = np.linspace(100.0, 300e3, 50)
    for tilt in (-0.5, 0.0, 1.0, 30.0):
        _, ground, _ = world_of_beam(slant, np.zeros(50), np.full(50, tilt), beam)
        # A few roundings; at the end of the range the cosine loses two digits.
        np.testing.assert_allclose(slant_of_ground(ground, np.full(50, tilt), beam), slant, rtol=1e-13)
    assert slant_of_ground(np.array([1e3]), np.array([120.0]), beam) == 1e60


def test_a_cappi_shows_the_value_at_its_height():
    radar = uneven(2)
    found = cappi(radar, 200.0, 24, reach=3000.0)
    wanted = [
        [loop.value_at(radar, np.array((x, y, 200.0)) + radar.origin) for x, y in line]
        for line in pixel_places(24, 3000.0)
    ]
    assert_same(found.values, wanted)
    assert 20 < found.seen.sum() < 550


def test_gates_as_measured_are_those_around_each_place():
    quarters = np.array([[1.0, -np.inf], [2.0, 20.0], [3.0, np.nan], [4.0, 40.0]])
    radar = RadarVolume([Sweep([45, 135, 225, 315], 0.0, quarters, 500, 1000)])
    found = ppi(radar, width=4, gates="nearest")
    np.testing.assert_array_equal(
        found.values,
        [
            [np.nan, 40.0, -32.0, np.nan],
            [40.0, 4.0, 1.0, -32.0],
            [np.nan, 3.0, 2.0, 20.0],
            [np.nan, np.nan, 20.0, np.nan],
        ],
    )


def test_north_is_up_and_east_is_right():
    compass = np.array([[1.0], [2.0], [3.0], [4.0]])  # north, east, south, west
    found = ppi(RadarVolume([Sweep([0, 90, 180, 270], 0.0, compass, 50, 100)]), width=3)
    assert (found.values[0, 1], found.values[1, 2], found.values[2, 1], found.values[1, 0]) == (1, 2, 3, 4)


def test_a_map_is_colored_where_the_table_shows_anything():
    values = np.array([[30.0], [10.0], [np.nan], [30.0]])
    found = ppi(RadarVolume([Sweep([45, 135, 225, 315], 0.0, values, 500, 1000)]), width=2, gates="nearest")
    image = found.colored(GREEN_FROM_20, background=(0, 0, 1), unseen=(0.5, 0.5, 0.5))
    assert image.tolist() == [
        [[0.0, 1.0, 0.0, 1.0], [0.0, 1.0, 0.0, 1.0]],
        [[0.5, 0.5, 0.5, 1.0], [0.0, 0.0, 1.0, 1.0]],
    ]


def test_rings_are_circles_at_whole_distances():
    found = ppi(knmi(), 0, 64, reach=160e3)
    plain, ringed = (found.colored(GREEN_FROM_20, rings=rings) for rings in (None, 50e3))
    changed = (plain != ringed).any(axis=-1)
    distance = np.array([[np.hypot(*place) for place in line] for line in pixel_places(64, 160e3)])
    off = np.abs(distance[:, :, None] - (50e3, 100e3, 150e3, 200e3)).min(axis=-1)
    np.testing.assert_array_equal(changed, off <= 2500.0)


@pytest.mark.parametrize(
    ("call", "says"),
    [
        (lambda r: ppi(r, 4), "sweep must be a whole number from 0 to 3, got 4"),
        (lambda r: ppi(r, 0, 0), "width must be a whole number"),
        (lambda r: ppi(r, reach=0), "reach must be at least 1"),
        (lambda r: ppi(r, gates="raw"), "gates must be 'linear' or 'nearest'"),
        (lambda r: cappi(r, np.nan), "height must be finite"),
        (lambda r: ppi(r, width=2).colored(GREEN_FROM_20, rings=0), "rings must be above 0"),
        (lambda r: ppi(r, width=2).colored(GREEN_FROM_20, unseen=1), r"unseen must have shape \(3\)"),
    ],
)
def test_what_cannot_be_drawn_is_refused(call, says):
    with pytest.raises(SceneError, match=says):
        call(uneven(1))
