"""Devices: what differs from one machine to the next while the program stays the same.

The numbers of the presets were measured on software implementations of WebGL; tests/webgl holds them to that.
"""

import json
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from volref.emulation.switches import Real, Switches, Whole, Word
from volref.errors import SceneError

FORMAT = "volref-device"
FORMAT_VERSION = 1

ARITHMETIC = {
    "float64": "64 bits, what no GPU has",
    "float32": "32 bits, highp",
    "float16": "16 bits, mediump",
}


@dataclass(frozen=True)
class Device(Switches, group="device"):
    """How one machine computes; the default is ideal but for the float32 that decides on counts of samples.

    Examples
    --------
    >>> Device().control, Device.named("swiftshader").subpixel_bits
    ('float32', 4)
    """

    name: str = "ideal"
    values: Annotated[str, Word("arithmetic of colours, tables and sums", ARITHMETIC)] = "float64"
    control: Annotated[str, Word("arithmetic of positions, lengths and counts", ARITHMETIC)] = "float32"
    weight_bits: Annotated[
        int | None,
        Whole("fraction bits of a linear filter's weights in 8-bit textures (None: all)", low=1, high=24),
    ] = None
    result_bits: Annotated[
        int | None,
        Whole("bits to which a linear filter of 8-bit textures rounds (None: all)", low=1, high=24),
    ] = None
    nearest_bits: Annotated[
        int | None,
        Whole("fraction bits of a nearest fetch's place in 8-bit textures (None: all)", low=1, high=24),
    ] = None
    subpixel_bits: Annotated[
        int | None, Whole("fraction bits of a vertex's window position (None: all)", low=1, high=16)
    ] = None
    nan_stored: Annotated[str, Word("what an 8-bit target holds for NaN", {"zero": "0", "one": "255"})] = (
        "zero"
    )
    mix: Annotated[
        str, Word("how mix(x, y, a) is computed", {"difference": "x + (y - x) a", "sum": "x (1 - a) + y a"})
    ] = "difference"
    constant_divisor: Annotated[
        str,
        Word(
            "what a division by a number that is known when the shader is compiled becomes",
            {"divided": "a division", "multiplied": "a product with the rounded reciprocal"},
        ),
    ] = "divided"
    angles: Annotated[
        str,
        Word(
            "how atan(y, x) and acos(x) are computed",
            {
                "rounded": "as exactly as the type holds",
                "swiftshader": "by SwiftShader's polynomials, up to 7e-5 beside them",
                "mesa": "by Mesa's, up to 1.6e-4 beside them",
            },
        ),
    ] = "rounded"
    srgb: Annotated[
        str,
        Word(
            "how a texture decodes sRGB",
            {"curve": "by its curve", "cubic": "by Mesa's cubic in its place, up to 0.0012 beside it"},
        ),
    ] = "curve"
    blend: Annotated[
        str,
        Word(
            "how 8-bit targets blend",
            {"float": "in floating point, rounded once", "integer": "product by product in whole numbers"},
        ),
    ] = "float"
    planes: Annotated[
        str,
        Word(
            "which corners the planes of a triangle's attributes go through",
            {"snapped": "those rounded to `subpixel_bits`", "unsnapped": "those of the vertex shader"},
        ),
    ] = "snapped"
    detail: Annotated[
        str,
        Word(
            "how the level of detail is computed from a footprint",
            {"log2": "its logarithm", "bits": "SwiftShader's line between powers of two, up to 0.022 below"},
        ),
    ] = "log2"
    depth_bits: Annotated[int, Whole("bits of a depth buffer, 32 for floats", low=16, high=32)] = 32
    fragment_color: Annotated[
        str,
        Word(
            "what gl_FragColor of WebGL 1, which is mediump, takes from a loop",
            {"float32": ARITHMETIC["float32"], "float16": ARITHMETIC["float16"]},
        ),
    ] = "float32"
    freedom: Annotated[
        str,
        Word(
            "how far arithmetic may be from what is emulated; see `accept`",
            {
                "none": "not at all",
                "rounded": "+ - * / and sqrt are rounded correctly, functions are as good as WebGPU demands",
                "khronos": "every operation is as bad as a division of WebGPU may be, 2.5 units in the last "
                "place",
            },
        ),
    ] = "rounded"
    weight_slack: Annotated[
        float, Real("by how much of a texel a linear filter's weight may be off, 8-bit textures", high=0.5)
    ] = 0.0
    snap_slack: Annotated[
        float, Real("by how many pixels a vertex's window position may be off", high=0.5)
    ] = 0.0
    store_slack: Annotated[
        float, Real("by how much of a step more than a half an 8-bit target may round", high=0.5)
    ] = 0.0
    blend_slack: Annotated[float, Real("by how many steps 8-bit targets may blend amiss", high=4.0)] = 0.0

    @property
    def values_type(self) -> type[np.floating[Any]]:
        """The type of colours, tables and sums."""
        return _TYPES[self.values]

    @property
    def control_type(self) -> type[np.floating[Any]]:
        """The type of positions, lengths and counts."""
        return _TYPES[self.control]

    @classmethod
    def named(cls, name: str) -> "Device":
        """Return a preset: a machine, or a set of machines ("webgl-highp", "webgpu") around one.

        Raises
        ------
        SceneError
            If there is none of that name.
        """
        if name not in PRESETS:
            message = f"device must be a preset, got {name!r}; use one of {', '.join(PRESETS)}"
            raise SceneError(message)
        return PRESETS[name]

    def to_json(self) -> str:
        """Return the device as JSON text."""
        return json.dumps({"format": FORMAT, "version": FORMAT_VERSION, **self.as_dict()}, indent=2) + "\n"


_TYPES: dict[str, type[np.floating[Any]]] = {
    "float64": np.float64,
    "float32": np.float32,
    "float16": np.float16,
}

PRESETS: dict[str, Device] = {
    device.name: device
    for device in (
        Device(),
        Device("exact", control="float64", freedom="none"),
        Device(
            "swiftshader",
            nearest_bits=16,
            subpixel_bits=4,
            constant_divisor="multiplied",
            angles="swiftshader",
            detail="bits",
        ),
        Device(
            "llvmpipe",
            weight_bits=8,
            result_bits=8,
            subpixel_bits=8,
            angles="mesa",
            srgb="cubic",
            planes="unsnapped",
            depth_bits=24,
            blend="integer",
            fragment_color="float16",
        ),
        Device(
            "lavapipe",
            weight_bits=8,
            result_bits=8,
            subpixel_bits=8,
            planes="unsnapped",
            depth_bits=24,
            mix="sum",
            angles="mesa",
            blend="integer",
        ),
        Device("mediump", values="float16", control="float16"),
        # Sets of machines.  Filters: 8 fraction bits, rounded (OpenGL ES leaves them open; Direct3D 11.3,
        # section 7.18.16.1, demands 8).  Window positions: 8 bits (the same, section 3.2.4.1).  Bytes: 0.6 of
        # a step (section 3.2.3.6).  Whole numbers blend up to 1.33 steps amiss, as Mesa's do.
        Device(
            "webgl-highp",
            freedom="khronos",
            weight_slack=2.0**-9,
            snap_slack=2.0**-9,
            store_slack=0.1,
            blend_slack=1.33,
        ),
        Device(
            "webgpu",
            freedom="khronos",
            weight_slack=2.0**-9,
            snap_slack=2.0**-9,
            store_slack=0.1,
            depth_bits=32,
        ),
    )
}
