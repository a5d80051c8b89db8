"""Archives: what numpy writes is read, what volref writes numpy reads, and equal arrays give equal files."""

import numpy as np

from volref.io.npy import npz_headers, read_npz, write_npz

ARRAYS = {"a": np.arange(6.0).reshape(2, 3), "word": np.array("clamp"), "one": np.array(3)}


def test_numpy_reads_what_is_written(tmp_path):
    write_npz(tmp_path / "a.npz", ARRAYS)
    with np.load(tmp_path / "a.npz") as archive:
        assert {name: archive[name].tolist() for name in archive} == {
            n: a.tolist() for n, a in ARRAYS.items()
        }


def test_what_numpy_writes_is_read(tmp_path):
    np.savez_compressed(tmp_path / "a.npz", **ARRAYS)
    again = read_npz(tmp_path / "a.npz", ("a", "word", "one", "missing"), 2**20)
    assert {name: a.tolist() for name, a in again.items()} == {n: a.tolist() for n, a in ARRAYS.items()}
    assert npz_headers(tmp_path / "a.npz")["a"].shape == (2, 3)


def test_equal_arrays_give_equal_bytes(tmp_path):
    for name in ("a", "b"):
        write_npz(tmp_path / f"{name}.npz", ARRAYS)
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()
