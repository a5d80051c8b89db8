"""Slice atlases: the slices of a volume side by side in one PNG, as WebGL 1 programs upload them.

Four slices in 2 tiles across and 2 down, `first_tile` "top" (the first row of tiles is the top one):

    +---+---+
    | 0 | 1 |      slice s lies in column s mod 2, row s div 2 counted from the top
    +---+---+      ("bottom": counted from the bottom)
    | 2 | 3 |
    +---+---+

`rows` says which way y grows inside a tile: "down" (the tile's top row is y = 0) or "up" (its bottom row
is; what a program sees that uploads with UNPACK_FLIP_Y_WEBGL).  `padding` is the number of pixels around
every tile on each side, so tiles stand 2 padding pixels apart; they are skipped when reading and repeat the
tile's edge when writing, which keeps a linear filter from bleeding.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from volref.arrays import Numbers, one_of, whole_number
from volref.errors import FormatError
from volref.io.png import read_png, write_png

CHANNELS = ("grey", "red", "green", "blue", "alpha")
COLUMN = {"red": 0, "green": 1, "blue": 2, "alpha": 3}
LARGEST_COUNT = 2**24


@dataclass(frozen=True)
class AtlasLayout:
    """How the slices of a volume lie in an image; see the head of this module."""

    tiles_across: int
    tiles_down: int
    slices: int
    first_tile: str = "top"
    rows: str = "down"
    channel: str = "grey"
    padding: int = 0

    def __post_init__(self) -> None:
        """Refuse a layout with no room for its slices."""
        for name in ("tiles_across", "tiles_down", "slices"):
            whole_number(f"atlas.{name}", getattr(self, name), low=1, high=LARGEST_COUNT)
        whole_number("atlas.padding", self.padding, low=0, high=LARGEST_COUNT)
        one_of("atlas.first_tile", self.first_tile, ("top", "bottom"))
        one_of("atlas.rows", self.rows, ("down", "up"))
        one_of("atlas.channel", self.channel, CHANNELS)
        room = self.tiles_across * self.tiles_down
        if self.slices > room:
            message = f"atlas.slices must be at most tiles_across x tiles_down = {room}, got {self.slices}; "
            raise FormatError(message + "add tiles or drop slices")


def read_atlas(path: str | Path, layout: AtlasLayout, max_bytes: int) -> Numbers:
    """Return the slices (nz, ny, nx) of a PNG atlas, uint8 or uint16.

    Raises
    ------
    FormatError
        If the image does not divide into the tiles, or the channel asked for is not the one that varies
        ("grey" of an image whose colours differ).
    """
    name = Path(path).name
    image = _channel(name, read_png(path, max_bytes), layout.channel)
    height, width = image.shape
    across, down, border = layout.tiles_across, layout.tiles_down, 2 * layout.padding
    if width % across or height % down or min(width // across, height // down) <= border:
        message = f"{name} must divide into {across} x {down} tiles with padding {layout.padding}, got "
        raise FormatError(message + f"{width} x {height} pixels; check tiles_across, tiles_down and padding")
    return slices_of_tiles(image, layout)


def slices_of_tiles(image: Numbers, layout: AtlasLayout) -> Numbers:
    """Return the slices (nz, ny, nx) of an atlas image (height, width).

    Examples
    --------
    >>> slices_of_tiles(np.array([[1, 2], [3, 4]]), AtlasLayout(2, 1, 2)).tolist()
    [[[1], [3]], [[2], [4]]]
    """
    across, down, pad = layout.tiles_across, layout.tiles_down, layout.padding
    height, width = image.shape[0] // down, image.shape[1] // across
    tiles = image.reshape(down, height, across, width)
    tiles = tiles[::-1] if layout.first_tile == "bottom" else tiles
    slices = tiles.transpose(0, 2, 1, 3).reshape(-1, height, width)[: layout.slices]
    slices = slices[:, pad : height - pad, pad : width - pad]
    return np.ascontiguousarray(slices[:, ::-1] if layout.rows == "up" else slices)


def tiles_of_slices(values: Numbers, layout: AtlasLayout) -> Numbers:
    """Return the atlas image (height, width) of slices (nz, ny, nx); undoes `slices_of_tiles`.

    Examples
    --------
    >>> tiles_of_slices(np.array([[[1], [3]], [[2], [4]]]), AtlasLayout(2, 1, 2)).tolist()
    [[1, 2], [3, 4]]
    """
    across, down, pad = layout.tiles_across, layout.tiles_down, layout.padding
    slices = values[:, ::-1] if layout.rows == "up" else values
    slices = np.pad(slices, ((0, 0), (pad, pad), (pad, pad)), mode="edge")
    empty = across * down - len(slices)
    tiles = np.pad(slices, ((0, empty), (0, 0), (0, 0)))
    height, width = tiles.shape[1:]
    tiles = tiles.reshape(down, across, height, width).transpose(0, 2, 1, 3)
    tiles = tiles[::-1] if layout.first_tile == "bottom" else tiles
    return tiles.reshape(down * height, across * width)


def write_atlas(path: str | Path, values: Numbers, layout: AtlasLayout, *, overwrite: bool = False) -> None:
    """Write slices (nz, ny, nx) of uint8 (or uint16, in grey) as a PNG atlas.

    In a colour channel the others are 0; with "alpha" the colours are 255, so that nothing is lost to a
    browser that premultiplies.

    Raises
    ------
    FormatError
        If the values are of another type.
    """
    deep = values.dtype == np.uint16 and layout.channel == "grey"
    if values.dtype != np.uint8 and not deep:
        message = f"atlas values must be uint8, or uint16 in channel 'grey', got {values.dtype} in channel "
        raise FormatError(message + f"{layout.channel!r}; rescale them to codes first")
    image = tiles_of_slices(values, layout)
    if layout.channel != "grey":
        codes = np.zeros((*image.shape, 4 if layout.channel == "alpha" else 3), np.uint8)
        codes[..., :3] = 255 if layout.channel == "alpha" else 0
        codes[..., COLUMN[layout.channel]] = image
        image = codes
    write_png(path, image, overwrite=overwrite)


def square_layout(slices: int) -> AtlasLayout:
    """Return the layout nearest to as many tiles across as down.

    Examples
    --------
    >>> layout = square_layout(5)
    >>> layout.tiles_across, layout.tiles_down
    (3, 2)
    """
    across = int(np.ceil(np.sqrt(slices)))
    return AtlasLayout(across, -(-slices // across), slices)


def _channel(name: str, image: Numbers, channel: str) -> Numbers:
    if image.ndim == 2:
        if channel != "grey":
            message = f"{name} must have the atlas.channel {channel!r}, got a grey image; use 'grey'"
            raise FormatError(message)
        return image
    if channel != "grey":
        return np.asarray(image[..., COLUMN[channel]])
    if (image[..., :3] != image[..., :1]).any():
        message = f"{name} must be grey for atlas.channel 'grey', got colours that differ; "
        raise FormatError(message + "choose 'red', 'green', 'blue' or 'alpha'")
    return np.asarray(image[..., 0])
