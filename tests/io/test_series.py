"""Series from files: their order, and that no more than two are in memory."""

import gc
import weakref

import numpy as np
import pytest

from tests.scenes import rough_volume
from volref import FormatError, SceneError, load_series, save_volume

VOLUMES = [rough_volume(seed, dtype=np.uint8, spacing=(1, 2, 3)) for seed in range(4)]


@pytest.fixture
def folder(tmp_path):
    """Four volumes, written in another order than that of their names; each .npy has a .json beside it."""
    for i in (2, 0, 3, 1):
        save_volume(VOLUMES[i], tmp_path / f"frame_{i:02d}.npy")
    return tmp_path


def radar_arrays(**more):
    codes = np.arange(2 * 2 * 3 * 4, dtype=np.uint8).reshape(2, 2, 3, 4)
    arrays = {"codes": codes, "gain": 0.5, "offset": -32.0, "undetect": 0, "elangle": [1.0, 2.0]}
    return arrays | {"rstart_m": 0.0, "rscale_m": 1000.0} | more


def test_a_folder_is_taken_in_the_order_of_its_names(folder):
    series = load_series(folder)
    assert series.times.tolist() == [0, 1, 2, 3]
    for i, volume in enumerate(VOLUMES):
        found = series.at(i)
        assert np.array_equal(found.values, volume.values)
        assert found.spacing == (1, 2, 3)


def test_a_list_is_taken_as_it_is_with_its_times(folder):
    files = [folder / "frame_03.npy", str(folder / "frame_01.npy")]
    series = load_series(files, [10, 70])
    assert np.array_equal(series.at(10).values, VOLUMES[3].values)
    assert np.array_equal(series.at(70).values, VOLUMES[1].values)


def test_what_is_stated_holds_for_every_file(folder):
    series = load_series(folder, spacing=(4, 5, 6))
    assert [series.at(i).spacing for i in range(4)] == [(4, 5, 6)] * 4


def test_the_last_two_volumes_stay_in_memory_and_no_more(folder):
    series = load_series(folder)
    first, second = series.at(0), series.at(1)
    assert series.at(0) is first
    assert series.at(1) is second
    gone = weakref.ref(first)
    series.at(2), series.at(3)
    del first
    gc.collect()
    assert gone() is None


def test_a_radar_file_with_an_axis_of_time_is_a_series(tmp_path):
    np.savez(tmp_path / "radar.npz", **radar_arrays())
    series = load_series(tmp_path / "radar.npz", [0, 300])
    for i, time in enumerate((0, 300)):
        codes = radar_arrays()["codes"][i]
        assert np.array_equal(series.at(time).sweeps[1].values, codes[1] * 0.5 - 32)


def test_radars_are_read_from_a_folder(tmp_path):
    for i in range(2):
        np.savez(tmp_path / f"radar_{i}.npz", **radar_arrays(codes=radar_arrays()["codes"][i]))
    (tmp_path / "radar_0.npz.json").write_text("{}")
    series = load_series(tmp_path, kind="radar")
    assert series.times.tolist() == [0, 1]
    assert series.at(1).sweeps[0].values[0, 0] == 24 * 0.5 - 32


def test_a_missing_file_is_told_when_it_is_needed(folder):
    series = load_series(folder)
    (folder / "frame_02.npy").unlink()
    series.at(1)
    with pytest.raises(FormatError, match=r"frame_02\.npy must be"):
        series.at(2)


def test_what_is_no_series_is_refused_in_one_sentence(folder, tmp_path_factory):
    empty = tmp_path_factory.mktemp("empty")
    for call, error, fragment in [
        (lambda: load_series(empty), FormatError, "got none that end in .npy"),
        (lambda: load_series(empty, kind="radar"), FormatError, "got none that end in .npz"),
        (lambda: load_series(empty / "none"), FormatError, "must be a file that exists"),
        (lambda: load_series([]), FormatError, "must have at least one file"),
        (lambda: load_series(folder, kind="mesh"), SceneError, "kind must be 'volume' or 'radar'"),
        (lambda: load_series(folder, [0, 1]), SceneError, "series.times must have shape (4), got (2)"),
        (lambda: load_series(folder, [0, 1, 3, 2]), SceneError, "series.times must rise"),
    ]:
        with pytest.raises(error) as refusal:
            call()
        assert fragment in str(refusal.value)
    (folder / "other.nrrd").write_bytes(b"NRRD")
    with pytest.raises(FormatError, match=r"files of one format, got \.npy, \.nrrd"):
        load_series(folder)
