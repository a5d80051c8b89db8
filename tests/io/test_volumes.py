"""Every volume format against the library that writes it, and the world against its own matrix."""

import gzip
import json
import sys
import zipfile

import nibabel
import nrrd
import numpy as np
import pytest

from tests.bad_files import nrrd_bytes
from tests.letters import FLIP_LPS, FLIPS, assert_places_equal, letter_f, oblique
from volref.errors import FormatError
from volref.io import load_raw, load_volume
from volref.scene.transform import transform_points


@pytest.mark.parametrize("flips", FLIPS)
@pytest.mark.parametrize("suffix", [".nii", ".nii.gz"])
@pytest.mark.parametrize("kind", [nibabel.Nifti1Image, nibabel.Nifti2Image])
def test_each_voxel_of_a_nifti_file_lies_where_nibabel_puts_it(tmp_path, flips, suffix, kind):
    path = tmp_path / f"f{suffix}"
    nibabel.save(kind(letter_f().T, oblique(flips=flips)), path)
    theirs = nibabel.load(path)
    ours = load_volume(path)
    assert_places_equal(ours, theirs.affine, np.asanyarray(theirs.dataobj).T)
    assert ours.values.dtype == np.int16


@pytest.mark.parametrize("flips", FLIPS)
@pytest.mark.parametrize("encoding", ["raw", "gzip", "bzip2"])
@pytest.mark.parametrize(
    ("space", "to_ras"),
    [
        ("right-anterior-superior", np.eye(3)),
        ("RAS", np.eye(3)),
        ("left-anterior-superior", np.diag([-1.0, 1, 1])),
        ("left-posterior-superior", FLIP_LPS),
        ("LPS", FLIP_LPS),
        ("3D-right-handed", np.eye(3)),
    ],
)
def test_each_voxel_of_a_nrrd_file_lies_where_its_header_puts_it(tmp_path, flips, encoding, space, to_ras):
    path = tmp_path / "f.nrrd"
    matrix = oblique(flips=flips)
    header = {"space": space, "encoding": encoding, "kinds": ["domain"] * 3}
    header |= {"space directions": matrix[:3, :3].T, "space origin": matrix[:3, 3]}
    nrrd.write(str(path), letter_f(), header, index_order="C")
    theirs, said = nrrd.read(str(path))
    affine = np.eye(4)
    affine[:3, :3] = to_ras @ said["space directions"].T
    affine[:3, 3] = to_ras @ said["space origin"]
    assert_places_equal(load_volume(path), affine, theirs.T)


def test_a_point_in_lps_is_the_same_point_in_ras(tmp_path):
    """Worked by hand: voxel (1, 0, 0) at LPS (10 + 2, 20, 30) is at RAS (-12, -20, 30)."""
    header = {"space": "LPS", "space directions": np.diag([2.0, 1, 1]), "space origin": [10.0, 20, 30]}
    nrrd.write(str(tmp_path / "a.nrrd"), np.zeros((2, 2, 2), np.uint8), header)
    volume = load_volume(tmp_path / "a.nrrd")
    point = transform_points(volume.world_from_index, np.array([1.0, 0, 0]))
    assert point.tolist() == [-12, -20, 30]


def test_the_same_head_in_nifti_and_in_nrrd_lies_at_the_same_place(tmp_path):
    affine = oblique()
    nibabel.save(nibabel.Nifti1Image(letter_f().T, affine), tmp_path / "f.nii")
    stored = nibabel.load(tmp_path / "f.nii").affine
    header = {"space": "LPS", "space directions": (FLIP_LPS @ stored[:3, :3]).T}
    header["space origin"] = FLIP_LPS @ stored[:3, 3]
    nrrd.write(str(tmp_path / "f.nrrd"), letter_f(), header, index_order="C")
    one, other = load_volume(tmp_path / "f.nii"), load_volume(tmp_path / "f.nrrd")
    assert np.array_equal(one.world_from_index, other.world_from_index)  # exact: only signs differ
    assert np.array_equal(one.values, other.values)


def test_nrrd_without_directions_uses_spacings_and_axis_mins(tmp_path):
    """A cell's axis min is its border, a node's is its place: 10 and 10 - 1/2 * 2 for spacing 2."""
    header = {"spacings": [2.0, 3.0, 4.0], "axis mins": [10.0, 20, 30]}
    for centering, origin in (("cell", (11, 21.5, 32)), ("node", (10, 20, 30))):
        path = tmp_path / f"{centering}.nrrd"
        nrrd.write(str(path), letter_f(), header | {"centerings": [centering] * 3}, index_order="C")
        volume = load_volume(path)
        assert volume.spacing == (2, 3, 4)
        assert volume.origin == origin
        assert volume.centering == centering


def test_a_detached_nrrd_header_reads_its_data_file(tmp_path):
    nrrd.write(str(tmp_path / "f.nhdr"), letter_f(), {"encoding": "raw"}, index_order="C")
    assert np.array_equal(load_volume(tmp_path / "f.nhdr").values, letter_f())


def test_big_endian_files_give_native_numbers(tmp_path):
    header = nibabel.Nifti1Header(endianness=">")
    header.set_data_dtype(">i2")
    image = nibabel.Nifti1Image(letter_f().T, np.eye(4), header)
    nibabel.save(image, tmp_path / "f.nii")
    letter_f().astype(">i2").tofile(tmp_path / "f.raw")
    np.save(tmp_path / "f.npy", letter_f().astype(">i2"))
    raw = load_raw(tmp_path / "f.raw", (5, 6, 4), "int16", "big", 0, (1, 1, 1))
    for volume in (load_volume(tmp_path / "f.nii"), load_volume(tmp_path / "f.npy"), raw):
        assert np.array_equal(volume.values, letter_f())
        assert volume.values.dtype == np.dtype(np.int16)


def test_nifti_scaling_is_applied_as_nibabel_does(tmp_path):
    image = nibabel.Nifti1Image(letter_f().T, np.eye(4))
    image.header.set_slope_inter(0.1, -31.5)
    nibabel.save(image, tmp_path / "f.nii.gz")
    raw = bytearray(gzip.decompress((tmp_path / "f.nii.gz").read_bytes()))
    raw[112:120] = np.array([0.1, -31.5], "<f4").tobytes()
    (tmp_path / "g.nii").write_bytes(raw)
    theirs = np.asanyarray(nibabel.load(tmp_path / "g.nii").dataobj).T
    ours = load_volume(tmp_path / "g.nii").values
    assert np.array_equal(ours, theirs)
    assert ours.min() == np.float64(np.float32(-31.5))
    assert ours.dtype == theirs.dtype


def test_npy_is_memory_mapped_and_read_only(tmp_path):
    np.save(tmp_path / "f.npy", letter_f())
    values = load_volume(tmp_path / "f.npy").values
    base = values
    while not isinstance(base, np.memmap):
        base = base.base
    assert base.mode == "r"
    assert not values.flags.writeable


@pytest.mark.parametrize("order", ["C", "F"])
def test_npy_keeps_its_axes_in_either_memory_order(tmp_path, order):
    np.save(tmp_path / "f.npy", np.asarray(letter_f(), order=order))
    assert np.array_equal(load_volume(tmp_path / "f.npy").values, letter_f())


def test_what_the_user_states_replaces_the_sidecar_which_replaces_the_file(tmp_path):
    np.savez(tmp_path / "f.npz", volume=letter_f(), spacing_zyx=(3, 2, 1), origin=(7, 8, 9))
    (tmp_path / "f.npz.json").write_text(json.dumps({"origin": [1, 2, 3], "centering": "node"}))
    volume = load_volume(tmp_path / "f.npz", origin=(4, 5, 6))
    assert (volume.spacing, volume.origin, volume.centering) == ((1, 2, 3), (4, 5, 6), "node")


def test_npz_takes_the_only_array_with_three_axes_or_the_named_one(tmp_path):
    np.savez(tmp_path / "one.npz", head=letter_f(), weights=np.zeros(3))
    np.savez(tmp_path / "two.npz", a=letter_f(), b=2 * letter_f())
    assert np.array_equal(load_volume(tmp_path / "one.npz").values, letter_f())
    assert np.array_equal(load_volume(tmp_path / "two.npz", key="b").values, 2 * letter_f())
    with pytest.raises(FormatError, match="got a, b; pass key=NAME"):
        load_volume(tmp_path / "two.npz")


def test_a_matrix_to_lps_in_npz_gives_ras():
    volume = load_volume("tests/data/ct_chest_lung1_256x256x48.npz")
    with np.load("tests/data/ct_chest_lung1_256x256x48.npz") as archive:
        lps = archive["affine_ijk_to_lps_mm"]
    ras = np.diag([-1.0, -1, 1, 1]) @ lps
    assert np.array_equal(volume.world_from_index, ras)  # exact: its axes are those of the world
    assert volume.spacing == (1.140625, 1.140625, 5.0)
    assert (volume.values.min(), volume.values.max()) == (-1024, 3071)


def test_the_head_loads_with_its_matrix():
    volume = load_volume("tests/data/mri_mni152_t1_1mm.nii.gz")
    assert volume.size == (197, 233, 189)
    assert np.array_equal(volume.world_from_index, nibabel.load("tests/data/mri_mni152_t1_1mm.nii.gz").affine)
    assert volume.origin == (-98, -134, -72)


def test_raw_reads_what_was_written_after_the_skip(tmp_path):
    (tmp_path / "f.raw").write_bytes(b"header!" + letter_f().astype("<i2").tobytes())
    stated = {"size": (5, 6, 4), "dtype": "int16", "byte_order": "little", "skip": 7, "spacing": (1, 2, 3)}
    direct = load_raw(tmp_path / "f.raw", **stated, origin=(1, 1, 1), centering="node")
    (tmp_path / "f.raw.json").write_text(json.dumps(stated))
    by_sidecar = load_volume(tmp_path / "f.raw")
    assert np.array_equal(direct.values, letter_f())
    assert np.array_equal(by_sidecar.values, letter_f())
    assert (direct.spacing, direct.origin, direct.centering) == ((1, 2, 3), (1, 1, 1), "node")


def test_trailing_axes_of_length_one_in_nifti_are_left_out(tmp_path):
    nibabel.save(nibabel.Nifti1Image(letter_f().T[..., None], np.eye(4)), tmp_path / "f.nii")
    assert np.array_equal(load_volume(tmp_path / "f.nii").values, letter_f())


def test_nan_voxels_are_replaced_when_asked(tmp_path):
    values = letter_f(np.float32)
    values[1, 2, 3] = np.nan
    np.save(tmp_path / "f.npy", values)
    assert load_volume(tmp_path / "f.npy", nan=-1.0).values[1, 2, 3] == -1


@pytest.mark.parametrize(
    ("module", "name"),
    [
        ("nrrd", "f.nrrd"),
        ("nibabel", "f.nii"),
        ("pydicom", "f.dcm"),
        ("tifffile", "f.tif"),
        ("h5py", "f.h5"),
        ("zarr", "f.zarr.zip"),
    ],
)
def test_a_missing_reader_is_one_sentence_with_the_command(tmp_path, monkeypatch, module, name):
    monkeypatch.setitem(sys.modules, module, None)
    starts = {"f.nrrd": b"NRRD0004\n", "f.dcm": b"\0" * 128 + b"DICM", "f.tif": b"II*\0" + b"\0" * 12}
    (tmp_path / name).write_bytes(starts.get(name, b"x"))
    if name == "f.zarr.zip":
        with zipfile.ZipFile(tmp_path / name, "w") as archive:
            archive.writestr("zarr.json", "{}")
    with pytest.raises(FormatError, match=r"pip install 'volref\[(nrrd|nifti|dicom|tiff|hdf5|zarr)\]'$"):
        load_volume(tmp_path / name)


@pytest.mark.parametrize(
    "spelling", ["axis mins: 10 20 30\naxis maxs: 20 26 38", "axismins: 10 20 30\naxismaxs: 20 26 38"]
)
@pytest.mark.parametrize(
    ("centering", "spacing", "origin"),
    [("cell", (2.5, 2, 4), (11.25, 21, 32)), ("node", (10 / 3, 3, 8), (10, 20, 30))],
)
def test_nrrd_axis_mins_and_maxs_state_the_spacing(tmp_path, spelling, centering, spacing, origin):
    """Worked by hand for 4 x 3 x 2 samples: 10 is 4 cells of 2.5 or 3 steps of 10 / 3."""
    more = [spelling, f"centers: {centering} {centering} {centering}"]
    (tmp_path / "a.nrrd").write_bytes(nrrd_bytes(data=b"x" * 24, more=more))
    volume = load_volume(tmp_path / "a.nrrd")
    assert (volume.spacing, volume.origin, volume.centering) == (spacing, origin, centering)


def test_nrrd_axis_maxs_may_stand_beside_the_spacings_they_agree_with(tmp_path):
    more = ["spacings: 0.333333 1 1", "axis mins: 0 0 0", "axis maxs: 1.33333 3 2"]
    (tmp_path / "a.nrrd").write_bytes(nrrd_bytes(data=b"x" * 24, more=more))
    assert load_volume(tmp_path / "a.nrrd").spacing == (0.333333, 1, 1)


@pytest.mark.parametrize("skip", [-1, 3])
def test_nrrd_samples_begin_after_the_skip_or_end_the_file(tmp_path, skip):
    data = bytes(range(24))
    (tmp_path / "a.nrrd").write_bytes(nrrd_bytes(data=b"abc" + data, more=[f"byte skip: {skip}"]))
    assert load_volume(tmp_path / "a.nrrd").values.tobytes() == data


def test_npz_may_state_its_place_twice_if_both_agree(tmp_path):
    """A spacing rounded to 5 digits beside the matrix, which is taken."""
    affine = np.diag([1.140625, 1.140625, 5, 1])
    np.savez(
        tmp_path / "f.npz", volume=letter_f(), spacing_zyx=(5, 1.1406, 1.1406), affine_ijk_to_ras_mm=affine
    )
    assert load_volume(tmp_path / "f.npz").spacing == (1.140625, 1.140625, 5)


def test_a_sidecar_may_write_4_as_4_point_0(tmp_path):
    (tmp_path / "f.raw").write_bytes(letter_f().astype("<i2").tobytes())
    stated = {
        "size": [5.0, 6, 4.0],
        "dtype": "int16",
        "byte_order": "little",
        "skip": 0.0,
        "spacing": [1, 1, 1],
    }
    (tmp_path / "f.raw.json").write_text(json.dumps(stated))
    assert np.array_equal(load_volume(tmp_path / "f.raw").values, letter_f())
