"""Programs with a fault are the systems' own, but for the fault."""

import pytest
from numpy.testing import assert_array_equal

from tests.webgl.faulty import draw_chart
from volref.golden.charts import CHARTS

# Strengths at which a fault's macro is there and does nothing.
NEUTRAL = (
    ("G1-half-voxel", 0.0, "f-shape"),
    ("G6-brick-seams", 100.0, "f-shape"),
    ("A2-slice-off-by-one", 0.0, "f-atlas"),
    ("A3-half-slice", 0.0, "f-atlas"),
    ("O1-stale", 1.0, "grey-slab"),
    ("O3-factor-per-sample", 1.0, "grey-slab"),
    ("O3-factor-per-sample", 1.0, "f-atlas"),
    ("O3-factor-per-sample", 1.0, "values-as-opacity"),
    ("T3-loop-cap", 1.0, "long-rays"),
    ("T3-loop-cap", 1.0, "f-atlas"),
    ("T4-step", 1.0, "thin-slab"),
    ("J1-biased-jitter", 0.5, "lit-sphere"),
    ("L1-half-texel", 0.0, "two-entries"),
    ("L2-short-table", 256.0, "spike"),
    ("L2-quantised-table", 8.0, "spike"),
    ("D1-range", 1.0, "stripes-behind"),
)


@pytest.mark.parametrize(("key", "strength", "chart"), NEUTRAL)
def test_a_fault_without_strength_draws_the_same_picture(swiftshader, key, strength, chart):
    clean = draw_chart(swiftshader, CHARTS[chart])
    assert_array_equal(draw_chart(swiftshader, CHARTS[chart], key, strength), clean)


def test_a_program_that_cannot_have_a_fault_is_refused(swiftshader):
    with pytest.raises(ValueError, match="texture3d has no fault A1-row-divisor"):
        draw_chart(swiftshader, CHARTS["f-shape"], "A1-row-divisor")
