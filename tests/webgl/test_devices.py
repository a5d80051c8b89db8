"""What the implementations were measured to do where WebGL leaves them free: the numbers of `Device` presets.

Chromium 156 with SwiftShader, and Mesa 22.3 (llvmpipe through GL, lavapipe through Vulkan; WebGL 1 only).
Bits are compared wherever a formula was found that gives them all.
"""

import numpy as np
import pytest

from tests.webgl.computing import PLACE, computed
from tests.webgl.engine import OVER, Geometry, Job, Pass, Program, Target, Texture

MESA = ("llvmpipe", "lavapipe")
SAMPLER = "uniform sampler2D s;"
RNG_POINTS = 4096


def random(seed, shape, low=0.0, high=1.0):
    return np.random.default_rng(seed).uniform(low, high, shape).astype(np.float32)


def fused(a, b, w):
    """a + w (b - a) with the product and the sum rounded once, as a fused multiply-add does."""
    return (a.astype(np.float64) + w.astype(np.float64) * (b - a).astype(np.float64)).astype(np.float32)


def plain(a, b, w):
    return a + w * (b - a)


def in_bytes(a, b, w):
    """Eight-bit lerp of whole numbers, weights in 1/256."""
    return a + ((w * (b - a) + 128) >> 8)


def neighbours(coordinate, size, *, weights):
    """Lower and upper texel and weight of the upper one; `weights` is 256 or None for float32."""
    place = coordinate * np.float32(size) - np.float32(0.5)
    if weights is None:
        lower, weight = np.floor(place).astype(int), place - np.floor(place)
    else:
        lower, weight = np.divmod(np.rint(place.astype(np.float64) * weights).astype(int), weights)
    return np.clip(lower, 0, size - 1), np.clip(lower + 1, 0, size - 1), weight


def linear(texels, points, lerp, *, weights=None):
    """Texture with linear filtering at points (N, 1 to 3): lerps along x, then y, then z."""
    axes = [neighbours(points[:, a], texels.shape[-1 - a], weights=weights) for a in range(points.shape[1])]

    def along(axis, chosen):
        if axis < 0:
            return texels[tuple(chosen)]
        lower, upper, weight = axes[axis]
        return lerp(along(axis - 1, [*chosen, lower]), along(axis - 1, [*chosen, upper]), weight)

    return along(points.shape[1] - 1, [])


@pytest.mark.parametrize("name", ["luminance8", "alpha8", "rgba8"])
def test_linear_filtering_of_8_bits_in_two_dimensions(every_webgl, name):
    texels = np.random.default_rng(1).integers(0, 256, (5, 7))
    points = random(2, (RNG_POINTS, 2), -0.1, 1.1)
    image = np.uint8(texels if name != "rgba8" else np.stack([texels] * 4, -1))
    got = computed(
        every_webgl, "c = texture2D(s, x.xy);", points, {"s": Texture(image, name, "linear")}, declare=SAMPLER
    )
    check_bytes(every_webgl, got[:, 3 if name == "alpha8" else 0], texels, points)


def test_linear_filtering_of_8_bits_in_three_dimensions(webgl):
    texels = np.random.default_rng(3).integers(0, 256, (3, 5, 7))
    points = random(4, (RNG_POINTS, 3), -0.1, 1.1)
    texture = Texture(np.uint8(texels), "r8", "linear")
    declare = "uniform sampler3D s;"
    got = computed(webgl, "c = texture(s, x.xyz);", points, {"s": texture}, declare=declare, version=2)
    check_bytes(webgl, got[:, 0], texels, points)


def check_bytes(engine, got, texels, points):
    """SwiftShader: floats, scaled last.  Mesa: weights in 1/256, each lerp rounded to 8 bits."""
    if engine.name in MESA:
        expected = linear(texels, points, in_bytes, weights=256).astype(np.float32) * np.float32(1 / 255)
        np.testing.assert_array_equal(got, expected)
    else:
        expected = linear(texels.astype(np.float32), points, plain) * np.float32(1 / 255)
        np.testing.assert_array_equal(got, expected)


def test_linear_filtering_of_floats_in_two_dimensions(every_webgl):
    texels, points = random(5, (5, 7), 0, 255), random(6, (RNG_POINTS, 2), -0.1, 1.1)
    given = {"s": Texture(texels, "r32f", "linear")}
    got = computed(every_webgl, "c = texture2D(s, x.xy);", points, given, declare=SAMPLER)[:, 0]
    lerp = fused if every_webgl.name in MESA else plain
    np.testing.assert_array_equal(got, linear(texels, points, lerp))


@pytest.mark.parametrize("name", ["r32f", "r16f"])
def test_linear_filtering_of_floats_in_three_dimensions(webgl, name):
    texels = random(7, (3, 5, 7), 0, 255).astype(np.float16).astype(np.float32)
    points = random(8, (RNG_POINTS, 3), -0.1, 1.1)
    given = {"s": Texture(texels if name == "r32f" else texels.astype(np.float16), name, "linear")}
    got = computed(webgl, "c = texture(s, x.xyz);", points, given, declare="uniform sampler3D s;", version=2)[
        :, 0
    ]
    lerp = fused if webgl.name in MESA else plain
    np.testing.assert_array_equal(got, linear(texels, points, lerp))


def test_nearest_takes_the_floor_of_the_float32_coordinate(every_webgl):
    edges = np.float32(np.arange(8) / 7)
    around = [np.nextafter(edges, np.float32(-9)), edges, np.nextafter(edges, np.float32(9))]
    points = np.concatenate([*around, random(9, 4000, -0.1, 1.1)])
    given = {"s": Texture(np.float32([range(7)]), "r32f")}
    got = computed(every_webgl, "c = texture2D(s, vec2(x.r, 0.5));", points, given, declare=SAMPLER)[:, 0]
    np.testing.assert_array_equal(got, np.clip(np.floor(points * np.float32(7)), 0, 6))


def test_bytes_are_read_as_multiples_of_the_float32_nearest_to_one_255th(every_webgl):
    bytes_ = np.arange(256)
    given = {"s": Texture(np.uint8([bytes_]), "luminance8")}
    statement = "c = texture2D(s, vec2((x.r + 0.5) / 256.0, 0.5));"
    got = computed(every_webgl, statement, bytes_, given, declare=SAMPLER)[:, 0]
    np.testing.assert_array_equal(got, bytes_.astype(np.float32) * np.float32(1 / 255))


def test_a_store_in_8_bits_rounds_half_to_even_and_nan_is_zero(every_webgl):
    values = np.float32([*(np.arange(256) / 255), *((np.arange(255) + 0.5) / 255), -1, 2, -np.inf, np.inf])
    # The product with 255 is a half exactly: the tie is real.
    assert np.all((values[256:511] * np.float32(255)) % 1 == 0.5)
    got = computed(every_webgl, "c = vec4(x.r);", values, output="rgba8")[:, 0]
    np.testing.assert_array_equal(got, np.rint(np.clip(values, 0, 1) * np.float32(255)))
    for nan in ("x.r / x.r", "sqrt(x.r - 1.0)", "normalize(x.rgb).r"):
        kept = computed(every_webgl, f"c = vec4({nan});", [0.0])[0]
        stored = computed(every_webgl, f"c = vec4({nan});", [0.0], output="rgba8")[0]
        assert np.isnan(kept).all()
        np.testing.assert_array_equal(stored, 0)


def test_srgb_is_decoded_before_filtering(webgl):
    bytes_ = np.arange(256)
    image = np.zeros((1, 256, 4), np.uint8)
    image[0, :, 0] = image[0, :, 3] = bytes_
    statement = "c = texture(s, vec2((x.r + 0.5) / 256.0, 0.5));"
    given = {"s": Texture(image, "srgb8_alpha8")}
    got = computed(webgl, statement, bytes_, given, declare=SAMPLER, version=2)
    code = bytes_ / 255
    if webgl.name in MESA:
        # A cubic in place of the power (Mesa, lp_bld_format_srgb.c); the error against the power is 0.0012.
        cubic = 0.0023 + code * (0.0030 + code * (0.6935 + code * 0.3012))
        np.testing.assert_allclose(got[:, 0], np.where(bytes_ <= 15, code / 12.6, cubic), atol=2**-23, rtol=0)
    else:
        power = np.where(code <= 0.04045, code / 12.92, ((code + 0.055) / 1.055) ** 2.4)
        # Measured 7.7e-6.
        np.testing.assert_allclose(got[:, 0], power, atol=8e-6, rtol=0)
    np.testing.assert_allclose(got[:, 3], code, atol=2**-23, rtol=0)
    middle = computed(
        webgl,
        "c = texture(s, vec2(0.5));",
        [0],
        {"s": Texture(np.uint8([[[0] * 4, [255] * 4]]), "srgb8_alpha8", "linear")},
        declare=SAMPLER,
        version=2,
    )
    np.testing.assert_allclose(middle[0], 0.5, atol=2**-23, rtol=0)


@pytest.mark.parametrize(
    "blend",
    [OVER, ("one", "one_minus_src_alpha", "one", "one_minus_src_alpha"), ("src_alpha", "one", "one", "one")],
)
def test_blending_on_8_bits(every_webgl, blend):
    """SwiftShader: in floats, rounded once.  Mesa: each product rounded to 8 bits."""
    rng = np.random.default_rng(10)
    under, over = rng.integers(0, 256, (2, 64, 64, 4))
    got = blended(every_webgl, Texture(np.uint8(under)), Texture(np.uint8(over)), blend)
    alpha = over[..., 3:]
    factors = {"one": 255 + 0 * alpha, "src_alpha": alpha, "one_minus_src_alpha": 255 - alpha}
    a, b = (np.concatenate([factors[blend[k]]] * 3 + [factors[blend[k + 2]]], -1) for k in (0, 1))
    if every_webgl.name in MESA:
        expected = np.minimum(product_in_bytes(over, a) + product_in_bytes(under, b), 255)
    else:
        expected = np.minimum(np.rint((over * a + under * b) / 255), 255)
    np.testing.assert_array_equal(got, expected)


def product_in_bytes(p, q):
    """p q / 255 in whole numbers as Mesa rounds it: one less than the nearest, now and then."""
    return (p * q + (p * q >> 8) + 128) >> 8


def blended(engine, under, over, blend):
    """Over drawn on under in RGBA8, rows from the bottom."""
    declare = "precision highp float; precision highp sampler2D; uniform sampler2D s;"
    program = Program(PLACE, declare + "void main() { gl_FragColor = texture2D(s, gl_FragCoord.xy / 64.0); }")
    first = Pass(program, uniforms={"s": "under"}, target="t")
    second = Pass(program, uniforms={"s": "over"}, target="t", blend=blend)
    job = Job(64, 64, (first, second), {"under": under, "over": over}, {"t": Target()})
    return engine.run(job)["t"][::-1].astype(int)


def test_mesa_rounds_the_source_to_8_bits_before_it_blends(every_webgl):
    over = np.full((64, 64, 4), 0.4 / 255, np.float32)
    got = blended(
        every_webgl, Texture(np.full((64, 64, 4), 10, np.uint8)), Texture(over, "rgba32f"), ("one",) * 4
    )
    assert np.all(got == 10)
    over = np.float32(np.tile([100.4 / 255] * 3 + [0.5], (64, 64, 1)))
    under = np.full((64, 64, 4), 50, np.uint8)
    exact = 100.4 * 0.5 + 50 * 0.5
    once = product_in_bytes(100, 128) + product_in_bytes(50, 127)
    got = blended(every_webgl, Texture(under), Texture(over, "rgba32f"), OVER)[..., 0]
    assert np.all(got == (once if every_webgl.name in MESA else round(exact)))


def strips():
    """Strips of one row from x = e to e + 8, e around 0.5 in steps of 1/2048; p.z is 0 to 1 along them."""
    count, width = 512, 16
    edges = 0.5 + (np.arange(count) - count // 2) / 2048
    left, right = edges / width * 2 - 1, (edges + 8) / width * 2 - 1
    low, high = np.arange(count) / count * 2 - 1, (np.arange(count) + 1) / count * 2 - 1
    zero, one = np.zeros(count), np.ones(count)
    corners = [(left, low, zero), (right, low, one), (right, high, one), (left, high, zero)]
    first = 4 * np.arange(count)[:, None]
    triangles = np.concatenate([first + np.array(three) for three in ((0, 1, 2), (0, 2, 3))])
    return edges, Geometry({"p": np.stack([np.stack(c, -1) for c in corners], 1).reshape(-1, 3)}, triangles)


def test_vertices_are_snapped_to_a_grid_and_mesa_interpolates_between_the_unsnapped_ones(every_webgl):
    edges, geometry = strips()
    vertex = "attribute vec3 p; varying float v; void main() { v = p.z; gl_Position = vec4(p.xy, 0.0, 1.0); }"
    body = "precision highp float; varying float v; void main() { gl_FragColor = vec4(1.0, v, 0.0, 1.0); }"
    drawn = Pass(Program(vertex, body), geometry, target="t", clear=(0, 0, 0, 0))
    image = every_webgl.run(Job(16, 512, (drawn,), targets={"t": Target("rgba32f")}))["t"][::-1]
    grid = 256 if every_webgl.name in MESA else 16
    snapped = np.rint(edges * grid) / grid
    # A pixel belongs to the strip if its centre lies right of the left edge or on it.
    np.testing.assert_array_equal(image[:, 0, 0], snapped <= 0.5)
    np.testing.assert_array_equal(image[:, 8, 0], snapped + 8 > 8.5)
    start = edges if every_webgl.name in MESA else snapped
    # A plane in float32: a few roundings.
    np.testing.assert_allclose(image[:, 4, 1], (4.5 - start) / 8, atol=2**-22, rtol=0)


def test_what_comes_of_gl_fragcoord_in_webgl_1_is_of_half_precision_on_llvmpipe(every_webgl):
    body = "precision highp float; void main() { gl_FragColor = gl_FragCoord.xxxx / vec4(1, 1000, 1, 1); }"
    drawn = Pass(Program(PLACE, body), target="t")
    image = every_webgl.run(Job(1000, 1, (drawn,), targets={"t": Target("rgba32f")}))["t"][0]
    centres = np.arange(1000) + 0.5
    np.testing.assert_array_equal(image[:, 0], centres)
    if every_webgl.name == "llvmpipe":
        np.testing.assert_array_equal(image[:, 1], np.float16(centres) / np.float16(1000))
    else:
        # A division of 2.5 ulp at most.
        np.testing.assert_allclose(image[:, 1], centres / 1000, rtol=3 * 2**-24)


def test_what_comes_of_gl_fragcoord_in_webgl_2_is_of_full_precision(webgl):
    got = computed(webgl, "c = gl_FragCoord / 1000.0;", np.zeros(64), version=2)[:, 0]
    np.testing.assert_allclose(got, (np.arange(64) + 0.5) / 1000, rtol=3 * 2**-24)


@pytest.mark.parametrize("precision", ["lowp", "mediump", "highp"])
def test_samplers_that_are_not_highp_give_halves_rounded_to_zero_on_llvmpipe(every_webgl, precision):
    """WebGL 1 samplers are lowp unless they say otherwise."""
    points = random(11, RNG_POINTS, 0.25, 0.75)
    given = {"s": Texture(np.float32([[0, 1]]), "r32f", "linear")}
    declare = f"uniform {precision} sampler2D s;"
    got = computed(every_webgl, "c = texture2D(s, vec2(x.r, 0.5));", points, given, declare=declare)[:, 0]
    exact = points * np.float32(2) - np.float32(0.5)
    halves = every_webgl.name == "llvmpipe" and precision != "highp"
    np.testing.assert_array_equal(got, half_towards_zero(exact) if halves else exact)


def half_towards_zero(values):
    """Half-precision numbers nearest to positive float32 ones and not above them."""
    nearest = values.astype(np.float16)
    return np.where(nearest > values, np.nextafter(nearest, np.float16(0)), nearest)


def test_mediump_arithmetic_is_of_half_precision_on_llvmpipe(every_webgl):
    values = random(12, RNG_POINTS, 0.1, 1.0)
    got = computed(every_webgl, "mediump float m = x.r; c = vec4(m, m / 3.0, 0.0, 0.0);", values)
    np.testing.assert_array_equal(got[:, 0], values)
    if every_webgl.name == "llvmpipe":
        np.testing.assert_array_equal(got[:, 1], values.astype(np.float16) / np.float16(3))
    else:
        np.testing.assert_allclose(got[:, 1], values / 3, rtol=3 * 2**-24)


def test_mix_has_the_form_its_driver_gives_it(every_webgl):
    x, y, a = random(13, (3, RNG_POINTS))
    got = computed(every_webgl, "c = vec4(mix(x.r, x.g, x.b));", np.stack([x, y, a], -1))[:, 0]
    forms = {"lavapipe": x * (1 - a) + y * a}
    np.testing.assert_array_equal(got, forms.get(every_webgl.name, x + (y - x) * a))


EXACT = {
    "sqrt(x.r)": np.sqrt,
    "1.0 / x.r": np.reciprocal,
    "x.r * x.r": np.square,
    "x.r + 0.1": lambda x: x + np.float32(0.1),
}


@pytest.mark.parametrize("expression", EXACT)
def test_sums_products_quotients_and_roots_are_correctly_rounded(every_webgl, expression):
    x = random(14, RNG_POINTS, 0.01, 8)
    got = computed(every_webgl, f"c = vec4({expression});", x)[:, 0]
    np.testing.assert_array_equal(got, EXACT[expression](x))


# Measured on 4096 numbers in 0.01 ... 8 and rounded up.
ULP = {
    "exp(-x.r)": (lambda x: np.exp(-x), 9),
    "exp2(-x.r)": (lambda x: np.exp2(-x), 4),
    "pow(x.r, 2.2)": (lambda x: x ** np.float64(np.float32(2.2)), 11),
    "inversesqrt(x.r)": (lambda x: 1 / np.sqrt(x), 2),
    "length(vec3(x.r, 1.0, 2.0))": (lambda x: np.sqrt(x * x + 5), 1),
    "normalize(vec3(x.r, 1.0, 2.0)).y": (lambda x: 1 / np.sqrt(x * x + 5), 3),
}


@pytest.mark.parametrize("expression", ULP)
def test_functions_are_within_their_ulps(every_webgl, expression):
    function, ulps = ULP[expression]
    x = random(14, RNG_POINTS, 0.01, 8)
    got = computed(every_webgl, f"c = vec4({expression});", x)[:, 0].astype(np.float64)
    expected = function(x.astype(np.float64))
    assert np.max(np.abs(got - expected) / np.spacing(expected.astype(np.float32))) <= ulps


def test_logarithms_and_sines_have_absolute_errors(every_webgl):
    x = random(15, RNG_POINTS, 0.01, 8)
    angles = random(16, RNG_POINTS, 0, 100)
    logs = computed(every_webgl, "c = vec4(log(x.r));", x)[:, 0]
    sines = computed(every_webgl, "c = vec4(sin(x.r));", angles)[:, 0]
    assert np.max(np.abs(logs - np.log(x.astype(np.float64)))) <= 4e-7
    worst = np.max(np.abs(sines - np.sin(angles.astype(np.float64))))
    assert worst <= 1e-7 if every_webgl.name in MESA else 1e-4 < worst < 2e-4
