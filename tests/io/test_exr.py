"""EXR images: float32, premultiplied, as OpenEXR itself reads and writes them."""

import numpy as np
import OpenEXR
import pytest

from tests.scenes import rough_scene
from volref.cli import main
from volref.errors import FormatError
from volref.io import read_image, save_scene, write_image

IMAGE = np.random.default_rng(3).random((3, 5, 4)) * [4, 4, 4, 1]


def test_openexr_reads_what_write_image_writes(tmp_path):
    write_image(tmp_path / "a.exr", IMAGE)
    with OpenEXR.File(str(tmp_path / "a.exr")) as theirs:
        assert np.array_equal(theirs.channels()["RGBA"].pixels, IMAGE.astype(np.float32))
    assert np.array_equal(read_image(tmp_path / "a.exr"), IMAGE.astype(np.float32))


@pytest.mark.parametrize("dtype", [np.float16, np.float32])
@pytest.mark.parametrize(
    "compression", ["NO_COMPRESSION", "PIZ_COMPRESSION", "ZIPS_COMPRESSION", "RLE_COMPRESSION"]
)
def test_read_image_reads_what_openexr_writes(tmp_path, dtype, compression):
    pixels = IMAGE.astype(dtype)
    header = {"compression": getattr(OpenEXR, compression), "type": OpenEXR.scanlineimage}
    OpenEXR.File(header, {"RGBA": pixels}).write(str(tmp_path / "a.exr"))
    assert np.array_equal(read_image(tmp_path / "a.exr"), pixels)


def test_colour_without_alpha_is_opaque_and_luminance_is_grey(tmp_path):
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    OpenEXR.File(header, {"RGB": IMAGE[..., :3].astype(np.float32)}).write(str(tmp_path / "c.exr"))
    assert np.array_equal(read_image(tmp_path / "c.exr")[..., 3], np.ones((3, 5)))
    OpenEXR.File(header, {"Y": IMAGE[..., 0].astype(np.float32)}).write(str(tmp_path / "y.exr"))
    assert np.array_equal(read_image(tmp_path / "y.exr")[..., 2], IMAGE[..., 0].astype(np.float32))


def test_render_writes_exr(tmp_path):
    save_scene(rough_scene(12, 8), tmp_path / "s.json")
    for name in ("a.exr", "a.npy"):
        assert main(["render", str(tmp_path / "s.json"), "-q", "-o", str(tmp_path / name)]) == 0
    exact = read_image(tmp_path / "a.npy")
    assert np.array_equal(read_image(tmp_path / "a.exr"), exact.astype(np.float32))


def test_an_exr_that_exists_is_kept(tmp_path):
    (tmp_path / "a.exr").write_bytes(b"old")
    with pytest.raises(FormatError, match="must not exist yet"):
        write_image(tmp_path / "a.exr", IMAGE)
    assert [file.name for file in tmp_path.iterdir()] == ["a.exr"]
    assert (tmp_path / "a.exr").read_bytes() == b"old"
