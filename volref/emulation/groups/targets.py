"""Opaque meshes beside the volume, and the way to the canvas."""

from dataclasses import dataclass
from typing import Annotated

from volref.emulation.groups.words import STORED
from volref.emulation.switches import Real, Switches, Word
from volref.errors import SceneError


@dataclass(frozen=True)
class MeshCut(Switches, group="pipeline.meshes"):
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
                "window": "window z, which is not either",
            },
        ),
    ] = "linear"
    measure: Annotated[
        str,
        Word(
            "what is taken for the world distance",
            {
                "distance": "the distance from the ray's origin",
                "view": "the distance along the view",
                "window": "near + window z (far - near)",
            },
        ),
    ] = "distance"
    scale: Annotated[float, Real("what distances and depths of surfaces are multiplied by")] = 1.0
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
class Output(Switches, group="pipeline.output"):
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
    encodings: Annotated[float, Real("how many times they are: 1, or something is wrong", high=4)] = 1.0
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
            got = ", ".join(f"{light:g}" for light in (self.low, self.mid, self.high))
            message = f"pipeline.output.low, mid and high must rise, got {got}; sort them"
            raise SceneError(message)
