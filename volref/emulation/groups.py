"""The decisions of a GPU program that draws a volume, as groups of switches.

`volref/emulation/pipeline.py` puts them together, in the order in which a program takes them.
"""

from dataclasses import dataclass
from typing import Annotated

from volref.emulation.switches import Flag, Real, Switches, Whole, Word
from volref.errors import SceneError

STORED = {
    "unorm8": "8 bits from 0 to 1",
    "half": "16-bit floating point",
    "float": "32-bit floating point",
    "exact": "64-bit floating point, what no GPU has",
}
FILTERS = {"nearest": "the texel that holds the coordinate", "linear": "between the texels around it"}


@dataclass(frozen=True)
class RaySetup(Switches):
    """Where rays enter and leave the box."""

    kind: Annotated[
        str,
        Word(
            "where entry and exit come from",
            {
                "coordinates": "two passes: the box's faces are drawn with texture coordinates as colours",
                "front-face": "one pass: the entry is the varying of the front faces, the rest the eye's",
                "slab": "a test of the ray against the box's six planes",
            },
        ),
    ] = "slab"
    direction: Annotated[
        str,
        Word(
            "how the direction of a slab test's ray is made",
            {
                "eye": "from the eye through the pixel; with parallel rays from the near plane",
                "unproject": "from the near to the far plane, by the inverse of the matrices",
                "focal": "(ndc x times aspect, ndc y, -focal length), turned into the world",
                "focal-square": "(ndc x, ndc y, -focal length): right for square images only",
            },
        ),
    ] = "eye"
    front: Annotated[
        str,
        Word(
            "where two passes take the entry from",
            {"target": "a target of its own, as the exit", "varying": "the varying of the faces being drawn"},
        ),
    ] = "target"
    no_exit: Annotated[
        str,
        Word(
            "what happens where the exit's target has x and y of 0: mostly, where nothing was drawn",
            {"walked": "the ray is walked", "left": "the fragment is transparent black, seed 002"},
        ),
    ] = "walked"
    format: Annotated[str, Word("what a coordinate target holds", STORED)] = "float"
    filter: Annotated[str, Word("how a coordinate target is read", FILTERS)] = "nearest"


@dataclass(frozen=True)
class Stepping(Switches):
    """Where the samples of a ray lie, and what ends it."""

    rule: Annotated[
        str,
        Word(
            "what is the same for all rays",
            {
                "count": "the number of steps between entry and exit",
                "texture-length": "the length of a step in texture space",
                "world-length": "the length of a step in the world",
                "voxel-count": "the samples per voxel, rounded to a whole number of steps for each ray",
            },
        ),
    ] = "world-length"
    steps: Annotated[int, Whole("steps of rule 'count'", low=1)] = 100
    length: Annotated[
        float | None,
        Real(
            "length of a step for the rules of lengths (None: half the least spacing for 'world-length', "
            "1 / steps for 'texture-length'), or in voxels for 'voxel-count' (None: 1)",
            low=1e-9,
        ),
    ] = None
    offset: Annotated[float, Real("where in the first step the first sample lies", high=1.0)] = 0.0
    jitter: Annotated[bool, Flag("whether a number from an image is added to the offset")] = False
    advance: Annotated[
        str,
        Word(
            "how the next position is made, in float32",
            {
                "add": "position += step",
                "parameter": "t += 1 / steps; position = mix(entry, exit, t)",
                "multiply": "position = entry + (i + offset) step",
            },
        ),
    ] = "multiply"
    end: Annotated[
        str,
        Word(
            "what ends a ray",
            {
                "count": "all steps are done",
                "length-before": "the length walked is at least the ray's, before a sample",
                "parameter": "t >= 1, before a sample",
                "length-after": "the length walked is at least the ray's, after a sample",
                "length-left": "no length is left, before a sample",
                "outside": "a coordinate is below 0 or above 1, after a sample",
                "outside-above": "a coordinate of the sample just taken is above 1; faces at 0 are missed",
            },
        ),
    ] = "length-before"
    cap: Annotated[int | None, Whole("most iterations of the loop (None: no cap)", low=1)] = None
    last_step: Annotated[
        str,
        Word(
            "what the last step of rule 'world-length' is",
            {
                "whole": "as long as the others",
                "partial": "what is left up to the exit",
                "dropped": "left out",
            },
        ),
    ] = "partial"
    opaque_at: Annotated[float | None, Real("alpha that ends a ray (None: none)", high=2.0)] = None
    opaque_test: Annotated[
        str,
        Word(
            "how alpha is compared with `opaque_at`",
            {"at-least": "alpha >= opaque_at", "above": "alpha > opaque_at"},
        ),
    ] = "at-least"


@dataclass(frozen=True)
class VolumeTexture(Switches):
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
class TableTexture(Switches):
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


@dataclass(frozen=True)
class SampleOpacity(Switches):
    """From the opacity of the table to that of a sample."""

    source: Annotated[
        str,
        Word("whose opacity it is", {"table": "the table's alpha", "value": "the value itself"}),
    ] = "table"
    rule: Annotated[
        str,
        Word(
            "what the step does to it",
            {
                "as-is": "nothing: a factor",
                "per-step": "a factor / steps",
                "per-length": "a factor length, the step's length in texture space",
                "corrected": "1 - (1 - a)^(factor length / unit distance), the step's length in the world",
            },
        ),
    ] = "corrected"
    factor: Annotated[
        float | None,
        Real("the factor (None: 1 for 'as-is' and 'corrected', else mean side / unit distance)"),
    ] = None
    by_gradient: Annotated[
        float, Real("the factor by which |g| of a gradient texture multiplies it; 0: it does not")
    ] = 0.0


@dataclass(frozen=True)
class Lighting(Switches):
    """What lights do to the colour of a sample."""

    model: Annotated[
        str,
        Word(
            "how lights and the material meet",
            {
                "none": "colours are taken as they are",
                "lit": "the scene's lights and material, in the world, as volref's own lit volumes have it",
                "cej": "seed 004: the whole illumination times the colour; Blinn-Phong has 4 shininess",
            },
        ),
    ] = "none"
    factor: Annotated[float, Real("what all colours are multiplied by")] = 1.0
    gradient: Annotated[
        str,
        Word(
            "where normals come from",
            {
                "none": "nowhere",
                "central": "central differences of the texture, one voxel to each side",
                "sobel-bytes": "a texture of value and gradient: minus Sobel's operator over 27, border 0",
                "sobel-bytes-printed": "the same with the misprint in the z kernel of seed 004's code",
            },
        ),
    ] = "none"
    zero: Annotated[
        str,
        Word(
            "how a gradient g lies in the bytes of such a texture",
            {
                "half": "(g + 1) / 2 255: no byte is 0, and 128 is read as 1 / 255, seed 004",
                "exact": "128 + 127 g: byte 128 is read as 0",
            },
        ),
    ] = "exact"
    flat: Annotated[
        str,
        Word(
            "what a sample without a gradient gets, from a texture that holds gradients",
            {
                "ambient": "no diffuse and no specular light, where the gradient is shorter than 0.001",
                "skipped": "nothing: it is left out, where the gradient's length is exactly 0, seed 004",
            },
        ),
    ] = "ambient"
    space: Annotated[
        str,
        Word(
            "where model 'cej' has its positions, normals and directions",
            {
                "world": "in the world",
                "texture": "in texture space, normals per voxel: skewed unless voxels are cubes and the "
                "volume is one, seed 004",
            },
        ),
    ] = "world"


@dataclass(frozen=True)
class Accumulation(Switches):
    """How samples are put together, front to back."""

    rule: Annotated[
        str,
        Word(
            "colour C and alpha A of the ray, c and a of the sample",
            {
                "over": "C += (1 - A) a c; A += (1 - A) a",
                "add-alpha": "C += (1 - A) a c; A += a, seed 001's eq. 4 and seed 002's article",
                "reversed-over": "C = a c + (1 - a) A C; A = a + (1 - a) A: the deepest sample lies in front",
            },
        ),
    ] = "over"
    alpha: Annotated[
        str,
        Word(
            "the alpha that is written",
            {
                "accumulated": "A",
                "weighted": "the sum of the samples' own alpha, weighted as their colour is, seed 002",
                "one": "1",
            },
        ),
    ] = "accumulated"
    normalize: Annotated[bool, Flag("whether colour is divided by an alpha above 1")] = False


@dataclass(frozen=True)
class MeshCut(Switches):
    """How opaque meshes cut the volume."""

    kind: Annotated[
        str,
        Word(
            "what the volume's pass knows of meshes",
            {
                "none": "nothing: scenes with meshes are refused",
                "distance": "the world distance of the nearest one: a slab's ray ends there",
                "depth": "a depth in an RGBA8 target, compared at each step",
            },
        ),
    ] = "distance"
    depth: Annotated[
        str,
        Word(
            "what depth is compared",
            {
                "linear": "(distance along the view - near) / (far - near)",
                "window-over-w": "1 - window z / clip w, which is not linear along a ray, seed 000",
            },
        ),
    ] = "linear"
    packing: Annotated[
        str,
        Word(
            "how a depth lies in four bytes",
            {
                "exact": "not at all: its target is one of floats",
                "printed": "digits k / 256 in bytes k / 255: no better than 8 bits, seed 000",
                "working": "digits times 256 / 255, and back",
            },
        ),
    ] = "working"
    comparison: Annotated[
        str,
        Word(
            "when the ray is at the surface",
            {
                "at": "ray depth >= surface depth",
                "one-step-early": "ray depth - surface depth > -step, seed 000",
            },
        ),
    ] = "at"
    composition: Annotated[
        str,
        Word(
            "how the surface is added to C and A",
            {
                "over": "C += (1 - A) o; A = 1",
                "printed": "C = A C + (1 - A) o; A = A A + (1 - A), seed 000",
            },
        ),
    ] = "over"
    format: Annotated[str, Word("what the target of the meshes' colours holds", STORED)] = "unorm8"


@dataclass(frozen=True)
class Output(Switches):
    """What happens to the colour on its way to the canvas."""

    tone_map: Annotated[
        str,
        Word(
            "how light is squeezed",
            {
                "none": "not at all",
                "reinhard": "c / (1 + c)",
                "artistic": "VPT's: between `low` and `high`, towards grey by `saturation`, bent at `mid`",
            },
        ),
    ] = "none"
    low: Annotated[float, Real("light that tone map 'artistic' makes black", low=-1e6, high=1e6)] = 0.0
    mid: Annotated[
        float, Real("light between them; half-way, 'artistic' bends nothing", low=-1e6, high=1e6)
    ] = 0.5
    high: Annotated[float, Real("light that tone map 'artistic' makes white", low=-1e6, high=1e6)] = 1.0
    saturation: Annotated[
        float, Real("share of colour that 'artistic' keeps; 0 is grey", low=-1e6, high=1e6)
    ] = 1.0
    gamma: Annotated[float, Real("colours are raised to 1 / gamma", low=0.01, high=100)] = 1.0
    blend: Annotated[
        str,
        Word(
            "how the fragment meets what is on the canvas",
            {
                "none": "it replaces it",
                "premultiplied": "ONE, ONE_MINUS_SRC_ALPHA",
                "straight": "SRC_ALPHA, ONE_MINUS_SRC_ALPHA",
                "additive-alpha": "SRC_ALPHA, ONE_MINUS_SRC_ALPHA; ONE, ONE for alpha",
                "shader": "not at all: the shader makes C + (1 - A) b^gamma of background b, alpha 1",
                "shader-straight": "the same with A C for C, the base of seed 003",
                "environment": "not at all: the shader adds 1 - A of what is there, none for A > 1, seed 004",
            },
        ),
    ] = "premultiplied"
    missed: Annotated[
        str,
        Word(
            "what a pixel holds whose ray misses the box",
            {
                "clear": "the clear colour: the box alone is drawn, or such fragments are discarded",
                "black": "opaque black: every pixel is drawn",
                "transparent": "transparent black: every pixel is drawn",
            },
        ),
    ] = "clear"
    discard_below: Annotated[
        float | None, Real("alpha below which nothing is drawn (None: none)", high=1.0)
    ] = None
    precision: Annotated[
        str,
        Word(
            "what the shader's output is declared as",
            {"highp": "highp", "mediump": "mediump, as gl_FragColor of WebGL 1 is: 16 bits on some devices"},
        ),
    ] = "highp"
    format: Annotated[str, Word("what the canvas holds", STORED)] = "unorm8"
    mean_format: Annotated[
        str | None, Word("what the running mean of frames holds (None: frames are not averaged)", STORED)
    ] = None

    def __post_init__(self) -> None:
        """Refuse a switch that breaks its rule, and a middle that is not between its ends."""
        super().__post_init__()
        if not self.low < self.mid < self.high:
            message = f"output.low, mid and high must rise, got {self.low:g}, {self.mid:g} and {self.high:g}; "
            raise SceneError(message + "sort them")
