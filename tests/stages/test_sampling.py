import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import ndimage

from tests.oracles import scalar
from volref import Volume
from volref.stages import sampling
from volref.stages.sampling import PAD, bare_grid, cell_corners, padded_grid, trilinear
from volref.workspace import Workspace

EPS = np.finfo(np.float64).eps


def sample(volume, index):
    """Values at index points (n, 3)."""
    position = np.ascontiguousarray(np.asarray(index, dtype=float).T) + PAD
    return trilinear(padded_grid(volume), position, Workspace()).copy()


def random_volume(dtype, centering="cell", shape=(4, 5, 6), seed=0):
    rng = np.random.default_rng(seed)
    if np.dtype(dtype).kind == "f":
        return Volume(rng.normal(size=shape).astype(dtype), centering=centering)
    info = np.iinfo(dtype)
    low, high = max(info.min, -(2**50)), min(info.max, 2**50)
    return Volume(rng.integers(low, high, shape, dtype=dtype, endpoint=True), centering=centering)


def points_inside(volume, n, seed=1):
    low, high = volume.index_bounds
    points = np.random.default_rng(seed).uniform(low, high, (n, 3))
    points[:8] = np.stack(np.meshgrid(*zip(low, high, strict=True)), axis=-1).reshape(8, 3)  # its corners
    return points


@pytest.mark.parametrize("centering", ["cell", "node"])
@pytest.mark.parametrize(
    "dtype", [np.uint8, np.int16, np.uint16, np.int32, np.int64, np.float16, np.float32, float]
)
def test_values_equal_the_scalar_loop_for_every_type(dtype, centering):
    volume = random_volume(dtype, centering)
    points = points_inside(volume, 200)
    expected = [scalar.trilinear(volume.values, point) for point in points]
    # Seven lerps here and eight products of four factors there: below 32 eps of the largest sample.
    tolerance = 32 * EPS * max(map(abs, volume.value_bounds))
    np.testing.assert_allclose(sample(volume, points), expected, rtol=0, atol=tolerance)


def test_values_equal_scipys_map_coordinates_with_its_nearest_border():
    volume = random_volume(float)
    points = points_inside(volume, 500)
    expected = ndimage.map_coordinates(volume.values, points[:, ::-1].T, order=1, mode="nearest")
    np.testing.assert_allclose(sample(volume, points), expected, rtol=0, atol=64 * EPS * 4)  # |samples| < 4


def test_half_voxel_a_cell_volume_is_flat_beyond_the_outer_centres():
    volume = Volume(np.array([[[10.0, 20.0, 40.0]]]))
    x = [-0.5, -0.25, 0.0, 0.5, 1.25, 2.0, 2.5]
    assert sample(volume, [(i, 0, 0) for i in x]).tolist() == [10, 10, 10, 15, 25, 40, 40]


def test_half_voxel_the_texture_coordinate_of_the_first_centre_is_half_over_n():
    volume = Volume(np.array([[[10.0, 20.0, 40.0, 80.0]]]))
    u = np.array([0.0, 0.5 / 4, 1.5 / 4, 2.0 / 4, 1.0])
    assert sample(volume, [(i * 4 - 0.5, 0, 0) for i in u]).tolist() == [10, 10, 20, 30, 80]


def test_half_voxel_a_node_volume_ends_at_its_outer_samples():
    values = np.zeros((2, 2, 3))
    values[...] = [10.0, 20.0, 40.0]
    volume = Volume(values, centering="node")
    assert [bound.tolist() for bound in volume.index_bounds] == [[0, 0, 0], [2, 1, 1]]
    assert sample(volume, [(0, 0, 0), (2, 1, 1), (1.5, 1, 0)]).tolist() == [10, 40, 30]


@given(index=st.integers(0, 119))
def test_a_voxel_centre_gives_its_voxel_exactly(index):
    volume = random_volume(np.float32)
    z, y, x = np.unravel_index(index, volume.values.shape)
    assert sample(volume, [(x, y, z)])[0] == volume.values[z, y, x]


@given(value=st.floats(-1e300, 1e300), x=st.floats(-0.5, 2.5), y=st.floats(-0.5, 1.5))
def test_a_constant_cell_gives_its_constant_exactly(value, x, y):
    assert sample(Volume(np.full((2, 2, 3), value)), [(x, y, 0.5)])[0] == value


@given(c=st.tuples(*[st.floats(-5, 5)] * 4), p=st.tuples(st.floats(0, 4), st.floats(0, 3), st.floats(0, 2)))
def test_linear_fields_are_reproduced(c, p):
    z, y, x = np.mgrid[0:3, 0:4, 0:5].astype(float)
    volume = Volume(c[0] * x + c[1] * y + c[2] * z + c[3], centering="node")
    expected = c[0] * p[0] + c[1] * p[1] + c[2] * p[2] + c[3]
    assert abs(sample(volume, [p])[0] - expected) <= 32 * EPS * 5 * (4 + 3 + 2 + 1)


def test_products_of_coordinates_are_reproduced_and_squares_are_not():
    z, y, x = np.mgrid[0:3, 0:3, 0:3].astype(float)
    point = (0.5, 1.25, 0.75)
    assert sample(Volume(x * y * z), [point])[0] == 0.5 * 1.25 * 0.75  # all dyadic: exact
    assert (
        sample(Volume(x * x), [point])[0] == 0.5
    )  # not 0.25: trilinear is exact to degree 1 per axis, and no more


def test_uint8_differences_do_not_wrap():
    volume = Volume(np.array([[[250, 5]]], np.uint8))
    assert sample(volume, [(0.5, 0, 0)])[0] == 127.5


def test_rounding_past_the_far_face_still_reads_the_border():
    volume = Volume(np.arange(24.0).reshape(2, 3, 4))
    low, high = volume.index_bounds
    beyond = np.nextafter(high, np.inf)
    before = np.nextafter(low, -np.inf)
    assert sample(volume, [beyond, before]).tolist() == [23.0, 0.0]


def test_the_grid_keeps_the_type_of_the_volume():
    assert padded_grid(Volume(np.zeros((3, 3, 3), np.uint8))).corners[0].dtype == np.uint8


# --- a volume that is left where it lies


def bare_volume(seed, order, centering, dtype=np.uint8, shape=(4, 5, 6)):
    values = (np.random.default_rng(seed).random(shape) * 200).astype(dtype)
    return Volume(np.asarray(values, order=order), centering=centering)


def points_within(volume, seed, count=300):
    """Padded positions (3, n) in the whole extent, its corners, faces and samples among them."""
    low, high = volume.index_bounds
    rng = np.random.default_rng(seed)
    points = low + rng.random((count, 3)) * (high - low)
    points[: count // 3] = np.where(rng.random((count // 3, 3)) < 0.5, low, high)
    points[count // 3 : count // 2] = np.clip(np.rint(points[count // 3 : count // 2]), low, high)
    return points.T + PAD


SHAPES = [(4, 5, 6), (1, 5, 6), (4, 1, 6), (4, 5, 1), (2, 2, 2)]


@pytest.mark.parametrize("order", ["C", "F"])
@pytest.mark.parametrize(
    ("shape", "centering"), [*((shape, "cell") for shape in SHAPES), ((4, 5, 6), "node"), ((2, 2, 2), "node")]
)
def test_a_bare_grid_is_the_same_field_as_a_padded_one(shape, centering, order):
    volume = bare_volume(0, order, centering, np.float32, shape)
    positions = points_within(volume, 1)
    padded = trilinear(padded_grid(volume), positions.copy(), Workspace()).copy()
    bare = trilinear(bare_grid(volume), positions.copy(), Workspace())
    # The fractions are those of other whole numbers: an ulp of 8, times differences of 200.
    np.testing.assert_allclose(bare, padded, rtol=0, atol=200 * 8 * EPS)


@pytest.mark.parametrize("order", ["C", "F"])
@pytest.mark.parametrize("shape", SHAPES)
def test_cells_of_a_bare_grid_have_the_corners_of_a_padded_one(shape, order):
    volume = bare_volume(3, order, "cell", shape=shape)
    nz, ny, nx = shape
    wholes = [
        whole.ravel()
        for whole in np.meshgrid(np.arange(nx + 1), np.arange(ny + 1), np.arange(nz + 1), indexing="ij")
    ]
    for bare, padded in zip(
        cell_corners(bare_grid(volume), wholes), cell_corners(padded_grid(volume), wholes), strict=True
    ):
        np.testing.assert_array_equal(bare, padded)


@pytest.mark.parametrize("make", [padded_grid, bare_grid])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_positions_may_be_counted_from_whole_corners(make, dtype):
    volume = bare_volume(4, "C", "cell")
    positions = points_within(volume, 5)
    corner = np.floor(positions).astype(np.int32) - 3
    grid = make(volume)
    whole = trilinear(grid, positions.copy(), Workspace()).copy()
    relative = trilinear(grid, (positions - corner).astype(dtype), Workspace(), corner)
    # Relative positions are below 4: half an ulp of that, times the differences of 200 along three axes, and
    # the roundings of seven interpolations.
    np.testing.assert_allclose(relative, whole, rtol=0, atol=200 * 16 * np.finfo(dtype).eps)


def test_only_large_mapped_volumes_are_left_where_they_lie(tmp_path, monkeypatch):
    monkeypatch.setattr(sampling, "MOST_COPIED", 100)
    np.save(tmp_path / "values.npy", np.zeros((5, 5, 5), np.uint8))
    mapped = np.load(tmp_path / "values.npy", mmap_mode="r")
    assert sampling.grid_of(Volume(mapped)).last == (4, 4, 4)
    assert sampling.grid_of(Volume(np.array(mapped))).last is None
    assert sampling.grid_of(Volume(mapped[:2])).last is None  # small
    assert sampling.grid_of(Volume(mapped[::-1])).last is None  # not one after the other
