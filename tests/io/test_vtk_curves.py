"""VTK's colour and opacity functions, against numbers of VTK 9.7.2, closed forms and colour-science."""

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.oracles.lookup import piecewise
from volref.errors import SceneError
from volref.io.vtk_colors import hsv_of_rgb, lab_of_rgb, rgb_of_hsv, rgb_of_lab
from volref.io.vtk_curves import color_curve, joined, opacity_curve
from volref.oracle.metrics import import_colour

DATA = Path(__file__).parents[1] / "data"
VTK = json.loads((DATA / "vtk_transfer_values.json").read_text())
MAPS = {entry["Name"]: entry for entry in json.loads((DATA / "tf_paraview_colormaps.json").read_text())}

unit = st.floats(0, 1)


def values_of(curve, at):
    return np.array([[piecewise(curve.knots, channel, x) for channel in curve.channels] for x in at])


@pytest.mark.parametrize("case", VTK["maps"], ids=lambda case: case["name"])
def test_a_colour_map_is_within_1e_4_of_vtk(case):
    entry = MAPS[case["name"]]
    curve = color_curve(np.reshape(entry["RGBPoints"], (-1, 4)), entry["ColorSpace"])
    np.testing.assert_allclose(values_of(curve, case["values"]), case["colors"], rtol=0, atol=1e-4)


@pytest.mark.parametrize("case", VTK["colors"], ids=lambda case: f"{case['space']} {case['nodes'][0][4:]}")
def test_every_space_with_midpoint_and_sharpness_is_within_1e_4_of_vtk(case):
    curve = color_curve(case["nodes"], case["space"])
    np.testing.assert_allclose(values_of(curve, case["values"]), case["colors"], rtol=0, atol=1e-4)


@pytest.mark.parametrize("case", VTK["curves"], ids=lambda case: f"{len(case['nodes'])} nodes")
def test_opacities_with_midpoint_and_sharpness_are_within_1e_4_of_vtk(case):
    curve = opacity_curve(case["nodes"])
    np.testing.assert_allclose(values_of(curve, case["values"])[:, 0], case["opacity"], rtol=0, atol=1e-4)


def test_the_worst_pieces_are_within_1e_4_between_their_knots_too():
    # The steepest curve there is; its closed form is the docstring's.
    midpoint, sharpness = 0.3, 0.98
    curve = opacity_curve([(0, 0, midpoint, sharpness), (1, 1, 0.5, 0)])
    u = np.linspace(0, 1, 20001)
    s = np.where(u < midpoint, u / (2 * midpoint), 0.5 + (u - midpoint) / (2 - 2 * midpoint))
    power = 1 + 10 * sharpness
    p = np.where(s < 0.5, (2 * s) ** power / 2, 1 - (2 - 2 * s) ** power / 2)
    true = 3 * p**2 - 2 * p**3 + (1 - sharpness) * p * (1 - p) * (1 - 2 * p)
    off = np.abs(np.interp(u, curve.knots, curve.channels[0]) - true).max()
    assert off < 2.5e-5
    assert len(curve.knots) < 1500


def test_what_is_linear_keeps_its_knots_and_numbers():
    nodes = [(-7.0, 0.1, 0.2, 0.3), (0.25, 0.4, 0.5, 0.6), (9.0, 1.0, 0.0, 0.7)]
    curve = color_curve(nodes, "RGB")
    assert np.array_equal(np.column_stack([curve.knots, curve.channels.T]), nodes)


def test_two_nodes_at_one_value_are_a_jump_and_of_more_the_outer_two_are_seen():
    curve = opacity_curve([(0, 0.0), (1, 0.2), (1, 0.9), (1, 0.5), (2, 0.5)])
    assert curve.knots.tolist() == [0, 1, 1, 2]
    assert curve.channels[0].tolist() == [0, 0.2, 0.5, 0.5]


def test_a_sharp_colour_jumps_at_its_midpoint():
    curve = color_curve([(0, 0, 0, 0, 0.25, 1), (8, 1, 1, 1, 0.5, 0)], "Lab")
    assert curve.knots.tolist() == [0, 2, 2, 8]
    assert curve.channels[0].tolist() == [0, 0, 1, 1]


def test_one_node_is_constant():
    curve = color_curve([(3, 0.1, 0.2, 0.3)], "Diverging")
    assert curve.channels.T.tolist() == [[0.1, 0.2, 0.3]]


def test_nodes_out_of_order_are_sorted_as_vtk_sorts_them():
    assert opacity_curve([(5, 1.0), (0, 0.25)]).channels[0].tolist() == [0.25, 1.0]


@given(st.tuples(unit, unit, unit), st.tuples(unit, unit, unit))
def test_hues_and_back_are_the_same_colour(one, other):
    rgb = np.array([one, other]).T
    # Three roundings of numbers up to 1, and a division by the spread of the channels.
    np.testing.assert_allclose(rgb_of_hsv(hsv_of_rgb(rgb)), rgb, rtol=0, atol=4e-15)


def test_lab_is_that_of_colour_science_but_for_vtks_rounded_constants():
    colour = import_colour()
    rgb = np.concatenate([np.random.default_rng(4).random((3, 2000)), np.eye(3), np.ones((3, 1))], axis=1)
    expected = colour.XYZ_to_Lab(colour.sRGB_to_XYZ(rgb.T)).T
    lab = lab_of_rgb(rgb)
    # VTK's white is 5e-5 of x and 6e-5 of z off D65: 500 / 3 and 200 / 3 of that are 0.008 and 0.004.
    np.testing.assert_allclose(lab, expected, rtol=0, atol=0.01)
    # Its two matrices are inverse to 2e-5, of which dark codes are 12.92 times as much.
    np.testing.assert_allclose(rgb_of_lab(lab), rgb, rtol=0, atol=5e-4)


def test_joined_curves_keep_every_knot_and_jump():
    one, other = opacity_curve([(0, 0), (4, 1)]), opacity_curve([(-1, 0.5), (1, 0.5), (1, 0), (4, 0)])
    knots, channels = joined(one, other)
    assert knots.tolist() == [-1, 0, 1, 1, 4]
    assert channels.tolist() == [[0, 0, 0.25, 0.25, 1], [0.5, 0.5, 0.5, 0, 0]]


@pytest.mark.parametrize(
    ("nodes", "fragment"),
    [
        ([(0, 0, 2, 0)], r"must have midpoint and sharpness in 0..1, got 2 at index 0"),
        (np.zeros((0, 4)), "must be 1 to 65536, got 0"),
        (np.zeros((65537, 4)), "must be 1 to 65536, got 65537; make them fewer"),
        ([(0, np.nan)], "must be finite"),
    ],
)
def test_nodes_that_break_a_rule_are_refused(nodes, fragment):
    with pytest.raises(SceneError, match=fragment):
        opacity_curve(nodes)
