"""Lights, material, planes, modes, radars and tables of value and gradient in scene files."""

import dataclasses
import json

import numpy as np
import pytest

import volref as vr
from tests.scenes import rough_scene
from volref.io.documents import scene_schema

LIGHTS = [
    vr.Light.ambient((0.1, 0.2, 1 / 3)),
    vr.Light.directional((1, 2, -3), (0.3, 0.7, 0.1)),
    vr.Light.point((1 / 7, 2, 3), attenuation=(1, 0.1, 0.01)),
    vr.Light.headlight(),
]
PLANES = [vr.Plane((1 / 3, 2, 3), (0, 1, 1)), vr.Plane((0, 0, 0), (1, 0, 0))]


def same(one, other):
    """Whether two records hold the same numbers, bit for bit."""
    if dataclasses.is_dataclass(one):
        fields = [field.name for field in dataclasses.fields(one)]
        return type(one) is type(other) and all(same(getattr(one, k), getattr(other, k)) for k in fields)
    if isinstance(one, np.ndarray):
        return one.dtype == other.dtype and np.array_equal(one, other, equal_nan=one.dtype.kind == "f")
    if isinstance(one, (list, tuple)):
        return len(one) == len(other) and all(map(same, one, other))
    return one == other


def saved_and_loaded(scene, folder):
    vr.save_scene(scene, folder / "shot.json")
    document = json.loads((folder / "shot.json").read_text())
    assert document.keys() <= scene_schema()["properties"].keys()
    return vr.load_scene(folder / "shot.json")


@pytest.mark.parametrize(
    "change",
    [
        {"lights": LIGHTS, "material": vr.Material("blinn-phong", ambient=1 / 3, two_sided=True)},
        {"mode": "isosurface", "isovalue": 0.1 + 0.2, "gradient": "sobel"},
        {"mode": "slice", "slice_plane": PLANES[0], "clip": PLANES},
        {"mode": "mip"},
        {"classification": "per-slice"},
        {"material": vr.Material("unlit"), "classification": "pre"},
    ],
)
def test_what_a_scene_says_of_light_and_look_loads_bit_for_bit(change, tmp_path):
    scene = dataclasses.replace(rough_scene(), **change)
    assert same(saved_and_loaded(scene, tmp_path), scene)


def test_a_table_of_value_and_gradient_lies_beside_the_scene(tmp_path):
    rgba = np.random.default_rng(0).random((3, 4, 4))
    table = vr.TransferFunction2D(rgba, (0, 1), (0, 3), 0.7, units="HU")
    scene = dataclasses.replace(rough_scene(), transfer=table)
    assert same(saved_and_loaded(scene, tmp_path), scene)


def test_a_radar_lies_beside_the_scene(tmp_path):
    random = np.random.default_rng(1)
    values = random.uniform(-20, 60, (12, 5))
    values[3, 2], values[4, 1] = np.nan, -np.inf
    sweeps = [vr.Sweep(np.arange(15.0, 360, 30), e, values + e, 500, 1000) for e in (0.5, 3.0)]
    radar = vr.RadarVolume(sweeps, beam="4/3-earth", origin=(10, 20, 30))
    camera = vr.Camera.look_at((0, -20e3, 9e3), (0, 0, 0), (0, 0, 1), 50, 1, 1e6)
    scene = vr.Scene(radar, vr.dbz_transfer(), camera, 8, 6)
    again = saved_and_loaded(scene, tmp_path)
    assert same(again.volume, radar)
    np.testing.assert_array_equal(
        vr.render(again, method="march").rgba, vr.render(scene, method="march").rgba
    )


def test_a_volume_and_a_radar_are_one_too_many(tmp_path):
    vr.save_scene(rough_scene(), tmp_path / "shot.json")
    document = json.loads((tmp_path / "shot.json").read_text())
    document["radar"] = {"path": "storm.npz"}
    (tmp_path / "shot.json").write_text(json.dumps(document))
    with pytest.raises(vr.FormatError, match="must have a volume or a radar, got both; remove one"):
        vr.load_scene(tmp_path / "shot.json")


def test_nothing_is_written_if_one_of_the_files_is_there(tmp_path):
    table = vr.TransferFunction2D(np.ones((2, 2, 4)), (0, 1), (0, 3))
    scene = dataclasses.replace(rough_scene(), transfer=table)
    (tmp_path / "shot.transfer.json").write_text("mine")
    with pytest.raises(vr.FormatError, match=r"shot.transfer.json"):
        vr.save_scene(scene, tmp_path / "shot.json")
    assert [path.name for path in tmp_path.iterdir()] == ["shot.transfer.json"]


def test_a_mesh_file_is_drawn_as_the_scene_says(tmp_path):
    scene = rough_scene()
    mesh = vr.Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)], opacity=0.5)
    vr.save_scene(dataclasses.replace(scene, meshes=[mesh]), tmp_path / "shot.json")
    document = json.loads((tmp_path / "shot.json").read_text())
    document["meshes"][0] |= {"opacity": 0.25, "lit": True, "sides": "front", "back_color": [1, 0, 0]}
    (tmp_path / "shot.json").write_text(json.dumps(document))
    (loaded,) = vr.load_scene(tmp_path / "shot.json").meshes
    assert (loaded.opacity, loaded.lit, loaded.sides) == (0.25, True, "front")
    assert np.array_equal(loaded.back_color[:3], (1, 0, 0))
