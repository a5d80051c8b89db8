import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from volref import SceneError, Volume
from volref.scene.blocks import block_ranges


def test_half_voxel_the_extent_of_a_cell_volume_reaches_beyond_its_outer_centres():
    volume = Volume(np.zeros((1, 1, 4)), spacing=(2, 1, 1))
    assert volume.corners[:, 0].min() == -1.0
    assert volume.corners[:, 0].max() == 7.0


def test_half_voxel_the_extent_of_a_node_volume_ends_at_its_outer_samples():
    volume = Volume(np.zeros((2, 2, 4)), spacing=(2, 1, 1), centering="node")
    assert volume.corners[:, 0].min() == 0.0
    assert volume.corners[:, 0].max() == 6.0


def test_the_origin_is_the_centre_of_the_first_voxel():
    turn = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]  # index x runs along world y, index y along -x
    volume = Volume(np.zeros((2, 3, 4)), (1, 2, 3), (10, 20, 30), turn)
    assert (volume.world_from_index @ [0, 0, 0, 1])[:3].tolist() == [10, 20, 30]
    assert (volume.world_from_index @ [1, 0, 0, 1])[:3].tolist() == [10, 21, 30]
    assert (volume.world_from_index @ [0, 1, 0, 1])[:3].tolist() == [8, 20, 30]
    np.testing.assert_allclose(volume.index_from_world @ volume.world_from_index, np.eye(4), atol=1e-14)


def test_values_are_kept_without_a_copy_and_cannot_be_written_through():
    values = np.zeros((2, 2, 2), np.uint8)
    volume = Volume(values)
    assert np.shares_memory(volume.values, values)
    with pytest.raises(ValueError, match="read-only"):
        volume.values[0, 0, 0] = 1


def test_foreign_byte_order_becomes_native():
    volume = Volume(np.arange(8, dtype=">i2").reshape(2, 2, 2))
    assert volume.values.dtype.isnative
    assert volume.values[1, 1, 1] == 7


def test_nan_is_refused_unless_a_value_is_stated_for_it():
    values = np.zeros((2, 2, 2))
    values[1, 0, 1], values[0, 0, 0] = np.nan, -np.inf
    with pytest.raises(SceneError, match=r"got -inf at \(z, y, x\) = \(0, 0, 0\) and 2 such voxels"):
        Volume(values)
    assert Volume(values, nan=-5.0).values.min() == -5.0
    assert np.isnan(values[1, 0, 1])


def test_interpolated_values_stay_within_the_value_bounds():
    assert Volume(np.array([[[3, 250]]], np.uint8)).value_bounds == (3.0, 250.0)


@given(
    shape=st.tuples(*[st.integers(1, 11)] * 3),
    block=st.sampled_from([2, 4]),
    reach=st.tuples(*[st.integers(0, 3)] * 3),
    seed=st.integers(0, 9),
)
def test_block_ranges_bound_every_value_within_their_reach(shape, block, reach, seed):
    rng = np.random.default_rng(seed)
    volume = Volume(rng.normal(size=shape))
    low, high = block_ranges(volume, block, reach)
    limit = np.array(volume.size) - 1.0
    for _ in range(20):
        place = rng.uniform(-0.5, limit + 0.5)  # a point of the extent, and another at most `reach` away
        other = np.clip(place + rng.uniform(-1, 1, 3) * reach, -0.5, limit + 0.5)
        b = np.clip(place // block, 0, np.array(low.shape[::-1]) - 1).astype(int)
        lower = np.clip(np.floor(other), 0, limit).astype(int)
        upper = np.clip(np.floor(other) + 1, 0, limit).astype(int)
        for x, y, z in np.ndindex(2, 2, 2):
            corner = [(upper if bit else lower)[axis] for axis, bit in enumerate((x, y, z))]
            sample = volume.values[corner[2], corner[1], corner[0]]
            assert low[b[2], b[1], b[0]] <= sample <= high[b[2], b[1], b[0]]


@pytest.mark.parametrize(("dtype", "value"), [(np.float16, 1e10), (np.float32, 1e39)])
def test_a_replacement_that_the_type_cannot_hold_is_refused(dtype, value):
    values = np.full((2, 2, 2), np.nan, dtype)
    with pytest.raises(SceneError, match=f"volume.nan must be a finite {np.dtype(dtype)}"):
        Volume(values, nan=value)


@pytest.mark.parametrize("dtype", [float, int])
def test_masked_arrays_are_refused_since_nobody_said_what_the_mask_means(dtype):
    values = np.ma.masked_equal(np.arange(8, dtype=dtype).reshape(2, 2, 2), 3)
    with pytest.raises(SceneError, match=r"got a masked one; say .* with \.filled\(VALUE\)"):
        Volume(values)
    assert Volume(values.filled(0)).values[0, 1, 1] == 0


def test_ragged_rows_are_refused_in_one_sentence():
    with pytest.raises(SceneError, match=r"volume.values must be an array, got rows of different lengths"):
        Volume([[[1, 2], [3]]])


@pytest.mark.parametrize("spacing", [1e-200, 1e200])
def test_lengths_whose_squares_overflow_are_refused(spacing):
    with pytest.raises(SceneError, match=r"volume.spacing must"):
        Volume(np.zeros((2, 2, 2)), spacing=(1, 1, spacing))
