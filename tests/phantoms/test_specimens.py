import numpy as np
import pytest

from volref.phantoms import specimens


@pytest.fixture(scope="module")
def quiet():
    return specimens.vessel((48, 36, 72), spacing=8 / 3, noise=0.0)


def test_a_vessel_holds_fat_wall_blood_and_calcium(quiet):
    values = quiet.values
    assert values.dtype == np.int16
    assert values.min() == specimens.FAT_HU
    assert values.max() > 900
    blood = (np.abs(values - specimens.BLOOD_HU) < 10).mean()
    calcium = (values > 700).mean()
    assert (values == specimens.FAT_HU).mean() > 0.7
    assert 0.02 < blood < 0.2
    assert 0 < calcium < 0.01


def test_a_vessel_is_one_piece(quiet):
    from scipy.ndimage import label

    _, pieces = label(quiet.values > 200)
    assert pieces == 1


def test_a_vessel_branches_below(quiet):
    from scipy.ndimage import label

    # In slices from the feet: two iliac arteries, then one aorta.
    _, low = label(quiet.values[4] > 150)
    _, high = label(quiet.values[24] > 150)
    assert (low, high) == (2, 1)


def test_noise_of_a_vessel_has_its_standard_deviation():
    plain = specimens.vessel((24, 18, 36), spacing=5.0, noise=0.0).values.astype(float)
    noisy = specimens.vessel((24, 18, 36), spacing=5.0, noise=12.0).values.astype(float)
    # 15552 samples: the deviation is known to 12 / sqrt(2 * 15552) = 0.07; five of those.
    assert (noisy - plain).std() == pytest.approx(12.0, abs=0.35)


def test_specimens_follow_their_seed():
    for make in (specimens.vessel, specimens.filaments):
        one, again, other = (make((16, 12, 24), spacing=8.0, seed=s).values for s in (1, 1, 2))
        assert (one == again).all()
        assert (one != other).any()


def test_filaments_are_sparse_and_bright():
    values = specimens.filaments().values.astype(float)
    background = np.median(values)
    assert 102 <= background <= 106  # offset 100 and Poisson(4)
    assert values.max() > background + 300
    assert (values > background + 40).mean() < 0.05


def test_the_background_of_filaments_is_poisson_noise():
    dark = specimens.filaments(count=1, size=(64, 64, 32)).values.astype(float) - 100
    far = dark[dark < 15]
    # Poisson(4): mean 4 and variance 4; the one filament lifts few of 131072 voxels.
    assert far.mean() == pytest.approx(4.0, abs=0.3)
    assert far.var() == pytest.approx(4.0, abs=0.6)


def test_filaments_are_blurred_three_times_more_along_z():
    fields = specimens.filaments(size=(48, 48, 48), spacing=1.0, count=8, photons=1e6).values.astype(float)
    rough = [np.abs(np.diff(fields, axis=axis)).mean() for axis in (0, 1, 2)]
    # Filaments lie flat, so without blur z would be the roughest axis.
    assert rough[0] < 0.6 * min(rough[1:])
