"""Ranges over blocks against loops over blocks; that passes are few; that they take little memory."""

import gc
import tracemalloc
import weakref

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from volref.scene import blocks
from volref.scene.blocks import Pass, block_ranges, flag_blocks, keep_ranges
from volref.scene.volume import Volume

TYPES = (np.uint8, np.int8, np.int16, np.float16, np.float32, np.float64)


def slow_ranges(values, block, reach):
    """The same by definition: a slice of the samples for each block."""
    counts = [-(-n // block) for n in values.shape]
    low, high = np.empty(counts), np.empty(counts)
    for place in np.ndindex(*counts):
        window = tuple(
            slice(max(b * block - r, 0), b * block + block + r + 1)
            for b, r in zip(place, reach[::-1], strict=True)
        )
        low[place], high[place] = values[window].min(), values[window].max()
    return low, high


def in_memory(values, order):
    """The same numbers, laid out in another way."""
    if order == "reversed":
        return values[::-1, :, ::-1].copy()[::-1, :, ::-1]
    if order == "swapped":
        return np.ascontiguousarray(values.transpose(1, 0, 2)).transpose(1, 0, 2)
    return np.array(values, order=order)


@given(
    shape=st.tuples(*[st.integers(1, 23)] * 3),
    dtype=st.sampled_from(TYPES),
    order=st.sampled_from(["C", "F", "reversed", "swapped"]),
    block=st.sampled_from([1, 2, 3, 4, 8, 16]),
    reach=st.tuples(*[st.integers(0, 30)] * 3),
    chunk=st.sampled_from([200, 4096, 1 << 22]),
    small=st.sampled_from([0, 1 << 23]),
    seed=st.integers(0, 9),
)
def test_ranges_are_over_all_samples_of_a_block_and_its_reach_and_no_others(
    shape, dtype, order, block, reach, chunk, small, seed
):
    values = np.random.default_rng(seed).normal(0, 40, shape).astype(dtype)
    volume = Volume(in_memory(values, order))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(blocks, "CHUNK_BYTES", chunk)
        patch.setattr(blocks, "MOST_FOR_SMALL", small)
        low, high = block_ranges(volume, block, reach)
    expected = slow_ranges(values, block, reach)
    assert low.dtype == high.dtype == np.float64
    assert np.array_equal(low, expected[0])
    assert np.array_equal(high, expected[1])


@given(dtype=st.sampled_from(TYPES), seed=st.integers(0, 9), chunk=st.sampled_from([5000, 1 << 18]))
def test_flags_are_those_of_the_ranges(dtype, seed, chunk):
    # 83 x 81 x 83 cells: more blocks of 2 than the 65536 ranges that two bytes can have
    values = np.random.default_rng(seed).normal(0, 40, (83, 81, 83)).astype(dtype)
    volume = Volume(values)

    low, high = block_ranges(volume, 2, (1, 0, 1))
    limits = np.median(low), np.median(high)

    def flag(low, high):
        return (low > limits[0]) | (high < limits[1])

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(blocks, "CHUNK_BLOCKS", chunk)
        flags = flag_blocks(volume, 2, (1, 0, 1), flag)
    expected = flag(low, high)
    assert expected.any()
    assert not expected.all()
    assert np.array_equal(flags, expected)


def test_a_flag_of_bytes_is_never_asked_for_a_range_that_cannot_be():
    volume = Volume(np.random.default_rng(0).integers(0, 255, (83, 83, 83), np.uint8))

    def flag(low, high):
        assert (low <= high).all()
        return high > 20

    assert flag_blocks(volume, 2, (0, 0, 0), flag).any()


def passes(monkeypatch):
    """Count the passes over the voxels of volumes."""
    made, reduced = [], blocks._reduced

    def counted(ranges, windows):
        if ranges[0] is ranges[1]:
            made.append([window.width for window in windows])
        return reduced(ranges, windows)

    monkeypatch.setattr(blocks, "_reduced", counted)
    return made


def test_all_that_the_integrators_ask_of_a_small_volume_is_one_pass(monkeypatch):
    made = passes(monkeypatch)
    volume = Volume(np.random.default_rng(0).random((20, 21, 22)))
    for block, reach in ((2, 0), (4, 2), (4, 2), (8, 4), (4, 10)):
        block_ranges(volume, block, (reach, reach, reach))
    assert made == [[3, 3, 3]]


def test_larger_blocks_of_a_large_volume_come_from_those_of_4(monkeypatch):
    monkeypatch.setattr(blocks, "MOST_FOR_SMALL", 0)
    made = passes(monkeypatch)
    volume = Volume(np.random.default_rng(0).random((20, 21, 22)))
    for block, reach in ((4, 0), (8, 4), (16, 8), (4, 12)):
        block_ranges(volume, block, (reach, reach, reach))
    block_ranges(volume, 4, (2, 6, 1))
    assert made == [[5, 5, 5], [7, 9, 9]]


def test_the_last_few_passes_are_kept_as_long_as_the_volume_lives(monkeypatch):
    made = passes(monkeypatch)
    volume = Volume(np.random.default_rng(0).random((9, 9, 9)))
    for block in (3, 5, 7, 9, 11):
        block_ranges(volume, block, (0, 0, 0))
    block_ranges(volume, 11, (0, 0, 0))
    assert len(made) == blocks.MOST_KEPT + 1
    block_ranges(volume, 3, (0, 0, 0))
    assert len(made) == blocks.MOST_KEPT + 2
    alive = weakref.ref(volume)
    del volume
    gc.collect()
    assert alive() is None


def test_a_keeper_is_asked_first_and_told_of_what_was_made():
    volume = Volume(np.zeros((9, 9, 9)))
    told = []

    class Memory:
        def read(self, made):
            return (np.full((5, 5, 5), 7.0),) * 2 if made == Pass(2, (1, 0, 0)) else None

        def write(self, made, ranges):
            told.append((made, ranges[0].shape))

    keep_ranges(volume, Memory())
    assert block_ranges(volume, 2, (0, 0, 1))[0].max() == 7.0
    assert block_ranges(volume, 2, (0, 0, 0))[0].max() == 0.0
    assert told == [(Pass(2, (0, 0, 0)), (5, 5, 5))]


@pytest.mark.parametrize("block", [4, 8, 32])
def test_a_pass_takes_little_more_memory_than_its_result(block):
    # 1 GiB in uint8 would take the same: chunks are as large, and its result is 32 MiB
    volume = Volume(np.zeros((256, 256, 512), np.uint8))
    tracemalloc.start()
    blocks._stored_ranges(volume, block, (2, 2, 2))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    # the ranges of blocks of 4, and a few buffers for a chunk of 4 MiB
    assert peak < 2 * volume.values.size / 64 + (10 << 20)


@pytest.mark.parametrize("order", ["C", "F"])
def test_voxels_that_are_not_finite_are_counted_and_replaced_in_any_order_of_memory(order, monkeypatch):
    monkeypatch.setattr("volref.scene.volume.PART_BYTES", 100)
    values = np.zeros((5, 6, 7), order=order)
    values[3, 2, 5], values[4, 5, 6] = np.nan, np.inf
    with pytest.raises(ValueError, match=r"got nan at \(z, y, x\) = \(3, 2, 5\) and 2 such voxels"):
        Volume(values)
    filled = Volume(values, nan=2.0)
    assert filled.values.sum() == 4.0
    assert filled.value_bounds == (0.0, 2.0)
