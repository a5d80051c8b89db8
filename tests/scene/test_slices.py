"""Slices: pixel by voxel along the axes; anywhere, against the exact value where a ray meets the plane."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.oracles.scalar import table_value
from tests.scenes import rough_volume
from volref import Camera, Plane, Scene, SceneError, TransferFunction, Volume
from volref.scene.slices import axis_slice, oblique_slice
from volref.stages.rays import pixel_rays
from volref.truth.digits.lattice import corner_samples, exact_point
from volref.truth.modes.reductions import prepare_reduction, reduce_pixels

COLORS = [(0.2, 0.0, 1.0), (1.0, 0.6, 0.1), (0.9, 0.9, 0.3)]
TABLE = TransferFunction([0.0, 0.4, 1.0], COLORS, opacity=[0.1, 0.9, 0.5])
BEHIND = (0.1, 0.2, 0.3, 0.5)

# A rotation, shear and mirror that no number of index space survives exactly.
TURNED = np.array([[0.6, -0.8, 0.1], [0.8, 0.6, 0.2], [0.0, 0.1, -1.0]])
TURNED /= np.linalg.norm(TURNED, axis=0)


def drawn(scene, begin=0.0, distance=np.inf):
    count = scene.width * scene.height
    behind = np.tile(np.array(scene.background), (count, 1))
    end = np.full(count, float(distance))
    out = reduce_pixels(scene, prepare_reduction(scene), np.arange(count), begin, end, behind, 1e-12)
    shape = scene.height, scene.width
    return out.rgba.reshape(*shape, 4), out.bound.reshape(shape)


def classified(value):
    """The layer of a value over what lies behind, by the scalar table."""
    opacity = table_value(list(TABLE.values), list(TABLE.opacity), value)
    color = [table_value(list(TABLE.values), list(c), value) for c in TABLE.colors.T]
    return [(1 - opacity) * b + opacity * c for b, c in zip(BEHIND, [*color, 1.0], strict=True)]


def assert_shows(scene, values):
    """Each pixel shows the value at its place exactly: to the rounding of classification."""
    rgba, bound = drawn(scene)
    assert values.shape == bound.shape
    truth = np.array([[classified(v) for v in row] for row in values.tolist()])
    np.testing.assert_allclose(rgba, truth, rtol=0, atol=4 * 2.0**-53)
    # Where the world lies 1000 away, index space is known to some 1e-13.
    assert bound.max() < 1e-11


@pytest.mark.parametrize("centering", ["cell", "node"])
@pytest.mark.parametrize(
    "place", [{}, {"spacing": (0.7, 1.3, 5.0), "origin": (-20.0, 3.0, 1e3), "direction": TURNED}]
)
def test_axis_slices_show_the_voxels_exactly_to_the_outermost_ones(place, centering):
    volume = rough_volume(4, shape=(4, 6, 9), centering=centering, **place)
    values = volume.values
    for k in (0, 2, 3):
        assert_shows(axis_slice(volume, TABLE, "z", k, background=BEHIND), values[k])
        assert_shows(axis_slice(volume, TABLE, "y", k, background=BEHIND), values[:, k])
        assert_shows(axis_slice(volume, TABLE, "x", k, background=BEHIND), values[:, :, k])


def test_columns_and_rows_grow_as_they_are_told_to():
    volume = rough_volume(5, shape=(3, 4, 5))
    for columns, rows, flip in [
        ("left", "down", np.s_[:, ::-1]),
        ("right", "up", np.s_[::-1]),
        ("left", "up", np.s_[::-1, ::-1]),
    ]:
        scene = axis_slice(volume, TABLE, "z", 1, columns=columns, rows=rows, background=BEHIND)
        assert_shows(scene, volume.values[1][flip])


def test_between_two_slices_pixels_are_the_mean_by_distance():
    volume = rough_volume(6)
    scene = axis_slice(volume, TABLE, "z", 1.25, background=BEHIND)
    truth = 0.75 * volume.values[1] + 0.25 * volume.values[2]
    rgba, bound = drawn(scene)
    for (row, column), value in np.ndenumerate(truth):
        # The mean itself is rounded too; slopes of the table are up to 2.
        assert np.abs(rgba[row, column] - classified(value)).max() <= bound[row, column] + 8 * 2.0**-53
    assert bound.max() < 1e-12


def test_an_index_outside_or_an_unknown_word_is_refused_in_one_sentence():
    volume = rough_volume(0, centering="node")
    with pytest.raises(SceneError, match=r"^slice.index must be at most 6, got 6.1; "):
        axis_slice(volume, TABLE, "z", 6.1)
    with pytest.raises(SceneError, match=r"^slice.axis must be "):
        axis_slice(volume, TABLE, "w", 0)
    with pytest.raises(SceneError, match=r"^slice.rows must be "):
        axis_slice(volume, TABLE, rows="left")
    with pytest.raises(SceneError, match=r"^slice.pixel_size must be "):
        oblique_slice(volume, TABLE, (0, 0, 0), (0, 0, 1), (0, 1, 0), 4, 4, 0.0)
    with pytest.raises(SceneError, match=r"^camera.up must not be parallel"):
        oblique_slice(volume, TABLE, (0, 0, 0), (0, 0, 1), (0, 0, 1), 4, 4, 1.0)


def exact_slice(scene):
    """The classified value where each float64 world ray meets the plane; None: beside the volume.

    The volume lies so that index space is the world.
    """
    rays = pixel_rays(scene.camera, scene.width, scene.height, np.arange(scene.width * scene.height))
    plane = scene.slice_plane
    point, normal = exact_point(plane.point.tolist()), exact_point(plane.normal.tolist())
    low, high = scene.volume.index_bounds
    for origin, direction in zip(rays.origins.tolist(), rays.directions.tolist(), strict=True):
        o, d = exact_point(origin), exact_point(direction)
        above = sum(n * (p - x) for n, p, x in zip(normal, point, o, strict=True))
        t = above / sum(n * x for n, x in zip(normal, d, strict=True))
        place = [x + t * y for x, y in zip(o, d, strict=True)]
        if t < 0 or any(not a <= p <= b for a, p, b in zip(low, place, high, strict=True)):
            yield None
            continue
        cell = tuple(int(p // 1) for p in place)
        total = Fraction(0)
        for k, sample in enumerate(corner_samples(scene.volume.values, cell)):
            for axis in range(3):
                share = place[axis] - cell[axis]
                sample = Fraction(sample) * (share if k >> axis & 1 else 1 - share)
            total += sample
        yield float(total)


@settings(max_examples=15)
@given(st.integers(0, 10_000), st.sampled_from([None, 9.0, 1e6]))
def test_an_oblique_slice_is_within_its_bound_of_the_exact_value(seed, away):
    rng = np.random.default_rng(seed)
    volume = rough_volume(seed)
    point, normal, up = rng.random(3) * 4 + 0.5, rng.normal(size=3), rng.normal(size=3)
    scene = oblique_slice(volume, TABLE, point, normal, up, 9, 7, 0.8, background=BEHIND)
    if away is not None:
        fov_y = float(np.degrees(6 / away))
        camera = Camera.look_at(point + away * normal + up, point, up, fov_y, 0.1, 10 * away)
        words = {"background": BEHIND, "mode": "slice", "slice_plane": scene.slice_plane}
        scene = Scene(volume, TABLE, camera, 9, 7, **words)
    rgba, bound = drawn(scene)
    truth = [BEHIND if v is None else classified(v) for v in exact_slice(scene)]
    error = np.abs(rgba.reshape(-1, 4) - truth).max(axis=1)
    # The truth is rounded to float64 and classified there: a few ulp, slopes of the table up to 2.
    assert (error <= bound.reshape(-1) + 8 * 2.0**-53).all()
    # From a million away positions have ten digits.
    assert np.median(bound) < (1e-7 if away == 1e6 else 1e-11)


def test_an_oblique_slice_looks_against_its_normal_with_up_upwards():
    z, _, x = np.mgrid[:5, :5, :5].astype(float)
    volume = Volume(x + 10 * z)
    grey = TransferFunction([0, 44], [(0, 0, 0), (1, 1, 1)], opacity=[1, 1])
    scene = oblique_slice(volume, grey, (2, 2, 2), (0, -1, 0), (0, 0, 1), 5, 5, 1.0)
    # Seen from -y with z upwards, x goes to the right.
    shown = drawn(scene)[0][..., 0] * 44
    np.testing.assert_allclose(shown, volume.values[::-1, 2, :], rtol=0, atol=1e-12)


def test_a_ray_along_the_plane_or_that_ends_before_it_shows_what_lies_behind():
    volume = rough_volume(1)
    scene = oblique_slice(volume, TABLE, (2, 2, 2), (0, 0, 1), (0, 1, 0), 3, 3, 0.5, background=BEHIND)
    assert (drawn(scene)[0] != np.array(BEHIND)).any()
    for words in ({"distance": 0.25}, {"begin": 0.75}):
        rgba, bound = drawn(scene, **words)
        assert (rgba == np.array(BEHIND)).all()
        assert (bound == 0).all()
    beside = Plane((2.0, 2.0, 2.0), (1.0, 0.0, 0.0))
    along = Scene(volume, TABLE, scene.camera, 3, 3, background=BEHIND, mode="slice", slice_plane=beside)
    rgba, bound = drawn(along)
    assert (rgba == np.array(BEHIND)).all()
    assert (bound == 0).all()


def test_where_rounding_decides_whether_the_plane_is_met_the_bound_is_the_contrast():
    volume = rough_volume(1)
    scene = oblique_slice(volume, TABLE, (2, 2, 2), (0, 0, 1), (0, 1, 0), 1, 1, 0.5, background=BEHIND)
    rgba, bound = drawn(scene, distance=0.5)
    assert bound[0, 0] >= np.abs(rgba[0, 0] - BEHIND).max() > 0.1
