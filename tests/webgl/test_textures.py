"""Fetches of `volref.stages.textures`, held to real WebGL at thousands of coordinates."""

import numpy as np
import pytest

from tests.webgl.engine import Job, Pass, Program, Target, Texture
from volref.formats import decoded
from volref.stages import textures
from volref.workspace import Workspace

SIDE = 96

# GLSL ES 1.00 and 3.00 at once; 3-D textures are of WebGL 2, which lavapipe does not have everywhere.
VERTEX = """attribute vec2 position;
varying highp vec2 at;
void main() { gl_Position = vec4(position, 0.0, 1.0); at = position * 0.5 + 0.5; }
"""

# The coordinates are given as an image, so that no arithmetic of the shader's stands between.
FRAGMENT = """precision highp float;
precision highp sampler2D; // else lowp, by which Mesa means 16 bits
precision highp SAMPLER;
uniform sampler2D places;
uniform SAMPLER texels;
varying highp vec2 at;
void main() { gl_FragColor = texture2D(texels, texture2D(places, at).COORDINATES); }
"""

NEWER = {"attribute": "in", "varying": "VARYING", "gl_FragColor": "found", "texture2D": "texture"}

CASES = {
    "luminance8": (21, 37),
    "rgba8": (64, 64),
    "rgba8, one row": (1, 256),
    "r32f": (21, 37),
    "rgba32f": (32, 64),
    "r8, 3-D": (9, 11, 13),
    "rgba8, 3-D": (4, 8, 16),
    "r32f, 3-D": (9, 11, 13),
}


def coordinates(shape, seed):
    """Coordinates (4, SIDE^2): at random, beyond the edges, on 256ths of a texel, on borders and centres."""
    rng = np.random.default_rng(seed)
    made = rng.uniform(-0.2, 1.2, (4, SIDE**2))
    third = SIDE**2 // 3
    for row, size in zip(made, shape[::-1], strict=False):
        row[:third] = rng.integers(-200, size * 256 + 200, third) / (256 * size)
        special = [0.0, 1.0, 0.5, 1 / size, 0.5 / size, 1 - 0.5 / size]
        row[third : third + third // 4] = rng.choice(special, third // 4)
    return made.astype(np.float32)


def texels_of(format_name, shape, seed):
    """Texels (..., C) as they are uploaded."""
    rng = np.random.default_rng(seed)
    shape = (*shape, 4 if format_name.startswith("rgba") else 1)
    return rng.random(shape, np.float32) if "32f" in format_name else rng.integers(0, 256, shape, np.uint8)


def _program(dimensions):
    vertex, fragment = VERTEX, FRAGMENT
    if dimensions == 3:
        for old, new in NEWER.items():
            vertex = vertex.replace(old, new.replace("VARYING", "out"))
            fragment = fragment.replace(old, new.replace("VARYING", "in"))
        vertex, fragment = f"#version 300 es\n{vertex}", f"#version 300 es\nout highp vec4 found;\n{fragment}"
    return Program(vertex, fragment, {"SAMPLER": f"sampler{dimensions}D", "COORDINATES": "xyz"[:dimensions]})


def drawn(engine, format_name, texels, places, filtering):
    """Channels (C, n) that the implementation fetches."""
    dimensions, channels = texels.ndim - 1, texels.shape[-1]
    fetched = Pass(_program(dimensions), uniforms={"places": "places", "texels": "texels"}, target="found")
    uploads = {
        "places": Texture(places.T.reshape(SIDE, SIDE, 4), "rgba32f"),
        "texels": Texture(texels[..., 0] if channels == 1 else texels, format_name, filtering),
    }
    job = Job(SIDE, SIDE, (fetched,), uploads, {"found": Target("rgba32f")}, version=dimensions - 1)
    return engine.run(job)["found"][::-1].reshape(-1, 4)[:, :channels].T


def both(engine, case, filtering, **options):
    """What the implementation fetches and what volref does, in float32."""
    format_name, shape = case.split(",")[0], CASES[case]
    texels, places = texels_of(format_name, shape, 0), coordinates(shape, 1)
    numbers = texels if texels.dtype == np.float32 else decoded(texels, np.float32)
    texture = textures.Texture(numbers, filtering, **options)
    ours = textures.fetch(texture, places[: texels.ndim - 1], Workspace())
    return drawn(engine, format_name, texels, places, filtering), ours


BYTES = [case for case in CASES if "32f" not in case]
FLOATS = [case for case in CASES if "32f" in case]


def on_mesa(cases):
    """Each case behind OpenGL, and those of WebGL 1 behind Vulkan too."""
    pairs = [("llvmpipe", case) for case in cases]
    pairs += [("lavapipe", case) for case in cases if len(CASES[case]) == 2]
    return pytest.mark.parametrize(("name", "case"), pairs)


@on_mesa(BYTES)
def test_mesa_filters_bytes_in_whole_numbers_and_is_met_to_the_bit(engine_of, name, case):
    theirs, ours = both(engine_of(name), case, "linear", weight_bits=8, result_bits=8)
    np.testing.assert_array_equal(theirs, ours)


@on_mesa(CASES)
def test_mesa_takes_the_nearest_texel_of_the_specification(engine_of, name, case):
    theirs, ours = both(engine_of(name), case, "nearest")
    np.testing.assert_array_equal(theirs, ours)


@pytest.mark.parametrize("case", FLOATS)
def test_swiftshader_filters_floats_as_volref_does_to_the_bit(swiftshader, case):
    theirs, ours = both(swiftshader, case, "linear")
    np.testing.assert_array_equal(theirs, ours)


@pytest.mark.parametrize("case", BYTES)
def test_swiftshader_filters_bytes_in_float32(swiftshader, case):
    theirs, ours = both(swiftshader, case, "linear")
    # Seven interpolations of numbers below 1, in another order: a rounding of half an ulp of 1 each.
    np.testing.assert_allclose(theirs, ours, rtol=0, atol=7 * 2.0**-24)


@on_mesa(FLOATS)
def test_mesa_filters_floats_in_float32(engine_of, name, case):
    theirs, ours = both(engine_of(name), case, "linear")
    np.testing.assert_allclose(theirs, ours, rtol=0, atol=7 * 2.0**-24)  # as above


@pytest.mark.parametrize("case", BYTES)
def test_swiftshader_finds_the_nearest_byte_by_16_bits_of_the_coordinate(swiftshader, case):
    theirs, ours = both(swiftshader, case, "nearest", nearest_bits=16)
    np.testing.assert_array_equal(theirs, ours)


@pytest.mark.parametrize("case", FLOATS)
def test_swiftshader_finds_the_nearest_float_by_the_whole_coordinate(swiftshader, case):
    theirs, ours = both(swiftshader, case, "nearest")
    np.testing.assert_array_equal(theirs, ours)


@pytest.mark.parametrize("case", ["luminance8", "r8, 3-D"])
def test_it_takes_these_roundings_to_meet_them(engine_of, swiftshader, case):
    theirs, ours = both(engine_of("llvmpipe"), case, "linear", weight_bits=8)
    assert np.abs(theirs - ours).max() > 1 / 1024
    theirs, ours = both(swiftshader, case, "nearest")
    assert (theirs != ours).any()
