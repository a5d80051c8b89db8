"""Any bytes at all: a reader returns a record or refuses; no other exception, whatever the file holds."""

import gzip
import json
from contextlib import suppress

import nibabel
import nrrd
import numpy as np
import pytest
import trimesh
from hypothesis import example, given
from hypothesis import strategies as st
from PIL import Image

from tests.bad_files import ATLAS, LOADERS, RAW, TRANSFER, nrrd_bytes, scene_document
from volref.errors import FormatError, SceneError

BOX = np.arange(24, dtype=np.int16).reshape(2, 3, 4)
PLAIN = trimesh.creation.box()
PLAIN.visual.vertex_colors = np.full((8, 4), 255, np.uint8)


def _bytes_written(folder, name, write):
    write(folder / name)
    return (folder / name).read_bytes()


WRITE = {
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
    "a.ply": ("mesh", {}, lambda path: PLAIN.export(path)),
    "a.obj": ("mesh", {}, lambda path: PLAIN.export(path)),
    "a.stl": ("mesh", {}, lambda path: PLAIN.export(path)),
    "a.off": ("mesh", {}, lambda path: PLAIN.export(path)),
    "a.glb": ("mesh", {}, lambda path: PLAIN.export(path)),
    "m.npz": ("mesh", {}, lambda path: np.savez(path, vertices=PLAIN.vertices, faces=PLAIN.faces)),
    "t.npy": ("transfer", {"domain": (0, 1)}, lambda path: np.save(path, np.zeros((4, 4)))),
    "t.json": (
        "transfer",
        {},
        lambda path: path.write_text(
            json.dumps({"format": "volref-transfer", "format_version": 1} | TRANSFER)
        ),
    ),
    "s.json": ("scene", {}, lambda path: path.write_text(json.dumps(scene_document()))),
}


@st.composite
def damages(draw):
    """Draw what is done to the bytes of a file: cut it short, change bytes, insert, or replace it all."""
    way = draw(st.sampled_from(["cut", "change", "insert", "replace"]))
    return way, draw(st.floats(0, 1, exclude_max=True)), draw(st.binary(min_size=1, max_size=12))


def damaged(data, damage):
    way, where, noise = damage
    at = int(where * len(data))
    if way == "cut":
        return data[:at]
    if way == "replace":
        return noise
    return data[:at] + noise + data[at + (len(noise) if way == "change" else 0) :]


@pytest.fixture(scope="module")
def valid(tmp_path_factory):
    folder = tmp_path_factory.mktemp("valid")
    return {name: _bytes_written(folder, name, write) for name, (_, _, write) in WRITE.items()}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("fuzz")


@pytest.mark.parametrize("name", WRITE)
def test_the_file_before_it_is_damaged_is_read(valid, folder, name):
    kind, statement, _ = WRITE[name]
    (folder / name).write_bytes(valid[name])
    LOADERS[kind](folder / name, **statement)


@pytest.mark.filterwarnings("default")  # libraries warn of what they find; what counts here is what is raised
@pytest.mark.parametrize("name", WRITE)
@given(damages())
@example(("replace", 0.0, b"\0" * 12))
@example(("cut", 0.5, b"x"))
@example(("cut", 0.99, b"x"))
def test_a_damaged_file_is_read_or_refused(valid, folder, name, damage):
    kind, statement, _ = WRITE[name]
    (folder / name).write_bytes(damaged(valid[name], damage))
    limit = {} if kind == "transfer" else {"max_bytes": 2**24}
    with suppress(FormatError, SceneError):
        LOADERS[kind](folder / name, **statement, **limit)


@pytest.mark.filterwarnings("default")
@given(damages())
def test_a_damaged_nifti_inside_a_sound_gzip_is_read_or_refused(valid, folder, damage):
    packed = gzip.compress(damaged(valid["a.nii"], damage))
    (folder / "b.nii.gz").write_bytes(packed)
    with suppress(FormatError, SceneError):
        LOADERS["volume"](folder / "b.nii.gz", max_bytes=2**24)
