"""Devices: presets, files."""

import json

import pytest
from hypothesis import given

import volref as vr
from tests.emulation import strategies
from volref.emulation.device import PRESETS, Device
from volref.emulation.files.documents import device_from_dict
from volref.emulation.switches import switches_of


@pytest.mark.parametrize("name", PRESETS)
def test_presets_go_through_files(name, tmp_path):
    path = tmp_path / "device.json"
    path.write_text(Device.named(name).to_json(), encoding="utf-8")
    assert vr.load_device(path) == Device.named(name)


@given(strategies.groups(Device))
def test_json_holds_every_device(device):
    assert device_from_dict(json.loads(device.to_json())) == device


def test_no_two_presets_are_equal():
    switches = [tuple(getattr(one, s.name) for s in switches_of(Device)) for one in PRESETS.values()]
    assert len(set(switches)) == len(PRESETS)


def test_what_is_left_out_is_ideal(tmp_path):
    path = tmp_path / "device.json"
    path.write_text('{"format": "volref-device", "version": 1, "weight_bits": 7}', encoding="utf-8")
    assert vr.load_device(path) == Device("mine", weight_bits=7)


@pytest.mark.parametrize(
    ("document", "sentence"),
    [
        ([], r"device.json: device must be an object of switches, got \[\]"),
        ({"format": "volref-pipeline"}, r"device.json: device.format must be 'volref-device', got 'volref-p"),
        (
            {"format": "volref-device", "version": 1, "weight_bits": 0},
            r"device.json: device.weight_bits must be",
        ),
        ({"format": "volref-device", "version": 1, "weights": 8}, r"device.json: device must have switches"),
        (
            {"format": "volref-device", "version": 1, "name": 3},
            r"device.json: device.name must be a short name",
        ),
    ],
)
def test_a_file_that_is_no_device_is_refused(document, sentence, tmp_path):
    path = tmp_path / "device.json"
    path.write_text(json.dumps(document), encoding="utf-8")
    with pytest.raises(vr.FormatError, match=f"^{sentence}"):
        vr.load_device(path)


def test_a_preset_that_there_is_not_is_refused():
    with pytest.raises(vr.SceneError, match=r"device must be a preset, got 'mesa'; use one of ideal, exact"):
        Device.named("mesa")
