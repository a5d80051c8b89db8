"""Random start offsets: uniform, independent of how they are made, and the same everywhere."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from volref import SceneError, jitter_images
from volref.stages.jitter import repeated


def test_a_frame_does_not_depend_on_how_many_are_made():
    all_frames = jitter_images(5, 4, frames=6, seed=3)
    assert np.array_equal(jitter_images(5, 4, frames=2, seed=3), all_frames[:2])
    assert np.array_equal(jitter_images(5, 4, frames=2, seed=3, first=4), all_frames[4:])


def test_frames_and_seeds_differ():
    images = [jitter_images(8, 8, seed=s, first=k)[0] for s, k in [(0, 0), (0, 1), (1, 0), (1, 1)]]
    assert len({image.tobytes() for image in images}) == 4


def test_offsets_are_uniform_in_0_to_1():
    offsets = jitter_images(100, 100, frames=2, seed=11)
    assert offsets.min() >= 0
    assert offsets.max() < 1
    # A seed is fixed: this either holds for ever or never. 1 in 1000 seeds would be refused.
    assert stats.kstest(offsets.ravel(), "uniform").pvalue > 1e-3
    assert abs(np.corrcoef(offsets[0].ravel(), offsets[1].ravel())[0, 1]) < 3 / 100


@given(st.integers(1, 9), st.integers(1, 9))
def test_a_texture_is_repeated_from_the_upper_left_corner(width, height):
    texture = np.arange(6.0).reshape(2, 3)
    image = repeated(texture, width, height)
    assert all(image[y, x] == texture[y % 2, x % 3] for y in range(height) for x in range(width))


@pytest.mark.parametrize(
    "call", [(0, 1, 1, 0), (1, 70000, 1, 0), (1, 1, 0, 0), (1, 1, 1, -1), (1, 1, 1, 0.5), (1, 1, 1, 2**64)]
)
def test_numbers_out_of_range_are_refused(call):
    with pytest.raises(SceneError, match="must be a whole number from"):
        jitter_images(*call)
