"""Noise textures from files."""

import numpy as np
import pytest

from volref import FormatError, load_jitter
from volref.io import write_png

CODES = np.array([[0, 51, 255], [102, 153, 204]], np.uint8)


def test_a_grey_png_is_read_as_a_texture_unit_reads_it(tmp_path):
    write_png(tmp_path / "a.png", CODES)
    write_png(tmp_path / "b.png", np.repeat(CODES[..., None], 3, axis=2))
    write_png(tmp_path / "c.png", CODES.astype(np.uint16) * 257)
    for name in ("a.png", "b.png", "c.png"):
        assert np.array_equal(load_jitter(tmp_path / name), CODES[None] / 255)


@pytest.mark.parametrize("frames", [CODES / 256, np.random.default_rng(0).random((3, 2, 4)), CODES])
def test_an_npy_holds_one_frame_or_several(tmp_path, frames):
    np.save(tmp_path / "a.npy", frames)
    expected = frames / 255 if frames.dtype == np.uint8 else frames
    assert np.array_equal(load_jitter(tmp_path / "a.npy"), expected.reshape(-1, *frames.shape[-2:]))


@pytest.mark.parametrize(
    ("array", "fragment"),
    [
        (np.array([[0.0, 1.5]]), "must hold offsets from 0 to 1, got 0 to 1.5"),
        (np.array([[-0.1]]), "must hold offsets from 0 to 1"),
        (np.array([0.5]), "must hold offsets (height, width)"),
        (np.array([[1, 0]]), "of floats or unsigned integers, got int64"),
        (np.array([[np.nan]]), "must be finite"),
    ],
)
def test_what_is_no_image_of_offsets_is_refused(tmp_path, array, fragment):
    np.save(tmp_path / "a.npy", array)
    with pytest.raises(ValueError, match=r".*") as refusal:
        load_jitter(tmp_path / "a.npy")
    assert fragment in str(refusal.value)


def test_colours_and_other_files_are_refused(tmp_path):
    write_png(tmp_path / "a.png", np.dstack([CODES, CODES, CODES[::-1]]))
    with pytest.raises(FormatError, match="must be grey, got colours"):
        load_jitter(tmp_path / "a.png")
    (tmp_path / "a.jpg").write_bytes(b"x")
    with pytest.raises(FormatError, match=r"must end in \.png or \.npy"):
        load_jitter(tmp_path / "a.jpg")
