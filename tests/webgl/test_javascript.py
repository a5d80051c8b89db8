"""volref's ES modules: arrays as NumPy writes them, and the verdicts of Python."""

import io

import numpy as np
import pytest

from tests.webgl.modules import ModuleError

READ = """
    const { shape, data, type } = v.readNpy(new Uint8Array(given));
    const text = (number) => (Number.isFinite(number) ? number : `${number}`);
    const again = Array.from(v.writeNpy({ shape, data, type }));
    return { shape, type, data: Array.from(data, text), again };
"""


def npy(array, **more):
    file = io.BytesIO()
    np.save(file, array, **more)
    return list(file.getvalue())


@pytest.mark.parametrize("dtype", ["|b1", "|u1", "<i2", "<u2", "<i4", "<f4", "<f8"])
@pytest.mark.parametrize("shape", [(), (3,), (2, 3), (5, 7, 4)])
def test_arrays_go_both_ways_byte_for_byte(page, dtype, shape):
    array = (
        (np.random.default_rng(5).normal(size=shape) * 300).astype(np.float32).astype(np.int32).astype(dtype)
    )
    got = page.run(READ, npy(array))
    assert got["shape"] == list(shape)
    assert got["type"] == dtype
    np.testing.assert_array_equal(np.array(got["data"], dtype).reshape(shape), array)
    assert got["again"] == npy(array)


def test_floats_arrive_with_all_their_digits(page):
    array = np.array([0.1, -0.0, 1e-310, np.pi, 1.7976931348623157e308, np.inf, np.nan])
    got = page.run(READ, npy(array))
    np.testing.assert_array_equal([float(n) for n in got["data"]], array)
    assert got["again"] == npy(array)


@pytest.mark.parametrize(
    ("file", "sentence"),
    [
        (npy(np.zeros(3))[:-1], r"must hold 24 bytes of numbers \(3 <f8\), got 23"),
        ([*npy(np.zeros(3)), 0], "must hold 24 bytes of numbers .*, got 25"),
        (npy(np.zeros(3))[:60], "must hold its header of 118 bytes, got 50; the file is cut short"),
        (npy(np.zeros((3, 2)).T), "must be in C order, got Fortran order"),
        (npy(np.zeros(3, ">f8")), "must have numbers of type .*, got >f8"),
        (npy(np.array([None]), allow_pickle=True), r"must have numbers of type .*, got \|O"),
        (npy(np.zeros(1, [("a", "<f4")])), "must hold plain numbers, got the header"),
        ([80, 75, 3, 4] * 10, r"must be a \.npy file of version 1 or 2, got other bytes"),
        ([], r"must be a \.npy file of version 1 or 2, got other bytes"),
    ],
)
def test_a_file_that_is_no_plain_array_is_refused(page, file, sentence):
    with pytest.raises(ModuleError, match=sentence):
        page.run("return v.readNpy(new Uint8Array(given), 'a.npy');", file)


def test_an_array_that_is_not_of_its_shape_is_not_written(page):
    with pytest.raises(ModuleError, match=r"must hold 6 numbers \(2 x 3\), got 5"):
        page.run("v.writeNpy({ shape: [2, 3], data: new Float32Array(5) });")
    with pytest.raises(ModuleError, match=r"must be a typed array of type .*, got BigInt64Array"):
        page.run("v.writeNpy({ shape: [5], data: new BigInt64Array(5) });")
