"""Fetches, held to a scalar loop after the specifications; tests/webgl holds them to what GPUs give."""

import itertools
import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from volref.stages.textures import Texture, fetch, fetch_mipmapped, fetch_slices, mip_chain
from volref.workspace import Workspace

SHAPES = [(5, 7, 1), (1, 9, 4), (6, 1, 2), (1, 1, 3), (4, 5, 6, 2), (3, 1, 4, 1)]
coordinate = st.floats(-2, 3, width=32)


def texel(texels, place, wrap):
    """Texel at whole places x, y (and z), beyond the edges too."""
    sizes = texels.shape[-2::-1]
    inside = [min(max(i, 0), n - 1) if wrap == "clamp" else i % n for i, n in zip(place, sizes, strict=True)]
    return texels[tuple(inside[::-1])]


def expected_linear(texels, point, wrap):
    """OpenGL ES 3.0, section 3.8.10.2: the sum of weighted texels, in fractions."""
    places = [Fraction(u) * n - Fraction(1, 2) for u, n in zip(point, texels.shape[-2::-1], strict=True)]
    total = [Fraction(0)] * texels.shape[-1]
    for sides in itertools.product((0, 1), repeat=len(point)):
        weight = Fraction(1)
        for place, side in zip(places, sides, strict=True):
            fraction = place - math.floor(place)
            weight *= fraction if side else 1 - fraction
        found = texel(texels, [math.floor(p) + s for p, s in zip(places, sides, strict=True)], wrap)
        total = [t + weight * Fraction(float(v)) for t, v in zip(total, found, strict=True)]
    return [float(t) for t in total]


def expected_nearest(texels, point, wrap):
    places = [math.floor(Fraction(u) * n) for u, n in zip(point, texels.shape[-2::-1], strict=True)]
    return texel(texels, places, wrap).tolist()


def expected_codes(codes, point, bits=8):
    """What Mesa does: places in whole 2^-bits, and each interpolation rounded to a code, halves up."""
    places = [
        round(Fraction(u) * n * 2**bits - 2 ** (bits - 1))
        for u, n in zip(point, codes.shape[-2::-1], strict=True)
    ]
    sides = itertools.product((0, 1), repeat=len(point))
    found = {
        s: texel(codes, [(p >> bits) + d for p, d in zip(places, s, strict=True)], "clamp") for s in sides
    }
    for axis, place in enumerate(places):
        weight = place % 2**bits
        found = {
            (*s[:axis], 0, *s[axis + 1 :]): [
                int(a) + math.floor(Fraction(weight * (int(b) - int(a)), 2**bits) + Fraction(1, 2))
                for a, b in zip(low, found[*s[:axis], 1, *s[axis + 1 :]], strict=True)
            ]
            for s, low in found.items()
            if s[axis] == 0
        }
    return found[(0,) * len(point)]


def points(shape, *, dtype=np.float64, count=150, low=-1.0, high=2.0, seed=0):
    """Points at random, at the edges, on texel borders and at texel centres."""
    rng = np.random.default_rng(seed)
    sizes = shape[-2::-1]
    made = rng.uniform(low, high, (len(sizes), count))
    for row, size in zip(made, sizes, strict=True):
        special = [0.0, 1.0, 0.5, 1 / size, 0.5 / size, 1 - 0.5 / size, 1 - 1 / size]
        row[: count // 3] = rng.choice(special, count // 3)
    return made.astype(dtype)


@pytest.mark.parametrize("wrap", ["clamp", "repeat"])
@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_a_linear_fetch_is_the_weighted_sum_of_the_specification(shape, wrap, dtype):
    texels = np.random.default_rng(1).random(shape)
    where = points(shape, dtype=dtype)
    got = fetch(Texture(texels, wrap=wrap), where, Workspace())
    expected = [expected_linear(texels, point, wrap) for point in where.T.tolist()]
    # A coordinate below 2 times a size below 16, less 1/2, is off by 2 ulp of 32, and so is its fraction at a
    # slope of at most 1 along each of 3 axes; "repeat" first rounds the coordinate, by an ulp of 1 times 16.
    np.testing.assert_allclose(got.T, expected, rtol=0, atol=3 * 3 * 32 * np.finfo(dtype).eps)


@pytest.mark.parametrize("wrap", ["clamp", "repeat"])
@pytest.mark.parametrize("shape", SHAPES)
def test_a_nearest_fetch_is_the_texel_in_which_the_point_lies(shape, wrap):
    texels = np.random.default_rng(1).random(shape)
    # 64ths times these sizes are exact, so that no border is crossed by rounding.
    where = np.round(points(shape) * 64) / 64
    got = fetch(Texture(texels, "nearest", wrap), where, Workspace())
    assert got.T.tolist() == [expected_nearest(texels, point, wrap) for point in where.T.tolist()]


def test_nearest_coordinates_are_cut_to_their_bits():
    texels = np.arange(3.0).reshape(1, 3, 1)
    just = np.array([1 / 3 + 1e-9, 1 / 3 + 2.0**-16, 2 / 3 + 1e-9])  # 2^16 2/3 is 43690.67
    sharp, cut = (
        fetch(Texture(texels, "nearest", nearest_bits=bits), (just, just), Workspace())[0].tolist()
        for bits in (None, 16)
    )
    assert (sharp, cut) == ([1, 1, 2], [0, 1, 1])


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_rounded_results_are_those_of_whole_number_arithmetic(shape, dtype):
    codes = np.random.default_rng(2).integers(0, 256, shape)
    where = points(shape, low=0, high=1)
    where = np.round(where * 2**12) / 2**12  # exact times the size
    texture = Texture((codes / 255).astype(dtype), weight_bits=8, result_bits=8)
    got = fetch(texture, where, Workspace())
    assert got.dtype == dtype
    expected = np.array([expected_codes(codes, point) for point in where.T.tolist()]).T
    assert (np.rint(got * 255) == expected).all()
    decoded = expected * np.float32(1 / 255) if dtype == np.float32 else expected / 255
    assert (got == decoded.astype(dtype)).all()


def test_rounded_weights_are_whole_256ths():
    ramp = Texture(np.array([[[0.0], [256.0]]]), weight_bits=8)
    u = np.linspace(0.25, 0.75, 1001)
    got = fetch(ramp, (u, u), Workspace())[0]
    assert got.tolist() == [float(round((x * 2 - 0.5) * 256)) for x in u.tolist()]


@pytest.mark.parametrize("bits", [{}, {"weight_bits": 8}, {"weight_bits": 8, "result_bits": 8}])
@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("filtering", ["linear", "nearest"])
def test_a_fetch_at_a_texels_centre_is_the_texel(shape, bits, filtering):
    texels = np.random.default_rng(3).integers(0, 256, shape) / 255
    centres = np.indices(shape[:-1])[::-1].reshape(len(shape) - 1, -1) + 0.5
    where = centres / np.array(shape[-2::-1])[:, None]
    got = fetch(Texture(texels, filtering, **bits), where, Workspace())
    # The place of a centre is whole but for 2 ulp of 8, at a slope of at most 1 along 3 axes.
    exact = bits or filtering == "nearest"
    tolerance = 0 if exact else 3 * 2 * 8 * np.finfo(float).eps
    np.testing.assert_allclose(got.T.reshape(shape), texels, rtol=0, atol=tolerance)


@given(value=st.integers(0, 255), u=coordinate, v=coordinate, wrap=st.sampled_from(["clamp", "repeat"]))
def test_a_constant_texture_gives_its_constant_exactly(value, u, v, wrap):
    where = np.array([[u], [v]])
    for bits in ({}, {"weight_bits": 8}, {"weight_bits": 8, "result_bits": 8}):
        texture = Texture(np.full((3, 5, 1), value / 255), wrap=wrap, **bits)
        assert fetch(texture, where, Workspace()).tolist() == [[value / 255]]


@given(a=st.floats(-5, 5), b=st.floats(-5, 5), u=st.floats(0.1, 0.9), v=st.floats(0.125, 0.875))
def test_a_linear_texture_is_reproduced_between_the_outer_centres(a, b, u, v):
    y, x = np.mgrid[0:4, 0:5]
    got = fetch(Texture((a * x + b * y)[..., None]), np.array([[u], [v]]), Workspace())[0, 0]
    # 7 roundings of numbers below 5 (4 + 3).
    assert abs(got - (a * (u * 5 - 0.5) + b * (v * 4 - 0.5))) <= 8 * 35 * np.finfo(float).eps


@given(u=st.floats(-1e300, 1e300), v=coordinate)
def test_clamped_is_the_same_as_at_the_edge(u, v):
    texture = Texture(np.random.default_rng(4).random((3, 4, 2)))
    beyond = fetch(texture, np.array([[u], [v]]), Workspace())
    edge = fetch(texture, np.array([[min(max(u, 0.0), 1.0)], [v]]), Workspace())
    assert (beyond == edge).all()


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("wrap", ["clamp", "repeat"])
@pytest.mark.parametrize("options", [{}, {"filter": "nearest"}, {"weight_bits": 8, "result_bits": 8}])
def test_what_is_no_number_gives_some_texel_and_leaves_the_others_alone(shape, wrap, options):
    texture = Texture(np.random.default_rng(5).random(shape), wrap=wrap, **options)
    where = points(shape)
    clean = fetch(texture, where, Workspace())
    where[:, :3] = np.array([np.nan, np.inf, -np.inf])
    got = fetch(texture, where, Workspace())
    assert np.isfinite(got).all()
    assert (got[:, 3:] == clean[:, 3:]).all()


def test_a_texel_that_is_no_number_stays_where_it_is():
    texels = np.ones((3, 4, 1))
    texels[0, 0] = np.nan
    for corner in ((1.0, 0.5), (0.5, 1.0), (1.0, 1.0)):
        assert fetch(Texture(texels), np.array(corner)[:, None], Workspace()).tolist() == [[1.0]]


def test_the_result_has_the_type_of_the_texels_and_coordinates_are_left_alone():
    for values, control in itertools.product((np.float16, np.float32, np.float64), repeat=2):
        texels, where = np.ones((2, 3, 2), values), np.full((2, 5), 0.3, control)
        before = where.copy()
        assert fetch(Texture(texels), where, Workspace()).dtype == values
        assert (where == before).all()


def test_places_are_computed_in_the_type_of_the_coordinates():
    texture = Texture(np.arange(512.0).reshape(1, 512, 1))
    u = np.random.default_rng(6).random(1000).astype(np.float32)
    u = u[(u > 0.01) & (u < 0.99)]
    place = u * np.float32(512) - np.float32(0.5)
    assert fetch(texture, (u, u), Workspace())[0].tolist() == place.astype(float).tolist()


def test_no_points_are_fetched_as_none():
    assert fetch(Texture(np.ones((2, 2, 3))), np.empty((2, 0)), Workspace()).shape == (3, 0)


def test_a_result_outlives_the_next_fetch():
    texture, where, work = (
        Texture(np.random.default_rng(11).random((4, 4, 2))),
        points((4, 4, 2)),
        Workspace(),
    )
    first = fetch(texture, where, work)
    before = first.copy()
    fetch(texture, where[::-1], work)
    assert (first == before).all()


def test_two_slices_are_two_fetches():
    texture = Texture(np.random.default_rng(7).random((8, 9, 2)))
    (u1, v1), (u2, v2) = points((8, 9, 2)), points((8, 9, 2), seed=1)
    first, second = fetch_slices(texture, u1, v1, u2, v2, Workspace())
    assert (first == fetch(texture, (u1, v1), Workspace())[0]).all()
    assert (second == fetch(texture, (u2, v2), Workspace())[0]).all()


# --- levels


def test_each_level_is_the_mean_of_four_of_the_last():
    texels = np.random.default_rng(8).random((5, 8, 2))
    chain = mip_chain(texels)
    assert [level.shape[:2] for level in chain] == [(5, 8), (2, 4), (1, 2), (1, 1)]
    for above, below in itertools.pairwise(chain):
        for y, x in np.ndindex(below.shape[:2]):
            four = [above[min(2 * y + dy, len(above) - 1), 2 * x + dx] for dy in (0, 1) for dx in (0, 1)]
            np.testing.assert_allclose(
                below[y, x], np.mean(four, axis=0), rtol=0, atol=4 * 2.0**-53
            )  # 4 roundings


def test_a_level_between_two_mixes_them():
    chain = [Texture(level) for level in mip_chain(np.random.default_rng(9).random((4, 8, 3)))]
    where = points((4, 8, 3))
    lod = np.random.default_rng(10).uniform(-1, 5, where.shape[1])
    lod[:4] = [0.0, 1.0, 3.0, np.nan]
    levels = np.array([fetch(level, where, Workspace()) for level in chain])
    got = fetch_mipmapped(chain, where, lod, Workspace())
    for n, exact in enumerate(lod.tolist()):
        held = 0.0 if math.isnan(exact) else min(max(exact, 0.0), 3.0)
        k = min(int(held), 2)
        expected = (1 - (held - k)) * levels[k, :, n] + (held - k) * levels[k + 1, :, n]
        np.testing.assert_allclose(got[:, n], expected, rtol=0, atol=4 * 2.0**-53)  # two forms of one mix
