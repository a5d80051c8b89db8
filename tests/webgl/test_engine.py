"""The engine held to closed forms: what a job says is what is drawn, and nothing else is."""

import asyncio
import itertools

import numpy as np
import pytest

from tests.webgl.computing import PLACE, PLACE_ES3, computed
from tests.webgl.engine import OVER, Geometry, Job, Pass, Program, Target, Texture, WebGLError

FLOATS = {"t": Target("rgba32f", depth=True)}
FLAT = "attribute vec3 corner; void main() { gl_Position = vec4(corner, 1.0); }"
SAMPLED = "uniform sampler2D s; uniform sampler2D other;"


def fragment(body, *, declare=""):
    return f"precision highp float;\nprecision highp sampler2D;\n{declare}\nvoid main() {{ {body} }}"


def filled(color, *, vertex=PLACE, **state):
    """Pass that draws one colour, all over unless it says where."""
    program = Program(vertex, fragment("gl_FragColor = c;", declare="uniform vec4 c;"))
    return Pass(program, **{"target": "t", "uniforms": {"c": color}, **state})


def quad(z, *, clockwise=False):
    """Square over the middle half of the target, at depth z."""
    corners = [(-0.5, -0.5, z), (0.5, -0.5, z), (0.5, 0.5, z), (-0.5, 0.5, z)]
    return Geometry({"corner": corners}, [(0, 2, 1), (0, 3, 2)] if clockwise else [(0, 1, 2), (0, 2, 3)])


def flat(color, **state):
    """Pass that draws one colour on corners in clip space."""
    return filled(color, vertex=FLAT, **state)


def test_float_constants_come_back_exactly(every_webgl):
    constants = np.float32([0.1, -1e-30, 1.7e38, 2.0**-24])
    image = every_webgl.run(Job(3, 2, (filled(constants),), targets=FLOATS))["t"]
    np.testing.assert_array_equal(image, np.tile(constants, (2, 3, 1)))


def test_row_zero_is_the_top_and_pixel_centres_are_halves(every_webgl):
    drawn = Pass(Program(PLACE, fragment("gl_FragColor = gl_FragCoord;")), target="t")
    image = every_webgl.run(Job(5, 3, (drawn,), targets=FLOATS))["t"]
    np.testing.assert_array_equal(image[0, :, 0], np.arange(5) + 0.5)
    np.testing.assert_array_equal(image[:, 0, 1], [2.5, 1.5, 0.5])


def test_row_zero_of_a_texture_is_at_the_bottom_unless_flipped(every_webgl):
    values = np.arange(12, dtype=np.float32).reshape(3, 4)
    body = "gl_FragColor = texture2D(s, gl_FragCoord.xy / vec2(4.0, 3.0));"
    drawn = Pass(Program(PLACE, fragment(body, declare=SAMPLED)), uniforms={"s": "image"}, target="t")
    for flip_y, expected in ((False, values[::-1]), (True, values)):
        given = {"image": Texture(values, "r32f", flip_y=flip_y)}
        image = every_webgl.run(Job(4, 3, (drawn,), given, FLOATS))["t"]
        np.testing.assert_array_equal(image[..., 0], expected)


@pytest.mark.parametrize(
    ("name", "version", "expected"),
    [
        ("luminance8", 1, (51, 51, 51, 255)),
        ("alpha8", 1, (0, 0, 0, 51)),
        ("luminance_alpha8", 1, (51, 51, 51, 102)),
        ("rgb8", 1, (51, 102, 153, 255)),
        ("rgba8", 1, (51, 102, 153, 204)),
        ("r8", 2, (51, 0, 0, 255)),
        ("rg8", 2, (51, 102, 0, 255)),
        ("luminance8", 2, (51, 51, 51, 255)),
        ("alpha8", 2, (0, 0, 0, 51)),
    ],
)
def test_channels_of_a_format_are_where_webgl_puts_them(webgl, name, version, expected):
    channels = {"r": 1, "rg": 2, "rgb": 3, "rgba": 4, "luminance": 1, "alpha": 1, "luminance_alpha": 2}[
        name[:-1]
    ]
    values = np.uint8([[[51, 102, 153, 204][:channels]]])
    texture = Texture(values if channels > 1 else values[..., 0], name)
    call = "texture2D" if version == 1 else "texture"
    declare = "uniform sampler2D s;"
    got = computed(
        webgl,
        f"c = {call}(s, vec2(0.5));",
        [0],
        {"s": texture},
        declare=declare,
        version=version,
        output="rgba8",
    )
    np.testing.assert_array_equal(got[0], expected)


@pytest.mark.parametrize("name", ["r16f", "rgba16f", "r32f", "rgba32f"])
def test_float_texels_come_back_exactly(webgl, name):
    values = np.array([0.1, -65504.0, 2.0**-14], np.float16 if "16" in name else np.float32)
    row = np.stack([values] * 4, axis=-1)[None]
    texture = Texture(row if "rgba" in name else row[..., 0], name)
    got = computed(
        webgl,
        "c = texture(s, vec2((x.r + 0.5) / 3.0, 0.5));",
        [0, 1, 2],
        {"s": texture},
        declare="uniform sampler2D s;",
        version=2,
    )
    np.testing.assert_array_equal(got[:, 0], values)


def test_a_texture_is_refused_if_its_array_is_not_of_its_format():
    with pytest.raises(ValueError, match="must have 2 or 3 axes and 4 channels"):
        Texture(np.zeros((4, 4), np.uint8), "rgba8").as_json()
    with pytest.raises(ValueError, match="must be of type u1, got float64"):
        Texture(np.zeros((4, 4)), "luminance8").as_json()


def test_mipmaps_are_means_of_two_by_two(webgl):
    values = np.uint8([[0, 4, 8, 8], [8, 4, 8, 8], [1, 1, 2, 2], [1, 1, 2, 6]])
    got = computed(
        webgl,
        "c = textureLod(s, x.xy, 1.0);",
        [(0.25, 0.25), (0.75, 0.25), (0.25, 0.75), (0.75, 0.75)],
        {"s": Texture(values, "r8", "linear-mipmap-linear")},
        declare="uniform sampler2D s;",
        version=2,
        output="rgba8",
    )
    np.testing.assert_array_equal(got[:, 0], [4, 8, 1, 3])


def test_uniforms_of_every_type_arrive(every_webgl):
    declare = """uniform float f; uniform vec2 v; uniform int i; uniform bool b; uniform mat3 m;
    uniform float a[3];"""
    summed = "a[0] + 10.0 * a[1] + 100.0 * a[2] + (b ? 1000.0 * float(i) : 0.0)"
    body = f"gl_FragColor = vec4(m * vec3(v, f), {summed});"
    matrix = np.arange(9).reshape(3, 3)
    uniforms = {"f": 3, "v": (1, 2), "i": 7, "b": True, "m": matrix, "a": [1, 2, 3], "unused": 0}
    drawn = Pass(Program(PLACE, fragment(body, declare=declare)), uniforms=uniforms, target="t")
    image = every_webgl.run(Job(1, 1, (drawn,), targets=FLOATS))["t"]
    np.testing.assert_array_equal(image[0, 0], [*(matrix @ [1, 2, 3]), 7321])


def test_infinity_and_nan_arrive_as_uniforms(every_webgl):
    image = every_webgl.run(Job(1, 1, (filled([np.inf, -np.inf, np.nan, 1]),), targets=FLOATS))["t"]
    np.testing.assert_array_equal(image[0, 0], [np.inf, -np.inf, np.nan, 1])


def test_the_nearer_surface_wins_in_either_order(every_webgl):
    near, far = [1, 0, 0, 1], [0, 1, 0, 1]
    for order in itertools.permutations([(near, -0.5), (far, 0.5)]):
        drawn = [flat(color, geometry=quad(z), depth_test="less") for color, z in order]
        job = Job(4, 4, (filled([0, 0, 1, 1], clear=(0, 0, 0, 0), depth_write=False), *drawn), targets=FLOATS)
        image = every_webgl.run(job)["t"]
        np.testing.assert_array_equal(image[1, 1], near)
        np.testing.assert_array_equal(image[0, 0], [0, 0, 1, 1])


def test_depth_is_written_only_if_the_pass_says_so(every_webgl):
    first = flat([1, 0, 0, 1], geometry=quad(-0.5), depth_test="less", depth_write=False, clear=(0, 0, 0, 0))
    second = flat([0, 1, 0, 1], geometry=quad(0.5), depth_test="less")
    image = every_webgl.run(Job(4, 4, (first, second), targets=FLOATS))["t"]
    np.testing.assert_array_equal(image[1, 1], [0, 1, 0, 1])


def test_a_depth_buffer_is_cleared_to_what_the_pass_says(every_webgl):
    drawn = flat([1, 1, 1, 1], geometry=quad(0.0), depth_test="greater", clear=(0, 0, 0, 0), clear_depth=0.25)
    job = Job(4, 4, (drawn,), targets=FLOATS)
    assert every_webgl.run(job)["t"][1, 1, 0] == 1
    drawn = flat([1, 1, 1, 1], geometry=quad(0.0), depth_test="greater", clear=(0, 0, 0, 0), clear_depth=0.75)
    assert every_webgl.run(Job(4, 4, (drawn,), targets=FLOATS))["t"][1, 1, 0] == 0


@pytest.mark.parametrize("clockwise", [False, True])
def test_counterclockwise_is_front(every_webgl, clockwise):
    for cull, drawn in (("none", 1), ("front", int(clockwise)), ("back", int(not clockwise))):
        one = flat([1, 1, 1, 1], geometry=quad(0.0, clockwise=clockwise), cull=cull, clear=(0, 0, 0, 0))
        assert every_webgl.run(Job(4, 4, (one,), targets=FLOATS))["t"][1, 1, 0] == drawn


def test_blending_on_floats_is_its_formula(every_webgl):
    under, over = np.float32([0.5, 0.25, 0.125, 0.5]), np.float32([1, 0.5, 0, 0.25])
    image = every_webgl.run(
        Job(1, 1, (filled(over, clear=tuple(under.tolist()), blend=OVER),), targets=FLOATS)
    )["t"]
    # Every product and sum is exact in float32.
    expected = [*(over[:3] * 0.25 + under[:3] * 0.75), 0.25 + 0.5 * 0.75]
    np.testing.assert_array_equal(image[0, 0], expected)


def test_state_of_a_pass_does_not_reach_the_next(every_webgl):
    strange = flat([1, 1, 1, 1], geometry=quad(-1.0), depth_test="less", cull="front", blend=("zero",) * 4)
    image = every_webgl.run(Job(4, 4, (strange, filled([0.5, 0.25, 2, 1])), targets=FLOATS))["t"]
    np.testing.assert_array_equal(image, np.tile(np.float32([0.5, 0.25, 2, 1]), (4, 4, 1)))


def test_perspective_varyings_are_linear_in_space(every_webgl):
    # Vertices at w = 1 left and w = 3 right; the attribute over w and 1 over w are linear on the screen.
    w = np.array([1.0, 3.0, 3.0, 1.0])
    corners = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    geometry = Geometry(
        {"corner": np.column_stack([corners * w[:, None], w]), "value": [(0,), (1,), (1,), (0,)]},
        [(0, 1, 2), (0, 2, 3)],
    )
    vertex = """attribute vec3 corner; attribute float value; varying float v;
    void main() { v = value; gl_Position = vec4(corner.xy, 0.0, corner.z); }"""
    program = Program(
        vertex, fragment("gl_FragColor = vec4(v, gl_FragCoord.w, 0.0, 1.0);", declare="varying float v;")
    )
    image = every_webgl.run(Job(64, 4, (Pass(program, geometry, target="t"),), targets=FLOATS))["t"]
    s = (np.arange(64) + 0.5) / 64
    one_over_w = (1 - s) + s / 3
    # Two products, a sum and a division: 2 ulp of 1.
    np.testing.assert_allclose(image[1, :, 0], s / 3 / one_over_w, atol=2**-22, rtol=0)
    np.testing.assert_allclose(image[1, :, 1], one_over_w, atol=2**-22, rtol=0)


def test_passes_read_what_earlier_ones_drew_on_targets_of_any_size(every_webgl):
    spread = Pass(Program(PLACE, fragment("gl_FragColor = vec4(gl_FragCoord.xy, 0.0, 1.0);")), target="small")
    body = "gl_FragColor = texture2D(s, gl_FragCoord.xy / 4.0) + texture2D(other, vec2(0.5));"
    summed = Pass(
        Program(PLACE, fragment(body, declare=SAMPLED)), uniforms={"s": "small", "other": "one"}, target="t"
    )
    targets = {"small": Target("rgba16f", width=2, height=2), **FLOATS}
    job = Job(4, 4, (spread, summed), {"one": Texture(np.float32([[8]]), "r32f")}, targets)
    images = every_webgl.run(job)
    assert images["small"].shape == (2, 2, 4)
    np.testing.assert_array_equal(images["t"][0, :, 0], [8.5, 8.5, 9.5, 9.5])
    np.testing.assert_array_equal(images["t"][:, 0, 1], [9.5, 9.5, 8.5, 8.5])


def test_frames_are_passes_with_uniforms_of_their_own(every_webgl):
    frames = [filled([k, 0, 0, 1], blend=("one", "one", "one", "one")) for k in range(1, 5)]
    image = every_webgl.run(Job(2, 2, tuple(frames), targets=FLOATS))["t"]
    np.testing.assert_array_equal(image[0, 0], [10, 0, 0, 4])


def test_defines_go_in_after_the_version_line(webgl):
    source = "#version 300 es\nprecision highp float; out vec4 color; void main() { color = vec4(LEVEL); }"
    drawn = Pass(Program(PLACE_ES3, source, {"LEVEL": 0.25}), target="t")
    assert webgl.run(Job(1, 1, (drawn,), targets=FLOATS, version=2))["t"][0, 0, 0] == 0.25


def test_the_canvas_comes_back_in_bytes_as_it_was_drawn(every_webgl):
    drawn = filled([0.2, 0.4, 1.0, 0.6], target="canvas")
    image = every_webgl.run(Job(2, 1, (drawn,)))["canvas"]
    assert image.dtype == np.uint8
    np.testing.assert_array_equal(image[0, 0], [51, 102, 255, 153])


@pytest.mark.parametrize(
    ("job", "message"),
    [
        (
            Job(1, 1, (Pass(Program(PLACE, fragment("gl_FragColor = nothing;"), {"STEPS": 3})),)),
            r"(?s)FRAGMENT_SHADER does not compile.*nothing.*   1  #define STEPS 3",
        ),
        (
            Job(1, 1, (Pass(Program(PLACE, fragment("gl_FragColor = v;", declare="varying vec4 v;"))),)),
            "does not link",
        ),
        (Job(1, 1, (filled([0, 0, 0, 0], uniforms={}),), targets=FLOATS), "uniform c is not set"),
        (Job(1, 1, (flat([0, 0, 0, 0]),), targets=FLOATS), "attribute corner is not in the geometry"),
        (Job(1, 1, (filled([0, 0, 0, 0], target="nowhere"),)), "pass 0: no target nowhere"),
        (
            Job(1, 1, (), {"three": Texture(np.zeros((3, 3), np.uint8), "alpha8", "linear-mipmap-linear")}),
            "INVALID_OPERATION while texture three was uploaded",
        ),
        (Job(1, 1, (), {"red": Texture(np.zeros((1, 1), np.uint8), "r8")}), "WebGL 1 has no format r8"),
        (
            Job(
                1,
                1,
                (
                    Pass(
                        Program(PLACE, fragment("gl_FragColor = texture2D(s, vec2(0.5));", declare=SAMPLED)),
                        uniforms={"s": "t"},
                        target="t",
                    ),
                ),
                targets=FLOATS,
            ),
            "INVALID_OPERATION while pass 0 drew on t",
        ),
    ],
    ids=["compile", "link", "uniform", "attribute", "target", "upload", "format", "feedback"],
)
def test_what_the_page_refuses_is_an_error_and_the_next_job_is_drawn(every_webgl, job, message):
    with pytest.raises(WebGLError, match=message):
        every_webgl.run(job)
    assert every_webgl.run(Job(1, 1, (filled([1, 0, 0, 0]),), targets=FLOATS))["t"][0, 0, 0] == 1


def test_an_open_browser_leaves_asyncio_alone(webgl):
    assert webgl.run(Job(1, 1, ())) == {}
    assert asyncio.run(asyncio.sleep(0, "ran")) == "ran"
