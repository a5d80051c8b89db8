"""A small sound file of every format that volref reads, for tests that damage them.

`SOUND` maps a name to (which loader, the loader's keyword arguments, what writes it).  A name without a
suffix, or with .zarr, is a folder.  `PLAIN` are those that only the core's and pure Python readers open.
"""

import json
import zipfile

import h5py
import metaimageio
import nibabel
import nrrd
import numcodecs
import numpy as np
import OpenEXR
import tifffile
import trimesh
import zarr
from PIL import Image

from tests.bad_files import ATLAS, RAW, TRANSFER, nrrd_bytes, scene_document
from tests.bad_formats import bvp_of, ome_of
from tests.dicom_files import write_series
from tests.letters import letter_f
from volref.io import save_radar
from volref.scene.radar import RadarVolume
from volref.scene.sweep import Sweep

BOX = np.arange(24, dtype=np.int16).reshape(2, 3, 4)
F = letter_f()
ONES = {"spacing": (1, 1, 1)}
CUBE = trimesh.creation.box()
CUBE.visual.vertex_colors = np.full((8, 4), 255, np.uint8)
MAP = [{"Name": "two", "RGBPoints": [0, 0, 0, 0, 1, 1, 1, 1], "Points": [0, 0, 0.5, 0, 1, 1, 0.5, 0]}]
PRESET = {"name": "bone", "scalarOpacity": "4 -100 0 300 0.5", "colorTransfer": "8 -100 0 0 0 100 1 0.5 0.25"}
PRESET |= {"gradientOpacity": "4 0 0 80 1", "shade": "1", "interpolation": "1"}
BUMP = {
    "position": {"x": 0.3, "y": 0.4},
    "size": {"x": 0.2, "y": 0.1},
    "color": {"r": 1, "g": 0.5, "b": 0, "a": 0.8},
}


def _json(path, document):
    path.write_text(json.dumps(document))


def _hdf5(path, **how):
    with h5py.File(path, "w") as archive:
        archive.create_dataset("f", data=F, **how).attrs["element_size_um"] = (3.0, 2.0, 1.0)


def _zarr(path, **how):
    zarr.create_array(path, data=F, chunks=(2, 3, 5), **how)


def _zarr_zip(path):
    _zarr(path.with_name("inside.zarr"))
    with zipfile.ZipFile(path, "w") as archive:
        for file in sorted(path.with_name("inside.zarr").rglob("*")):
            archive.write(file, file.relative_to(path.with_name("inside.zarr")))


def _dicom(folder):
    folder.mkdir()
    write_series(folder, F, np.diag([1.0, 2, 3, 1]), RescaleSlope=2, RescaleIntercept=-7)


def _exr(path):
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    OpenEXR.File(header, {"RGBA": np.full((6, 5, 4), 0.5, np.float32)}).write(str(path))


def _odim(path):
    with h5py.File(path, "w") as file:
        file.attrs["Conventions"] = np.bytes_("ODIM_H5/V2_2")
        _attributes(file, "what", {"date": "20110610", "time": "114002", "object": "PVOL"})
        _attributes(file, "where", {"lat": 53.0, "lon": 4.8, "height": 50.0})
        for k in (1, 2):
            sweep = file.create_group(f"dataset{k}")
            place = {"elangle": 0.5 * k, "rstart": 0.0, "rscale": 500.0, "nrays": 3, "nbins": 4, "a1gate": 0}
            _attributes(sweep, "where", place)
            said = {"quantity": "DBZH", "gain": 0.5, "offset": -32.0, "nodata": 255.0, "undetect": 0.0}
            _attributes(sweep, "data1/what", said)
            codes = np.arange(12, dtype=np.uint8).reshape(3, 4)
            sweep["data1"].create_dataset("data", data=codes, compression="gzip")


def _attributes(group, name, said):
    for key, value in said.items():
        group.require_group(name).attrs[key] = value


def _radar(path):
    azimuths = [0.0, 90, 180, 270]
    sweeps = [Sweep(azimuths, angle, np.full((4, 3), 20.0), 250.0, 500.0) for angle in (0.5, 1.5)]
    save_radar(RadarVolume(sweeps), path)


PLAIN = {
    "a.npy": ("volume", {}, lambda path: np.save(path, BOX)),
    "a.npz": ("volume", {}, lambda path: np.savez_compressed(path, volume=BOX, spacing=(1, 2, 3))),
    "a.raw": ("volume", RAW, lambda path: BOX.tofile(path)),
    "a.nrrd": ("volume", {}, lambda path: nrrd.write(str(path), BOX, {"spacings": [1.0, 2.0, 3.0]})),
    "raw.nrrd": ("volume", {}, lambda path: path.write_bytes(nrrd_bytes(data=b"x" * 24))),
    "a.nii": ("volume", {}, lambda path: nibabel.save(nibabel.Nifti1Image(BOX.T, np.eye(4)), path)),
    "a.nii.gz": ("volume", {}, lambda path: nibabel.save(nibabel.Nifti1Image(BOX.T, np.eye(4)), path)),
    "a.png": ("volume", ATLAS, lambda path: Image.fromarray(BOX.astype(np.uint8)[0, :2]).save(path)),
    "i.png": ("image", {}, lambda path: Image.fromarray(BOX.astype(np.uint8)).save(path)),
    "i.npy": ("image", {}, lambda path: np.save(path, BOX / 24)),
    "a.ply": ("mesh", {}, lambda path: CUBE.export(path)),
    "a.obj": ("mesh", {}, lambda path: CUBE.export(path)),
    "a.stl": ("mesh", {}, lambda path: CUBE.export(path)),
    "a.off": ("mesh", {}, lambda path: CUBE.export(path)),
    "a.glb": ("mesh", {}, lambda path: CUBE.export(path)),
    "m.npz": ("mesh", {}, lambda path: np.savez(path, vertices=CUBE.vertices, faces=CUBE.faces)),
    "t.npy": ("transfer", {"domain": (0, 1)}, lambda path: np.save(path, np.zeros((4, 4)))),
    "t.json": (
        "transfer",
        {},
        lambda path: _json(path, {"format": "volref-transfer", "format_version": 1} | TRANSFER),
    ),
    "s.json": ("scene", {}, lambda path: _json(path, scene_document())),
}

SOUND = PLAIN | {
    "a.mha": ("volume", {}, lambda path: metaimageio.write(path, F)),
    "packed.mha": ("volume", {}, lambda path: metaimageio.write(path, F, CompressedData=True)),
    "dicom": ("volume", {}, _dicom),
    "imagej.tif": (
        "volume",
        {},
        lambda path: tifffile.imwrite(
            path,
            F.astype(np.uint16),
            imagej=True,
            resolution=(2, 3),
            metadata={"axes": "ZYX", "spacing": 2.0},
        ),
    ),
    "ome.tif": (
        "volume",
        {},
        lambda path: tifffile.imwrite(
            path,
            F,
            ome=True,
            photometric="minisblack",
            compression="zlib",
            metadata={"axes": "ZYX"} | {f"PhysicalSize{axis}": 1.0 for axis in "XYZ"},
        ),
    ),
    "plain.tif": (
        "volume",
        ONES,
        lambda path: tifffile.imwrite(path, F, metadata=None, photometric="minisblack", rowsperstrip=2),
    ),
    "a.h5": ("volume", {}, _hdf5),
    "gzip.h5": ("volume", {}, lambda path: _hdf5(path, compression="gzip", shuffle=True, chunks=(2, 3, 5))),
    "v2.zarr": (
        "volume",
        ONES,
        lambda path: _zarr(path, zarr_format=2, compressors=numcodecs.Blosc()),
    ),
    "v3.zarr": ("volume", ONES, _zarr),
    "gzip.zarr": ("volume", ONES, lambda path: _zarr(path, compressors=zarr.codecs.GzipCodec())),
    "ome.zarr": ("volume", {"index": [1]}, lambda path: ome_of()(path.parent / "ome").rename(path)),
    "a.zarr.zip": ("volume", ONES, _zarr_zip),
    "a.bvp": ("volume", {}, lambda path: bvp_of()(path.parent).rename(path)),
    "i.exr": ("image", {}, _exr),
    "paraview.json": ("transfer", {}, lambda path: _json(path, MAP)),
    "slicer.json": ("transfer", {}, lambda path: _json(path, [PRESET])),
    "vpt.json": ("transfer", {}, lambda path: _json(path, [BUMP])),
    "r.h5": ("radar", {}, _odim),
    "r.npz": ("radar", {}, _radar),
}
