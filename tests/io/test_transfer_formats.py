"""Transfer functions that other programs write: ParaView, Slicer and VPT."""

import json
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.oracles.lookup import piecewise, vpt_canvas
from volref.errors import FormatError, SceneError
from volref.io import load_preset, load_transfer
from volref.io.transfer_vpt import bumps_of_document, drawn_bumps

DATA = Path(__file__).parents[1] / "data"
MAPS, PRESETS = DATA / "tf_paraview_colormaps.json", DATA / "tf_slicer_presets.json"
NAMES = [preset["name"] for preset in json.loads(PRESETS.read_text())]

MAP = {"Name": "two", "RGBPoints": [0, 0, 0, 0, 1, 1, 1, 1]}
STRINGS = {
    "name": "bone",
    "shade": "1",
    "ambient": "0.3",
    "diffuse": "0.6",
    "specular": "0.5",
    "specularPower": "40",
    "interpolation": "1",
    "scalarOpacity": "4 -100 0 300 0.5",
    "colorTransfer": "8 -100 0 0 0 100 1 0.5 0.25",
    "gradientOpacity": "4 0 0 80 1",
}
COMPONENT = {
    "shade": True,
    "lighting": {"ambient": 0.3, "diffuse": 0.6, "specular": 0.5, "specularPower": 40},
    "scalarOpacityUnitDistance": 2.5,
    "disableGradientOpacity": False,
    "rgbTransferFunction": {"points": [{"x": -100, "color": [0, 0, 0]}, {"x": 100, "color": [1, 0.5, 0.25]}]},
    "scalarOpacity": {
        "points": [{"x": -100, "y": 0, "midpoint": 0.5, "sharpness": 0}, {"x": 300, "y": 0.5}],
    },
    "gradientOpacity": {"points": [{"x": 0, "y": 0}, {"x": 80, "y": 1}]},
}
BUMPS = [
    {
        "position": {"x": 0.3, "y": 0.4},
        "size": {"x": 0.2, "y": 0.1},
        "color": {"r": 1, "g": 0.5, "b": 0, "a": 0.8},
    },
    {
        "position": {"x": 0.6, "y": 0.5},
        "size": {"x": 0.05, "y": 0.4},
        "color": {"r": 0, "g": 0.2, "b": 1, "a": 1},
    },
]


def saved(folder, content):
    (folder / "tf.json").write_text(json.dumps(content))
    return folder / "tf.json"


def test_a_paraview_map_spreads_over_a_domain_and_runs_from_clear_to_opaque(tmp_path):
    tf = load_transfer(saved(tmp_path, [MAP]), domain=(-10, 30), unit_distance=3, units="dBZ")
    assert tf.values.tolist() == [-10, 30]
    assert tf.opacity.tolist() == [0, 1]
    assert (tf.unit_distance, tf.units, tf.interpolation) == (3, "dBZ", "opacity")


def test_paraview_opacities_have_knots_of_their_own(tmp_path):
    points = [0, 0, 0.5, 0, 0.25, 0.8, 0.5, 0, 1, 0.2, 0.5, 0]
    tf = load_transfer(saved(tmp_path, MAP | {"Points": points}))
    assert tf.values.tolist() == [0, 0.25, 1]
    assert tf.opacity.tolist() == [0, 0.8, 0.2]
    assert tf.colors[:, 1].tolist() == [0, 0.25, 1]


def test_hues_wrap_only_where_the_map_says_so(tmp_path):
    rainbow = {"ColorSpace": "HSV", "RGBPoints": [0, 0, 0, 1, 1, 1, 0, 0]}  # blue to red

    def middle(**change):
        tf = load_transfer(saved(tmp_path, rainbow | change))
        return [round(piecewise(tf.values, channel, 0.5), 6) for channel in tf.colors.T]

    assert middle() == [0, 1, 0]
    assert middle(HSVWrap=1) == [1, 0, 1]


@pytest.mark.parametrize("name", [entry["Name"] for entry in json.loads(MAPS.read_text())])
def test_every_map_is_found_by_its_name(name):
    tf = load_transfer(MAPS, key=name)
    entry = next(entry for entry in json.loads(MAPS.read_text()) if entry["Name"] == name)
    ends = np.reshape(entry["RGBPoints"], (-1, 4))[[0, -1]]
    assert np.array_equal(tf.values[[0, -1]], ends[:, 0])
    assert np.array_equal(tf.colors[[0, -1]], ends[:, 1:])
    assert len(tf.values) < 1000


def test_a_preset_is_transfer_function_gradient_opacity_and_material(tmp_path):
    tf, material = load_preset(saved(tmp_path, [STRINGS]), "bone", mean_spacing=2.0, units="HU")
    assert tf.values.tolist() == [-100, 100, 300]
    assert tf.opacity.tolist() == [0, 0.25, 0.5]
    assert tf.colors.tolist() == [[0, 0, 0], [1, 0.5, 0.25], [1, 0.5, 0.25]]
    # 80 units per average voxel of 2 mm are 40 per mm.
    assert [column.tolist() for column in tf.gradient_opacity] == [[0, 40], [0, 1]]
    assert (tf.unit_distance, tf.units) == (1, "HU")
    assert (material.model, material.two_sided) == ("phong", True)
    assert (material.ambient, material.diffuse) == (0.3, 0.6)
    assert (material.specular, material.shininess) == (0.5, 40)


def test_old_and_new_presets_of_slicer_are_the_same_but_for_what_only_the_new_one_states(tmp_path):
    old, old_material = load_preset(saved(tmp_path, STRINGS))
    document = {"@schema": "...", "volumeProperties": [{"components": [COMPONENT]}]}
    path = tmp_path / "bone.vp.json"
    path.write_text(json.dumps(document))
    new, new_material = load_preset(path)
    for name in ("values", "colors", "opacity"):
        assert np.array_equal(getattr(old, name), getattr(new, name))
    assert np.array_equal(old.gradient_opacity, new.gradient_opacity)
    assert old_material.__dict__ == new_material.__dict__
    assert (old.unit_distance, new.unit_distance) == (1, 2.5)
    assert load_transfer(path, unit_distance=4).unit_distance == 4


def test_a_preset_that_does_not_shade_has_no_material(tmp_path):
    assert load_preset(saved(tmp_path, STRINGS | {"shade": "0"}))[1] is None
    component = COMPONENT | {"shade": False, "disableGradientOpacity": True}
    tf, material = load_preset(saved(tmp_path, {"volumeProperties": [{"components": [component]}]}))
    assert (tf.gradient_opacity, material) == (None, None)


@pytest.mark.parametrize("name", NAMES)
def test_every_preset_of_slicer_keeps_its_numbers(name):
    tf, material = load_preset(PRESETS, name)
    entry = next(preset for preset in json.loads(PRESETS.read_text()) if preset["name"] == name)
    opacity = np.array(entry["scalarOpacity"].split()[1:], float).reshape(-1, 2)
    colors = np.array(entry["colorTransfer"].split()[1:], float).reshape(-1, 4)
    for x, y in opacity:
        first = float(opacity[opacity[:, 0] == x][-1, 1])
        assert piecewise(tf.values, tf.opacity, x) in (y, first)
    for x, *rgb in colors:
        last = colors[colors[:, 0] == x][-1, 1:]
        # Where an opacity has a knot between two colours, theirs are interpolated: off by an ulp.
        found = [piecewise(tf.values, channel, x) for channel in tf.colors.T]
        assert np.allclose(found, rgb, rtol=0, atol=1e-15) or np.allclose(found, last, rtol=0, atol=1e-15)
    assert (material is None) == (entry["shade"] == "0")
    assert tf.gradient_opacity is None  # a factor of 1 everywhere in all of them


@pytest.mark.parametrize("blend", ["source-alpha", "premultiplied"])
@pytest.mark.parametrize("rounded", [True, False])
def test_bumps_are_drawn_as_the_scalar_loop_draws_them(monkeypatch, blend, rounded):
    monkeypatch.setattr("volref.io.transfer_vpt.SIZE", 24)
    found = drawn_bumps(bumps_of_document(Path("x"), BUMPS), rounded=rounded, blend=blend)
    expected = np.array(vpt_canvas(BUMPS, 24, rounded=rounded, blend=blend))
    if rounded:
        assert np.array_equal(found, np.rint(255 * expected))
    else:
        np.testing.assert_allclose(found, expected, rtol=0, atol=4e-16)  # sums of numbers up to 1


def test_bumps_are_a_table_of_256_by_256_with_y_upwards(tmp_path):
    tf = load_transfer(saved(tmp_path, BUMPS[:1]), domain=(-100, 300))
    assert tf.rgba.shape == (256, 256, 4)
    assert (tf.value_domain, tf.magnitude_domain) == ((-100, 300), (0, 400))
    row, column = np.unravel_index(tf.rgba[..., 3].argmax(), (256, 256))
    # Rows and columns are not swapped: the bump is at x = 0.3, y = 0.4; several texels share its peak.
    assert (row, column) == (pytest.approx(0.4 * 256, abs=4), pytest.approx(0.3 * 256, abs=8))
    assert np.array_equal(tf.rgba * 255, np.rint(tf.rgba * 255))
    smooth = load_transfer(saved(tmp_path, BUMPS[:1]), rounded=False, magnitude_domain=(0, 2))
    assert np.abs(smooth.rgba - tf.rgba).max() <= 0.5 / 255
    assert smooth.magnitude_domain == (0, 2)


def test_the_order_of_bumps_matters(tmp_path):
    wide = [bump | {"position": {"x": 0.5, "y": 0.5}, "size": {"x": 9, "y": 9}} for bump in BUMPS]
    orange_then_blue = load_transfer(saved(tmp_path, wide)).rgba
    blue_then_orange = load_transfer(saved(tmp_path, wide[::-1])).rgba
    # The second one hides the first, but for the Gaussian's fall of 0.6 % towards the corners.
    assert orange_then_blue[..., 0].max() < 0.01 < 0.7 < blue_then_orange[..., 0].min()


BAD = [
    ("no key", MAPS, {}, "must be given a key, got none for 17 entries, pass|must be given a key"),
    ("unknown key", PRESETS, {"key": "CT-Bon"}, "got 'CT-Bon'; use 'CT-Bone'"),
    ("option of another format", PRESETS, {"key": NAMES[0], "domain": (0, 1)}, "without domain"),
    ("indexed colours", [{"Name": "i", "IndexedColors": [0, 0, 0]}], {}, "RGBPoints, .* got IndexedColors"),
    ("no colours", [{"ColorSpace": "RGB"}], {}, "must have RGBPoints, .* got none"),
    ("unknown space", MAP | {"ColorSpace": "CIEDE2000"}, {}, "ColorSpace must be one of RGB, HSV, Lab"),
    ("log scale", MAP | {"UseLogScale": 1}, {}, "must be linear in the value"),
    ("odd count", MAP | {"RGBPoints": [0, 0, 0]}, {}, "four for each point, got 3 numbers"),
    ("text for numbers", MAP | {"RGBPoints": ["a"] * 4}, {}, "RGBPoints must be numbers"),
    (
        "opacity above 1",
        MAP | {"Points": [0, 2, 0.5, 0]},
        {},
        "opacity nodes must have channels in 0..1, got 2 at index 0",
    ),
    ("midpoint above 1", MAP | {"Points": [0, 0, 1.5, 0]}, {}, "midpoint and sharpness in 0..1"),
    ("wrong count", STRINGS | {"scalarOpacity": "6 0 0 1 1"}, {}, "begin with the count .* got 6 before 4"),
    ("no opacity", {"colorTransfer": "4 0 1 1 1"}, {}, "scalarOpacity must begin .* got nothing before 0"),
    ("words", STRINGS | {"colorTransfer": "4 a b c d"}, {}, "colorTransfer must hold numbers, got could not"),
    ("not finite", STRINGS | {"colorTransfer": "4 nan 0 0 0"}, {}, "must be finite"),
    ("no component", {"volumeProperties": [{"components": []}]}, {}, "components must be a list of one"),
    (
        "point without y",
        {"volumeProperties": [{"components": [COMPONENT | {"scalarOpacity": {"points": [{"x": 1}]}}]}]},
        {},
        r"scalarOpacity.points\[0\] must be a number, got None",
    ),
    (
        "colour of two",
        {
            "volumeProperties": [
                {"components": [COMPONENT | {"rgbTransferFunction": {"points": [{"x": 1, "color": [1, 1]}]}}]}
            ]
        },
        {},
        r"points\[0\] must have 3 channels, got 2",
    ),
    (
        "lighting of text",
        {"volumeProperties": [{"components": [COMPONENT | {"lighting": "x"}]}]},
        {},
        "an object",
    ),
    ("bump without colour", [{"position": {"x": 0, "y": 0}, "size": {}, "color": {}}], {}, "must have size"),
    ("flat bump", [BUMPS[0] | {"size": {"x": 0, "y": 1}}], {}, r"size must not be 0, got \[0.0, 1.0\]"),
    ("unknown blend", BUMPS, {"blend": "over"}, "blend must be 'source-alpha' or"),
    ("many bumps", BUMPS * 513, {}, "1 to 1024 bumps, got 1026"),
    ("empty list", [], {}, "must hold a JSON object, got list"),
]


@pytest.mark.parametrize(
    ("content", "options", "fragment"), [case[1:] for case in BAD], ids=[c[0] for c in BAD]
)
def test_a_bad_file_is_refused_in_one_sentence(tmp_path, content, options, fragment):
    path = content if isinstance(content, Path) else saved(tmp_path, content)
    with pytest.raises((FormatError, SceneError), match=fragment) as refusal:
        load_transfer(path, **options)
    assert "\n" not in str(refusal.value)
    assert str(refusal.value).count(";") == 1


def test_only_presets_are_loaded_as_presets(tmp_path):
    with pytest.raises(FormatError, match="must hold presets of Slicer"):
        load_preset(saved(tmp_path, [MAP]))


SOUND = [
    [MAP, MAP | {"Name": "other", "ColorSpace": "Diverging", "Points": [0, 0, 0.3, 0.5, 1, 1, 0.5, 0]}],
    MAP | {"ColorSpace": "HSV", "HSVWrap": 1},
    [STRINGS],
    {"volumeProperties": [{"components": [COMPONENT]}]},
    BUMPS[:1],
    {
        "format": "volref-transfer",
        "format_version": 1,
        "values": [0, 1],
        "colors": [[0, 0, 0], [1, 1, 1]],
        "opacity": [0, 0.5],
        "gradient_opacity": [[0, 1], [0, 1]],
        "units": "HU",
    },
    {
        "format": "volref-transfer",
        "format_version": 1,
        "value_domain": [0, 1],
        "magnitude_domain": [0, 1],
        "rgba": [[[0, 0, 0, 0.5]]],
    },
]
ODD = [None, True, "", "x", "nan", [], [[]], {}, [0], 0, -1, 2, 0.5, 1e308, -1e308, 1e-320, 10**25, "9" * 400]


def places(content, path=()):
    """Return the path of every part of a document."""
    inner = content.items() if isinstance(content, dict) else ()
    if isinstance(content, list):
        inner = enumerate(content)
    return [path, *(place for key, part in inner for place in places(part, (*path, key)))]


def with_part(content, path, part):
    if not path:
        return part
    copy = content.copy()
    copy[path[0]] = with_part(content[path[0]], path[1:], part)
    return copy


@pytest.mark.parametrize("sound", SOUND, ids=range(len(SOUND)))
@settings(max_examples=50)
@given(st.data())
def test_a_document_with_one_odd_part_is_read_or_refused(tmp_path_factory, sound, data):
    path = tmp_path_factory.getbasetemp() / "odd.json"
    odd = with_part(sound, data.draw(st.sampled_from(places(sound))), data.draw(st.sampled_from(ODD)))
    path.write_text(json.dumps(odd))
    for load in (load_transfer, load_preset):
        with suppress(FormatError, SceneError):
            load(path)
        with suppress(FormatError, SceneError):
            load(path, key="other")
