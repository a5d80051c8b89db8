"""Gradients against scalar loops, polynomials and linear ramps in the world."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mpmath import mp, mpf

from tests.oracles import lit_ray
from volref.stages.gradients import (
    cej_kernels,
    cell_gradient,
    differentiated,
    in_world,
    length_and_direction,
    sobel,
    sobel_kernels,
)

EPS = np.finfo(np.float64).eps
SEEDS = st.integers(0, 2**32 - 1)

# The kernels of seed 004's system, [z][y][x], times 27; the last number of all is its slip.
PRINTED_X = [[[1, 0, -1], [2, 0, -2], [1, 0, -1]], [[2, 0, -2], [4, 0, -4], [2, 0, -2]]]
PRINTED_X = [*PRINTED_X, PRINTED_X[0]]
PRINTED_Y = [[[1, 2, 1], [0, 0, 0], [-1, -2, -1]], [[2, 4, 2], [0, 0, 0], [-2, -4, -2]]]
PRINTED_Y = [*PRINTED_Y, PRINTED_Y[0]]
PRINTED_Z = [[[1, 2, 1], [2, 4, 2], [1, 2, 1]], [[0] * 3] * 3, [[-1, -2, -1], [-2, -4, -2], [-1, -2, -2]]]


def grid(shape=(4, 5, 6)):
    z, y, x = np.indices(shape).astype(np.float64)
    return x, y, z


def every_voxel(shape):
    return [(x, y, z) for z in range(shape[0]) for y in range(shape[1]) for x in range(shape[2])]


def samples(dtype, shape=(4, 3, 5)):
    values = np.random.default_rng(4).uniform(-1, 1, shape)
    if np.dtype(dtype).kind in "iu":
        info = np.iinfo(dtype)
        return np.random.default_rng(4).integers(info.min, info.max, shape, dtype, endpoint=True)
    return values.astype(dtype)


def whole_sobel(values):
    return np.stack([sobel(values, axis) for axis in range(3)])


@pytest.mark.parametrize("dtype", ["u1", "i1", "u2", "i2", "u4", "i4", "f2", "f4", "f8"])
@pytest.mark.parametrize("shape", [(4, 3, 5), (1, 2, 1)])
def test_sobel_is_the_scalar_loop_with_held_borders(dtype, shape):
    values = samples(dtype, shape)
    found, lists = whole_sobel(values), values.astype(np.float64).tolist()
    for x, y, z in every_voxel(shape):
        expected = lit_ray.sobel_difference(lists, x, y, z)
        # 18 products of a power of two, added in another order; whole numbers of up to 32 bits are exact
        exact = np.dtype(dtype).kind in "iu"
        np.testing.assert_allclose(found[:, z, y, x], expected, rtol=0, atol=0 if exact else 18 * EPS)


def test_sobel_is_kept_in_float32_only_where_that_is_exact():
    kinds = ("i1", "u2", "i4", "f2", "f4")
    assert [kind for kind in kinds if sobel(samples(kind), 0).dtype == np.float32] == ["i1", "u2"]
    # The widest that 16 bits give: a difference of 65535, and one less in one corner, of weight 1/32.
    values = np.zeros((3, 3, 3), np.uint16)
    values[:, :, 2] = 65535
    values[0, 0, 2] = 65534
    assert sobel(values, 0)[1, 1, 1] == 65535 / 2 - 1 / 32


@given(value=st.floats(-1e300, 1e300), seed=SEEDS)
def test_sobel_is_exactly_zero_where_nothing_changes(value, seed):
    # Anything else has a direction, and a flat part of a volume would be lit from anywhere.
    assert not whole_sobel(np.full((3, 4, 2), value)).any()
    along_x = np.random.default_rng(seed).random(6) * np.ones((4, 3, 1))
    assert not whole_sobel(along_x)[1:].any()


def test_sobel_is_the_correlation_with_its_kernels():
    values = samples(np.float64)
    found, expected = whole_sobel(values), differentiated(values, sobel_kernels())
    np.testing.assert_allclose(found, expected, rtol=0, atol=18 * EPS)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_the_sobel_kernels_are_exact_for_ramps_and_smooth_across(axis):
    kernel = sobel_kernels()[axis]
    coordinates = np.indices((3, 3, 3))[::-1] - 1.0  # x, y, z
    assert (kernel * coordinates[axis]).sum() == 1.0
    for other in coordinates[np.arange(3) != axis]:
        assert (kernel * other).sum() == 0.0
    assert kernel.sum() == 0.0
    assert np.abs(kernel).sum() == 1.0


@pytest.mark.parametrize("dtype", [np.float64, np.float16])
@pytest.mark.parametrize("kernels", [cej_kernels(), np.random.default_rng(0).random((3, 3, 3, 3))])
def test_correlation_is_the_scalar_loop_with_held_borders(kernels, dtype):
    values = samples(dtype)
    found, lists = differentiated(values, kernels), values.tolist()
    for x, y, z in every_voxel(values.shape):
        expected = [lit_ray.correlated(lists, kernel.tolist(), x, y, z) for kernel in kernels]
        np.testing.assert_allclose(found[:, z, y, x], expected, rtol=0, atol=27 * 27 * EPS)  # 27 products


def test_the_kernels_of_seed_004_are_those_of_its_code_slip_included():
    for kernel, printed in zip(cej_kernels(), (PRINTED_X, PRINTED_Y, PRINTED_Z), strict=True):
        np.testing.assert_allclose(kernel * 27, printed, rtol=0, atol=4 * EPS)
    # Without the slip they are minus Sobel's, as large as 32/27 of the gradient.
    x, y, z = grid()
    minus = differentiated(3 * x - 2 * y + 5 * z, cej_kernels())[:, 2, 2, 2]
    np.testing.assert_allclose(minus[:2], [-3 * 32 / 27, 2 * 32 / 27], rtol=0, atol=100 * EPS)


@given(value=st.floats(-1e3, 1e3))
def test_the_slip_of_seed_004_gives_constants_a_gradient_along_z(value):
    found = differentiated(np.full((3, 3, 3), value), cej_kernels())
    # sums of up to 16 / 27 of the value, each rounded
    np.testing.assert_allclose(found[:2], 0.0, rtol=0, atol=27 * abs(value) * EPS)
    np.testing.assert_allclose(found[2], -value / 27, rtol=0, atol=27 * abs(value) * EPS)


def cell(seed, n=20):
    random = np.random.default_rng(seed)
    return [random.uniform(-1, 1, n) for _ in range(8)], random.random((3, n))


@given(seed=SEEDS)
def test_the_gradient_of_a_cell_is_the_derivative_of_its_trilinear_function(seed):
    corners, fraction = cell(seed, 3)
    found = cell_gradient(corners, fraction)

    def value(k, place):
        total = mpf(0)
        for corner, samples_here in enumerate(corners):
            weight = mpf(float(samples_here[k]))
            for axis, f in enumerate(place):
                weight *= f if corner >> axis & 1 else 1 - f
            total += weight
        return total

    with mp.workdps(30):
        for k in range(3):
            place = [mpf(f) for f in fraction[:, k]]
            for axis in range(3):
                ends = []
                for way in (-1, 1):
                    moved = list(place)
                    moved[axis] += way * mpf("0.25")
                    ends.append(value(k, moved))
                slope = (ends[1] - ends[0]) * 2  # the function is linear along each axis
                assert found[axis, k] == pytest.approx(float(slope), abs=16 * EPS)  # one difference, mixed


@given(
    coefficients=st.lists(st.integers(-9, 9), min_size=8, max_size=8),
    eighths=st.lists(st.integers(0, 8), min_size=3, max_size=3),
)
def test_the_gradient_of_a_cell_is_exact_for_polynomials(coefficients, eighths):
    a, b, c, d, e, f, g, h = coefficients
    corners = [
        np.array([a + b * x + c * y + d * z + e * x * y + f * y * z + g * z * x + h * x * y * z], np.float64)
        for z in (0, 1)
        for y in (0, 1)
        for x in (0, 1)
    ]
    x, y, z = (k / 8 for k in eighths)
    found = cell_gradient(corners, np.array([[x], [y], [z]]))
    expected = [b + e * y + g * z + h * y * z, c + e * x + f * z + h * z * x, d + f * y + g * x + h * x * y]
    assert found.ravel().tolist() == expected  # whole numbers and eighths: nothing is rounded


@given(value=st.floats(-1e300, 1e300), seed=SEEDS)
def test_the_gradient_of_a_constant_cell_is_exactly_zero(value, seed):
    assert not cell_gradient([np.array([value])] * 8, cell(seed, 1)[1]).any()


@given(seed=SEEDS)
def test_in_the_world_a_gradient_says_how_the_value_changes_with_a_step(seed):
    # The value is g . index, and an index changes by M times the step in the world.
    random = np.random.default_rng(seed)
    matrix = np.eye(4)
    matrix[:3] = random.normal(size=(3, 4))
    gradient, step = random.normal(size=(3, 7)), random.normal(size=3)
    found = in_world(gradient, matrix)
    change = gradient.T @ (matrix[:3, :3] @ step)
    np.testing.assert_allclose(found.T @ step, change, rtol=0, atol=1e3 * EPS)  # sums of products


@given(seed=SEEDS, scale=st.sampled_from([1e-310, 1e-200, 1e-3, 1.0, 1e200, 1e307]))
def test_lengths_and_directions_of_vectors_of_any_size(seed, scale):
    vectors = np.random.default_rng(seed).uniform(-1, 1, (3, 10)) * scale
    length, direction = length_and_direction(vectors)
    # Numbers below 1e-307 have fewer digits themselves; three squares, a root and two products are rounded.
    np.testing.assert_allclose((direction**2).sum(axis=0), 1.0, rtol=0, atol=8 * EPS)
    np.testing.assert_allclose(length * direction, vectors, rtol=8 * EPS, atol=2e-323)
    assert (length >= np.abs(vectors).max(axis=0)).all()


def test_a_vector_of_length_zero_has_no_direction():
    length, direction = length_and_direction(np.zeros((3, 2)))
    assert not length.any()
    assert not direction.any()
