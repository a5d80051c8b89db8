import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from volref.errors import SceneError
from volref.phantoms import fields

MAKERS = [
    fields.homogeneous_box,
    fields.linear_ramp,
    fields.exponential_ramp,
    fields.sphere,
    fields.squared_distance,
    fields.shells,
    fields.marschner_lobb,
    fields.gaussian_blobs,
]


@pytest.mark.parametrize("make", MAKERS)
@pytest.mark.parametrize("centering", ["cell", "node"])
def test_a_field_has_the_asked_size_and_lies_about_the_origin(make, centering):
    volume = make((4, 5, 6), spacing=(1.0, 2.0, 0.5), centering=centering)
    assert volume.size == (4, 5, 6)
    assert volume.centering == centering
    assert volume.spacing == (1.0, 2.0, 0.5)
    # Exact: half-integer multiples of powers of two.
    assert volume.corners.min(axis=0).tolist() == (-volume.corners.max(axis=0)).tolist()


def test_a_ramp_runs_along_its_own_axis_only():
    values = fields.linear_ramp((3, 4, 5), axis="y", low=-1.0, high=2.0).values
    assert np.ptp(values, axis=(0, 2)).max() == 0
    assert values[0, :, 0].tolist() == [-1.0, 0.0, 1.0, 2.0]


def test_an_unknown_axis_is_refused():
    with pytest.raises(SceneError, match="axis must be 'x' or 'y' or 'z', got 't'; choose one"):
        fields.linear_ramp(3, axis="t")


def test_the_straight_lines_of_an_exponential_ramp_lie_above_it_by_the_stated_share():
    low, high, n = 0.5, 8.0, 9
    values = fields.exponential_ramp(n, axis="x", low=low, high=high).values[0, 0]
    middle = (values[1:] + values[:-1]) / 2
    exact = low * (high / low) ** ((np.arange(n - 1) + 0.5) / (n - 1))
    excess = (middle - exact) / values[1:]
    assert (excess > 0).all()
    assert (excess <= np.log(high / low) ** 2 / (8 * (n - 1) ** 2)).all()


@given(st.floats(-1, 1), st.floats(-1, 1), st.floats(-1, 1))
def test_marschner_lobb_agrees_with_the_printed_formula_in_plain_scalars(x, y, z):
    from math import cos, pi, sin, sqrt

    radial = cos(2 * pi * 6 * cos(pi * sqrt(x**2 + y**2) / 2))
    want = (1 - sin(pi * z / 2) + 0.25 * (1 + radial)) / (2 * (1 + 0.25))
    got = fields.marschner_lobb_value(np.array(x), np.array(y), np.array(z))
    # The argument 12 pi cos(...) reaches 38: an ulp of it is 7e-15, weighted by alpha / 2.5 = 0.1.
    assert abs(got - want) <= 4e-15
    assert -4e-15 <= got <= 1 + 4e-15


@pytest.mark.parametrize(
    ("point", "want"),
    [((0, 0, 1), 0.2), ((0, 0, 0), 0.6), ((0, 0, -1), 1.0), ((1, 0, 0), 0.6), ((2 / 3, 0, 0), 0.6)],
)
def test_marschner_lobb_has_its_known_values(point, want):
    # r = 0: cos(12 pi) = 1; r = 1: cos 0 = 1; r = 2/3: cos(pi/3) = 1/2, cos(6 pi) = 1.
    got = fields.marschner_lobb_value(*(np.array(float(c)) for c in point))
    assert got == pytest.approx(want, abs=4e-15)  # as above


def test_marschner_lobb_fills_the_extent_of_either_centering():
    node = fields.marschner_lobb(5, centering="node").values[:, 2, 2]
    cell = fields.marschner_lobb(5, centering="cell").values[:, 2, 2]
    assert node == pytest.approx(0.6 - 0.4 * np.sin(np.pi / 2 * np.linspace(-1, 1, 5)), abs=4e-15)
    assert cell == pytest.approx(0.6 - 0.4 * np.sin(np.pi / 2 * np.linspace(-0.8, 0.8, 5)), abs=4e-15)


def test_the_interpolated_distance_lies_above_it_by_the_stated_bound():
    spacing = np.array((1.0, 1.5, 0.75))
    volume = fields.sphere(24, spacing=tuple(spacing))
    v = volume.values
    middle = sum(v[k : k + 23, j : j + 23, i : i + 23] for k, j, i in np.ndindex(2, 2, 2)) / 8
    axes = [(np.arange(23) - 11) * s for s in spacing]
    radius = np.sqrt(sum(a**2 for a in np.meshgrid(*axes[::-1], indexing="ij")))
    diagonal = np.linalg.norm(spacing)
    far = radius > 2 * diagonal
    excess = (middle - radius)[far]
    assert (excess > 0).all()
    assert (excess <= (spacing**2).sum() / (8 * (radius[far] - diagonal))).all()


def test_the_squared_distance_is_a_sum_of_three_profiles():
    values = fields.squared_distance((5, 6, 7), spacing=(1.0, 0.5, 2.0)).values
    mixed = values[1:, 1:, 1:] - values[:-1, 1:, 1:] - values[1:, :-1, 1:] + values[:-1, :-1, 1:]
    assert (mixed == 0).all()  # exact: quarters of small whole numbers


def test_shells_alternate_with_their_period():
    along = fields.shells(33, period=8.0).values[16, 16, 16:]
    # Half a turn of the cosine in 4 voxels; its argument is at most 4 pi, off by a few ulp.
    assert along[::8] == pytest.approx(0.0, abs=1e-14)
    assert along[4::8] == pytest.approx(1.0, abs=1e-14)


def test_blobs_follow_their_seed():
    one, again, other = (fields.gaussian_blobs(16, seed=s).values for s in (3, 3, 4))
    assert (one == again).all()
    assert (one != other).any()
    assert one.max() == 1.0
    assert one.min() >= 0.0


def test_a_size_of_one_is_refused():
    with pytest.raises(SceneError, match="size must be a whole number from 2 to 65536, got 1"):
        fields.sphere(1)
