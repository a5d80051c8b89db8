"""Tests of volref.stages.raster."""

import numpy as np

from volref.stages.raster import depth_test, rasterize

SQUARE = np.array([[-1.0, -1.0, 0.0, 1.0], [1.0, -1.0, 0.0, 1.0], [1.0, 1.0, 0.0, 1.0], [-1.0, 1.0, 0.0, 1.0]])
HALVES = np.array([[0, 1, 2], [0, 2, 3]])


def test_two_halves_cover_every_pixel_of_a_square_once():
    fragments = rasterize(SQUARE, HALVES, SQUARE[:, :2], 5, 5, subpixel_bits=4)
    np.testing.assert_array_equal(np.sort(fragments.pixel), np.arange(25))
    assert fragments.front.all()
    np.testing.assert_array_equal(depth_test(fragments, 25), np.argsort(fragments.pixel))
