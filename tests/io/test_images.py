"""Images: each bit depth of PNG as its specification reads it, alpha and encoding as stated."""

import struct
import zlib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from tests.bad_files import png_bytes
from volref.errors import FormatError
from volref.image import decode_rgba8, decode_srgb, encode_rgba8, encode_srgb
from volref.io import read_image, write_image, write_png

CODES = np.random.default_rng(0).integers(0, 256, (3, 5, 4), np.uint8)


def test_png_is_straight_srgb_unless_said_otherwise(tmp_path):
    write_png(tmp_path / "a.png", CODES)
    assert np.array_equal(read_image(tmp_path / "a.png"), decode_rgba8(CODES))
    assert np.array_equal(read_image(tmp_path / "a.png", encoding="none"), decode_rgba8(CODES, "none"))


def test_premultiplied_codes_are_divided_before_they_are_decoded(tmp_path):
    """A canvas holds encode(0.5) * 0.5: straight linear 0.5 at alpha 0.5 is premultiplied 0.25."""
    canvas = np.array([[[encode_srgb(np.array(0.5)) * 0.5] * 3 + [0.5]]])
    np.save(tmp_path / "a.npy", canvas)
    image = read_image(tmp_path / "a.npy", encoding="srgb", alpha="premultiplied")
    # sRGB decode of encode: the two constants of the standard agree to 1e-7 and the powers to a few ulp.
    assert np.allclose(image, [[[0.25, 0.25, 0.25, 0.5]]], rtol=0, atol=1e-7)


def test_floats_are_taken_as_they_are(tmp_path):
    image = np.random.default_rng(1).random((2, 3, 4))
    for name in ("a.npy", "a.npz"):
        write_image(tmp_path / name, image)
        assert np.array_equal(read_image(tmp_path / name), image)


@given(st.integers(0, 255), st.integers(1, 255))
def test_png_written_and_read_gives_the_same_codes(tmp_path_factory, color, alpha):
    path = tmp_path_factory.mktemp("png") / "a.png"
    codes = np.full((1, 1, 4), (color, color, color, alpha), np.uint8)
    write_image(path, decode_rgba8(codes))
    assert np.array_equal(encode_rgba8(read_image(path)), codes)


def test_grey_and_rgb_get_alpha_1(tmp_path):
    grey = CODES[..., 0]
    write_png(tmp_path / "grey.png", grey)
    write_png(tmp_path / "rgb.png", CODES[..., :3])
    for name, straight in (("grey", np.repeat(grey[..., None], 3, 2)), ("rgb", CODES[..., :3])):
        image = read_image(tmp_path / f"{name}.png")
        assert np.array_equal(image[..., :3], decode_srgb(straight / 255))
        assert (image[..., 3] == 1).all()


def test_16_bit_grey_keeps_both_bytes(tmp_path):
    codes = np.array([[0, 1, 256, 65535]], np.uint16)
    write_png(tmp_path / "a.png", codes)
    image = read_image(tmp_path / "a.png", encoding="none")
    assert np.array_equal(image[..., 0], codes / 65535)


@pytest.mark.parametrize("color_type", [2, 4, 6])
def test_16_bit_colour_which_pillow_reads_by_dropping_the_low_byte_is_refused(tmp_path, color_type):
    (tmp_path / "a.png").write_bytes(png_bytes(2, 2, 16, color_type))
    with Image.open(tmp_path / "a.png") as image:
        assert np.asarray(image).dtype == np.uint8  # the trap itself
    with pytest.raises(FormatError, match="must have 8 bits per sample"):
        read_image(tmp_path / "a.png")


@pytest.mark.parametrize(("depth", "codes"), [(1, [0, 255]), (2, [0, 85, 170, 255]), (4, [0, 17, 34, 51])])
def test_grey_of_few_bits_is_stretched_to_the_whole_range(tmp_path, depth, codes):
    bits = "".join(format(i, f"0{depth}b") for i in range(len(codes))).ljust(16, "0")
    row = bytes(int(bits[i : i + 8], 2) for i in range(0, (len(codes) * depth + 7) // 8 * 8, 8))
    (tmp_path / "a.png").write_bytes(png_bytes(len(codes), 1, depth, 0, rows=b"\0" + row))
    assert (read_image(tmp_path / "a.png", encoding="none")[0, :, 0] * 255).round().tolist() == codes


def test_a_transparent_colour_of_a_palette_becomes_alpha_0(tmp_path):
    image = Image.new("P", (2, 1))
    image.putpalette([255, 0, 0, 0, 255, 0])
    image.putdata([0, 1])
    image.save(tmp_path / "a.png", transparency=1)
    assert read_image(tmp_path / "a.png").tolist() == [[[1, 0, 0, 1], [0, 0, 0, 0]]]


def test_a_header_that_promises_more_than_the_file_can_hold_is_refused_at_once(tmp_path):
    header = struct.pack(">IIBBBBB", 2**31 - 1, 2**31 - 1, 8, 6, 0, 0, 0)
    chunk = struct.pack(">I", 13) + b"IHDR" + header + struct.pack(">I", zlib.crc32(b"IHDR" + header))
    (tmp_path / "a.png").write_bytes(b"\x89PNG\r\n\x1a\n" + chunk)
    with pytest.raises(FormatError, match="compressed bytes, which cannot"):
        read_image(tmp_path / "a.png")


@pytest.mark.parametrize(
    ("color_type", "depth", "side"), [(0, 16, 300), (2, 8, 220), (4, 8, 300), (6, 8, 200)]
)
def test_the_promise_of_a_header_counts_every_sample_of_a_pixel(tmp_path, color_type, depth, side):
    """One byte a pixel would fit in what so short a stream can hold at best; all its samples do not."""
    data = png_bytes(side, side, depth, color_type, rows=b"\0")
    samples = {0: 1, 2: 3, 4: 2, 6: 4}[color_type] * depth // 8
    assert side**2 < 1032 * len(data) + 2**16 < samples * side**2
    (tmp_path / "a.png").write_bytes(data)
    with pytest.raises(
        FormatError, match=f"must hold {samples * side**2} bytes .* compressed bytes, which cannot"
    ):
        read_image(tmp_path / "a.png")
