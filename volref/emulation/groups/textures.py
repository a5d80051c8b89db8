"""The volume and the transfer function as textures."""

from dataclasses import dataclass
from typing import Annotated

from volref.emulation.groups.words import FILTERS, STORED
from volref.emulation.switches import Flag, Real, Switches, Whole, Word


@dataclass(frozen=True)
class VolumeTexture(Switches, group="pipeline.volume"):
    """How the volume lies in textures, and how a position becomes texture coordinates."""

    layout: Annotated[
        str,
        Word(
            "what kind of texture", {"3d": "a 3-D texture", "atlas": "slices side by side in a 2-D texture"}
        ),
    ] = "3d"
    format: Annotated[
        str,
        Word(
            "what a texel holds", {**STORED, "unorm16-split": "16 bits in two 8-bit channels, high and low"}
        ),
    ] = "unorm8"
    channel: Annotated[
        str,
        Word(
            "where in the uploaded image the value is",
            {"red": "R8, or the red of RGBA8", "alpha": "A8, or the alpha of RGBA8"},
        ),
    ] = "red"
    filter: Annotated[str, Word("how texels are fetched", FILTERS)] = "linear"
    reach: Annotated[
        str,
        Word(
            "what 0 and 1 of the box are in the texture",
            {"faces": "its edges", "centers": "the centres of its outer voxels"},
        ),
    ] = "faces"
    shift: Annotated[
        float, Real("voxels by which each sample is read further along all axes", low=-1e4, high=1e4)
    ] = 0.0
    brick: Annotated[
        int | None,
        Whole("voxels along a side of bricks that know nothing of their neighbours (None: one brick)", low=1),
    ] = None
    tiles_across: Annotated[
        int | None, Whole("tiles in a row of an atlas (None: as square as can be)", low=1)
    ] = None
    first_tile: Annotated[
        str,
        Word(
            "where the atlas begins", {"v0": "with the row of tiles at v = 0", "v1": "with the row at v = 1"}
        ),
    ] = "v0"
    rows: Annotated[
        str,
        Word("which way y runs in a tile", {"with-v": "y grows with v", "against-v": "y grows against v"}),
    ] = "with-v"
    padding: Annotated[int, Whole("texels around each tile that repeat its border", high=64)] = 0
    in_tile: Annotated[
        str,
        Word(
            "what happens at the border of a tile",
            {
                "bleeds": "nothing: a linear filter reads the neighbour tile",
                "clamped": "coordinates are held half a texel inside",
            },
        ),
    ] = "bleeds"
    slices: Annotated[
        str,
        Word(
            "which slice a z of 0..1 means, N slices",
            {
                "count": "z N: slice i lies at i / N",
                "last": "z (N - 1): slice i lies at i / (N - 1)",
                "centers": "z N - 1/2: slice i lies at (i + 1/2) / N",
            },
        ),
    ] = "centers"
    second_slice: Annotated[
        str,
        Word(
            "the slice after the last",
            {"clamped": "is the last again", "unclamped": "is the next tile, empty or outside the atlas"},
        ),
    ] = "clamped"
    between: Annotated[
        str,
        Word(
            "how two slices are mixed",
            {
                "z": "by the fraction of z",
                "x": "by x N - s1, as seed 001 prints eq. 17",
                "none": "not at all: the first is taken",
            },
        ),
    ] = "z"
    tile_row: Annotated[
        str,
        Word(
            "how the row of a slice's tile is found, M tiles across and P down",
            {
                "columns": "floor(s / M) / P",
                "rows": "floor(s / P) / P: right for as many rows as columns only",
                "printed": "fract(s / P) / P, as seed 001 prints eq. 8 and 10",
            },
        ),
    ] = "columns"
    tile_column: Annotated[
        str,
        Word(
            "how the column of a slice's tile is found",
            {"fract": "fract(s / M)", "mod": "mod(s, M) / M: rounded once only"},
        ),
    ] = "fract"
    second_column: Annotated[
        str,
        Word(
            "how the column of the second slice's tile is found",
            {"fract": "fract(s2 / M)", "printed": "floor(s2 / M), as seed 001 prints eq. 9"},
        ),
    ] = "fract"
    geometry: Annotated[
        str,
        Word(
            "what the axes of the texture are",
            {
                "box": "x, y and z of the box",
                "spherical": "azimuth, range and sweep of a radar, eq. 18 to 20 put right",
                "spherical-printed": "the same with eq. 18 to 20 as seed 001 prints them",
            },
        ),
    ] = "box"
    seam: Annotated[
        str,
        Word(
            "what lies beyond the first and the last azimuth of a radar's texture",
            {
                "clamped": "its edge: between the last column and the first nothing is interpolated",
                "wrapped": "a copy of the column at the other end",
            },
        ),
    ] = "clamped"


@dataclass(frozen=True)
class TableTexture(Switches, group="pipeline.table"):
    """The transfer function as a texture."""

    size: Annotated[int, Whole("entries along the value", low=2, high=1 << 16)] = 256
    rows: Annotated[int, Whole("entries along the gradient magnitude, 1 for none", low=1, high=4096)] = 1
    steepest: Annotated[
        float | None,
        Real(
            "the gradient's magnitude, in value units per world unit, that v = 1 stands for in the rows "
            "(None: that of |g| = 1 in a gradient texture)",
            low=1e-30,
        ),
    ] = None
    format: Annotated[str, Word("what an entry holds", STORED)] = "unorm8"
    opacity_format: Annotated[
        str | None,
        Word("what holds its opacity, if that is a texture of its own, vtk.js (None: none)", STORED),
    ] = None
    filter: Annotated[
        str,
        Word(
            "how entries are fetched",
            {**FILTERS, "linear-mipmap": "linear, between mip levels as GL chooses"},
        ),
    ] = "linear"
    baked: Annotated[
        str,
        Word(
            "which value entry k of n stands for",
            {
                "centers": "(k + 1/2) / n of the domain",
                "ends": "k / (n - 1) of the domain",
                "canvas": "what the first row of a canvas n by 20 has of a gradient between its corners",
            },
        ),
    ] = "centers"
    coordinate: Annotated[
        str,
        Word(
            "where a value v of 0..1 is looked up",
            {"direct": "at v", "centered": "at (v (n - 1) + 1/2) / n"},
        ),
    ] = "direct"
    shift: Annotated[float, Real("entries by which it is read further", low=-1e4, high=1e4)] = 0.0
    premultiplied: Annotated[bool, Flag("whether its colours are multiplied by its opacity")] = False
    srgb: Annotated[bool, Flag("whether the texture decodes its colours from sRGB")] = False
    last_column: Annotated[
        str,
        Word(
            "what the last entry holds",
            {"filled": "its colour", "empty": "nothing: a canvas not filled to its end"},
        ),
    ] = "filled"
    order: Annotated[
        str,
        Word(
            "when values are classified",
            {
                "post": "after all interpolation",
                "per-slice": "in each of two slices, then mixed",
                "pre": "in the voxels, before they are uploaded",
            },
        ),
    ] = "post"
