import numpy as np
import pytest

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
