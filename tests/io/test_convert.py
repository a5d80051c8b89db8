"""Volumes through every format: values exact everywhere, places as exact as the format is."""

import itertools
import json

import numpy as np
import pytest

from tests.letters import letter_f
from volref.errors import FormatError
from volref.io import convert_volume, load_volume, save_volume
from volref.scene import Volume

TURN = np.array([[0.6, -0.8, 0], [0.8, 0.6, 0], [0, 0, -1.0]])
VOLUME = Volume(letter_f(), (0.7, 1.3, 5.1), (-98.3, 134.5, 72.1), TURN)

# How far a position may move, as a share of its size: NRRD and MetaImage are text of 17 digits, joined and
# split again (a few ulp); NIfTI stores float32, half an ulp of which is 2^-24 = 6e-8.
EXACT, TEXT, FLOAT32 = 0.0, 1e-15, 6e-8
FORMATS = [
    (".npy", EXACT),
    (".npz", EXACT),
    (".raw", EXACT),
    (".h5", EXACT),
    (".nrrd", TEXT),
    (".mha", TEXT),
    (".nii", FLOAT32),
    (".nii.gz", FLOAT32),
]


def assert_same(one, other, tolerance):
    assert np.array_equal(one.values, other.values)
    assert one.values.dtype == other.values.dtype
    assert one.centering == other.centering
    scale = np.abs(one.world_from_index).max()
    assert np.abs(one.world_from_index - other.world_from_index).max() <= tolerance * scale


@pytest.mark.parametrize(("suffix", "tolerance"), FORMATS)
@pytest.mark.parametrize("dtype", [np.uint8, np.int16, np.uint16, np.int64, np.float32, np.float64])
def test_a_volume_comes_back_from_each_format(tmp_path, suffix, tolerance, dtype):
    if (suffix, dtype) == (".mha", np.int64):
        suffix = ".hdf5"  # MetaImage's MET_LONG has 4 bytes in some programs and 8 in others
    volume = Volume(letter_f(dtype), VOLUME.spacing, VOLUME.origin, TURN)
    save_volume(volume, tmp_path / f"v{suffix}")
    assert_same(volume, load_volume(tmp_path / f"v{suffix}"), tolerance)


def test_a_chain_of_conversions_ends_where_it_began(tmp_path):
    volume = Volume(letter_f(np.uint8), (1, 2, 4), (8, -16, 32), np.diag([1.0, -1, 1]))
    names = ["a.npy", "b.npz", "c.raw", "d.png", "e.nrrd", "f.nii.gz", "h.mha", "i.h5", "g.npy"]
    save_volume(volume, tmp_path / names[0])
    for source, target in itertools.pairwise(names):
        convert_volume(tmp_path / source, tmp_path / target)
    assert_same(volume, load_volume(tmp_path / "g.npy"), 0.0)  # powers of two: exact in every format
    assert (tmp_path / "a.npy").read_bytes() == (tmp_path / "g.npy").read_bytes()


def test_node_centering_is_kept_or_refused(tmp_path):
    volume = Volume(letter_f(), centering="node")
    save_volume(volume, tmp_path / "v.nrrd")
    assert load_volume(tmp_path / "v.nrrd").centering == "node"
    with pytest.raises(FormatError, match=r"'cell', got 'node'; use \.nrrd or \.npz"):
        save_volume(volume, tmp_path / "v.nii")


@pytest.mark.parametrize(
    ("suffix", "dtype"), [(".png", np.int16), (".png", np.float32), (".nii", np.float16)]
)
def test_values_are_refused_rather_than_changed(tmp_path, suffix, dtype):
    with pytest.raises(FormatError, match=f"got {np.dtype(dtype)}"):
        save_volume(Volume(letter_f(dtype)), tmp_path / f"v{suffix}")
    assert list(tmp_path.iterdir()) == []


def test_an_unknown_target_is_refused_with_the_known_ones(tmp_path):
    with pytest.raises(FormatError, match=r"must end in \.npy.*use '\.nrrd'$"):
        save_volume(VOLUME, tmp_path / "v.nrd")


def test_the_sidecar_states_the_geometry_for_people(tmp_path):
    save_volume(VOLUME, tmp_path / "v.raw")
    stated = json.loads((tmp_path / "v.raw.json").read_text())
    assert stated["size"] == [5, 6, 4]
    assert (stated["dtype"], stated["byte_order"], stated["skip"]) == ("int16", "little", 0)
    assert stated["spacing"] == [0.7, 1.3, 5.1]


def test_a_sidecar_that_exists_stops_the_conversion(tmp_path):
    (tmp_path / "v.npy.json").write_text("{}")
    with pytest.raises(FormatError, match=r"v\.npy\.json must not exist yet"):
        save_volume(VOLUME, tmp_path / "v.npy")
    assert not (tmp_path / "v.npy").exists()


@pytest.mark.parametrize("suffix", [".npz", ".nrrd", ".nii"])
def test_an_old_sidecar_of_a_format_that_needs_none_is_refused_or_removed(tmp_path, suffix):
    path, beside = tmp_path / f"v{suffix}", tmp_path / f"v{suffix}.json"
    beside.write_text('{"spacing": [9, 9, 9]}')
    with pytest.raises(FormatError, match=r"\.json must not exist yet"):
        save_volume(VOLUME, path)
    assert not path.exists()
    save_volume(VOLUME, path, overwrite=True)
    assert_same(VOLUME, load_volume(path), FLOAT32)
    assert not beside.exists()


def test_metaimage_refuses_what_it_cannot_say(tmp_path):
    with pytest.raises(FormatError, match=r"a type that MetaImage has, got int64; use \.nrrd or \.npz$"):
        save_volume(Volume(letter_f(np.int64)), tmp_path / "v.mha")
    with pytest.raises(FormatError, match=r"'cell', got 'node'; use \.nrrd or \.npz$"):
        save_volume(Volume(letter_f(), centering="node"), tmp_path / "v.mha")
    assert not list(tmp_path.iterdir())
