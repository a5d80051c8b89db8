"""Where each voxel of each format lies, against what the library that wrote the file says of it.

The volume is a letter F of unequal slices; the places are oblique, anisotropic and mirrored in turn.
NRRD and NIfTI are held in the same way in test_volumes.py.
"""

import io
import json
import zipfile

import h5py
import metaimageio
import numcodecs
import numpy as np
import pydicom
import pytest
import tifffile
import zarr

from tests.dicom_files import write_series
from tests.letters import FLIP_LPS, FLIPS, assert_places_equal, letter_f, oblique
from volref.errors import FormatError
from volref.io import load_volume, save_volume
from volref.scene import Volume

LPS = np.diag([-1.0, -1.0, 1.0, 1.0])


def mha_place(affine):
    """Return what metaimageio is told of a matrix to LPS."""
    spacing = np.linalg.norm(affine[:3, :3], axis=0)
    return {
        "Offset": affine[:3, 3],
        "TransformMatrix": affine[:3, :3] / spacing,
        "ElementSpacing": spacing,
    }


@pytest.mark.parametrize("flips", FLIPS)
@pytest.mark.parametrize("name", ["f.mha", "packed.mha", "f.mhd", "packed.mhd"])
def test_each_voxel_of_a_metaimage_lies_where_its_library_puts_it(tmp_path, flips, name):
    packed = {"CompressedData": True} if "packed" in name else {}
    metaimageio.write(tmp_path / name, letter_f(), **mha_place(oblique(flips=flips)), **packed)
    theirs, said = metaimageio.read(tmp_path / name)
    affine = metaimageio.util.get_transform(said) @ np.diag([*said["ElementSpacing"], 1.0])
    assert_places_equal(load_volume(tmp_path / name), LPS @ affine, theirs)


def test_a_metaimage_of_the_other_byte_order_gives_native_numbers(tmp_path):
    metaimageio.write(tmp_path / "f.mhd", letter_f())
    text = (tmp_path / "f.mhd").read_text().replace("ByteOrderMSB = False", "ByteOrderMSB = True")
    (tmp_path / "f.mhd").write_text(text)
    letter_f().astype(">i2").tofile(tmp_path / "f.raw")
    assert np.array_equal(load_volume(tmp_path / "f.mhd").values, letter_f())


@pytest.mark.parametrize("flips", FLIPS)
def test_metaimageio_reads_what_save_volume_writes(tmp_path, flips):
    affine = oblique(flips=flips)
    metaimageio.write(tmp_path / "f.mha", letter_f(), **mha_place(affine))
    ours = load_volume(tmp_path / "f.mha")
    save_volume(ours, tmp_path / "g.mha")
    theirs, said = metaimageio.read(tmp_path / "g.mha")
    placed = metaimageio.util.get_transform(said) @ np.diag([*said["ElementSpacing"], 1.0])
    assert_places_equal(ours, LPS @ placed, theirs)


# nibabel warns at import that it reads few kinds of DICOM; what is used here is its matrix of one slice.
@pytest.mark.filterwarnings("ignore:The DICOM readers are highly experimental:UserWarning")
@pytest.mark.parametrize("flips", FLIPS)
def test_each_voxel_of_a_dicom_series_lies_where_nibabel_puts_its_slice(tmp_path, flips):
    """nibabel takes a voxel of one slice as (row, column, 0) to LPS."""
    from nibabel.nicom.dicomwrappers import wrapper_from_data

    affine = oblique(flips=flips)
    write_series(tmp_path, letter_f(), affine)
    ours = load_volume(tmp_path)
    placed = {}
    for file in tmp_path.iterdir():
        data = pydicom.dcmread(file)
        theirs = wrapper_from_data(data).affine
        for j, row in enumerate(data.pixel_array):
            for i, code in enumerate(row):
                point = FLIP_LPS @ (theirs @ [j, i, 0, 1])[:3]
                placed[tuple(np.round(point, 6) + 0.0)] = int(code)
    assert len(placed) == letter_f().size
    nz, ny, nx = ours.values.shape
    for k, j, i in np.ndindex(nz, ny, nx):
        point = (ours.world_from_index @ [i, j, k, 1])[:3]
        # Positions are texts of 16 characters: 11 digits behind the point here.
        assert placed[tuple(np.round(point, 6) + 0.0)] == ours.values[k, j, i]


SPACING = (0.7, 1.3, 5.0)
PLACE = {"axes": "ZYX"} | {f"PhysicalSize{axis}": step for axis, step in zip("XYZ", SPACING, strict=True)}


def write_imagej(path, **more):
    text = {"axes": "ZYX", "spacing": 5.0, "unit": "um"}
    tifffile.imwrite(
        path, letter_f(np.uint16), imagej=True, resolution=(1 / 0.7, 1 / 1.3), metadata=text, **more
    )


def write_ome(path, **more):
    tifffile.imwrite(path, letter_f(), ome=True, photometric="minisblack", metadata=PLACE, **more)


@pytest.mark.parametrize("write", [write_imagej, write_ome])
@pytest.mark.parametrize("more", [{}, {"compression": "zlib"}, {"byteorder": ">"}])
def test_a_tiff_stack_has_the_axes_and_the_spacing_of_its_text(tmp_path, write, more):
    write(tmp_path / "f.tif", **more)
    volume = load_volume(tmp_path / "f.tif")
    assert_places_equal(volume, np.diag([*volume.spacing, 1.0]), tifffile.imread(tmp_path / "f.tif"))
    assert np.array_equal(volume.values, letter_f())
    # ImageJ writes x and y as quotients of 32-bit numbers, pixels per unit.
    assert volume.spacing == pytest.approx(SPACING, rel=1e-9)


def test_a_plain_tiff_stack_takes_the_spacing_that_is_stated(tmp_path):
    tifffile.imwrite(tmp_path / "f.tif", letter_f(), photometric="minisblack", metadata=None)
    volume = load_volume(tmp_path / "f.tif", spacing=SPACING)
    assert np.array_equal(volume.values, tifffile.imread(tmp_path / "f.tif"))
    assert volume.spacing == SPACING


@pytest.mark.parametrize("flips", FLIPS)
def test_h5py_reads_what_save_volume_writes(tmp_path, flips):
    affine = oblique(flips=flips)
    place = {"spacing": SPACING, "origin": affine[:3, 3], "direction": affine[:3, :3] / SPACING}
    ours = Volume(letter_f(), **place, centering="node")
    save_volume(ours, tmp_path / "f.h5")
    with h5py.File(tmp_path / "f.h5") as archive:
        said = archive["volume"].attrs
        assert_places_equal(ours, affine, archive["volume"][()])
        assert_places_equal(load_volume(tmp_path / "f.h5"), affine, archive["volume"][()])
        assert np.array_equal(said["direction"], ours.direction)
    assert load_volume(tmp_path / "f.h5").centering == "node"
    assert np.array_equal(load_volume(tmp_path / "f.h5").world_from_index, ours.world_from_index)


GZIP = {"compression": "gzip", "shuffle": True, "fletcher32": True}


@pytest.mark.parametrize("name", ["element_size_um", "spacing_zyx"])
@pytest.mark.parametrize(
    "more", [{}, {"compression": "gzip", "shuffle": True, "fletcher32": True}, {"chunks": True}]
)
def test_a_dataset_of_hdf5_has_its_spacing_from_z_to_x(tmp_path, name, more):
    with h5py.File(tmp_path / "f.h5", "w") as archive:
        archive.create_dataset("a/f", data=letter_f(), **more).attrs[name] = SPACING[::-1]
        archive["a/list"] = np.arange(3)
        archive["label"] = np.zeros((2, 2, 2), np.uint8)
        archive["text"] = "x"
    volume = load_volume(tmp_path / "f.h5", key="a/f")
    assert volume.spacing == SPACING
    assert np.array_equal(volume.values, letter_f())


GZIP_CODEC = {2: numcodecs.GZip(), 3: zarr.codecs.GzipCodec()}
BLOSC_CODEC = {2: numcodecs.Blosc(), 3: zarr.codecs.BloscCodec()}


@pytest.mark.parametrize("form", [2, 3])
@pytest.mark.parametrize("compressors", [None, "auto", GZIP_CODEC, BLOSC_CODEC])
def test_a_zarr_array_has_its_axes_in_order(tmp_path, form, compressors):
    if compressors not in (None, "auto"):
        compressors = compressors[form]
    zarr.create_array(
        tmp_path / "f.zarr", data=letter_f(), chunks=(2, 3, 4), zarr_format=form, compressors=compressors
    )
    volume = load_volume(tmp_path / "f.zarr", spacing=SPACING)
    assert_places_equal(volume, np.diag([*SPACING, 1.0]), zarr.open_array(tmp_path / "f.zarr", mode="r")[:])


def test_a_zarr_array_with_named_axes_is_turned_to_z_first(tmp_path):
    zarr.create_array(tmp_path / "f.zarr", data=letter_f().T.copy(), dimension_names=("x", "y", "z"))
    assert np.array_equal(load_volume(tmp_path / "f.zarr", spacing=SPACING).values, letter_f())


def test_a_sharded_zarr_array_is_read(tmp_path):
    zarr.create_array(tmp_path / "f.zarr", data=letter_f(), chunks=(2, 3, 5), shards=(4, 6, 5))
    assert np.array_equal(load_volume(tmp_path / "f.zarr", spacing=SPACING).values, letter_f())


def write_ome_zarr(store, form, values):
    """Write a pyramid of two levels, the second of every other sample, with axes t, c, z, y, x."""
    group = zarr.open_group(store, mode="w", zarr_format=form)
    datasets = []
    for level, step in enumerate((1, 2)):
        group.create_array(str(level), data=values[:, :, ::step, ::step, ::step])
        scale = {"type": "scale", "scale": [1, 1, *(step * np.array(SPACING[::-1]))]}
        shift = {"type": "translation", "translation": [0, 0, 3.0, -2.0, 10.0]}
        datasets.append({"path": str(level), "coordinateTransformations": [scale, shift]})
    axes = [{"name": "t", "type": "time"}, {"name": "c", "type": "channel"}]
    axes += [{"name": name, "type": "space", "unit": "micrometer"} for name in "zyx"]
    whole = [{"type": "scale", "scale": [1, 1, 2, 2, 2]}]
    image = [{"axes": axes, "datasets": datasets, "coordinateTransformations": whole}]
    if form == 2:
        group.attrs["multiscales"] = image
    else:
        group.attrs["ome"] = {"version": "0.5", "multiscales": image}


@pytest.mark.parametrize("form", [2, 3])
@pytest.mark.parametrize("level", [0, 1])
@pytest.mark.parametrize("name", ["f.zarr", "f.zarr.zip"])
def test_each_voxel_of_an_ome_zarr_level_lies_where_its_transformations_put_it(tmp_path, form, level, name):
    """Worked by hand: scale, then translation, then the scale 2 of the whole image."""
    values = np.stack([letter_f(), 2 * letter_f()])[:, None]
    write_ome_zarr(tmp_path / "f.zarr", form, values)
    if name.endswith("zip"):
        with zipfile.ZipFile(tmp_path / name, "w") as archive:
            for file in (tmp_path / "f.zarr").rglob("*"):
                archive.write(file, file.relative_to(tmp_path / "f.zarr"))
    step = 2**level
    affine = np.diag([*(2 * step * np.array(SPACING)), 1.0])
    affine[:3, 3] = (20, -4, 6)
    for time in (0, 1):
        volume = load_volume(tmp_path / name, level=level, index=[time, 0])
        assert_places_equal(volume, affine, values[time, 0, ::step, ::step, ::step])


def bvp_bytes(blocks, *, matrix=None, **change):
    """Return a BVP file of (position (x, y, z), samples (z, y, x)) blocks, as VPT's converter writes it."""
    values = letter_f(np.uint8)
    depth, height, width = values.shape
    modality = {"name": "default", "dimensions": {"width": width, "height": height, "depth": depth}}
    modality |= {"format": 6403, "internalFormat": 33321, "type": 5121, "placements": []}
    modality |= {} if matrix is None else {"transform": {"matrix": matrix}}
    manifest = {"meta": {"version": 1}, "modalities": [modality | change], "blocks": []}
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        for number, (position, samples) in enumerate(blocks):
            shape = dict(zip(("depth", "height", "width"), samples.shape, strict=True))
            block = {"url": f"blocks/{number}", "format": "raw", "dimensions": shape}
            manifest["blocks"].append(block)
            place = {"index": number, "position": dict(zip("xyz", position, strict=True))}
            modality["placements"].append(place)
            archive.writestr(block["url"], samples.tobytes())
        archive.writestr("manifest.json", json.dumps(manifest))
    return stream.getvalue()


def test_each_block_of_a_bvp_lies_where_the_manifest_puts_it(tmp_path):
    values = letter_f(np.uint8)
    starts = [(x, y, z) for x in (0, 3) for y in (0, 2) for z in (0, 1)]
    parts = [
        values[z : 1 if z == 0 else None, y : 2 if y == 0 else None, x : 3 if x == 0 else None]
        for x, y, z in starts
    ]
    blocks = list(zip(starts, parts, strict=True))[::-1]
    (tmp_path / "f.bvp").write_bytes(bvp_bytes(blocks))
    volume = load_volume(tmp_path / "f.bvp")
    assert np.array_equal(volume.values, values)
    # The unit cube, within the rounding of a product and a sum.
    assert volume.corners.min(axis=0) == pytest.approx([0, 0, 0], abs=1e-15)
    assert volume.corners.max(axis=0) == pytest.approx([1, 1, 1], abs=1e-15)


def test_a_bvp_with_a_matrix_that_vpt_never_reads_needs_its_spacing_stated(tmp_path):
    matrix = np.diag([2.0, 1, 1, 1]).ravel().tolist()
    (tmp_path / "f.bvp").write_bytes(bvp_bytes([((0, 0, 0), letter_f(np.uint8))], matrix=matrix))
    with pytest.raises(FormatError, match="must state its spacing"):
        load_volume(tmp_path / "f.bvp")
    assert load_volume(tmp_path / "f.bvp", spacing=SPACING).spacing == SPACING


def test_a_bvp_of_16_bits_as_older_files_say_it(tmp_path):
    values = letter_f(np.uint16) * 300
    old = {"type": None, "bits": 16, "components": 1}
    (tmp_path / "f.bvp").write_bytes(bvp_bytes([((0, 0, 0), values)], **old))
    assert np.array_equal(load_volume(tmp_path / "f.bvp").values, values)
