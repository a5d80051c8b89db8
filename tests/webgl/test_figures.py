"""The figures themselves, counted by hand: a comparison that sees nothing proves nothing."""

from dataclasses import replace

import numpy as np
import pytest

from tests.webgl.cases import cases, compared
from tests.webgl.figures import figures, together
from tests.webgl.systems import congote


def never():
    raise AssertionError("asked without need")


def image(*pixels):
    return np.array([pixels], np.float64)


def test_bytes_count_drawn_pixels_exact_ones_and_those_off_by_more_than_one():
    ours = image((0, 0), (0.2, 0.4), (0.2, 0.4), (0.6, 0.8), (0, 0))
    theirs = np.array([[(0, 0), (51, 102), (51, 103), (153, 206), (3, 0)]], np.uint8)
    found = figures(ours, theirs, lambda: np.array([[False, False, False, True, False]]), (0.0, 0.0))
    assert (found.pixels, found.exact, found.off, found.unexplained) == (4, 0.25, 2, 1)
    assert found.error.tolist() == [0, 1, 2, 3]
    assert found.colors == 4


def test_floats_beyond_1_are_off_in_proportion():
    theirs = image((0.5, 0), (100.0, 0)).astype(np.float32)
    found = figures(image((0.25, 0), (101.0, 0)), theirs, lambda: np.ones((1, 2), bool), (0.0,))
    assert found.error.tolist() == [0.25, 0.01]


def test_nan_equals_nan_and_nothing_else():
    ours, theirs = (
        image((np.nan,), (np.nan,), (np.inf,)),
        image((np.nan,), (1.0,), (np.inf,)).astype(np.float32),
    )
    found = figures(ours, theirs, lambda: np.zeros((1, 3), bool), (0.0,))
    assert found.error.tolist() == [0.0, np.inf, 0.0]
    assert found.unexplained == 1


def test_what_is_predicted_is_asked_only_where_a_pixel_is_off():
    assert figures(image((0.5,)), image((0.5,)).astype(np.float32), never, (0.0,)).exact == 1.0


def test_a_background_that_both_left_alone_does_not_count():
    held = image((0.1,)).astype(np.float32)
    assert figures(held.astype(np.float64), held, never, (0.1,)).pixels == 0


def test_pixels_that_no_ray_met_do_not_count_unless_they_are_off():
    ours, theirs = image((0.5,), (1.0,), (1.0,)), image((0.5,), (1.0,), (0.5,)).astype(np.float32)
    found = figures(ours, theirs, lambda: np.zeros((1, 3), bool), (0.0,), np.array([[True, False, False]]))
    assert (found.pixels, found.off, found.unexplained) == (2, 1, 1)


def test_percentiles_are_of_all_pixels_taken_together():
    apart = [0.0, 0.0, 2.0**-9]
    parts = [figures(image((1.0,)), image((1.0 - e,)).astype(np.float32), never, (0.0,)) for e in apart]
    both = together(parts)
    assert (both.pixels, both.percentile(50), both.percentile(99), both.worst) == (3, 0.0, 2.0**-9, 2.0**-9)


# One word of the shader each: what a renderer gets wrong, and the figures must show.
FAULTS = {
    "half a slice": ("float s1 = floor(along)", "float s1 = floor(along - 0.5)"),
    "rows by the wrong divisor": ("floor(slice / tiles.x) / tiles.y", "floor(slice / tiles.y) / tiles.y"),
    "opacity a twentieth too high": ("(1.0 / float(STEPS))", "(1.05 / float(STEPS))"),
    "alpha without what is in front": ("alpha += (1.0 - alpha) * opacity", "alpha += opacity"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_faults_in_a_shader_are_seen(swiftshader, monkeypatch, fault):
    case = next(case for case in cases() if str(case) == "congote2012, unorm8, eleven slices")
    right = congote.program

    def broken(*names):
        program = right(*names)
        assert FAULTS[fault][0] in program.fragment
        return replace(program, fragment=program.fragment.replace(*FAULTS[fault]))

    monkeypatch.setattr(congote, "program", broken)
    found = compared(swiftshader, case)["canvas"]
    assert found.unexplained > 0.1 * found.pixels
