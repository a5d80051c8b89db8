"""DICOM series: order by place, values as the standard rescales them, and the grids that are kept."""

import numpy as np
import pydicom
import pytest

from tests.dicom_files import dicom_slice, write_series
from tests.letters import letter_f, oblique
from volref.errors import FormatError
from volref.io import describe_file, load_volume

PLACE = np.diag([0.5, 2.0, 4.0, 1.0])


def test_slices_are_in_order_of_place_whatever_their_names_and_numbers(tmp_path):
    write_series(tmp_path, letter_f(), PLACE)
    assert np.array_equal(load_volume(tmp_path).values, letter_f())
    numbers = [pydicom.dcmread(tmp_path / f"slice{i}.dcm").InstanceNumber for i in range(4)]
    assert numbers != sorted(numbers)


def test_slices_from_head_to_foot_are_turned_to_a_right_handed_grid(tmp_path):
    """Positions that fall with k: the grid begins at the lowest of them."""
    write_series(tmp_path, letter_f(), PLACE @ np.diag([1.0, 1, -1, 1]))
    volume = load_volume(tmp_path)
    assert np.array_equal(volume.values, letter_f()[::-1])
    assert volume.origin == (0, 0, -12)
    assert volume.spacing == (0.5, 2, 4)


def test_one_file_stands_for_its_series(tmp_path):
    write_series(tmp_path, letter_f(), PLACE, name="a", series="1.2.3")
    write_series(tmp_path, 2 * letter_f(), PLACE, name="b", series="1.2.4")
    assert np.array_equal(load_volume(tmp_path / "b0.dcm").values, 2 * letter_f())
    assert np.array_equal(load_volume(tmp_path, key="1.2.3").values, letter_f())


def test_other_files_in_the_folder_are_left_alone(tmp_path):
    write_series(tmp_path, letter_f(), PLACE)
    (tmp_path / "README.txt").write_text("scans")
    assert load_volume(tmp_path).size == (5, 6, 4)
    about = describe_file(tmp_path)
    assert about["size"] == [5, 6, 4]
    assert about["file_bytes"] == sum(file.stat().st_size for file in tmp_path.iterdir())


@pytest.mark.parametrize(
    ("change", "dtype"),
    [
        ({}, np.int16),
        ({"RescaleSlope": 1, "RescaleIntercept": 0}, np.int16),
        ({"RescaleSlope": 1, "RescaleIntercept": -1024, "BitsStored": 12, "HighBit": 11}, np.int16),
        ({"RescaleSlope": 1, "RescaleIntercept": -1024}, np.int32),
        ({"RescaleSlope": 100000, "RescaleIntercept": 7}, np.int64),
        ({"RescaleSlope": 0.5, "RescaleIntercept": -3}, np.float64),
    ],
)
def test_values_are_rescaled_and_stay_whole_numbers_where_they_can(tmp_path, change, dtype):
    write_series(tmp_path, letter_f(), PLACE, **change)
    volume = load_volume(tmp_path)
    slope, intercept = change.get("RescaleSlope", 1), change.get("RescaleIntercept", 0)
    assert np.array_equal(volume.values, letter_f() * np.float64(slope) + intercept)
    assert volume.values.dtype == dtype


def test_unsigned_codes_of_12_bits_fit_in_int16_as_hounsfield_units(tmp_path):
    how = {"RescaleIntercept": -1024, "RescaleSlope": 1, "BitsStored": 12, "HighBit": 11}
    write_series(tmp_path, letter_f(np.uint16), PLACE, **how)
    volume = load_volume(tmp_path)
    assert volume.values.dtype == np.int16
    assert np.array_equal(volume.values, letter_f() - 1024)


def test_each_slice_is_rescaled_by_its_own_slope(tmp_path):
    for k in range(4):
        data = dicom_slice(letter_f()[k], PLACE, k, RescaleSlope=0.5 * (k + 1), RescaleIntercept=0)
        data.save_as(tmp_path / f"{k}.dcm", enforce_file_format=True)
    expected = letter_f() * (0.5 * np.arange(1, 5))[:, None, None]
    assert np.array_equal(load_volume(tmp_path).values, expected)


def test_a_tilted_gantry_gives_the_sheared_grid_of_its_positions(tmp_path):
    affine = PLACE.copy()
    affine[1, 2] = 0.75
    write_series(tmp_path, letter_f(), affine)
    volume = load_volume(tmp_path)
    expected = np.diag([-1.0, -1, 1, 1]) @ affine
    # The length of the third column is taken out and put back: 2 ulp.
    np.testing.assert_allclose(volume.world_from_index, expected, rtol=4e-16, atol=0)


def test_one_slice_takes_the_thickness_that_it_states(tmp_path):
    write_series(tmp_path, letter_f()[:1], oblique(spacing=(1, 1, 3)))
    # The direction is a text of 13 digits behind the point.
    assert load_volume(tmp_path).spacing == pytest.approx((1, 1, 3), rel=1e-12)


def test_run_length_coded_slices_are_decoded(tmp_path):
    write_series(tmp_path, letter_f(), PLACE)
    for file in tmp_path.iterdir():
        data = pydicom.dcmread(file)
        data.compress(pydicom.uid.RLELossless, generate_instance_uid=False)
        data.save_as(file, enforce_file_format=True)
    assert np.array_equal(load_volume(tmp_path).values, letter_f())


@pytest.mark.parametrize("shift", [0.03, 0.05])
def test_positions_may_be_rounded_by_a_hundredth_of_the_spacing(tmp_path, shift):
    affine = np.eye(4)
    affine[2, 2] = 4.0
    for k in range(4):
        moved = affine.copy()
        moved[2, 3] = shift if k == 1 else 0.0
        dicom_slice(letter_f()[k], moved, k).save_as(tmp_path / f"{k}.dcm", enforce_file_format=True)
    if shift < 0.04:
        assert load_volume(tmp_path).spacing == (1, 1, 4)
    else:
        with pytest.raises(FormatError, match="in line with the other slices"):
            load_volume(tmp_path)
