"""Slice atlases against a pixel-by-pixel reading of their definition."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from volref.errors import FormatError
from volref.io import AtlasLayout, load_volume, save_volume
from volref.io.atlas import slices_of_tiles, tiles_of_slices
from volref.scene import Volume


@st.composite
def atlases(draw):
    across, down = draw(st.integers(1, 4)), draw(st.integers(1, 4))
    layout = AtlasLayout(
        across,
        down,
        draw(st.integers(1, across * down)),
        draw(st.sampled_from(["top", "bottom"])),
        draw(st.sampled_from(["down", "up"])),
        padding=draw(st.integers(0, 2)),
    )
    shape = layout.slices, draw(st.integers(1, 4)), draw(st.integers(1, 4))
    return layout, np.random.default_rng(draw(st.integers(0, 99))).integers(0, 256, shape, np.uint8)


def pixel_of_voxel(x, y, z, size, layout):
    """Scalar oracle: column and row from the top left of the pixel that holds voxel (x, y, z)."""
    nx, ny, _ = size
    cell_width, cell_height = nx + 2 * layout.padding, ny + 2 * layout.padding
    tile_column, tile_row = z % layout.tiles_across, z // layout.tiles_across
    if layout.first_tile == "bottom":
        tile_row = layout.tiles_down - 1 - tile_row
    row = y if layout.rows == "down" else ny - 1 - y
    return tile_column * cell_width + layout.padding + x, tile_row * cell_height + layout.padding + row


@given(atlases())
def test_each_voxel_is_at_the_pixel_that_the_definition_names(case):
    layout, values = case
    image = tiles_of_slices(values, layout)
    nz, ny, nx = values.shape
    for z in range(nz):
        for y in range(ny):
            for x in range(nx):
                column, row = pixel_of_voxel(x, y, z, (nx, ny, nz), layout)
                assert image[row, column] == values[z, y, x]


@given(atlases())
def test_reading_undoes_writing(case):
    layout, values = case
    assert np.array_equal(slices_of_tiles(tiles_of_slices(values, layout), layout), values)


def test_padding_repeats_the_edge_of_its_own_tile():
    values = np.array([[[1, 2]], [[3, 4]]], np.uint8)
    image = tiles_of_slices(values, AtlasLayout(2, 1, 2, padding=1))
    assert image.tolist() == [[1, 1, 2, 2, 3, 3, 4, 4]] * 3


def test_the_seed_layout_puts_slice_s_at_s_mod_m_with_y_upwards():
    """Three slices of 1 x 2 in 2 x 2 tiles, first tile top, rows up: y = 0 is the tile's lower row."""
    values = np.array([[[1], [2]], [[3], [4]], [[5], [6]]], np.uint8)
    image = tiles_of_slices(values, AtlasLayout(2, 2, 3, "top", "up"))
    assert image.tolist() == [[2, 4], [1, 3], [6, 0], [5, 0]]


@pytest.mark.parametrize("channel", ["grey", "red", "green", "blue", "alpha"])
def test_an_atlas_in_any_channel_comes_back_through_png(tmp_path, channel):
    values = np.random.default_rng(1).integers(0, 256, (5, 3, 4), np.uint8)
    volume = Volume(values, (1, 2, 3), (4, 5, 6), centering="node")
    layout = AtlasLayout(3, 2, 5, "bottom", "up", channel, 1)
    save_volume(volume, tmp_path / "a.png", layout=layout)
    again = load_volume(tmp_path / "a.png")
    assert np.array_equal(again.values, values)
    assert again.world_from_index.tolist() == volume.world_from_index.tolist()
    assert again.centering == "node"


def test_sixteen_bit_grey_atlases_are_exact(tmp_path):
    values = np.arange(24, dtype=np.uint16).reshape(2, 3, 4) * 2731
    save_volume(Volume(values), tmp_path / "a.png")
    assert np.array_equal(load_volume(tmp_path / "a.png").values, values)


def test_an_atlas_that_pillow_takes_for_a_bomb_is_read(tmp_path, monkeypatch):
    """16384 x 16384 pixels are over Pillow's own limit and a common texture; here the limit is lowered."""
    Image.new("L", (32, 32), 7).save(tmp_path / "a.png")
    monkeypatch.setattr(Image, "MAX_IMAGE_PIXELS", 100)
    with pytest.raises(Image.DecompressionBombError):
        Image.open(tmp_path / "a.png")
    assert load_volume(tmp_path / "a.png", tiles_across=2, tiles_down=2, slices=1).size == (16, 16, 1)


@pytest.mark.parametrize(
    ("change", "fragment"),
    [
        ({"slices": 7}, "atlas.slices must be at most tiles_across x tiles_down = 6, got 7"),
        ({"tiles_across": 5}, "must divide into 5 x 2 tiles"),
        ({"padding": 1}, "with padding 1, got 6 x 4 pixels"),
        ({"channel": "lightness"}, "atlas.channel must be"),
    ],
)
def test_a_layout_that_does_not_fit_is_refused(tmp_path, change, fragment):
    Image.fromarray(np.zeros((4, 6), np.uint8)).save(tmp_path / "a.png")
    with pytest.raises(ValueError, match=fragment.replace("(", r"\(")):
        load_volume(tmp_path / "a.png", **{"tiles_across": 3, "tiles_down": 2, "slices": 6, **change})


def test_colours_that_differ_are_no_grey_atlas(tmp_path):
    codes = np.zeros((2, 2, 3), np.uint8)
    codes[0, 0] = 1, 2, 3
    Image.fromarray(codes).save(tmp_path / "a.png")
    with pytest.raises(FormatError, match="choose 'red'"):
        load_volume(tmp_path / "a.png", tiles_across=1, tiles_down=1, slices=1)
