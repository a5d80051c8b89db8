"""What a sample adds: its opacity, its colour under lights, and how samples are put together."""

from dataclasses import dataclass
from typing import Annotated

from volref.emulation.switches import Real, Switches, Word


@dataclass(frozen=True)
class SampleOpacity(Switches, group="pipeline.opacity"):
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
                "corrected-in-texture": "the same of its length in texture space times the longest side",
                "corrected-by-ray": "the same of the mean side times the share that a step is of its ray",
            },
        ),
    ] = "corrected"
    factor: Annotated[
        float | None,
        Real("the factor (None: mean side / unit distance for 'per-step' and 'per-length', else 1)"),
    ] = None
    times: Annotated[float, Real("what a sample's opacity is multiplied by at last")] = 1.0
    by_gradient: Annotated[
        float, Real("the factor by which |g| of a gradient texture multiplies it; 0: it does not")
    ] = 0.0


@dataclass(frozen=True)
class Lighting(Switches, group="pipeline.lighting"):
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
                "forward": "differences of the texture to the sample and one voxel behind it, vtk.js",
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
    normals: Annotated[
        str,
        Word(
            "what normals are",
            {
                "outward": "unit vectors towards lesser values, 0 without a gradient",
                "inward": "unit vectors towards greater values: the wrong sign",
                "untransformed": "unit vectors along the gradient per voxel, taken for one in the world",
                "unguarded": "gradients divided by their length, not a number where that is 0",
            },
        ),
    ] = "outward"
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
class Accumulation(Switches, group="pipeline.accumulation"):
    """How samples are put together, front to back."""

    rule: Annotated[
        str,
        Word(
            "colour C and alpha A of the ray, c and a of the sample",
            {
                "over": "C += (1 - A) a c; A += (1 - A) a",
                "add-alpha": "C += (1 - A) a c; A += a, seed 001's eq. 4 and seed 002's article",
                "add-clamped": "C += (1 - A) a c; A = min(A + a, 1), VPT's DOS",
                "reversed-over": "C = a c + (1 - a) A C; A = a + (1 - a) A: the deepest sample lies in front",
                "mean": "C += a c / n; A += a / n, n the ray's length in steps",
                "greatest": "C = a c; A = a, of the sample whose a is greatest",
            },
        ),
    ] = "over"
    color: Annotated[
        str,
        Word(
            "what c is taken for",
            {"straight": "straight: it is added times a", "premultiplied": "premultiplied: without a"},
        ),
    ] = "straight"
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
    normalize: Annotated[
        str,
        Word(
            "whether colour is divided by alpha after the loop",
            {
                "none": "no",
                "above-one": "where alpha is above 1, VPT",
                "always": "where alpha is above 0: straight colour, for a blend that multiplies, vtk.js",
            },
        ),
    ] = "none"
