"""References: a volume is read again elsewhere, bit for bit, or refused."""

import json
import pickle
from pathlib import Path

import numpy as np
import pytest

import volref as vr
from tests.scenes import rough_volume
from volref.io import references
from volref.io.convert import save_volume
from volref.io.references import FileReference, fetch_volume, pack, refer_to_volume, unpack
from volref.io.volumes import _ORIGINS, origin_of


def never():
    raise AssertionError("written")


def again(volume, folder=never):
    """The volume as another process gets it."""
    fetch_volume.cache_clear()
    return fetch_volume(pickle.loads(pickle.dumps(refer_to_volume(volume, folder))))


def assert_same(first, second):
    assert first.values.dtype == second.values.dtype
    assert first.values.tobytes() == second.values.tobytes()
    for name in ("spacing", "origin", "centering"):
        assert getattr(first, name) == getattr(second, name)
    assert first.direction.tobytes() == second.direction.tobytes()


PLACE = {"spacing": (0.1, 0.7, 1 / 3), "origin": (1e-3, 2, -3), "direction": np.eye(3)[[1, 2, 0]]}


@pytest.mark.parametrize(
    "suffix", [".npy", ".npz", ".nrrd", ".nii", ".nii.gz", ".mha", ".h5", ".raw", ".png"]
)
def test_a_volume_from_a_file_is_read_from_there(tmp_path, suffix):
    path = tmp_path / f"volume{suffix}"
    save_volume(rough_volume(dtype=np.uint8, centering="cell", **PLACE), path)
    volume = vr.load_volume(path)
    assert_same(again(volume), volume)


def test_it_is_read_as_the_user_asked_for_it(tmp_path):
    values = np.arange(24.0).reshape(2, 3, 4)
    values[1, 1, 1] = np.nan
    np.savez(tmp_path / "two.npz", other=values, volume=np.zeros((2, 2, 2)))
    volume = vr.load_volume(tmp_path / "two.npz", key="other", nan=-7.5, **PLACE)
    assert volume.values[1, 1, 1] == -7.5
    assert_same(again(volume), volume)


def test_what_stands_beside_the_file_now_does_not_matter(tmp_path):
    path, beside = tmp_path / "volume.raw", tmp_path / "volume.raw.json"
    path.write_bytes(bytes(range(24)))
    said = {"size": [4, 3, 2], "dtype": "uint8", "byte_order": "little", "skip": 0, "spacing": [1, 2, 3]}
    beside.write_text(json.dumps(said))
    volume = vr.load_volume(path)
    beside.write_text(json.dumps(said | {"size": [2, 3, 4], "spacing": [9, 9, 9]}))
    assert_same(again(volume), volume)


@pytest.mark.parametrize("field", ["data file", "datafile"])
def test_a_volume_from_two_files_is_written_as_one(tmp_path, field):
    values = np.arange(24, dtype=np.uint8)
    (tmp_path / "samples.raw").write_bytes(values.tobytes())
    head = f"NRRD0004\ntype: uint8\ndimension: 3\nsizes: 4 3 2\nencoding: raw\n{field}: samples.raw\n"
    (tmp_path / "volume.nhdr").write_text(head)
    volume = vr.load_volume(tmp_path / "volume.nhdr")
    assert origin_of(volume) is None
    folder = tmp_path / "new"
    folder.mkdir()
    assert_same(again(volume, lambda: folder), volume)
    assert [path.name for path in folder.iterdir()] == ["volume.npy"]


@pytest.mark.parametrize("dtype", [np.uint8, np.int16, np.float32, np.float64])
def test_a_volume_of_no_file_is_written_once(tmp_path, dtype):
    volume = rough_volume(dtype=dtype, centering="node", **PLACE)
    assert_same(again(volume, lambda: tmp_path), volume)
    written = (tmp_path / "volume.npy").stat().st_mtime_ns
    again(volume, lambda: tmp_path)
    assert (tmp_path / "volume.npy").stat().st_mtime_ns == written


def test_a_volume_that_nobody_holds_is_forgotten(tmp_path):
    np.save(tmp_path / "volume.npy", np.zeros((2, 2, 2)))
    before = len(_ORIGINS)
    volume = vr.load_volume(tmp_path / "volume.npy")
    assert len(_ORIGINS) == before + 1
    del volume
    assert len(_ORIGINS) == before


def test_a_file_is_read_for_its_sha_once_for_each_of_its_states(tmp_path, monkeypatch):
    np.save(tmp_path / "volume.npy", np.zeros((2, 2, 2)))
    volume, opened, digest = vr.load_volume(tmp_path / "volume.npy"), [], references.hashlib.file_digest
    monkeypatch.setattr(references.hashlib, "file_digest", lambda *all_: opened.append(1) or digest(*all_))
    reference = refer_to_volume(volume, never)
    assert reference == refer_to_volume(volume, never)
    for _ in range(3):
        reference.file.checked()
    assert len(opened) == 1


def test_a_file_that_is_gone_or_another_is_refused_in_one_sentence(tmp_path):
    path = tmp_path / "volume.npy"
    np.save(path, np.zeros((2, 2, 2)))
    reference = refer_to_volume(vr.load_volume(path), never)
    np.save(path, np.ones((2, 2, 3)))
    with pytest.raises(
        vr.FormatError, match=r"must stay as it is while it is rendered, got SHA-256 \w{12} in"
    ):
        again_of(reference)
    path.unlink()
    message = (
        r"volume.npy must be a file that every worker can read, got No such file or directory on .*; keep it"
    )
    with pytest.raises(vr.FormatError, match=message):
        again_of(reference)


def again_of(reference):
    fetch_volume.cache_clear()
    return fetch_volume(reference)


@pytest.mark.parametrize("count", [10, 100_000])
def test_data_travel_as_they_are_or_in_a_file(tmp_path, count):
    data = {"numbers": np.random.default_rng(0).random(count), "name": "one"}
    message = pack(data, lambda: tmp_path)
    assert isinstance(message, FileReference) == (count > 10)
    assert len(pickle.dumps(message)) < 1000
    found = unpack(message)
    assert (found["name"], found["numbers"].tobytes()) == ("one", data["numbers"].tobytes())
    if count > 10:
        Path(message.path).write_bytes(b"something else")
        with pytest.raises(vr.FormatError, match="must stay as it is"):
            unpack(message)


def test_a_folder_without_room_is_refused_with_a_cure(tmp_path):
    missing = tmp_path / "missing"
    with pytest.raises(vr.FormatError, match=r"must have room .*; name another folder in VOLREF_SHARED"):
        refer_to_volume(rough_volume(), lambda: missing)
