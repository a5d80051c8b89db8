import numpy as np
import pytest

import volref as vr
from tests.oracles.lookup import piecewise
from volref.phantoms import transfer

MAKERS = [
    transfer.grey_ramp,
    transfer.two_colors,
    transfer.few_knots,
    transfer.smooth,
    transfer.smooth_curve_256,
]


@pytest.mark.parametrize("make", MAKERS)
def test_a_table_spans_its_ends_and_reaches_its_extinction(make):
    table = make(-100.0, 300.0, 2.5)
    assert table.values[0] == -100.0
    assert table.values[-1] == 300.0
    assert table.knot_extinction.max() == 2.5
    assert table.interpolation == "extinction"


def test_a_smooth_table_with_256_knots_bends_at_every_one_above_its_clear_part():
    table = transfer.smooth_curve_256()
    assert len(table.values) == 256
    bends = np.diff(np.diff(table.knot_extinction))
    assert (np.abs(bends[40:]) > 0).all()
    assert (table.knot_extinction[:38] == 0).all()


def test_two_samplings_of_the_smooth_curve_agree_to_second_order():
    at = np.linspace(0, 1, 4001)
    errors = []
    for knots in (33, 65, 129):
        table = transfer.smooth(extinction=1.0, knots=knots)
        errors.append(np.abs(np.interp(at, table.values, table.extinction) - transfer.smooth_curve(at)).max())
    # |f''| <= (pi / 0.85)^2 / 2, and a straight line errs by h^2 / 8 of it.
    for error, knots in zip(errors, (33, 65, 129), strict=True):
        assert error <= (np.pi / 0.85) ** 2 / 2 / (knots - 1) ** 2 / 8


def test_spikes_are_one_knot_wide_and_per_voxel():
    extinction = transfer.spiky(0, 255, voxel=0.5).knot_extinction
    assert np.flatnonzero(extinction).tolist() == [60, 119, 120, 121, 200]
    assert extinction[[60, 120, 200]].tolist() == [2e4, 100.0, 2e3]


def test_a_jump_is_a_step_at_one_value():
    table = transfer.steps([1.0, 2.0, 3.0], [(1, 0, 0), (0, 1, 0), (0, 0, 1)], [1.0, 2.0, 3.0])
    assert table.values.tolist() == [1, 1, 2, 2, 3, 3]
    assert table.knot_extinction.tolist() == [1, 2, 2, 3, 3, 0]
    assert table.colors[:, 0].tolist() == [1, 0, 0, 0, 0, 0]
    assert table.colors[:, 2].tolist() == [0, 0, 0, 1, 1, 1]


def test_reflectivity_has_the_colour_of_its_band_and_is_clear_below_5_dbz():
    table = vr.dbz_transfer()
    bands = {7.0: (4, 233, 231), 37.0: (253, 248, 2), 50.0: (253, 0, 0), 74.9: (152, 84, 198)}
    bands |= {75.0: (253, 253, 253), 90.0: (253, 253, 253)}
    for dbz, codes in bands.items():
        found = [255 * piecewise(table.values, channel, dbz) for channel in table.colors.T]
        np.testing.assert_allclose(found, codes, rtol=0, atol=1e-12)
    assert not table.is_visible(-32.0, 5.0)
    assert table.units == "dBZ"


@pytest.mark.parametrize("banded", [True, False])
def test_reflectivity_reaches_its_extinction_at_75_dbz_without_a_jump(banded):
    table = vr.dbz_transfer(0.02, banded=banded)
    assert table.extinction.max() == 0.02
    assert table.most_extinction(40.0, 40.0) == pytest.approx(0.02 / 4, rel=1e-15)
    assert (np.diff(table.values) == 0).any() == banded
    jumps = np.flatnonzero(np.diff(table.values) == 0)
    assert np.array_equal(table.extinction[jumps], table.extinction[jumps + 1])
