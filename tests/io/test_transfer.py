"""Transfer functions from files: bit for bit through JSON, tables as from_lut places them."""

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from volref.errors import FormatError
from volref.io import load_transfer, save_transfer
from volref.io.transfer_json import document_of_transfer, transfer_of_document
from volref.scene import TransferFunction, TransferFunction2D

unit = st.floats(0, 1)
FIELDS = ("values", "colors", "extinction", "opacity", "gradient_opacity")


@st.composite
def transfers(draw):
    values = sorted(draw(st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=6, unique=True)))
    count = len(values)
    colors = draw(st.lists(st.tuples(unit, unit, unit), min_size=count, max_size=count))
    amounts = draw(st.lists(unit, min_size=count, max_size=count))
    length = draw(st.floats(1e-3, 1e3))
    kind = draw(st.sampled_from(["opacity", "extinction"]))
    more = {"units": draw(st.sampled_from(["", "HU", "dBZ", "normalised"]))}
    if draw(st.booleans()):
        more["gradient_opacity"] = ([0, length, length], draw(st.tuples(unit, unit, unit)))
    return TransferFunction(values, colors, **{kind: amounts}, unit_distance=length, **more)


def assert_same(one, other):
    for name in FIELDS:
        assert np.array_equal(getattr(one, name), getattr(other, name))
    for name in ("interpolation", "unit_distance", "units"):
        assert getattr(one, name) == getattr(other, name)


@given(transfers())
def test_json_keeps_every_number_bit_for_bit(tmp_path_factory, transfer):
    path = tmp_path_factory.mktemp("tf") / "tf.json"
    save_transfer(transfer, path)
    assert_same(load_transfer(path), transfer)
    assert json.loads(path.read_text()).get("units", "") == transfer.units


def table_2d(rows=3, columns=5):
    rgba = np.random.default_rng(8).random((rows, columns, 4))
    return TransferFunction2D(rgba, (-1000.1, 3000), (0, 1 / 3), 0.7, units="HU")


def assert_same_2d(one, other):
    assert np.array_equal(one.rgba, other.rgba)
    for name in ("value_domain", "magnitude_domain", "unit_distance", "units"):
        assert getattr(one, name) == getattr(other, name)


def test_a_table_of_two_dimensions_is_kept_bit_for_bit_in_a_file_beside_the_json(tmp_path):
    save_transfer(table_2d(), tmp_path / "bones.json")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["bones.json", "bones.rgba.npy"]
    assert_same_2d(load_transfer(tmp_path / "bones.json"), table_2d())
    with pytest.raises(FormatError, match="must not exist yet"):
        save_transfer(table_2d(), tmp_path / "bones.json")


def test_a_table_of_two_dimensions_may_stand_in_the_json(tmp_path):
    document = {"format": "volref-transfer", "format_version": 1, **document_of_transfer(table_2d())}
    assert_same_2d(load(tmp_path, document), table_2d())
    with pytest.raises(FormatError, match="rgba_file must lie beside a file"):
        transfer_of_document({"value_domain": [0, 1], "rgba_file": "x.npy"})


def test_the_file_beside_may_not_lie_elsewhere(tmp_path):
    save_transfer(table_2d(), tmp_path / "bones.json")
    document = json.loads((tmp_path / "bones.json").read_text()) | {"rgba_file": "../bones.rgba.npy"}
    (tmp_path / "inner").mkdir()
    with pytest.raises(FormatError, match="must stay inside the folder"):
        load(tmp_path / "inner", document)


def document(**change):
    base = {
        "format": "volref-transfer",
        "format_version": 1,
        "values": [0, 1],
        "colors": [[0, 0, 0], [1, 1, 1]],
    }
    return base | {"opacity": [0, 0.5], "unit_distance": 2.0} | change


def load(folder, content):
    (folder / "tf.json").write_text(json.dumps(content))
    return load_transfer(folder / "tf.json")


def test_a_domain_spreads_fractions_over_itself(tmp_path):
    transfer = load(tmp_path, document(domain=[100, 300], values=[0.25, 1]))
    assert transfer.values.tolist() == [150, 300]


def test_opacities_may_state_that_extinction_is_linear(tmp_path):
    transfer = load(tmp_path, document(interpolation="extinction"))
    assert transfer.interpolation == "extinction"
    assert transfer.extinction.tolist() == [0, -np.log1p(-0.5) / 2]


@pytest.mark.parametrize("name", ["t.npy", "t.png"])
def test_a_table_is_placed_as_from_lut_does(tmp_path, name):
    codes = np.random.default_rng(3).integers(0, 255, (256, 4), np.uint8)
    path = tmp_path / name
    if name.endswith("npy"):
        np.save(path, codes)
    else:
        Image.fromarray(np.repeat(codes[None], 2, axis=0)).save(path)
    for options in ({}, {"texel_centers": False, "unit_distance": 3.0, "interpolation": "extinction"}):
        assert_same(
            load_transfer(path, domain=(-10, 50), **options),
            TransferFunction.from_lut(codes, (-10, 50), **options),
        )


def test_a_table_of_rows_is_one_of_value_and_magnitude(tmp_path):
    codes = np.random.default_rng(3).integers(0, 255, (4, 6, 4), np.uint8)
    np.save(tmp_path / "t.npy", codes)
    found = load_transfer(tmp_path / "t.npy", domain=(0, 255), magnitude_domain=(0, 60), units="codes")
    assert_same_2d(found, TransferFunction2D(codes, (0, 255), (0, 60), units="codes"))
    with pytest.raises(FormatError, match="must be given a magnitude_domain, got none for a table of 4 rows"):
        load_transfer(tmp_path / "t.npy", domain=(0, 255))
    with pytest.raises(FormatError, match="without interpolation"):
        load_transfer(
            tmp_path / "t.npy", domain=(0, 255), magnitude_domain=(0, 60), interpolation="extinction"
        )


def test_a_table_without_a_domain_is_refused(tmp_path):
    np.save(tmp_path / "t.npy", np.zeros((256, 4), np.uint8))
    with pytest.raises(FormatError, match="must be given a domain, got none; pass domain="):
        load_transfer(tmp_path / "t.npy")


def test_a_json_file_states_its_domain_itself(tmp_path):
    (tmp_path / "tf.json").write_text(json.dumps(document()))
    with pytest.raises(FormatError, match="without domain"):
        load_transfer(tmp_path / "tf.json", domain=(0, 1))
