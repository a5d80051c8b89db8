"""Files of the formats that other libraries write which volref must refuse; see `tests.bad_files`."""

import io
import json
import struct
import zipfile
import zlib

import h5py
import numpy as np
import OpenEXR
import pydicom
import tifffile
import zarr

from tests.bad_files import HUGE, BadFile, file_of
from tests.dicom_files import dicom_slice, write_series
from tests.letters import letter_f

F = letter_f()
PLACE = np.diag([0.7, 1.3, 5.0, 1.0])
NAN_F = np.where(F.max() == F, np.nan, F).astype(np.float32)


def mha_of(data=None, name="a.mha", **change):
    """Return a builder of a MetaImage with some keys changed (None removes one)."""
    keys = {"ObjectType": "Image", "NDims": 3, "BinaryData": "True", "DimSize": "5 6 4"}
    keys |= {"ElementSpacing": "1 1 2", "ElementType": "MET_SHORT"} | change
    keys["ElementDataFile"] = change.get("ElementDataFile", "LOCAL")
    text = "".join(f"{key} = {value}\n" for key, value in keys.items() if value is not None)
    return file_of(name, text.encode() + (F.tobytes() if data is None else data))


def packed_mha(data, **change):
    packed = zlib.compress(data)
    return mha_of(packed, CompressedData="True", CompressedDataSize=len(packed), **change)


def dicom_of(change=None, **every):
    """Return a builder of a series; `change(slices)` edits the data sets before they are written."""

    def build(folder):
        slices = [dicom_slice(F[k], PLACE, k, **every) for k in range(len(F))]
        for number, data in enumerate(change(slices) if change else slices):
            data.save_as(folder / f"{number}.dcm", enforce_file_format=True)
        return folder

    return build


def with_element(k, **elements):
    """Return a change that sets elements of slice k."""

    def change(slices):
        for name, value in elements.items():
            setattr(slices[k], name, value)
        return slices

    return change


def with_syntax(uid):
    def change(slices):
        for data in slices:
            data.file_meta.TransferSyntaxUID = uid
            data["PixelData"].VR = "OB"
            data.PixelData = pydicom.encaps.encapsulate([b"\0" * 8])
        return slices

    return change


def two_series(folder):
    for uid in ("1.2.3", "1.2.4"):
        write_series(folder, F, PLACE, name=f"s{uid}", series=uid)
    return folder


def foreign_syntax(folder):
    """Write a series whose transfer syntax is a UID of something else."""
    for file in write_series(folder, F, PLACE).iterdir():
        syntax, other = b"1.2.840.10008.1.2.1\0", b"1.2.840.10008.1.1\0\0\0"
        file.write_bytes(file.read_bytes().replace(syntax, other))
    return folder


def cut_dicom(folder):
    write_series(folder, F, PLACE)
    file = sorted(folder.iterdir())[1]
    file.write_bytes(file.read_bytes()[:-9])
    return folder


def tiff_of(values=F, **how):
    def build(folder):
        how.setdefault("photometric", "minisblack")
        tifffile.imwrite(folder / "a.tif", values, **how)
        return folder / "a.tif"

    return build


def cut(build, count=1):
    """Return a builder that cuts bytes off the end of what another one writes."""

    def shorter(folder):
        path = build(folder)
        path.write_bytes(path.read_bytes()[:-count])
        return path

    return shorter


def tiff_bomb(folder):
    """Write a stack whose strip unpacks to 32 MiB instead of 60 bytes a slice."""
    path = tiff_of(np.zeros((2, 6, 5), np.uint8), compression="zlib", metadata=None)(folder)
    data = path.read_bytes()
    with tifffile.TiffFile(path) as tiff:
        place = tiff.pages[0].tags["StripByteCounts"].valueoffset
        start = tiff.pages[0].tags["StripOffsets"].valueoffset
    bomb = zlib.compress(b"\0" * 2**25)
    data = bytearray(data + bomb)
    data[place : place + 4] = struct.pack("<I", len(bomb))[:4]
    data[start : start + 4] = struct.pack("<I", len(data) - len(bomb))
    path.write_bytes(data)
    return path


def huge_tiff(folder):
    """Write a TIFF of one page that promises 10^6 x 10^9 pixels."""
    tags = {256: 10**6, 257: 10**9, 258: 8, 259: 1, 262: 1, 273: 8, 277: 1, 278: 10**9, 279: 2**31}
    entries = b"".join(struct.pack("<HHII", tag, 4, 1, value) for tag, value in tags.items())
    (folder / "a.tif").write_bytes(b"II*\0" + struct.pack("<IH", 8, len(tags)) + entries + b"\0" * 4)
    return folder / "a.tif"


def looped_tiff(folder):
    """Write a TIFF whose only directory says that it is the next one, too."""
    path = tiff_of(metadata=None)(folder)
    data = bytearray(path.read_bytes())
    start = struct.unpack_from("<I", data, 4)[0]
    count = struct.unpack_from("<H", data, start)[0]
    struct.pack_into("<I", data, start + 2 + 12 * count, start)
    path.write_bytes(data)
    return path


def hdf5_of(write):
    def build(folder):
        with h5py.File(folder / "a.h5", "w") as archive:
            write(archive)
        return folder / "a.h5"

    return build


def hdf5_bomb(archive):
    """Write a dataset whose chunk of 240 bytes unpacks to 10^7."""
    dataset = archive.create_dataset("f", F.shape, F.dtype, chunks=F.shape, compression="gzip")
    dataset.id.write_direct_chunk((0, 0, 0), zlib.compress(b"\0" * 10**7))


def dataset_of(values=F, **how):
    return hdf5_of(lambda archive: archive.create_dataset("f", data=values, **how))


def zarr_of(values=F, **how):
    def build(folder):
        zarr.create_array(folder / "a.zarr", data=np.asarray(values), **how)
        return folder / "a.zarr"

    return build


def zarr_with(change, **how):
    """Return a builder of a Zarr 3 array whose metadata `change` edits."""

    def build(folder):
        path = zarr_of(**how)(folder)
        said = json.loads((path / "zarr.json").read_text())
        change(said)
        (path / "zarr.json").write_text(json.dumps(said))
        return path

    return build


def old_zarr_with(**change):
    def build(folder):
        path = zarr_of(zarr_format=2)(folder)
        said = json.loads((path / ".zarray").read_text()) | change
        (path / ".zarray").write_text(json.dumps(said))
        return path

    return build


def zarr_chunk(data, compressors):
    """Return a builder of a Zarr array of one chunk, whose bytes are replaced."""

    def build(folder):
        path = zarr_of(chunks=F.shape, compressors=compressors)(folder)
        (path / "c" / "0" / "0" / "0").write_bytes(data)
        return path

    return build


def linked_zarr(folder):
    path = zarr_of(chunks=F.shape)(folder)
    chunk = path / "c" / "0" / "0" / "0"
    (folder / "secret").write_bytes(chunk.read_bytes())
    chunk.unlink()
    chunk.symlink_to(folder / "secret")
    return path


def ome_of(**change):
    """Return a builder of an OME-Zarr image of two channels with parts of its multiscales changed."""

    def build(folder):
        group = zarr.open_group(folder / "a.zarr", mode="w", zarr_format=3)
        group.create_array("0", data=np.stack([F, F]))
        axes = [{"name": "c", "type": "channel"}, *({"name": n, "type": "space"} for n in "zyx")]
        datasets = [{"path": "0", "coordinateTransformations": [{"type": "scale", "scale": [1, 5, 1, 1]}]}]
        group.attrs["ome"] = {"multiscales": [{"axes": axes, "datasets": datasets} | change]}
        return folder / "a.zarr"

    return build


def bvp_of(*, block=None, members=None, placement=None, **change):
    """Return a builder of a BVP file of one block with parts of its manifest changed."""
    size = {"width": 5, "height": 6, "depth": 4}
    place = {"index": 0, "position": {"x": 0, "y": 0, "z": 0}} | (placement or {})
    modality = {"name": "default", "dimensions": size, "format": 6403, "type": 5122, "placements": [place]}
    blocks = [{"url": "b", "format": "raw", "dimensions": size} | (block or {})]
    manifest = {"meta": {"version": 1}, "modalities": [modality | change], "blocks": blocks}
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in (
            {"b": F.tobytes(), "manifest.json": json.dumps(manifest)} | (members or {})
        ).items():
            archive.writestr(name, data)
    return file_of("a.bvp", stream.getvalue())


def exr_of(channels, **header):
    def build(folder):
        said = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage} | header
        OpenEXR.File(said, channels).write(str(folder / "a.exr"))
        return folder / "a.exr"

    return build


def huge_exr(folder):
    """Write an EXR image whose windows are edited to 10^6 x 10^6 pixels."""
    path = exr_of({"RGBA": np.zeros((3, 5, 4), np.float32)})(folder)
    data = bytearray(path.read_bytes())
    for name in (b"dataWindow\0box2i\0", b"displayWindow\0box2i\0"):
        start = data.index(name) + len(name) + 4
        data[start : start + 16] = struct.pack("<4i", 0, 0, 10**6 - 1, 10**6 - 1)
    path.write_bytes(data)
    return path


MHA = [
    BadFile("not a MetaImage", file_of("a.mha", b"hello\n"), "volume", ("Key = value", "check its suffix")),
    BadFile("truncated MetaImage", mha_of(F.tobytes()[:-1]), "volume", ("240 bytes", "got 239", "cut short")),
    BadFile("truncated compressed MetaImage", packed_mha(F.tobytes()[:-1]), "volume", ("240", "got 239")),
    BadFile("MetaImage bomb", packed_mha(b"\0" * 10**7), "volume", ("240 bytes", "got 241", "more")),
    BadFile("10^12 voxels in MetaImage", mha_of(DimSize="10000 10000 10000"), "volume", ("1862.6 GiB",)),
    BadFile(
        "lying MetaImage", packed_mha(b"\0" * 240, DimSize="999 999 999"), "volume", ("which cannot", "write")
    ),
    BadFile("MetaImage of colours", mha_of(ElementNumberOfChannels=3), "volume", ("3 channels", "save one")),
    BadFile("MetaImage of two axes", mha_of(NDims=2, DimSize="5 24"), "volume", ("2 axes", "save one")),
    BadFile("MetaImage of text", mha_of(BinaryData="False"), "volume", ("binary data", "write")),
    BadFile("MetaImage of complex", mha_of(ElementType="MET_COMPLEX"), "volume", ("MET_COMPLEX", "convert")),
    BadFile("MetaImage of longs", mha_of(ElementType="MET_LONG"), "volume", ("MET_LONG has 4 bytes",)),
    BadFile("MetaImage without spacing", mha_of(ElementSpacing=None), "volume", ("spacing", "got none")),
    BadFile("MetaImage of two spacings", mha_of(ElementSpacing="1 1"), "volume", ("3 numbers", "'1 1'")),
    BadFile("MetaImage of zero size", mha_of(DimSize="5 0 4"), "volume", ("DimSize", "'5 0 4'")),
    BadFile("MetaImage of two origins", mha_of(Offset="0 0 0", Position="1 0 0"), "volume", ("one offset",)),
    BadFile(
        "MetaImage turned about a point",
        mha_of(CenterOfRotation="1 0 0", TransformMatrix="0 1 0 1 0 0 0 0 1"),
        "volume",
        ("CenterOfRotation", "Offset"),
    ),
    BadFile(
        "MetaImage over slices",
        mha_of(name="a.mhd", ElementDataFile="s%d.raw 1 4 1"),
        "volume",
        ("one data file",),
    ),
    BadFile(
        "MetaImage above", mha_of(name="a.mhd", ElementDataFile="../s.raw"), "volume", ("inside the folder",)
    ),
    BadFile(
        "MetaImage of NaN", mha_of(NAN_F.tobytes(), ElementType="MET_FLOAT"), "volume", ("got nan", "nan=")
    ),
]

DICOM = [
    BadFile("several series", two_series, "volume", ("1.2.3 (4 slices), 1.2.4 (4 slices)", "pass key=")),
    BadFile("no such series", two_series, "volume", ("key='1.2.5'", "use '1.2.4'"), {"key": "1.2.5"}),
    BadFile(
        "a slice left out", dicom_of(lambda s: [*s[:1], *s[2:]]), "volume", ("must lie", "got 10", "missing")
    ),
    BadFile("a slice twice", dicom_of(lambda s: [*s, s[2]]), "volume", ("a place of its own", "one time")),
    BadFile(
        "mixed pixel spacing",
        dicom_of(with_element(2, PixelSpacing=[1, 1])),
        "volume",
        ("2.dcm", "PixelSpacing of 0.dcm", "[1.0, 1.0]"),
    ),
    BadFile(
        "mixed orientation",
        dicom_of(with_element(2, ImageOrientationPatient=[0, 1, 0, 1, 0, 0])),
        "volume",
        ("ImageOrientationPatient", "one geometry"),
    ),
    BadFile("mixed size", dicom_of(with_element(1, Rows=5)), "volume", ("Rows of 0.dcm", "[5.0]")),
    BadFile("slices without place", dicom_of(ImagePositionPatient=None), "volume", ("ImagePositionPatient",)),
    BadFile("slices without spacing", dicom_of(PixelSpacing=None), "volume", ("PixelSpacing", "geometry")),
    BadFile("skew rows", dicom_of(ImageOrientationPatient=[1, 0, 0, 1, 0, 0]), "volume", ("right angle",)),
    BadFile("NaN position", dicom_of(ImagePositionPatient=["1", "2"]), "volume", ("3 finite numbers",)),
    BadFile("multi-frame", dicom_of(NumberOfFrames=2), "volume", ("2 frames", "multi-frame", "NIfTI")),
    BadFile("DICOM colours", dicom_of(SamplesPerPixel=3), "volume", ("one grey value", "3 of 16", "convert")),
    BadFile("DICOM masks", dicom_of(BitsAllocated=1), "volume", ("one grey value", "1 of 1")),
    BadFile("slope 0", dicom_of(RescaleSlope=0), "volume", ("RescaleSlope", "not 0")),
    BadFile("high bit", dicom_of(BitsStored=12, HighBit=15), "volume", ("low bits of 16", "HighBit 15")),
    BadFile("huge slices", dicom_of(Rows=65535, Columns=65535), "volume", ("32 GiB", "max_bytes=")),
    BadFile(
        "slices that cannot hold it", dicom_of(Rows=30000, Columns=30000), "volume", ("which cannot", "write")
    ),
    BadFile("truncated DICOM", cut_dicom, "volume", ("DICOM", "readable")),
    BadFile("not a DICOM", file_of("a.dcm", b"x" * 200), "volume", ("DICM", "another folder")),
    BadFile(
        "deflated DICOM",
        dicom_of(with_syntax("1.2.840.10008.1.2.1.99")),
        "volume",
        ("deflated", "Explicit VR Little Endian"),
    ),
    BadFile(
        "JPEG-LS without its plugin",
        dicom_of(with_syntax("1.2.840.10008.1.2.4.80")),
        "volume",
        ("JPEG-LS", "install pylibjpeg"),
    ),
    BadFile("no transfer syntax", foreign_syntax, "volume", ("slice0.dcm", "transfer syntax")),
    BadFile(
        "MPEG DICOM", dicom_of(with_syntax("1.2.840.10008.1.2.4.100")), "volume", ("MPEG2", "uncompressed")
    ),
]

TIFF = [
    BadFile("not a TIFF", file_of("a.tif", b"hello"), "volume", ("a.tif", "readable TIFF")),
    BadFile("truncated TIFF", cut(tiff_of(), 99), "volume", ("a.tif",), {"spacing": (1, 1, 1)}),
    BadFile("TIFF pages in a loop", looped_tiff, "volume", ("overlap", "write the file again")),
    BadFile("TIFF without spacing", tiff_of(), "volume", ("spacing", "got none", "pass spacing=")),
    BadFile(
        "OME without z",
        tiff_of(ome=True, metadata={"axes": "ZYX", "PhysicalSizeX": 1.0, "PhysicalSizeY": 1.0}),
        "volume",
        ("spacing", "got none"),
    ),
    BadFile(
        "OME of two units",
        tiff_of(
            ome=True,
            metadata={f"PhysicalSize{a}": 1.0 for a in "XYZ"} | {"axes": "ZYX", "PhysicalSizeZUnit": "nm"},
        ),
        "volume",
        ("one unit", "nm"),
    ),
    BadFile(
        "TIFF of colours",
        tiff_of(np.zeros((4, 6, 5, 3), np.uint8), photometric="rgb"),
        "volume",
        ("one grey stack", "RGB", "channel"),
    ),
    BadFile(
        "TIFF over time",
        tiff_of(np.stack([F, F]).astype(np.uint16), imagej=True, metadata={"axes": "TZYX"}),
        "volume",
        ("axes TZYX of 2 x 4 x 6 x 5", "one time"),
    ),
    BadFile("TIFF of complex", tiff_of(F * 1j), "volume", ("complex128", "convert"), {"spacing": (1, 1, 1)}),
    BadFile("TIFF of NaN", tiff_of(NAN_F), "volume", ("got nan", "nan="), {"spacing": (1, 1, 1)}),
    BadFile("TIFF bomb", tiff_bomb, "volume", ("unpack to at most", "got more"), {"spacing": (1, 1, 1)}),
    BadFile(
        "TIFF that promises 10^15 bytes",
        huge_tiff,
        "volume",
        ("931322.6 GiB", "max_bytes="),
        {"spacing": (1, 1, 1)},
    ),
]

HDF5 = [
    BadFile("not an HDF5", file_of("a.h5", b"hello" * 9), "volume", ("HDF5 file", "check its suffix")),
    BadFile("truncated HDF5", cut(dataset_of()), "volume", ("a.h5", "readable HDF5")),
    BadFile("HDF5 without spacing", dataset_of(), "volume", ("spacing", "got none", "a.h5.json")),
    BadFile(
        "HDF5 of two datasets",
        hdf5_of(lambda a: (a.create_dataset("f", data=F), a.create_dataset("g/h", data=F))),
        "volume",
        ("got f, g/h", "pass key=NAME"),
    ),
    BadFile("HDF5 of an image", dataset_of(F[0]), "volume", ("3 axes", "got none", "save")),
    BadFile("no such dataset", dataset_of(), "volume", ("key='g'", "use one of f"), {"key": "g"}),
    BadFile("HDF5 of complex", dataset_of(F * 1j), "volume", ("complex128", "key=NAME")),
    BadFile("HDF5 of text", dataset_of(F.astype("S3")), "volume", ("numbers on 3 axes", "|S")),
    BadFile("HDF5 of NaN", dataset_of(NAN_F), "volume", ("got nan", "nan="), {"spacing": (1, 1, 1)}),
    BadFile(
        "HDF5 that promises 10^15 bytes",
        hdf5_of(lambda a: a.create_dataset("f", (10**5,) * 3, "u1", chunks=(64, 64, 64))),
        "volume",
        ("931322.6 GiB", "max_bytes="),
    ),
    BadFile(
        "HDF5 of nothing written",
        hdf5_of(lambda a: a.create_dataset("f", (1000,) * 3, "u1", chunks=(64, 64, 64))),
        "volume",
        ("1000000000 bytes", "which cannot"),
    ),
    BadFile(
        "HDF5 of huge chunks",
        hdf5_of(lambda a: a.create_dataset("f", (2, 2, 2), "u1", maxshape=(None,) * 3, chunks=(999,) * 3)),
        "volume",
        ("chunks", "950.8 MiB"),
    ),
    BadFile(
        "HDF5 in another file",
        hdf5_of(lambda a: a.create_dataset("f", (4, 6, 5), "i2", external=[("/etc/hostname", 0, 240)])),
        "volume",
        ("other files", "copy it"),
    ),
    BadFile(
        "HDF5 link to another file",
        hdf5_of(lambda a: a.__setitem__("f", h5py.ExternalLink("other.h5", "/f"))),
        "volume",
        ("key='f'",),
        {"key": "f"},
    ),
]

ONES = {"spacing": (1, 1, 1)}
HDF5.append(BadFile("HDF5 gzip bomb", hdf5_of(hdf5_bomb), "volume", ("unpack to at most", "a chunk"), ONES))
ZARR = [
    BadFile("Zarr without spacing", zarr_of(), "volume", ("spacing", "got none", "a.zarr.json")),
    BadFile("Zarr of an image", zarr_of(F[0]), "volume", ("3 axes", "(6, 5)")),
    BadFile("Zarr over time", zarr_of(F[None].repeat(2, 0)), "volume", ("axis 0 of 2", "pass index="), ONES),
    BadFile(
        "Zarr index beyond", zarr_of(F[None]), "volume", ("volume.index[0]", "got 1"), ONES | {"index": 1}
    ),
    BadFile(
        "Zarr of two indices", zarr_of(F[None]), "volume", ("1 numbers", "got 2"), ONES | {"index": [0, 0]}
    ),
    BadFile("Zarr of complex", zarr_of(F * 1j), "volume", ("complex128", "convert"), ONES),
    BadFile("Zarr of booleans", zarr_of(F > 0), "volume", ("bool", "convert"), ONES),
    BadFile("Zarr of NaN", zarr_of(NAN_F), "volume", ("got nan", "nan="), ONES),
    BadFile(
        "Zarr that promises 10^15 bytes",
        zarr_with(lambda said: said.update(shape=[10**5] * 3)),
        "volume",
        ("1862645.1 GiB", "max_bytes="),
        ONES,
    ),
    BadFile(
        "Zarr of huge chunks",
        zarr_with(lambda said: said["chunk_grid"]["configuration"].update(chunk_shape=[999] * 3)),
        "volume",
        ("chunks of 1.9 GiB",),
        ONES,
    ),
    BadFile(
        "Zarr of chunks that are not there",
        zarr_with(
            lambda said: (
                said.update(shape=[500] * 3),
                said["chunk_grid"]["configuration"].update(chunk_shape=[1] * 3),
            )
        ),
        "volume",
        ("125000000 chunks", "of some size"),
        ONES,
    ),
    BadFile("truncated Zarr", zarr_chunk(b"\0" * 3, None), "volume", ("a.zarr", "readable"), ONES),
    BadFile(
        "Zarr gzip bomb",
        zarr_chunk(zlib.compress(b"\0" * 10**6, wbits=31), zarr.codecs.GzipCodec()),
        "volume",
        ("unpack to at most", "c/0/0/0"),
        ONES,
    ),
    BadFile(
        "Zarr blosc bomb",
        zarr_chunk(
            b"\2\1\1\2" + struct.pack("<3I", 2**31 - 1, 512, 99) + b"\0" * 99, zarr.codecs.BloscCodec()
        ),
        "volume",
        ("2147483647", "c/0/0/0"),
        ONES,
    ),
    BadFile(
        "Zarr zstd bomb",
        zarr_chunk(b"\x28\xb5\x2f\xfd\xa0" + struct.pack("<I", 2**31), zarr.codecs.ZstdCodec()),
        "volume",
        ("2147483648", "c/0/0/0"),
        ONES,
    ),
    BadFile("Zarr that runs code", old_zarr_with(compressor={"id": "pickle"}), "volume", ("pickle",), ONES),
    BadFile(
        "Zarr of a codec that makes numbers",
        old_zarr_with(filters=[{"id": "fixedscaleoffset", "offset": 1, "scale": 2, "dtype": "<i2"}]),
        "volume",
        ("packed by", "got fixedscaleoffset"),
        ONES,
    ),
    BadFile("Zarr of objects", old_zarr_with(dtype="|O"), "volume", ("a.zarr",), ONES),
    BadFile("Zarr with a link", linked_zarr, "volume", ("the link 0", "copy it"), ONES),
    BadFile("Zarr with damaged JSON", zarr_with(lambda said: said.clear()), "volume", ("a.zarr",), ONES),
    BadFile("channels of OME-Zarr", ome_of(), "volume", ("c of 2", "index= with 1")),
    BadFile("OME-Zarr level", ome_of(), "volume", ("volume.level", "got 1"), {"level": 1}),
    BadFile(
        "OME-Zarr rotated",
        ome_of(coordinateTransformations=[{"type": "rotation", "rotation": [[1]]}]),
        "volume",
        ("a scale and a translation", "rotation"),
    ),
    BadFile(
        "OME-Zarr without scale",
        ome_of(datasets=[{"path": "0"}]),
        "volume",
        ("spacing", "none"),
        {"index": 0},
    ),
    BadFile(
        "OME-Zarr of two units",
        ome_of(axes=[{"name": "c"}, *({"name": n, "unit": u} for n, u in zip("zyx", "mns", strict=True))]),
        "volume",
        ("one unit", "m, n, s"),
    ),
    BadFile("OME-Zarr of unnamed axes", ome_of(axes=[]), "volume", ("axes x, y and z", "none")),
    BadFile("damaged .zarr.zip", file_of("a.zarr.zip", b"PK\3\4xxxx"), "volume", ("readable Zarr",)),
]

HALF = {"width": 5, "height": 6, "depth": 2}
BVP = [
    BadFile("not a BVP", file_of("a.bvp", b"hello"), "volume", ("a.bvp", "readable BVP")),
    BadFile(
        "BVP without manifest", bvp_of(members={"manifest.json": "{}"}), "volume", ("a.bvp", "modalities")
    ),
    BadFile(
        "BVP of another version",
        bvp_of(members={"manifest.json": '{"meta": {"version": 2}}'}),
        "volume",
        ("got 2",),
    ),
    BadFile("truncated BVP block", bvp_of(members={"b": b"x" * 239}), "volume", ("240 bytes", "got 239")),
    BadFile("BVP bomb", bvp_of(members={"b": b"\0" * 10**7}), "volume", ("240 bytes", "got 10000000")),
    BadFile(
        "10^12 voxels in BVP",
        bvp_of(dimensions=dict(zip(("width", "height", "depth"), HUGE, strict=True))),
        "volume",
        ("2794 GiB",),
    ),
    BadFile(
        "lying BVP",
        bvp_of(dimensions={"width": 999, "height": 999, "depth": 999}),
        "volume",
        ("which cannot", "all blocks"),
    ),
    BadFile("BVP of colours", bvp_of(format=6408), "volume", ("one number per voxel", "6408", "channel")),
    BadFile("BVP type", bvp_of(type=33635), "volume", ("33635",)),
    BadFile(
        "BVP block outside", bvp_of(placement={"position": {"x": 1, "y": 0, "z": 0}}), "volume", ("inside",)
    ),
    BadFile(
        "BVP blocks on each other",
        bvp_of(
            block={"dimensions": HALF},
            members={"b": F[:2].tobytes()},
            placements=[{"index": 0, "position": {"x": 0, "y": 0, "z": 0}}] * 2,
        ),
        "volume",
        ("each of its 120 voxels", "120 voxels that leave 60 out"),
    ),
    BadFile("BVP block missing", bvp_of(placements=[]), "volume", ("each of its 120 voxels", "120 out")),
    BadFile("BVP compressed", bvp_of(block={"format": "lz4"}), "volume", ("raw blocks", "'lz4'")),
    BadFile("BVP url", bvp_of(block={"url": "../../etc/passwd"}), "volume", ("a.bvp", "passwd")),
    BadFile("no such modality", bvp_of(), "volume", ("key='x'", "use one of default"), {"key": "x"}),
    BadFile("BVP of NaN", bvp_of(type=5126, members={"b": NAN_F.tobytes()}), "volume", ("got nan", "nan=")),
]

PIXELS = np.zeros((3, 5, 4), np.float32)
EXR = [
    BadFile("not an EXR", file_of("a.exr", b"hello"), "image", ("EXR image", "check its suffix")),
    BadFile("truncated EXR", cut(exr_of({"RGBA": PIXELS}), 40), "image", ("a.exr", "readable EXR")),
    BadFile("EXR of NaN", exr_of({"RGBA": PIXELS * np.nan}), "image", ("a.exr", "nan")),
    BadFile("EXR of depths", exr_of({"Z": PIXELS[..., 0]}), "image", ("R, G, B", "got Z", "rename")),
    BadFile(
        "EXR of whole numbers", exr_of({"Y": np.ones((3, 5), np.uint32)}), "image", ("uint32", "convert")
    ),
    BadFile("EXR of 10^12 pixels", huge_exr, "image", ("29802.3 GiB", "max_bytes=")),
    BadFile(
        "cropped EXR",
        exr_of({"RGBA": PIXELS}, displayWindow=(np.array([0, 0], np.int32), np.array([9, 9], np.int32))),
        "image",
        ("display window", "crop or pad"),
    ),
]

BAD_FORMATS = MHA + DICOM + TIFF + HDF5 + ZARR + BVP + EXR
