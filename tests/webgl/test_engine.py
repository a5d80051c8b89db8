"""The engine held to closed forms, and what the implementations were measured to do."""

import asyncio

import numpy as np
import pytest

from tests.webgl.engine import Job, Pass, Program, Target, Texture, WebGLError

PLACE = "attribute vec2 position; void main() { gl_Position = vec4(position, 0.0, 1.0); }"


SAMPLED = "uniform sampler2D s; uniform vec2 size;"


def fragment(body, *, declare=""):
    return f"precision highp float;\n{declare}\nvoid main() {{ {body} }}"


def test_float_constants_come_back_exactly(every_webgl):
    drawn = Pass(
        Program(PLACE, fragment("gl_FragColor = c;", declare="uniform vec4 c;")),
        uniforms={"c": [0.1, -1e-30, 3.5e38 / 2, 2.0**-24]},
        target="t",
    )
    image = every_webgl.run(Job(3, 2, (drawn,), targets={"t": Target("rgba32f")}))["t"]
    np.testing.assert_array_equal(image, np.tile(np.float32([0.1, -1e-30, 3.5e38 / 2, 2.0**-24]), (2, 3, 1)))


def test_row_zero_is_the_top_and_pixel_centres_are_halves(every_webgl):
    drawn = Pass(Program(PLACE, fragment("gl_FragColor = gl_FragCoord;")), target="t")
    image = every_webgl.run(Job(5, 3, (drawn,), targets={"t": Target("rgba32f")}))["t"]
    np.testing.assert_array_equal(image[0, :, 0], np.arange(5) + 0.5)
    np.testing.assert_array_equal(image[:, 0, 1], [2.5, 1.5, 0.5])


def test_a_shader_that_does_not_compile_is_shown_with_line_numbers(every_webgl):
    bad = Pass(Program(PLACE, fragment("gl_FragColor = nothing;"), {"STEPS": 3}))
    with pytest.raises(
        WebGLError, match=r"(?s)FRAGMENT_SHADER does not compile.*nothing.*   1  #define STEPS 3"
    ):
        every_webgl.run(Job(1, 1, (bad,)))


def test_an_open_browser_leaves_asyncio_alone(every_webgl):
    assert every_webgl.run(Job(1, 1, ())) == {}
    assert asyncio.run(asyncio.sleep(0, "ran")) == "ran"


@pytest.mark.parametrize("filter_of", ["nearest", "linear"])
def test_texels_come_back_where_they_lie(every_webgl, filter_of):
    values = np.arange(12, dtype=np.float32).reshape(3, 4)
    drawn = Pass(
        Program(PLACE, fragment("gl_FragColor = texture2D(s, gl_FragCoord.xy / size);", declare=SAMPLED)),
        uniforms={"s": "volume", "size": (4.0, 3.0)},
        target="t",
    )
    for flip_y, expected in ((False, values[::-1]), (True, values)):
        given = {"volume": Texture(values, "r32f", filter_of, flip_y=flip_y)}
        image = every_webgl.run(Job(4, 3, (drawn,), given, {"t": Target("rgba32f")}))["t"]
        np.testing.assert_array_equal(image[..., 0], expected)
