"""Files that volref must refuse, each with what its sentence must name; shared by the tests of io and cli.

`BAD_FILES` holds cases as (name, build, kind, statement, fragments): `build(folder)` writes the file and
returns its path, `kind` says which loader it is for ("volume", "mesh", "transfer", "image" or "scene"),
`statement` are the loader's keyword arguments, and every fragment must occur in the message.
"""

import gzip
import io
import json
import pickle
import struct
import zipfile
import zlib
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import nibabel
import numpy as np

from volref.io import load_mesh, load_scene, load_transfer, load_volume, read_image

LOADERS = {
    "volume": load_volume,
    "mesh": load_mesh,
    "transfer": load_transfer,
    "image": read_image,
    "scene": load_scene,
}

CAMERA = {"kind": "perspective", "eye": [0, 0, 5], "target": [0, 0, 0], "up": [0, 1, 0], "fov_y": 40}
CAMERA |= {"near": 0.1, "far": 100}
TRIANGLE = {"vertices": [[0, 0, 0], [1, 0, 0], [0, 1, 0]], "faces": [[0, 1, 2]]}
RAW = {"size": (4, 3, 2), "dtype": "int16", "byte_order": "little", "skip": 0, "spacing": (1, 1, 1)}
ATLAS = {"tiles_across": 2, "tiles_down": 2, "slices": 3}
TRANSFER = {"values": [0, 1], "colors": [[0, 0, 0], [1, 1, 1]], "opacity": [0, 0.5]}


@dataclass(frozen=True)
class BadFile:
    """A file to refuse: how to build it, who loads it, and what the sentence says."""

    name: str
    build: Callable[[Path], Path]
    kind: str
    fragments: tuple[str, ...]
    statement: dict[str, Any] = field(default_factory=dict)

    def load(self, folder):
        return LOADERS[self.kind](self.build(folder), **self.statement)


def file_of(name, data):
    """Return a builder that writes `data`."""

    def build(folder):
        (folder / name).write_bytes(data)
        return folder / name

    return build


def scene_document(**change):
    """Return a valid scene of one triangle, with some keys changed (None removes one)."""
    document = {"format": "volref-scene", "format_version": 1, "width": 8, "height": 6}
    document |= {"camera": dict(CAMERA), "meshes": [dict(TRIANGLE)]} | change
    return {key: value for key, value in document.items() if value is not None}


def scene_of(**change):
    return file_of("scene.json", json.dumps(scene_document(**change)).encode())


def camera_of(**change):
    camera = {key: value for key, value in (CAMERA | change).items() if value is not None}
    return scene_of(camera=camera)


def transfer_of(**change):
    document = {"format": "volref-transfer", "format_version": 1} | TRANSFER | change
    return file_of("tf.json", json.dumps({k: v for k, v in document.items() if v is not None}).encode())


def npy_bytes(array):
    stream = io.BytesIO()
    np.save(stream, array)
    return stream.getvalue()


def npy_header(shape, descr="|u1"):
    """Return the head of a .npy file that promises an array of `shape`."""
    stream = io.BytesIO()
    header = {"descr": descr, "fortran_order": False, "shape": shape}
    np.lib.format.write_array_header_1_0(stream, header)
    return stream.getvalue()


def npz_of(**members):
    """Return a builder of an .npz of raw members (bytes of .npy files)."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in members.items():
            archive.writestr(f"{name}.npy", data)
    return file_of("a.npz", stream.getvalue())


def obj_of(material):
    """Return a builder of a triangle with the lines `material` in its .mtl file."""
    text = b"mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m\nf 1 2 3\n"

    def build(folder):
        (folder / "a.mtl").write_text(f"newmtl m\n{material}\n")
        return file_of("a.obj", text)(folder)

    return build


def scene_with_transfer(**keys):
    """Return a builder of a scene whose transfer function is a JSON file, with `keys` beside its path."""

    def build(folder):
        transfer_of()(folder)
        file_of("v.npy", npy_bytes(np.zeros((2, 3, 4), np.uint8)))(folder)
        return scene_of(volume={"path": "v.npy"}, transfer={"path": "tf.json"} | keys)(folder)

    return build


def nrrd_bytes(sizes=(4, 3, 2), *, kind="uint8", encoding="raw", data=b"", more=()):
    fields = [f"type: {kind}", f"dimension: {len(sizes)}", f"sizes: {' '.join(map(str, sizes))}"]
    lines = ["NRRD0005", *fields, "endian: little", f"encoding: {encoding}", *more, "", ""]
    return "\n".join(lines).encode() + data


def nifti_bytes(shape=(4, 3, 2), *, dtype=np.uint8, dims=None, intent=None, data=None, offset=352, version=1):
    """Return a NIfTI file; `dims` overwrites what its header says of the shape."""
    header = nibabel.Nifti1Header() if version == 1 else nibabel.Nifti2Header()
    header.set_data_dtype(dtype)
    header.set_data_shape(shape)
    header["vox_offset"] = offset
    if intent is not None:
        header.set_intent(intent)
    if dims is not None:
        header["dim"][: len(dims) + 1] = (len(dims), *dims)
    count = int(np.prod(shape)) * header.get_data_dtype().itemsize
    return header.binaryblock + b"\0" * 4 + (b"\0" * count if data is None else data)


def png_bytes(width, height, depth, color_type, *, rows=None):
    """Return a PNG with the stated header; its pixels are 0 unless `rows` (with filter bytes) are given."""
    samples = {0: 1, 2: 3, 3: 1, 4: 2, 6: 4}[color_type]
    row = b"\0" + b"\1" * ((width * samples * depth + 7) // 8)
    data = zlib.compress(row * height if rows is None else rows)
    chunks = [(b"IHDR", struct.pack(">IIBBBBB", width, height, depth, color_type, 0, 0, 0))]
    chunks += [(b"IDAT", data), (b"IEND", b"")]
    body = b"".join(
        struct.pack(">I", len(payload)) + name + payload + struct.pack(">I", zlib.crc32(name + payload))
        for name, payload in chunks
    )
    return b"\x89PNG\r\n\x1a\n" + body


def outside(name):
    """Return a builder of a scene in a folder whose mesh lies in the folder above it, reached by `name`."""

    def build(folder):
        (folder / "secret.ply").write_bytes(b"ply")
        (folder / "in").mkdir()
        (folder / "in" / "link.ply").symlink_to(folder / "secret.ply")
        path = folder / "in" / "scene.json"
        path.write_text(json.dumps(scene_document(meshes=[{"path": name.format(folder=folder)}])))
        return path

    return build


NAN = np.zeros((2, 3, 4), np.float32)
NAN[1, 2, 3] = np.nan
INFINITE = np.where(np.isnan(NAN), np.inf, 0).astype(np.float64)
HUGE = (10_000, 10_000, 10_000)
BOX = np.zeros((2, 3, 4), np.uint8)
EMPTY_PLY = b"ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty float y\nproperty float z\n"
EMPTY_PLY += b"element face 0\nproperty list uchar int vertex_indices\nend_header\n"
HUGE_PLY = EMPTY_PLY.replace(b"ascii", b"binary_little_endian").replace(b"vertex 0", b"vertex 1000000000000")
FLAT_OBJ = b"v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n"

VOLUMES = [
    BadFile(
        "missing file", lambda folder: folder / "none.npy", "volume", ("none.npy", "no such file", "check")
    ),
    BadFile("a folder", lambda folder: folder, "volume", ("got a folder", "check")),
    BadFile("empty file", file_of("a.npy", b""), "volume", ("a.npy", "an empty file", "write it again")),
    BadFile("unknown suffix", file_of("a.vti", b"x"), "volume", ("a.vti", ".nrrd", "'.vti'", "convert")),
    BadFile("not a .npy", file_of("a.npy", b"hello"), "volume", ("a.npy", "readable .npy")),
    BadFile("pickled .npy", file_of("a.npy", npy_bytes(BOX)[:0] + pickle.dumps(BOX)), "volume", ("a.npy",)),
    BadFile(
        "objects in .npy",
        file_of("a.npy", npy_header((2, 2, 2), "|O") + pickle.dumps([1] * 8)),
        "volume",
        ("a.npy", "pickled Python objects", "allow_pickle=False"),
    ),
    BadFile(
        "truncated .npy", file_of("a.npy", npy_bytes(BOX)[:-1]), "volume", ("24 bytes", "got 23", "cut short")
    ),
    BadFile("longer .npy", file_of("a.npy", npy_bytes(BOX) + b"x"), "volume", ("24 bytes", "got 25", "more")),
    BadFile(
        "10^12 voxels in .npy",
        file_of("a.npy", npy_header(HUGE)),
        "volume",
        ("16 GiB", "931.3 GiB", "10000 x 10000 x 10000 uint8", "pass max_bytes=1000000000000"),
    ),
    BadFile(
        "10^12 voxels in .npy, limit raised",
        file_of("a.npy", npy_header(HUGE)),
        "volume",
        ("1000000000000 bytes", "got 0", "cut short"),
        {"max_bytes": 2**50},
    ),
    BadFile("10^12 voxels in .npz", npz_of(volume=npy_header(HUGE)), "volume", ("931.3 GiB", "max_bytes")),
    BadFile("lying .npz", npz_of(volume=npy_header((99, 99, 99))), "volume", ("970299 bytes", "got 0")),
    BadFile(
        "objects in .npz", npz_of(volume=npy_header((2, 2, 2), "|O")), "volume", ("pickled", "allow_pickle")
    ),
    BadFile("no volume in .npz", npz_of(a=npy_bytes(BOX[0])), "volume", ("'volume'", "got none", "save")),
    BadFile(
        "no such key",
        npz_of(volumes=npy_bytes(BOX)),
        "volume",
        ("key='volume'", "'volumes'"),
        {"key": "volume"},
    ),
    BadFile("damaged .npz", file_of("a.npz", b"PK\3\4" + b"x" * 50), "volume", ("readable .npz",)),
    BadFile(
        "two axes", file_of("a.npy", npy_bytes(BOX[0])), "volume", ("volume.values", "(3, 4)", "z first")
    ),
    BadFile(
        "complex", file_of("a.npy", npy_bytes(BOX + 1j)), "volume", ("volume.values", "complex128", "convert")
    ),
    BadFile("booleans", file_of("a.npy", npy_bytes(BOX > 0)), "volume", ("volume.values", "bool", "convert")),
    BadFile(
        "NaN", file_of("a.npy", npy_bytes(NAN)), "volume", ("got nan at (z, y, x) = (1, 2, 3)", "nan=VALUE")
    ),
    BadFile("infinity", file_of("a.npy", npy_bytes(INFINITE)), "volume", ("got inf", "1 such", "nan=VALUE")),
    BadFile(
        "infinite nan=", file_of("a.npy", npy_bytes(NAN)), "volume", ("volume.nan", "inf"), {"nan": np.inf}
    ),
    BadFile(
        "zero spacing", file_of("a.npy", npy_bytes(BOX)), "volume", ("spacing", "0.0"), {"spacing": (1, 0, 1)}
    ),
    BadFile(
        "negative spacing",
        file_of("a.npy", npy_bytes(BOX)),
        "volume",
        ("-1.0", "flip"),
        {"spacing": (-1, 1, 1)},
    ),
    BadFile(
        "singular direction",
        file_of("a.npy", npy_bytes(BOX)),
        "volume",
        ("volume.direction", "invertible", "independent"),
        {"direction": np.ones((3, 3)) / 3**0.5},
    ),
    BadFile(
        "statement that does not suit",
        file_of("a.npy", npy_bytes(BOX)),
        "volume",
        ("spacings", "use 'spacing'"),
        {"spacings": (1, 1, 1)},
    ),
    BadFile("RAW without statement", file_of("a.raw", b"x"), "volume", ("dtype", "a.raw.json", "pass them")),
    BadFile("truncated RAW", file_of("a.raw", b"x" * 47), "volume", ("48 bytes", "got 47", "cut short"), RAW),
    BadFile("RAW too long", file_of("a.raw", b"x" * 49), "volume", ("48 bytes", "got 49", "skip"), RAW),
    BadFile("RAW skip", file_of("a.raw", b"x" * 48), "volume", ("volume.skip", "-1"), RAW | {"skip": -1}),
    BadFile(
        "RAW size", file_of("a.raw", b"x" * 48), "volume", ("volume.size", "(4, 3)"), RAW | {"size": (4, 3)}
    ),
    BadFile(
        "RAW zero size", file_of("a.raw", b"x"), "volume", ("volume.size[1]", "0"), RAW | {"size": (4, 0, 2)}
    ),
    BadFile(
        "RAW type",
        file_of("a.raw", b"x" * 48),
        "volume",
        ("volume.dtype", "'short'"),
        RAW | {"dtype": "short"},
    ),
    BadFile(
        "RAW byte order",
        file_of("a.raw", b"x" * 48),
        "volume",
        ("byte_order", "'<'"),
        RAW | {"byte_order": "<"},
    ),
    BadFile("RAW 10^12 voxels", file_of("a.raw", b"x"), "volume", ("1862.6 GiB",), RAW | {"size": HUGE}),
    BadFile("not a NRRD", file_of("a.nrrd", b"hello\n\n"), "volume", ("a.nrrd", "readable NRRD")),
    BadFile(
        "10^12 voxels in NRRD", file_of("a.nrrd", nrrd_bytes(HUGE)), "volume", ("931.3 GiB", "max_bytes=")
    ),
    BadFile(
        "truncated NRRD", file_of("a.nrrd", nrrd_bytes(data=b"x" * 23)), "volume", ("24 bytes", "got 23")
    ),
    BadFile(
        "NRRD bomb",
        file_of("a.nrrd", nrrd_bytes((4, 3, 2), encoding="gzip", data=gzip.compress(b"\0" * 10**7))),
        "volume",
        ("24 bytes", "more"),
    ),
    BadFile(
        "lying NRRD",
        file_of("a.nrrd", nrrd_bytes((1000, 1000, 1000), encoding="gzip", data=gzip.compress(b"\0" * 24))),
        "volume",
        ("1000000000 bytes", "compressed bytes, which cannot"),
    ),
    BadFile(
        "NRRD of vectors", file_of("a.nrrd", nrrd_bytes((3, 4, 3, 2))), "volume", ("[3, 4, 3, 2]", "channel")
    ),
    BadFile(
        "NRRD of colours",
        file_of("a.nrrd", nrrd_bytes((3, 4, 2), data=b"x" * 24, more=["kinds: RGB-color domain domain"])),
        "volume",
        ("rgb-color", "channel"),
    ),
    BadFile(
        "NRRD segmentation",
        file_of("a.nrrd", nrrd_bytes(data=b"x" * 24, more=["Segment0_ID:=liver"])),
        "volume",
        ("segmentation", "scalar volume"),
    ),
    BadFile("NRRD of blocks", file_of("a.nrrd", nrrd_bytes(kind="block", data=b"x")), "volume", ("'block'",)),
    BadFile(
        "NRRD left-handed",
        file_of("a.nrrd", nrrd_bytes(data=b"x" * 24, more=["space: 3D-left-handed"])),
        "volume",
        ("right-handed", "'3d-left-handed'", "resave"),
    ),
    BadFile(
        "NRRD data elsewhere",
        file_of("a.nhdr", nrrd_bytes(more=["data file: ../a.raw"])),
        "volume",
        ("a.nhdr", "inside the folder", "'../a.raw'", "copy"),
    ),
    BadFile(
        "NRRD text", file_of("a.nrrd", nrrd_bytes(encoding="ascii", data=b"1 2")), "volume", ("'ascii'",)
    ),
    BadFile(
        "NRRD negative skip",
        file_of("a.nrrd", nrrd_bytes(data=b"x" * 24, more=["byte skip: -3"])),
        "volume",
        ("byte skip of at least -1", "got -3", "resave"),
    ),
    BadFile(
        "truncated NRRD at the end of its file",
        file_of("a.nrrd", nrrd_bytes(data=b"x" * 20, more=["byte skip: -1"])),
        "volume",
        ("24 bytes", "got 20", "cut short"),
    ),
    BadFile(
        "NRRD of two spacings",
        file_of(
            "a.nrrd",
            nrrd_bytes(data=b"x" * 24, more=["spacings: 1 1 1", "axis mins: 0 0 0", "axis maxs: 4 3 9"]),
        ),
        "volume",
        ("axis maxs that agree", "[4.0, 3.0, 9.0]", "remove axis maxs"),
    ),
    BadFile(
        "NRRD of axis maxs alone",
        file_of("a.nrrd", nrrd_bytes(data=b"x" * 24, more=["axis maxs: 4 3 2"])),
        "volume",
        ("axis maxs that agree", "remove axis maxs"),
    ),
    BadFile(
        "NIfTI voxels in the header",
        file_of("a.nii", nifti_bytes(offset=0)),
        "volume",
        ("byte 352 or later", "vox_offset", "got 0"),
    ),
    BadFile(
        "NIfTI voxels in the header of .nii.gz",
        file_of("a.nii.gz", gzip.compress(nifti_bytes(offset=0))),
        "volume",
        ("byte 352 or later", "got 0"),
    ),
    BadFile(
        "NIfTI-2 voxels in the header",
        file_of("a.nii", nifti_bytes(offset=0, version=2)),
        "volume",
        ("byte 544 or later", "got 0"),
    ),
    BadFile(
        ".npz of two spacings",
        npz_of(
            volume=npy_bytes(BOX),
            spacing=npy_bytes(np.ones(3)),
            affine_ijk_to_ras_mm=npy_bytes(np.eye(4) * 2),
        ),
        "volume",
        ("spacing once", "[1.0, 1.0, 1.0]", "affine_ijk_to_ras_mm", "[2.0, 2.0, 2.0]", "remove"),
    ),
    BadFile(
        ".npz of two origins",
        npz_of(
            volume=npy_bytes(BOX), origin=npy_bytes(np.ones(3)), affine_ijk_to_lps_mm=npy_bytes(np.eye(4))
        ),
        "volume",
        ("origin once", "affine_ijk_to_lps_mm", "[0.0, 0.0, 0.0]", "remove"),
    ),
    BadFile(
        ".npz of two orders",
        npz_of(
            volume=npy_bytes(BOX),
            spacing=npy_bytes(np.arange(3) + 1),
            spacing_zyx=npy_bytes(np.arange(3) + 1),
        ),
        "volume",
        ("spacing once", "[1, 2, 3]", "spacing_zyx", "[3, 2, 1]"),
    ),
    BadFile("not a NIfTI", file_of("a.nii", b"x" * 400), "volume", ("a.nii", "NIfTI header")),
    BadFile("truncated NIfTI", file_of("a.nii", nifti_bytes()[:-1]), "volume", ("376 bytes", "got 375")),
    BadFile("truncated NIfTI header", file_of("a.nii", nifti_bytes()[:100]), "volume", ("NIfTI header",)),
    BadFile(
        "10^12 voxels in NIfTI",
        file_of("a.nii", nifti_bytes(dims=HUGE)),
        "volume",
        ("931.3 GiB", "max_bytes"),
    ),
    BadFile(
        "10^12 voxels in .nii.gz",
        file_of("a.nii.gz", gzip.compress(nifti_bytes(dims=HUGE))),
        "volume",
        ("931.3 GiB", "16 GiB", "max_bytes="),
    ),
    BadFile(
        "lying .nii.gz",
        file_of("a.nii.gz", gzip.compress(nifti_bytes(dims=(1000, 1000, 1000)))),
        "volume",
        ("compressed bytes, which cannot",),
    ),
    BadFile(
        "truncated .nii.gz", file_of("a.nii.gz", gzip.compress(nifti_bytes())[:-9]), "volume", ("a.nii.gz",)
    ),
    BadFile(
        "NIfTI over time", file_of("a.nii", nifti_bytes((4, 3, 2, 5))), "volume", ("(4, 3, 2, 5)", "channel")
    ),
    BadFile(
        "NIfTI labels", file_of("a.nii", nifti_bytes(intent="label")), "volume", ("'label'", "label, vector")
    ),
    BadFile("NIfTI colours", file_of("a.nii", nifti_bytes(dtype=128)), "volume", ("one integer or real",)),
    BadFile(
        "atlas without layout",
        file_of("a.png", png_bytes(4, 4, 8, 0)),
        "volume",
        ("tiles_across", "a.png.json"),
    ),
    BadFile(
        "16-bit RGB atlas", file_of("a.png", png_bytes(4, 4, 16, 2)), "volume", ("16-bit RGB", "8-bit"), ATLAS
    ),
    BadFile(
        "sidecar that is a list",
        lambda folder: [file_of("a.npy.json", b"[]")(folder), file_of("a.npy", npy_bytes(BOX))(folder)][1],
        "volume",
        ("a.npy.json", "list"),
    ),
    BadFile(
        "sidecar with an unknown key",
        lambda folder: [
            file_of("a.npy.json", b'{"orgin": [0,0,0]}')(folder),
            file_of("a.npy", npy_bytes(BOX))(folder),
        ][1],
        "volume",
        ("orgin", "use 'origin'"),
    ),
]

MESHES = [
    BadFile("mesh suffix", file_of("a.fbx", b"x"), "mesh", ("a.fbx", ".ply", "convert")),
    BadFile("empty mesh", file_of("a.ply", EMPTY_PLY), "mesh", ("a.ply", "none")),
    BadFile("10^12 vertices", file_of("a.ply", HUGE_PLY), "mesh", ("a.ply",)),
    BadFile(
        "only degenerate triangles", file_of("a.obj", FLAT_OBJ), "mesh", ("mesh.faces", "area", "1 without")
    ),
    BadFile("index beyond the vertices", file_of("a.obj", b"v 0 0 0\nf 1 2 9\n"), "mesh", ("a.obj",)),
    BadFile(
        "NaN vertex",
        file_of("a.obj", b"v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"),
        "mesh",
        ("mesh.vertices", "nan"),
    ),
    BadFile("d above 1", obj_of("Kd 1 0 0\nd 1.5"), "mesh", ("a.obj", "d as one number in 0..1", "d 1.5")),
    BadFile("Tr below 0", obj_of("Kd 1 0 0\nTr -1"), "mesh", ("a.obj", "Tr as one number in 0..1", "Tr -1")),
    BadFile("d of 0", obj_of("Kd 1 0 0\nd 0"), "mesh", ("a.obj", "opacity of 0 by d")),
    BadFile("d against Tr", obj_of("Kd 1 0 0\nd 1\nTr 1"), "mesh", ("a.obj", "d = 1 - Tr", "d 1 and Tr 1")),
    BadFile("transparent by a halo", obj_of("d -halo 0.5"), "mesh", ("one number", "d -halo 0.5")),
    BadFile("transparent by a map", obj_of("Kd 1 0 0\nmap_d b.png"), "mesh", ("map_d b.png", "remove map_d")),
    BadFile("Kd above 1", obj_of("Kd 255 0 0"), "mesh", ("a.obj", "Kd of 3 numbers in 0..1", "255.0")),
    BadFile("Kd of one number", obj_of("Kd 0.5"), "mesh", ("a.mtl", "3 numbers for Kd", "'Kd 0.5'")),
    BadFile("Kd of a spectrum", obj_of("Kd spectral a.rfl"), "mesh", ("3 numbers for Kd", "a.rfl")),
    BadFile("Kd of words", obj_of("Kd xyz 0.1 0.2"), "mesh", ("3 numbers for Kd", "'Kd xyz 0.1 0.2'")),
    BadFile("Ka of two numbers", obj_of("Kd 1 0 0\nKa 1 0\nd 0.5"), "mesh", ("3 numbers for Ka", "mend it")),
    BadFile("Ns of two numbers", obj_of("Kd 1 0 0\nNs 1 0\nd 0.5"), "mesh", ("1 number for Ns", "mend it")),
    BadFile("Kd of NaN", obj_of("Kd nan 0 0"), "mesh", ("Kd of 3 numbers in 0..1", "nan")),
    BadFile("damaged GLB", file_of("a.glb", b"glTF" + b"\2\0\0\0" * 8), "mesh", ("readable mesh",)),
    BadFile("damaged STL", file_of("a.stl", b"solid" + b"\xff" * 100), "mesh", ("a.stl",)),
    BadFile(
        "mesh .npz without faces",
        npz_of(vertices=npy_bytes(np.zeros((3, 3)))),
        "mesh",
        ("faces", "save_mesh"),
    ),
    BadFile(
        "mesh too large", file_of("a.ply", EMPTY_PLY), "mesh", ("10 bytes", "max_bytes="), {"max_bytes": 10}
    ),
]

TRANSFERS = [
    BadFile(
        "knots out of order",
        transfer_of(values=[1, 0]),
        "transfer",
        ("must not decrease", "0 after 1", "sort"),
    ),
    BadFile(
        "opacity above 1", transfer_of(opacity=[0, 2]), "transfer", ("transfer.opacity", "0..1", "got 2")
    ),
    BadFile("opacity below 0", transfer_of(opacity=[-1, 0]), "transfer", ("transfer.opacity", "-1")),
    BadFile(
        "no opacity", transfer_of(opacity=None), "transfer", ("transfer.opacity", "must be given", "add")
    ),
    BadFile("counts differ", transfer_of(opacity=[0]), "transfer", ("transfer.opacity", "(2)", "(1)")),
    BadFile("zero unit_distance", transfer_of(unit_distance=0), "transfer", ("unit_distance", "above 0")),
    BadFile(
        "transfer key", transfer_of(unit_distanse=1), "transfer", ("unit_distanse", "use 'unit_distance'")
    ),
    BadFile(
        "transfer version", transfer_of(format_version=2), "transfer", ("format_version", "got 2", "newer")
    ),
    BadFile("transfer of another format", transfer_of(format="x"), "transfer", ("'volref-transfer'", "'x'")),
    BadFile(
        "table without domain", file_of("t.npy", npy_bytes(np.zeros((9, 4)))), "transfer", ("domain", "pass")
    ),
    BadFile(
        "table of three columns",
        file_of("t.npy", npy_bytes(np.zeros((9, 3)))),
        "transfer",
        ("transfer.rgba", "(9, 3)"),
        {"domain": (0, 1)},
    ),
    *(
        BadFile(f"JSON with {name}", transfer_of(), "transfer", ("tf.json", f"without {name}"), {name: value})
        for name, value in (
            *(("domain", (0, 1)), ("unit_distance", 1.0)),
            *(("texel_centers", False), ("interpolation", "extinction")),
        )
    ),
    BadFile("transfer suffix", file_of("t.xml", b"x"), "transfer", ("t.xml", ".json", "convert")),
]

IMAGES = [
    BadFile(
        "16-bit RGB PNG", file_of("a.png", png_bytes(2, 2, 16, 2)), "image", ("16-bit RGB", "8 bits", ".npy")
    ),
    BadFile("16-bit RGBA PNG", file_of("a.png", png_bytes(2, 2, 16, 6)), "image", ("16-bit RGBA", ".npy")),
    BadFile("zero-size image", file_of("a.png", png_bytes(0, 2, 8, 2)), "image", ("width=0", "write")),
    BadFile(
        "zero-size array", file_of("a.npy", npy_header((0, 4, 4), "<f8")), "image", ("(0, 4, 4)", "write")
    ),
    BadFile(
        "not a PNG", file_of("a.png", b"GIF89a" + b"x" * 50), "image", ("a.png", "other bytes", "convert")
    ),
    BadFile("truncated PNG", file_of("a.png", png_bytes(9, 9, 8, 2)[:50]), "image", ("a.png",)),
    BadFile("JPEG", file_of("a.jpg", b"\xff\xd8\xff"), "image", ("a.jpg", ".png", "convert")),
    BadFile(
        "image of two channels", file_of("a.npy", npy_bytes(np.zeros((3, 3, 2)))), "image", ("(3, 3, 2)",)
    ),
    BadFile("NaN pixel", file_of("a.npy", npy_bytes(np.full((1, 1, 4), np.nan))), "image", ("a.npy", "nan")),
    BadFile(
        "encoding", file_of("a.png", png_bytes(2, 2, 8, 2)), "image", ("encoding",), {"encoding": "gamma"}
    ),
]

SCENES = [
    BadFile("corrupt JSON", file_of("s.json", b'{"format": '), "scene", ("s.json", "readable JSON", "mend")),
    BadFile("400 digits", camera_of(near=10**400), "scene", ("scene.json", "401 digits", "mend")),
    BadFile("-400 digits", camera_of(near=-(10**400)), "scene", ("scene.json", "401 digits", "mend")),
    BadFile("400 pixels' digits", scene_of(width=10**400), "scene", ("401 digits", "mend")),
    BadFile("width of 300 digits", scene_of(width=10**300), "scene", ("scene.width", "1e+300")),
    BadFile("width of 20 digits", scene_of(width=10**19), "scene", ("scene.width", "65536")),
    BadFile(
        "format version of 300 digits",
        scene_of(format_version=10**300),
        "scene",
        ("format_version", "1e+300"),
    ),
    BadFile("not UTF-8", file_of("s.json", b"\xff\xfe{"), "scene", ("s.json", "readable JSON")),
    BadFile("deep JSON", file_of("s.json", b"[" * 10**5), "scene", ("s.json", "readable JSON")),
    BadFile("NaN in JSON", file_of("s.json", b'{"width": NaN}'), "scene", ("NaN", "JSON does not have")),
    BadFile("1e999 in JSON", file_of("s.json", b'{"width": 1e999}'), "scene", ("1e999",)),
    BadFile("key twice", file_of("s.json", b'{"width": 1, "width": 2}'), "scene", ("'width' twice",)),
    BadFile("a list", file_of("s.json", b"[]"), "scene", ("JSON object", "list")),
    BadFile("another format", scene_of(format="usd"), "scene", ("format", "'volref-scene'", "'usd'")),
    BadFile("wrong version", scene_of(format_version=2), "scene", ("format_version", "got 2", "newer")),
    BadFile("unknown key", scene_of(widht=3), "scene", ("widht", "key that is known", "use 'width'")),
    BadFile("unknown camera key", camera_of(fov_z=3), "scene", ("camera.fov_z", "use 'fov_y'")),
    BadFile("no camera", scene_of(camera=None), "scene", ("camera", "must be given", "add")),
    BadFile(
        "camera kind",
        camera_of(kind="fisheye"),
        "scene",
        ("camera.kind", "'fisheye'", "'perspective' or 'orthographic' or 'matrix'"),
    ),
    BadFile("text for a number", camera_of(near="close"), "scene", ("camera.near", "a number", "'close'")),
    BadFile("two numbers for a point", camera_of(eye=[0, 5]), "scene", ("camera.eye", "at least 3", "got 2")),
    BadFile("up parallel to the view", camera_of(up=[0, 0, 1]), "scene", ("camera.up", "parallel", "choose")),
    BadFile("eye at target", camera_of(eye=[0, 0, 0]), "scene", ("camera.target", "differ", "move")),
    BadFile("near beyond far", camera_of(near=200), "scene", ("camera.far", "200", "swap")),
    BadFile("near at 0", camera_of(near=0), "scene", ("camera.near", "above 0")),
    BadFile("fov of 180", camera_of(fov_y=180), "scene", ("camera.fov_y", "180")),
    BadFile("zero-size scene", scene_of(width=0), "scene", ("scene.width", "got 0")),
    BadFile("fractional width", scene_of(width=1.5), "scene", ("width", "whole number", "1.5")),
    BadFile("nothing to see", scene_of(meshes=[]), "scene", ("volume or a mesh", "give one")),
    BadFile(
        "volume without transfer", scene_of(volume={"path": "a.npy"}), "scene", ("a.npy", "no such file")
    ),
    BadFile(
        "aspect mismatch",
        scene_of(
            camera={
                "kind": "matrix",
                "view_from_world": np.eye(4).tolist(),
                "clip_from_view": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, -1.1, -0.2], [0, 0, -1, 0]],
            }
        ),
        "scene",
        ("camera.clip_matrix", "aspect", "8 x 6", "canvas"),
    ),
    BadFile(
        "background not premultiplied",
        scene_of(background=[1, 1, 1, 0]),
        "scene",
        ("premultiplied", "alpha 0"),
    ),
    *(
        BadFile(
            f"JSON transfer with {name}",
            scene_with_transfer(**{name: value}),
            "scene",
            ("tf.json", f"without {name}", "change the file"),
        )
        for name, value in (("texel_centers", False), ("interpolation", "extinction"), ("domain", [0, 1]))
    ),
    BadFile(
        "path above",
        outside("../secret.ply"),
        "scene",
        ("inside the folder", "../secret.ply", "allow_outside"),
    ),
    BadFile(
        "absolute path", outside("{folder}/secret.ply"), "scene", ("inside the folder", "allow_outside=True")
    ),
    BadFile(
        "absolute path inside",
        outside("{folder}/in/link.ply"),
        "scene",
        ("inside the folder", "allow_outside"),
    ),
    BadFile("link that leads out", outside("link.ply"), "scene", ("inside the folder", "'link.ply'")),
    BadFile("drive letter", outside("C:\\secret.ply"), "scene", ("inside the folder", "C:")),
    BadFile("NUL in a path", scene_of(meshes=[{"path": "a\0b"}]), "scene", ("path",)),
    BadFile("missing mesh", scene_of(meshes=[{"path": "none.ply"}]), "scene", ("none.ply", "no such file")),
    BadFile("null mesh", scene_of(meshes=[None]), "scene", ("meshes[0]", "an object", "nothing")),
    BadFile(
        "empty inline mesh",
        scene_of(meshes=[{"vertices": [], "faces": []}]),
        "scene",
        ("mesh.vertices", "(0)"),
    ),
    BadFile("faces from 1", scene_of(meshes=[TRIANGLE | {"faces": [[1, 2, 3]]}]), "scene", ("start at 1",)),
]

BAD_FILES = VOLUMES + MESHES + TRANSFERS + IMAGES + SCENES
